"""warm(): afterwards the public functions compile nothing, whatever arrays they are given."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import engine
from engine import warm_command, warmup
from engine.warmup import STEPS
from tests.programs import COUNTER

PROBE = """
import importlib, pkgutil
import numpy as np
import engine
from engine.compiling.jit import KERNELS

for module in pkgutil.walk_packages(engine.__path__, "engine."):
    importlib.import_module(module.name)
done = []
engine.warm(done.append)
assert sum(done) == 100
left = [f"{k.py_func.__module__}.{k.py_func.__name__}" for k in KERNELS if not k.signatures]
left = [name for name in left if ".textbook." not in name and not name.endswith("_batch")]
assert not left, f"not compiled by warm(): {left}"
known = {k: list(k.signatures) for k in KERNELS}


def layouts(array):
    array = np.asarray(array, float)
    frozen = array.copy()
    frozen.flags.writeable = False
    strided = np.repeat(array, 2, 0)[::2]
    return [array, frozen, np.asfortranarray(array), strided, array.astype(np.float32), array.tolist()]


cube = engine.Polyhedron(
    [[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)],
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]],
)
solids = {
    3: [cube, engine.Aabb([0, 0, 0], [1, 1, 1]), engine.Sphere([0, 0, 0], 1), engine.HalfSpace([1, 0, 0], 0),
        engine.Convex([[1, 0, 0, 0]])],
    2: [engine.Polygon([[[0, 0], [1, 0], [0, 1]]]), engine.Aabb([0, 0], [1, 1]), engine.Sphere([0, 0], 1),
        engine.HalfSpace([1, 0], 0), engine.Convex([[1, 0, 0]])],
}
for dimension in (2, 3):
    for points in [*layouts(np.linspace(0, 1, 30 * dimension).reshape(-1, dimension)), np.empty((0, dimension))]:
        for solid in solids[dimension]:
            engine.locate(points, solid)
        engine.locate_scene(points, solids[dimension])
    segments_of = layouts(np.linspace(-1, 2, 6 * dimension).reshape(-1, 2, dimension))
    for segments in [*segments_of, np.empty((0, 2, dimension))]:
        for solid in solids[dimension]:
            engine.clip_segments(segments, solid)
        if dimension == 3:
            engine.hits(segments, cube)
            engine.Scene([cube, cube], [None, engine.Pose(np.eye(3)[[1, 2, 0]], [0.5, 0, 0])]).hits(segments, rays=True)
    for triangles in layouts(np.linspace(-1, 2, 6 * dimension).reshape(-1, 3, dimension)):
        engine.collide_triangles(triangles, triangles)
for turns, moves in zip(layouts(np.broadcast_to(np.eye(3), (4, 3, 3))), layouts(np.eye(3)[[0, 1, 2, 0]])):
    engine.collide_poses(cube, cube, turns, moves)
engine.collide(cube, engine.Polyhedron(cube.vertices + 0.5, np.asarray(cube.triangles)))
new = {k.py_func.__name__: k.signatures for k in KERNELS if list(k.signatures) != known[k]}
assert not new, f"compiled after warm(): {new}"
before = len(done)
engine.warm(done.append)
assert len(done) == before
"""

FIRST_CALLS = """
import sys
import numpy as np
from engine import Aabb, HalfSpace, Polyhedron, Pose, Scene, Sphere
from engine.compiling.caches import KernelCache

compiled = []
KernelCache.save_overload = lambda self, types, result: compiled.append(self._function.__name__)
cube = Polyhedron(
    [[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)],
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]],
)
bodies = [Aabb([0, 0, 0], [1, 1, 1]), Sphere([0, 0, 0], 1), cube, HalfSpace([1, 0, 0], 0), cube]
scene = Scene(bodies, [None, Pose(np.eye(3), [0.5, 0, 0]), None, None, Pose(np.eye(3), [0.5, 0, 0])])
segments = np.array([[[-1.0, 0.2, 0.3], [3, 0.4, 0.2]], [[0, 0, -2.0], [0.3, 0.3, 3]], [[-1, 0, 0], [3, 0, 0.0]]])
away = np.tile([[[-9.0, 0, 0], [-9, 1, 1]]], (int(sys.argv[1]), 1, 1))  # ties would be settled one by one, for seconds
for keep in sys.argv[2:]:
    scene.clip_segments(np.concatenate([segments, away]), keep=keep)
