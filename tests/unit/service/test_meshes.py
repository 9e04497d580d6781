"""Real meshes posted over HTTP, and the hard points whose exact location is known."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import engine
from service import mesh_reader
from service.errors import ServiceError
from service.settings import Settings
from service.store import Store
from service.work import Call, Memory

pytestmark = [pytest.mark.anyio, pytest.mark.data]
HARD = ["c3d_spot", "c3d_spot_off1e6", "syn_bracket_off1e9", "syn_gear_off1e9", "syn_menger2", "syn_sliver_uv"]
MESHES = ["igl_bunny", "c3d_spot", "c3d_fandisk", "tm_quadknot", "tm_rabbit", "syn_menger2"]


@pytest.fixture
def app(app: Any) -> Any:
    app.state.settings = app.state.settings.model_copy(update={"max_body_bytes": 2**26})
    return app


async def store(client: httpx.AsyncClient, mesh: Any) -> dict[str, Any]:
    """Store a mesh and return how a request names it."""
    body = {"type": "polyhedron", "vertices": mesh["vertices"].tolist(), "faces": mesh["faces"].tolist()}
    answer = await client.post("/v1/solids", json=body, timeout=120)
    assert answer.status_code in (200, 201), answer.text[:500]
    return {"type": "stored", "id": answer.json()["id"]}


@pytest.mark.parametrize("name", HARD)
async def test_hard_points_have_their_exact_location(client: httpx.AsyncClient, data: Path, name: str) -> None:
    with np.load(data / "hard_containment" / f"{name}.npz") as case:
        solid = await store(client, case)
        points, expected = case["points"], case["location"]
    answer = await client.post("/v1/contains", json={"solid": solid, "points": points.tolist()}, timeout=120)
    assert answer.json()["contained"] == (expected >= 0).tolist()
    assert answer.json()["boundary"] == np.flatnonzero(expected == 0).tolist()


@pytest.mark.parametrize("name", MESHES)
async def test_answers_over_http_are_those_in_process(client: httpx.AsyncClient, data: Path, name: str) -> None:
    with np.load(data / "meshes" / f"{name}.npz") as mesh:
        solid = await store(client, mesh)
        vertices, faces = mesh["vertices"], mesh["faces"]
    points = np.random.default_rng(4).uniform(vertices.min(axis=0), vertices.max(axis=0), (1000, 3))
    points[:100] = vertices[:100]
    answer = await client.post("/v1/contains", json={"solid": solid, "points": points.tolist()}, timeout=120)
    located = engine.locate(points, engine.Polyhedron(vertices, faces))
    assert answer.json()["contained"] == (located >= 0).tolist()
    assert answer.json()["boundary"] == np.flatnonzero(located == 0).tolist()
    assert set(range(min(100, len(vertices)))) <= set(answer.json()["boundary"])


async def test_two_bunnies_collide_where_they_stand_and_not_far_away(client: httpx.AsyncClient, data: Path) -> None:
    with np.load(data / "meshes" / "igl_bunny.npz") as mesh:
        solid, size = await store(client, mesh), float(np.ptp(mesh["vertices"][:, 0]))
    turn = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    poses = [{"rotation": turn, "translation": [x, 0, 0]} for x in (0.0, 10 * size)]
    answer = await client.post("/v1/collide", json={"first": solid, "second": solid, "poses": poses}, timeout=120)
    relations = [found["relation"] for found in answer.json()["collisions"]]
    assert relations[1] == "disjoint"
    assert relations[0] in ("overlapping", "disjoint")


async def test_segments_are_clipped_by_the_menger_sponge(client: httpx.AsyncClient, data: Path) -> None:
    with np.load(data / "meshes" / "syn_menger2.npz") as mesh:
        solid = await store(client, mesh)
        low, high = mesh["vertices"].min(axis=0), mesh["vertices"].max(axis=0)
    ends = np.random.default_rng(3).uniform(low, high, (50, 2, 3))
    answer = await client.post("/v1/clip/segments", json={"region": solid, "segments": ends.tolist()}, timeout=120)
    assert answer.status_code == 200, answer.text
    middles = [np.mean([piece["start"], piece["end"]], axis=0).tolist() for piece in answer.json()["pieces"]]
    inside = await client.post("/v1/contains", json={"solid": solid, "points": middles}, timeout=120)
    assert all(inside.json()["contained"])


def test_a_long_folder_of_temporary_files_needs_no_socket_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The name of a socket has at most some hundred bytes: its server would not start, and nothing would answer."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / ("long" * 30)))
    assert mesh_reader.context().get_start_method() == "spawn"
    monkeypatch.setattr(tempfile, "tempdir", "/tmp")
    assert mesh_reader.context().get_start_method() in ("forkserver", "spawn")


def test_a_reader_that_cannot_start_is_said_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    started: Any = mesh_reader.context()

    def refuse(_: object) -> None:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(started.Process, "start", refuse)
    call = Call(Settings(), Store(1), Memory(1 << 30))
    with pytest.raises(ServiceError, match="temporarily unavailable"):
        mesh_reader.read(b"solid", "stl", call)


def test_a_reader_that_is_late_is_no_lost_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    started: Any = mesh_reader.context()
    monkeypatch.setattr(started.Process, "start", lambda _: time.sleep(0.5))
    call = Call(Settings(deadline_seconds=0.1), Store(1), Memory(1 << 30))
    with pytest.raises(engine.DeadlineExceededError):
        mesh_reader.read(b"v 0 0 0\n", "obj", call)


def end_at_once(*_: object) -> None:
    """A reader that is killed, or meets a fault of the interpreter."""
    os._exit(9)


def test_a_reader_that_is_lost_ends_the_call(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing comes through its pipe: the call ends then, and not at its deadline."""
    monkeypatch.setattr(mesh_reader, "_child", end_at_once)
    call = Call(Settings(deadline_seconds=300), Store(1), Memory(1 << 30))
    start = time.monotonic()
    with pytest.raises(ServiceError, match="ended without an answer"):
        mesh_reader.read(b"v 0 0 0\n", "obj", call)
    assert time.monotonic() - start < 150


def test_a_lost_server_of_readers_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    started: Any = mesh_reader.context()

    def refuse(_: object) -> None:
        raise EOFError("unexpected EOF")

    monkeypatch.setattr(started.Process, "start", refuse)
    call = Call(Settings(), Store(1), Memory(1 << 30))
    with pytest.raises(ServiceError, match="did not start or was lost") as raised:
        mesh_reader.read(b"solid", "stl", call)
    assert raised.value.code == "out_of_memory"
