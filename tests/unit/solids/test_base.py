"""What all solids share: immutable, picklable, prepared once, memory counted."""

from __future__ import annotations

import copy
import pickle
import threading
import time

import numpy as np
import pytest

import engine
from engine.running.budget import Budget

TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
SOLIDS: list[engine.Solid] = [
    engine.HalfSpace([0, 0, 1], -2),
    engine.Sphere([0, 0, 0], 1),
    engine.Aabb([0, 0, 0], [1, 2, 3]),
    engine.Convex([[1, 0, 0], [0, 1, 0], [-1, -1, 1]]),
    engine.Polyhedron(*TETRAHEDRON),
    engine.Surface(SQUARE, [[0, 1, 2, 3]]),
    engine.Triangle([[0, 0], [1, 0], [0, 1]]),
    engine.Polygon([[[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [2, 1], [1, 2]]]),
    engine.Implicit([{"powers": [2, 0], "coefficient": -1}, {"powers": [0, 0], "coefficient": 4}]),
    engine.Csg("union", [engine.Sphere([0, 0], 1), engine.Csg("union", [engine.Sphere([1, 0], 1)])]),
]
by_type = pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: solid.type)


@by_type
def test_is_immutable(solid: engine.Solid) -> None:
    for name in [*solid._fields(), "type", "anything"]:
        with pytest.raises(AttributeError, match="immutable"):
            setattr(solid, name, None)
    with pytest.raises(AttributeError, match="immutable"):
        del solid.dimension
    with pytest.raises(AttributeError, match="immutable"):
        solid._set(dimension=2)
    for name in dir(solid):
        value = getattr(solid, name)
        if isinstance(value, np.ndarray):
            assert not value.flags.writeable, name
            assert value.flags.c_contiguous, name
            assert value.dtype in (np.float64, np.int64), name


@by_type
def test_pickles_and_copies(solid: engine.Solid) -> None:
    assert copy.copy(solid) is solid
    assert copy.deepcopy(solid) is solid
    solid.prepared("something", lambda: 1)
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(solid, protocol))
        assert type(again) is type(solid)
        assert repr(again) == repr(solid)
        assert again._prepared == {}
        for name in dir(solid):
            value = getattr(solid, name)
            if isinstance(value, np.ndarray):
                assert not getattr(again, name).flags.writeable
                assert (getattr(again, name) == value).all()


@by_type
def test_compares_by_value_and_prints_short(solid: engine.Solid) -> None:
    again = pickle.loads(pickle.dumps(solid))
    assert again == solid
    assert len({solid, solid, again}) == 1
    assert len(repr(solid)) < 200


def test_the_caller_s_array_is_copied() -> None:
    center = np.zeros(3)
    solid = engine.Sphere(center, 1.0)
    center[0] = 5.0
    assert solid.center.tolist() == [0.0, 0.0, 0.0]


def test_minus_zero_becomes_zero() -> None:
    solids = [engine.Sphere([-0.0, 0.0], -0.0), engine.HalfSpace([-0.0, 1.0], -0.0), engine.Aabb([-0.0, 0], [0, -0.0])]
    assert "-0.0" not in repr(solids)


def test_prepared_is_built_once_under_concurrency() -> None:
    solid, builds = engine.Sphere([0, 0], 1), []

    def build() -> object:
        builds.append(1)
        time.sleep(0.05)
        return object()

    found: list[object] = []
    threads = [threading.Thread(target=lambda: found.append(solid.prepared("tree", build))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert builds == [1]
    assert len(set(map(id, found))) == 1
    solid.drop("tree", "what is not there")
    assert solid.cached("tree") is None


def test_a_build_that_fails_is_tried_again_and_builds_may_nest() -> None:
    solid = engine.Sphere([0, 0], 1)

    def fail() -> object:
        raise engine.DeadlineExceededError("too late")

    with pytest.raises(engine.DeadlineExceededError):
        solid.prepared("tree", fail)
    assert solid.prepared("tree", lambda: solid.prepared("box", lambda: 41) + 1) == 42


def test_who_waits_for_a_build_looks_at_his_own_clock() -> None:
    solid, is_building, may_end = engine.Sphere([0, 0], 1), threading.Event(), threading.Event()

    def build() -> int:
        is_building.set()
        may_end.wait(30.0)
        return 41

    builder = threading.Thread(target=lambda: solid.prepared("tree", build))
    builder.start()
    try:
        assert is_building.wait(30.0)
        assert solid.cached("tree") is None
        with Budget(0.05) as budget, pytest.raises(engine.DeadlineExceededError):
            solid.prepared("tree", lambda: 42, budget.check)
        cancel = engine.Cancel()
        cancel.set()
        with Budget(None, cancel) as budget, pytest.raises(engine.CancelledError):
            solid.prepared("tree", lambda: 42, budget.check)
    finally:
        may_end.set()
        builder.join()
    assert solid.prepared("tree", lambda: 43) == 41 == solid.cached("tree")


def test_memory_counts_every_array_once() -> None:
    ball = engine.Sphere([0, 0, 0], 1)
    assert ball.memory == 24
    assert engine.Csg("union", [ball, ball]).memory == 24
    ball.prepared("grid", lambda: (np.zeros(100), {"inner": [np.zeros(10)]}))
    assert ball.memory == 24 + 880
    mesh = engine.Polyhedron(*TETRAHEDRON)
    assert mesh.memory == 4 * 24 + 4 * 24  # vertices, and one array for faces and triangles
    mesh.prepared("view", lambda: mesh.vertices[1:])
    assert mesh.memory == 4 * 24 + 4 * 24


def test_base_is_not_a_solid_by_itself() -> None:
    with pytest.raises(AttributeError):
        engine.Solid().anything = 1


def test_a_hash_waits_for_nobody() -> None:
    """Another thread may hold the lock for as long as it builds a structure."""
    ball = engine.Sphere((0, 0), 1.0)
    held, done = threading.Event(), threading.Event()

    def build() -> int:
        held.set()
        return int(done.wait(60))

    thread = threading.Thread(target=lambda: ball.prepared("slow", build))
    thread.start()
    try:
        assert held.wait(60)
        assert hash(ball) == hash(engine.Sphere((0, 0), 1.0))
    finally:
        done.set()
        thread.join()


def test_messages_have_the_right_article() -> None:
    with pytest.raises(AttributeError, match="an aabb is immutable"):
        engine.Aabb((0, 0), (1, 1)).min = 3  # type: ignore[assignment]
    with pytest.raises(AttributeError, match="a sphere is immutable"):
        del engine.Sphere((0, 0), 1.0).radius