assert not compiled, compiled
"""


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_nothing_is_compiled_after_warm() -> None:
    found = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, text=True, timeout=600)
    assert found.returncode == 0, found.stderr[-3000:]
    for asked in (["0", "all", "any"], ["0", "any", "all"], ["12000", "all"], ["12000", "first"]):  # in another process
        found = subprocess.run([sys.executable, "-c", FIRST_CALLS, *asked], capture_output=True, text=True, timeout=600)
        assert found.returncode == 0, (asked, found.stderr[-3000:])


COUNT = (
    COUNTER
    + """
import numpy as np
import engine
engine.locate(np.zeros((4, 3)), engine.Sphere([0, 0, 0], 1))
print(counter.n)
engine.clip_segments(np.linspace(-1, 2, 24).reshape(4, 2, 3), engine.Aabb([0, 0, 0], [1, 1, 1]))
print(counter.n)
"""
)
COMPILATIONS = [17, 61]
"""Of kernels and inner functions, up to the first answer of each: a new one, or one for other types, is seen here.
Three are those of the compilers' canary."""


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_first_answers_take_no_more_compilations_than_known(tmp_path: Path) -> None:
    empty = {**os.environ, "ENGINE_CACHE_DIR": str(tmp_path / "cache")}
    empty.pop("ENGINE_CACHE_SEED", None)
    found = subprocess.run([sys.executable, "-c", COUNT], env=empty, capture_output=True, text=True, timeout=600)
    assert found.returncode == 0, found.stderr[-3000:]
    counts = [int(word) for word in found.stdout.split()]
    assert all(count <= known for count, known in zip(counts, COMPILATIONS, strict=True)), counts


@pytest.mark.full
@pytest.mark.parametrize("step", [step.__name__ for step in STEPS])
def test_any_step_may_be_the_first(tmp_path: Path, step: str) -> None:
    """What is compiled for one kernel depends on those before it: who asks about scenes first gets other code."""
    code = f"from engine import warmup; warmup.{step}()"
    empty = {**os.environ, "ENGINE_CACHE_DIR": str(tmp_path / "cache"), "ENGINE_CACHE_SEED": ""}
    found = subprocess.run([sys.executable, "-c", code], env=empty, capture_output=True, text=True, timeout=600)
    assert found.returncode == 0, found.stderr[-3000:]


def test_steps_are_all_in_some_group_and_some_operation() -> None:
    assert sorted(step for group in warm_command.GROUPS for step in group) == [*range(len(STEPS))]
    assert {step for steps in warmup.OPERATIONS.values() for step in steps} == {*STEPS}
    assert len(warmup.SHARES) == len(STEPS)
    assert all(hasattr(engine, name) for name in warmup.OPERATIONS)


@pytest.mark.parametrize("operations", [["volumes"], "overlay", [1], ["overlay", "?"], 5, [[]]])
def test_an_unknown_operation_is_refused(operations: Any) -> None:
    with pytest.raises(engine.InvalidInputError, match="overlay_batch"):
        engine.warm(operations=operations)


ONE_OPERATION = """
import sys
import engine
from engine.compiling.jit import KERNELS

cube = engine.Polyhedron(
    [[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)],
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]],
)
square = engine.Polygon([[[0, 0], [2, 0], [0, 2]]])
done = []
engine.warm(done.append, operations=[sys.argv[1]])
assert sum(done) == 100, done
known = {k: list(k.signatures) for k in KERNELS}
match sys.argv[1]:
    case "overlay":
        engine.overlay(square, engine.Polygon([[[1, 0], [1, 1], [0, 1]]]))
    case "locate":
        engine.locate([[0.5, 0.5, 0.5]], cube)
    case "collide":
        engine.collide(cube, engine.Sphere([0, 0, 0], 1))
    case "clip_segments":
        engine.clip_segments([[[-1, 0.5, 0.5], [2, 0.5, 0.5]]], cube)
    case "bounds":
        engine.bounds(cube)
new = {k.py_func.__name__: k.signatures for k in KERNELS if list(k.signatures) != known[k]}
assert not new, new
assert any(not k.signatures for k in KERNELS)  # the others wait
"""


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
@pytest.mark.some(2)
@pytest.mark.parametrize("operation", ["overlay", "locate", "collide", "clip_segments", "bounds"])
def test_one_operation_is_made_ready_by_itself(operation: str) -> None:
    code = [sys.executable, "-c", ONE_OPERATION, operation]
    done = subprocess.run(code, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr[-3000:]
