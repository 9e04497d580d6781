"""The store of solids: in memory, in its folder, and what goes wrong there."""

from __future__ import annotations

import contextlib
import logging
import os
import random
import sys
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine
from engine.solids import registry
from service import mesh_reader
from service.errors import ServiceError
from service.store import Folder, Store, solid_id

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
    """A million leaves that are one: named, stored and read again as four solids."""
    solid: engine.Solid = sphere(1)
    for _ in range(3):
        solid = engine.Csg("union", [solid] * 100)
    store = Store(10**9, tmp_path)
    name, _ = store.put(solid)
    assert (tmp_path / name).stat().st_size < 20_000
    assert solid_id(Store(10**9, tmp_path).get(name)) == name


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: solid.type)
def test_another_process_finds_the_same_solid(tmp_path: Path, solid: engine.Solid) -> None:
    name, is_new = Store(10**6, tmp_path).put(solid)
    assert is_new
    other = Store(10**6, tmp_path)
    found = other.get(name)
    assert (found.type, solid_id(found)) == (solid.type, name)
    assert other.get(name) is found
    assert other.put(solid) == (name, False)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_what_left_the_memory_is_in_the_folder(tmp_path: Path) -> None:
    store = Store(2 * sphere(0).memory, tmp_path)
    names = [store.put(sphere(x))[0] for x in range(5)]
    assert [solid_id(store.get(name)) for name in names] == names


def test_damaged_files_are_never_served(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL, "service")
    source, solid = random.Random(5), SOLIDS[10]
    name, _ = Store(10**6, tmp_path).put(solid)
    whole = (tmp_path / name).read_bytes()
    served = 0
    for turn in range(300):
        octets = bytearray(whole)
        if turn % 3 == 0:
            del octets[source.randrange(len(octets)) :]
        else:
            at = source.randrange(len(octets))
            octets[at : at + 4] = source.randbytes(4)
        (tmp_path / name).write_bytes(octets)
        found = Folder(tmp_path, 2**30).get(name)
        assert (found is None) != (tmp_path / name).exists()
        if found is not None:
            served += 1  # bytes that mean nothing, such as times in the archive
            assert solid_id(found) == name
    assert served < 150


class Torus(engine.Solid):
    """A type that the service knows nothing of."""

    __slots__ = ()
    type = "torus"

    def __init__(self) -> None:
        self._set(dimension=3)


BEHIND = {
    "alone": lambda solid: solid,
    "operand": lambda solid: engine.Csg("union", [sphere(0), solid]),
    "body": lambda solid: engine.Scene([sphere(0), solid]),
}


@pytest.mark.parametrize("has_folder", [True, False])
@pytest.mark.parametrize("behind", BEHIND.values(), ids=BEHIND.keys())
def test_a_type_without_a_codec_is_refused_by_name(tmp_path: Path, behind: Any, has_folder: bool) -> None:
    store = Store(10**6, tmp_path if has_folder else None)
    with pytest.raises(ServiceError, match="type 'torus'; send it with each request") as caught:
        store.put(behind(Torus()))
    assert caught.value.code == "unsupported_solid"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("behind", BEHIND.values(), ids=BEHIND.keys())
def test_a_file_of_another_version_is_refused_and_stays(
    tmp_path: Path, behind: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Replicas of two versions share a folder: what the older one cannot read is no damage."""
    with monkeypatch.context() as later:
        later.setitem(registry._ROWS, "torus", registry.Row(solid=Torus, about="", stored=("dimension",)))
        name, _ = Store(10**6, tmp_path).put(behind(Torus()))
    store = Store(10**6, tmp_path)
    for get in (store.get, store.get_scene):
        with pytest.raises(ServiceError, match="type 'torus'") as caught:
            get(name)
        assert caught.value.code == "unsupported_solid"
    assert (tmp_path / name).exists()


def test_a_file_under_another_name_is_not_served(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL, "service")
    name, _ = Store(10**6, tmp_path).put(sphere(1))
    wrong = "0" * 64
    os.replace(tmp_path / name, tmp_path / wrong)
    with pytest.raises(ServiceError):
        Store(10**6, tmp_path).get(wrong)
    for odd in ("../secret", "", "A" * 64, f"{name}/x"):
        with pytest.raises(ServiceError):
            Store(10**6, tmp_path).get(odd)


def test_the_files_used_longest_ago_leave(tmp_path: Path) -> None:
    folder = Folder(tmp_path, 2**40)
    names = [solid_id(sphere(x)) for x in range(6)]
    for x, name in enumerate(names):
        folder.put(name, sphere(x))
        os.utime(tmp_path / name, (x, x))
    stale = tmp_path / "abc.part"
    stale.write_bytes(b"half")
    os.utime(stale, (1, 1))
    assert folder.get(names[0])
    size = (tmp_path / names[0]).stat().st_size
    Folder(tmp_path, 3 * size)
    assert {path.name for path in tmp_path.iterdir()} == {names[0], names[4], names[5]}


def test_threads_share_one_object(tmp_path: Path) -> None:
    name, _ = Store(10**6, tmp_path).put(SOLIDS[10])
    store, found, start = Store(10**6, tmp_path), [], threading.Barrier(4)

    def work() -> None:
        start.wait()
        found.append(store.get(name))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({id(solid) for solid in found}) == 1


def write_on(folder: Path, seed: int, told: Connection) -> None:
    """Store one solid after another and tell each that is stored."""
    source, store = np.random.default_rng(seed), Store(2**30, folder)
    while True:
        told.send_bytes(store.put(engine.Convex(source.normal(size=(20_000, 4))))[0].encode())


def kill_writers(folder: Path, times: int) -> None:
    """Kill processes that write to `folder` at random moments; all files must be whole, all reported ones there."""
    source, told = random.Random(6), set()
    context = mesh_reader.context()  # a process has one server of forks: another's would lack what its readers need
    for turn in range(times):
        ours, theirs = context.Pipe(duplex=False)
        writer = context.Process(target=write_on, args=(folder, turn, theirs))
        writer.start()
        theirs.close()
        told.add(ours.recv_bytes())
        time.sleep(source.random() * 0.02)
        writer.kill()
        writer.join()
        with contextlib.suppress(EOFError):
            while True:
                told.add(ours.recv_bytes())
        ours.close()
        writer.close()
    names = {path.name for path in folder.iterdir() if not path.name.endswith(".part")}
    assert {name.decode() for name in told} <= names
    store = Store(2**30, folder)
    assert all(solid_id(store.get(name)) == name for name in names)


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_killed_writers_leave_nothing_torn(tmp_path: Path) -> None:
    kill_writers(tmp_path, 10)


@pytest.mark.full
def test_many_killed_writers_leave_nothing_torn(tmp_path: Path) -> None:
    kill_writers(tmp_path, 200)
