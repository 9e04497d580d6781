"""The compilers of kernels: a canary that notices when they do not fit numba, and numba's own steps in their place."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba import config as numba_config

ROOT = Path(__file__).resolve().parents[3]
pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")
ASK = """
import warnings
warnings.simplefilter("always")
{change}
import engine
sphere = engine.Sphere((0, 0, 0), 1)
print(engine.locate([(0.6, 0.8, 0), (1, 0, 0), (0.6, 0.7, 0)], sphere).tolist())
"""
CHANGES = {
    "other numbers than Python's": (
        "import engine.compiling.compilers as c\n"
        "def step(rows, place, scale): return scale * (int(place) + 1 << 62 << 3), 1\n"  # integers that have no end
        "c._step.__code__ = step.__code__",
        "does not compile as expected",
    ),
    "a step that raises": (
        "import engine.compiling.compilers as c; c.lookup_environment = None",
        "does not compile as expected",
    ),
    "compilers that cannot be imported": (
        "import sys; sys.modules['engine.compiling.compilers'] = None",
        "compiling takes three times as long",
    ),
    "caches that cannot be imported": (
        "import sys; sys.modules['engine.compiling.caches'] = None",
        "compiled again in each process",
    ),
}


def ask(change: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "ENGINE_CACHE_DIR": str(folder), "ENGINE_CACHE_SEED": ""}
    code = ASK.format(change=change)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, env=environment)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", CHANGES)
def test_without_one_part_the_answers_stay_and_a_warning_says_so(name: str, tmp_path: Path) -> None:
    change, warning = CHANGES[name]
    ran = ask(change, tmp_path)
    assert (ran.returncode, ran.stdout) == (0, "[-1, 0, 1]\n"), ran.stderr
    assert warning in ran.stderr


def test_nothing_is_said_where_both_fit(tmp_path: Path) -> None:
    ran = ask("", tmp_path)
    assert (ran.returncode, ran.stdout) == (0, "[-1, 0, 1]\n")
    assert re.fullmatch("no compiled kernels for containment yet: .*\n", ran.stderr)  # and nothing else
    assert [*tmp_path.rglob("*.nbc")]


@pytest.mark.full
def test_caching_works_without_the_compilers(tmp_path: Path) -> None:
    change = CHANGES["compilers that cannot be imported"][0]
    assert ask(change, tmp_path).returncode == 0
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}
    assert kept
    ran = ask(change, tmp_path)
    assert ran.stdout == "[-1, 0, 1]\n"
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")} == kept


def test_numba_is_known_up_to_the_version_here() -> None:
    import tomllib

    with (ROOT / "pyproject.toml").open("rb") as file:
        needs = tomllib.load(file)["project"]["dependencies"]
    [bounds] = [each.split(",") for each in needs if each.startswith("numba")]
    highest = tuple(int(part) for part in bounds[1].strip().removeprefix("<").split("."))
    here = tuple(int(part) for part in numba.__version__.split(".")[:2])
    assert here < highest
