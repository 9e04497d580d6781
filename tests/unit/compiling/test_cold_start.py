"""An empty kernel cache is filled once, by several processes, and never by a step that failed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba import config as numba_config

from engine.compiling import kernel_cache

ROOT = Path(__file__).resolve().parents[3]
pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")

WORK = """
import os, pathlib
PLACE = pathlib.Path({place!r})

def say(step):
    (PLACE / f"{{step}}-{{os.getpid()}}").touch()

STEPS = [lambda: say(0), lambda: say(1), lambda: {third}]
"""
FILL = "from engine.compiling.cold_start import fill_cache; fill_cache('engine.work', (1, 1, 1), 2)"


@pytest.fixture
def place(tmp_path: Path) -> Path:
    package = tmp_path / "engine"
    package.mkdir()
    (package / "compiling").mkdir()
    compiling = [f"compiling/{path.name}" for path in (ROOT / "engine" / "compiling").glob("*.py")]
    for name in ("__init__.py", *compiling):
        text = "" if name == "__init__.py" else (ROOT / "engine" / name).read_text("utf-8")
        (package / name).write_text(text)
    (tmp_path / "done").mkdir()
    return tmp_path


def fill(
    place: Path, third: str = "say(2)", code: str = FILL, work: str = WORK, **more: str
) -> subprocess.Popen[bytes]:
    (place / "engine" / "work.py").write_text(work.format(place=str(place / "done"), third=third))
    variables = {"PYTHONPATH": str(place), "ENGINE_CACHE_DIR": str(place / "cache"), "ENGINE_CACHE_SEED": "", **more}
    command = [sys.executable, "-X", "dev", "-c", code]  # says of every file that is left open
    return subprocess.Popen(command, env={**os.environ, **variables}, cwd=place, stderr=subprocess.PIPE)


def end(process: subprocess.Popen[bytes]) -> tuple[int, bytes]:
    """Return what it ended with, and what it complained of."""
    said = process.communicate(timeout=120)[1]
    return process.returncode, said


def steps_done(place: Path) -> list[str]:
    return sorted(file.name.partition("-")[0] for file in (place / "done").iterdir())


def test_each_step_runs_once_in_one_of_two_processes_whoever_asks(place: Path) -> None:
    together = [fill(place), fill(place)]
    assert [end(process) for process in together] == [(0, b"")] * 2
    assert end(fill(place)) == (0, b"")
    assert steps_done(place) == ["0", "1", "2"]
    assert len({file.name.partition("-")[2] for file in (place / "done").iterdir()}) <= 2


def test_related_steps_are_called_by_one_process_in_their_order(place: Path) -> None:
    """The first list waits for the second, which another process calls meanwhile."""
    wait = "[say(2), [time.sleep(0.01) for time in [__import__('time')] * 6000 if not any(PLACE.glob('1-*'))]]"
    assert end(fill(place, wait, FILL.replace("2)", "2, related=((2, 0), (1,)))"))) == (0, b"")
    by = {file.name[0]: file for file in (place / "done").iterdir()}
    assert by["0"].name[2:] == by["2"].name[2:] != by["1"].name[2:]
    assert by["2"].stat().st_mtime_ns <= by["0"].stat().st_mtime_ns


def test_a_seed_that_is_full_needs_no_step(place: Path) -> None:
    assert end(fill(place)) == (0, b"")
    kernel_cache.seal(place / "cache")
    other = {"ENGINE_CACHE_DIR": str(place / "other"), "ENGINE_CACHE_SEED": str(place / "cache")}
    assert end(fill(place, **other)) == (0, b"")
    assert steps_done(place) == ["0", "1", "2"]


def test_a_seed_for_another_cpu_is_left_and_said_to_be(place: Path) -> None:
    assert end(fill(place)) == (0, b"")
    kernel_cache.seal(place / "cache")
    older = {"NUMBA_CPU_NAME": "x86-64-v2", "NUMBA_CPU_FEATURES": ""}
    other = {"ENGINE_CACHE_DIR": str(place / "other"), "ENGINE_CACHE_SEED": str(place / "cache"), **older}
    code, said = end(fill(place, **other))
    assert code == 0
    assert b"lacks kernels of this version for this CPU" in said
    assert steps_done(place) == ["0", "0", "1", "1", "2", "2"]


def test_a_killed_compiler_ends_in_answers(place: Path) -> None:
    assert end(fill(place, "os.kill(os.getpid(), 9)")) == (0, b"")
    assert steps_done(place) == ["0", "1"]
    assert end(fill(place)) == (0, b"")
    assert steps_done(place) == ["0", "0", "1", "1", "2"]


def test_a_step_that_fails_is_tried_again(place: Path) -> None:
    assert end(fill(place, "1 / 0")) == (0, b"")
    assert steps_done(place) == ["0", "1"]
    assert end(fill(place, "1 / 0")) == (0, b"")
    assert steps_done(place) == ["0", "0", "1", "1"]


TURNS = """
import os, pathlib, time
import numpy as np
from numba.core import event
from engine.compiling.jit import kernel
PLACE = pathlib.Path({place!r})

@kernel
def total(rows):
    total = 0.0
    for row in rows:
        total += row[0]
    return total

def both(step):
    (PLACE / f"ready-{{step}}").touch()
    while len(list(PLACE.glob("ready-*"))) < 2:
        time.sleep(0.001)
    with event.install_recorder("numba:compile") as seen:
        assert total(np.ones((8, 2))) == 8.0
    (PLACE / f"{{len(seen.buffer)}}-{{step}}").touch()

STEPS = [lambda: both(0), lambda: both(1)]
"""


def test_a_kernel_that_two_processes_need_is_compiled_by_one(place: Path) -> None:
    assert end(fill(place, code=FILL.replace("1, 1, 1", "1, 1"), work=TURNS)) == (0, b"")
    counts = [name for name in steps_done(place) if name != "ready"]
    assert (len(counts), counts.count("0")) == (2, 1)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc to look processes up in")
def test_steps_end_with_the_process_that_asked(place: Path) -> None:
    asked = fill(place, "[say(2), __import__('time').sleep(600)]")
    while "2" not in steps_done(place):
        assert asked.poll() is None
    asked.kill()
    asked.communicate()
    (sleeper,) = [int(file.name.partition("-")[2]) for file in (place / "done").glob("2-*")]
    for _ in range(1000):
        if not _lives(sleeper):
            return
        subprocess.run(["sleep", "0.05"], check=True)
    raise AssertionError("the step lives on")


def _lives(process: int) -> bool:
    stat = Path(f"/proc/{process}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
