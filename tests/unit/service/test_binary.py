"""The binary lane gives what the engine gives, refuses what it must; files of meshes become solids."""

from __future__ import annotations

import multiprocessing
import random
import re
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

import engine
from service.app import create_app
from service.settings import Settings
from tests.unit.files.soups import FAR, ball, binary, has_equal
from tests.unit.service.asking import SPHERE, check_problem, client_of

pytestmark = pytest.mark.anyio
OCTETS = {"Content-Type": "application/octet-stream"}
CUBE = {"type": "aabb", "min": [-1.0, -1.0, -1.0], "max": [1.0, 1.0, 1.0]}
FORMATS = ("stl", "obj", "ply", "off", "glb")


async def stored(client: httpx.AsyncClient, solid: dict[str, Any]) -> str:
    answer = await client.post("/v1/solids", json=solid)
    return f"/v1/solids/{answer.json()['id']}"


async def send(client: httpx.AsyncClient, path: str, content: Any) -> httpx.Response:
    return await client.post(path, content=bytes(content), headers=OCTETS)


async def test_contains_answers_with_locations_and_their_accuracy(client: httpx.AsyncClient) -> None:
    path = await stored(client, SPHERE)
    points = np.vstack([np.random.default_rng(0).normal(size=(999, 3)), [[1.0, 0.0, 0.0]]])
    answer = await send(client, f"{path}/contains", points)
    locations = np.frombuffer(answer.content, np.int8)
    assert locations.tolist() == engine.locate(points, engine.Sphere([0, 0, 0], 1)).tolist()
    assert locations[-1] == engine.Location.BOUNDARY
    assert answer.headers["content-type"] == "application/octet-stream"
    assert answer.headers["geometry-accuracy"].startswith("decisions=exact, items=1000, ")
    assert "compute;dur=" in answer.headers["server-timing"]
    empty = await send(client, f"{path}/contains", b"")
    assert (empty.status_code, empty.content) == (200, b"")
    assert empty.headers["content-type"] == "application/octet-stream"


async def test_clip_segments_answers_with_ends_and_nan(client: httpx.AsyncClient) -> None:
    path = await stored(client, CUBE)
    segments = np.random.default_rng(1).normal(size=(500, 2, 3)) * 2
    answer = await send(client, f"{path}/clip/segments", segments)
    ends = np.frombuffer(answer.content).reshape(-1, 2, 3)
    pieces = engine.clip_segments(segments, engine.Aabb((-1, -1, -1), (1, 1, 1)))
    assert 0 < len(pieces.source) < len(ends)
    assert np.array_equal(ends[pieces.source], np.stack([pieces.start, pieces.end], 1))
    assert np.isnan(np.delete(ends, pieces.source, 0)).all()
    assert "coordinates_ulp=0.5" in answer.headers["geometry-accuracy"]


async def test_a_hundred_thousand_segments_on_a_stored_convex_solid(monkeypatch: pytest.MonkeyPatch) -> None:
    """In one request, within the size that the service takes by default: the same bits as in process."""
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    draw = np.random.default_rng(2)
    normals = draw.normal(size=(20, 3))
    planes = np.column_stack([normals, np.linalg.norm(normals, axis=1)])  # they touch the unit sphere
    segments = draw.uniform(-2.0, 2.0, (100_000, 2, 3))
    async with client_of(create_app(Settings(deadline_seconds=300))) as client:
        path = await stored(client, {"type": "convex", "planes": planes.tolist()})
        answer = await send(client, f"{path}/clip/segments", segments)
    ends = np.frombuffer(answer.content).reshape(-1, 2, 3)
    pieces = engine.clip_segments(segments, engine.Convex(planes))
    expected = np.full(segments.shape, np.nan)
    expected[pieces.source] = np.stack([pieces.start, pieces.end], 1)
    assert 10_000 < len(pieces) < len(segments)
    assert np.array_equal(ends.view(np.int64)[pieces.source], expected.view(np.int64)[pieces.source])
    assert np.array_equal(ends, expected, equal_nan=True)


async def test_what_is_refused(client: httpx.AsyncClient) -> None:
    path = await stored(client, SPHERE)
    check_problem(await send(client, f"{path}/contains", b"1234567"), 422, "invalid_array")
    check_problem(await send(client, f"{path}/clip/segments", b"1" * 24), 422, "invalid_array")
    problem = check_problem(
        await send(client, f"{path}/contains", np.array([0.0, 0, 0, 0, np.inf, 0])), 422, "not_finite"
    )
    assert "points[1][1] is inf" in problem["detail"]
    check_problem(await send(client, f"/v1/solids/{'0' * 64}/contains", b""), 404, "unknown_solid")
    answer = await client.post(f"{path}/contains", json={})
    check_problem(answer, 415, "unsupported_media_type")
    assert answer.headers["accept-post"] == "application/octet-stream"
    check_problem(await send(client, f"{path}/contains", bytes(2**20 + 1)), 413, "body_too_large")
    polygon = await stored(client, {"type": "polygon", "rings": [[[0, 0], [1, 0], [0, 1]]]})
    problem = check_problem(await send(client, f"{polygon}/clip/segments", b""), 422, "unsupported_solid")
    assert "POST /v1/clip/segments" in problem["detail"]


