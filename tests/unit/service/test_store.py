"""Names of solids depend on their content alone, and the store forgets what was used longest ago."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

import engine
from service.errors import ServiceError
from service.store import Store, solid_id

CUBE_FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
CUBE_VERTICES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]


def sphere(x: float) -> engine.Sphere:
    return engine.Sphere([x, 0.0, 0.0], 1.0)


SOLIDS = [
    engine.HalfSpace([0, 0, 1], 0),
    engine.Sphere([0, 0, 1], 0),
    engine.Sphere([0, 1], 1),
    engine.Aabb([0, 0, 1], [0, 0, 1]),
    engine.Convex([[1, 0, 0, 1]]),
    engine.Convex([[1, 0, 0]]),
    engine.Triangle([[0, 0], [1, 0], [0, 1]]),
    engine.Polygon([[[0, 0], [1, 0], [0, 1]]]),
    engine.Polygon([[[0, 0], [1, 0], [0, 1], [0, 0], [1, 0], [0, 1], [2, 2]]]),
    engine.Polygon([[[0, 0], [1, 0], [0, 1]], [[0, 0], [1, 0], [0, 1], [2, 2]]]),
    engine.Polyhedron(CUBE_VERTICES, CUBE_FACES),
    engine.Surface(CUBE_VERTICES, CUBE_FACES),
    engine.Implicit([{"powers": [1, 0], "coefficient": 1.0}]),
    engine.Implicit([{"powers": [0, 1], "coefficient": 1.0}]),
    engine.Csg("union", [sphere(0), sphere(1)]),
    engine.Csg("union", [sphere(1), sphere(0)]),
    engine.Csg("difference", [sphere(0), sphere(1)]),
    engine.Csg("union", [engine.Csg("union", [sphere(0), sphere(1)])]),
]


def test_names_differ_where_content_does() -> None:
    assert len({solid_id(solid) for solid in SOLIDS}) == len(SOLIDS)
    assert all(len(solid_id(solid)) == 64 for solid in SOLIDS)


def test_a_name_is_the_same_everywhere_for_ever() -> None:
    assert solid_id(sphere(0)) == "330265484bc42d79546f5ee8b2bda5f96ef7f5e9011bc809d003f12e3b3e0d0b"


def test_minus_zero_and_lists_or_arrays_make_no_difference() -> None:
    assert solid_id(sphere(-0.0)) == solid_id(sphere(0.0))
    again = engine.Polyhedron(np.array(CUBE_VERTICES, "f8"), [tuple(face) for face in CUBE_FACES])
    assert solid_id(again) == solid_id(SOLIDS[10])


def test_a_solid_with_prepared_structures_keeps_its_name() -> None:
    solid = sphere(2)
    before = solid_id(solid)
    solid.prepared("tree", lambda: np.zeros(3))
    assert solid_id(solid) == before


def test_put_returns_whether_it_is_new_and_get_the_very_object() -> None:
    store, solid = Store(10**6), sphere(0)
    name, is_new = store.put(solid)
    assert is_new
    assert store.put(sphere(0)) == (name, False)
    assert store.get(name) is solid


def test_the_least_recently_used_leaves_first() -> None:
    store = Store(3 * sphere(0).memory)
    names = [store.put(sphere(x))[0] for x in range(3)]
    store.get(names[0])
    store.put(sphere(3))
    assert store.get(names[0])
    with pytest.raises(ServiceError) as caught:
        store.get(names[1])
    assert caught.value.code == "unknown_solid"
    assert "put it again" in caught.value.detail


def test_memory_of_prepared_structures_counts() -> None:
    store = Store(10_000)
    names = [store.put(sphere(x))[0] for x in range(3)]
    store.get(names[2]).prepared("tree", lambda: np.zeros(2000))
    assert store.get(names[2])  # larger than the whole budget by now, yet the one in use stays
    with pytest.raises(ServiceError):
        store.get(names[0])


def test_a_solid_larger_than_the_store_is_refused() -> None:
    with pytest.raises(ServiceError) as caught:
        Store(10).put(sphere(0))
    assert caught.value.code == "limit_exceeded"


def test_many_threads_agree() -> None:
    store, found = Store(10**6), []

    def work() -> None:
        found.extend(store.put(sphere(x))[1] for x in range(200))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(found) == 200


def test_a_tree_of_shared_solids_takes_time_and_room_by_its_distinct_nodes(tmp_path: Path) -> None:
    """A million leaves that are one: named, kept and read again as four solids."""
    solid: engine.Solid = sphere(1)
    for _ in range(3):
        solid = engine.Csg("union", [solid] * 100)
    store = Store(10**9, tmp_path)
    name, _ = store.put(solid)
    assert (tmp_path / name).stat().st_size < 20_000
    assert solid_id(Store(10**9, tmp_path).get(name)) == name
