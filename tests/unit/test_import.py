"""`import engine` with numpy and numba alone; `exact_geometry`, its other name."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import engine
import exact_geometry

ROOT = Path(__file__).resolve().parents[2]
ASK = """
import sys
sys.path.append({folder!r})  # before it: the standard library alone, as -I and -S leave it
before = set(sys.modules)
import engine
box = engine.Aabb((0, 0), (1, 1))
print(engine.locate([[0.5, 0.5], [1.0, 0.5], [2.0, 2.0]], box).tolist())
print(engine.collide(box, engine.Aabb((1, 0), (2, 1))).relation.label)
import exact_geometry
print(exact_geometry.locate is engine.locate)
known = {{*sys.stdlib_module_names, *before, "cython_runtime", "numpy", "numba", "llvmlite"}}
known |= {{"engine", "exact_geometry"}}
print(sorted({{name.partition(".")[0] for name in sys.modules}} - known))
"""


def test_numpy_and_numba_suffice(tmp_path: Path) -> None:
    """In an environment that holds nothing else."""
    for name in ("numpy", "numba", "llvmlite"):
        place = Path(find_spec(name).origin).parent  # type: ignore[union-attr,arg-type]
        (tmp_path / name).symlink_to(place)
        for beside in (*place.parent.glob(f"{name}.libs"), *place.parent.glob(f"{name}-*.dist-info")):
            (tmp_path / beside.name).symlink_to(beside)
    for name in ("engine", "exact_geometry"):
        (tmp_path / name).symlink_to(ROOT / name)
    script = ASK.format(folder=str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[:3] == ["[1, 0, -1]", "touching", "True"]
    assert not [name for name in lines[3].strip("[]").replace("'", "").split(", ") if name and name[0] != "_"], lines[3]


def test_the_other_name_has_the_same_names() -> None:
    assert exact_geometry.__all__ == engine.__all__
    assert all(getattr(exact_geometry, name) is getattr(engine, name) for name in engine.__all__)
    assert exact_geometry.__version__ == engine.__version__


BESIDE = """
import pickle
import exact_geometry
import engine
assert engine.WHOSE == "another's" and not [name for name in sys.modules if name.startswith("engine.")]
ball = pickle.loads(pickle.dumps(exact_geometry.Sphere((0, 0), 5)))
assert type(ball).__module__ == "exact_geometry.engine.solids.primitives"
assert isinstance(ball, exact_geometry.Solid)
print(exact_geometry.locate([[3.0, 4.0], [3.1, 4.0]], ball).tolist())
"""


@pytest.mark.full
@pytest.mark.parametrize("name", ["engine.py", "engine/__init__.py"])
def test_ours_stands_beside_another_engine(tmp_path: Path, name: str) -> None:
    """Twice: the second time from the bytecode of the first, which the plain import does not meet."""
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text('WHOSE = "another\'s"\n')
    for _ in range(2):
        script = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]\n{BESIDE}"
        done = _run(script, tmp_path)
        assert done.stdout == "[0, -1]\n", done.stderr
    assert (
        _run(
            f"import sys; sys.path[:0] = [{str(ROOT)!r}]\nimport engine.solids.primitives as s; print(s.__name__)",
            tmp_path.parent,
        ).stdout
        == "engine.solids.primitives\n"
    )


def test_the_command_line_has_the_other_name_too() -> None:
    words = [sys.executable, "-m", "exact_geometry", "--version"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout == f"exact-geometry {engine.__version__}\n", done.stderr


def _run(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-c", script]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