async def test_every_format_of_a_mesh_is_the_same_solid(client: httpx.AsyncClient) -> None:
    trimesh = pytest.importorskip("trimesh", reason="the extra 'formats' is not installed")
    box = trimesh.creation.box((1, 2, 4))
    names = set()
    for kind in (*FORMATS, "stl_ascii"):
        content = box.export(file_type=kind)
        body = content.encode() if isinstance(content, str) else content
        answer = await send(client, f"/v1/solids/import?format={kind.partition('_')[0]}", body)
        assert answer.status_code in (200, 201), answer.text
        assert answer.headers["location"] == f"/v1/solids/{answer.json()['id']}"
        assert (answer.json()["type"], answer.json()["vertices"], answer.json()["faces"]) == ("polyhedron", 8, 12)
        found = await send(
            client, f"{answer.headers['location']}/contains", np.array([[0.5, 1, 2], [0, 0, 0], [9, 0, 0]], float)
        )
        assert np.frombuffer(found.content, np.int8).tolist() == [0, 1, -1]
        if "stl" not in kind:
            names.add(answer.json()["id"])
    assert len(names) == 1


async def test_triangles_that_equal_corners_collapse_are_left_out_and_counted(client: httpx.AsyncClient) -> None:
    pytest.importorskip("trimesh", reason="the extra 'formats' is not installed")
    corners = 3 * ball(56) + FAR
    answer = await send(client, "/v1/solids/import?format=stl", binary(corners))
    n_lost = int(has_equal(corners).sum())
    assert n_lost > 100
    assert answer.status_code == 201, answer.text
    assert (answer.json()["collapsed"], answer.json()["faces"]) == (n_lost, len(corners) - n_lost)
    assert "collapsed" not in (await client.get(f"/v1/solids/{answer.json()['id']}")).json()
    assert "collapsed" not in (await send(client, "/v1/solids/import?format=stl", binary(ball(8)))).json()
    turned = corners.copy()
    face = int(np.flatnonzero(~has_equal(corners))[-1])
    turned[face] = turned[face, ::-1]
    problem = (await send(client, "/v1/solids/import?format=stl", binary(turned))).json()
    assert problem["code"] == "inconsistent_orientation"
    named = re.findall(r"an edge of face (\d+), from", problem["detail"])
    assert named
    assert not has_equal(corners)[[int(place) for place in named]].any()


async def test_meshes_are_checked(client: httpx.AsyncClient) -> None:
    trimesh = pytest.importorskip("trimesh", reason="the extra 'formats' is not installed")
    box = trimesh.creation.box()
    box.update_faces(np.arange(12) != 3)
    body = box.export(file_type="off").encode()
    check_problem(await send(client, "/v1/solids/import?format=off", body), 422, "not_closed")
    answer = await send(client, "/v1/solids/import?format=off&type=surface", body)
    assert (answer.status_code, answer.json()["type"]) == (201, "surface")
    for query in ("", "?format=fbx", "?format=", "?format=off&type=aabb"):
        check_problem(await send(client, f"/v1/solids/import{query}", body), 422, "invalid_request")
    assert (await client.get("/v1/solids/import")).status_code == 404


async def test_broken_files_are_refused(client: httpx.AsyncClient) -> None:
    trimesh = pytest.importorskip("trimesh", reason="the extra 'formats' is not installed")
    source, box = random.Random(1), trimesh.creation.box()
    seen = set()
    for turn in range(60):
        kind = FORMATS[turn % 5]
        content = box.export(file_type=kind)
        body = bytearray(content.encode() if isinstance(content, str) else content)
        at = source.randrange(len(body))
        if turn % 3 == 0:
            del body[at:]
        else:
            body[at : at + 4] = source.randbytes(4)
        answer = await send(client, f"/v1/solids/import?format={kind}", body)
        seen.add(answer.status_code)
        assert answer.status_code in (200, 201, 422), (kind, bytes(body), answer.text)
    assert 422 in seen


async def test_a_reader_of_files_ends_with_its_request(app: FastAPI, anyio_backend: str) -> None:
    """At the deadline, and when the client goes away; a file of many groups is read in linear time."""
    pytest.importorskip("trimesh", reason="the extra 'formats' is not installed")
    groups = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"".join(b"g a%d\nusemtl m%d\nf 1 2 3\n" % (i, i) for i in range(20_000))
    async with client_of(app) as client:
        answer = await send(client, "/v1/solids/import?format=obj&type=surface", groups)
        assert (answer.status_code, answer.json()["faces"]) == (201, 20_000)
        app.state.settings = app.state.settings.model_copy(update={"max_body_bytes": 2**26, "deadline_seconds": 0.3})
        answer = await send(client, "/v1/solids/import?format=obj", b"v 0 0 0\n" * 2_000_000)
        check_problem(answer, 504, "deadline_exceeded")
    assert not multiprocessing.active_children()
