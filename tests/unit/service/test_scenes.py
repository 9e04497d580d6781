"""Stored scenes and segments through scenes over HTTP: what the engine says, whatever moved, and what is refused."""

from __future__ import annotations

import json
from typing import Any

import httpx
import numpy as np
import pytest

import engine
from service.store import Store
from tests.unit.service.asking import check_problem

pytestmark = pytest.mark.anyio
OCTETS = {"Content-Type": "application/octet-stream"}
SQUARE = {"type": "aabb", "min": [0, 0], "max": [1, 1]}
STEP = {"rotation": [[1, 0], [0, 1]], "translation": [3, 0]}
BACK = {"rotation": [[1, 0], [0, 1]], "translation": [1, 0]}
BODIES: list[dict[str, Any]] = [{"solid": SQUARE}, {"solid": SQUARE, "pose": STEP}]
SPACE = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [0, 0, 0]}
SEGMENTS = [[[-1, 0.5], [5, 0.5]], [[0, 9], [1, 9]]]
POINTS = [[0.5, 0.5], [1, 1], [9, 9]]


async def send(client: httpx.AsyncClient, path: str, content: Any, **query: str) -> httpx.Response:
    return await client.post(path, params=query, content=content.tobytes(), headers=OCTETS)


async def put(client: httpx.AsyncClient, bodies: list[dict[str, Any]] = BODIES) -> str:
    answer = await client.post("/v1/scenes", json={"bodies": bodies})
    assert answer.status_code in (200, 201), answer.text
    return str(answer.headers["location"])


async def test_a_scene_is_stored_under_its_content(client: httpx.AsyncClient) -> None:
    answer = await client.post("/v1/scenes", json={"bodies": BODIES})
    summary = answer.json()
    assert (answer.status_code, summary["bodies"], summary["dimension"]) == (201, 2, 2)
    assert answer.headers["location"] == f"/v1/scenes/{summary['id']}"
    assert answer.headers["etag"] == f'"{summary["id"]}"'
    again = await client.post(
        "/v1/scenes", json={"bodies": [{**BODIES[0], "pose": {**STEP, "translation": [0, 0]}}, BODIES[1]]}
    )
    assert (again.status_code, again.json()["id"]) == (200, summary["id"])
    other = await client.post("/v1/scenes", json={"bodies": BODIES[::-1]})
    assert other.json()["id"] != summary["id"]
    found = await client.get(answer.headers["location"])
    assert (found.status_code, found.json()["id"], found.json()["bodies"]) == (200, summary["id"], 2)
    assert (await client.head(answer.headers["location"])).status_code == 200
    solid = (await client.post("/v1/solids", json=SQUARE)).json()["id"]
    named = [{**body, "solid": {"type": "stored", "id": solid}} for body in BODIES]
    assert (await client.post("/v1/scenes", json={"bodies": named})).json()["id"] == summary["id"]


async def test_what_is_no_scene_is_to_be_put_again(client: httpx.AsyncClient) -> None:
    solid = (await client.post("/v1/solids", json=SQUARE)).json()["id"]
    scene = (await put(client)).rpartition("/")[2]
    for name in ("0" * 64, "nonsense", solid):
        problem = check_problem(await client.get(f"/v1/scenes/{name}"), 404, "unknown_scene")
        assert "put it again" in problem["detail"]
    check_problem(await client.get(f"/v1/solids/{scene}"), 404, "unknown_solid")
    assert (await client.head("/v1/scenes/nonsense")).status_code == 404


async def test_answers_as_a_scene_sent_along(client: httpx.AsyncClient) -> None:
    path = await put(client)
    for moved, bodies in (
        ({}, BODIES),
        ({"moved": [{"body": 1, "pose": BACK}]}, [BODIES[0], {**BODIES[1], "pose": BACK}]),
    ):
        stored = (await client.post(f"{path}/contains", json={"points": POINTS, **moved})).json()
        sent = (await client.post("/v1/contains/scene", json={"points": POINTS, "bodies": bodies})).json()
        assert (stored["bodies"], stored["boundary"]) == (sent["bodies"], sent["boundary"])
        stored = (await client.post(f"{path}/collide", json=moved)).json()
        sent = (await client.post("/v1/collide/scene", json={"bodies": bodies})).json()
        assert stored["pairs"] == sent["pairs"]
        for keep in ("all", "first", "any"):
            question = {"segments": SEGMENTS, "keep": keep}
            stored = (await client.post(f"{path}/clip/segments", json={**question, **moved})).json()
            sent = (await client.post("/v1/clip/segments/scene", json={**question, "bodies": bodies})).json()
            assert stored == sent
    assert (await client.post(f"{path}/collide", json={})).json()["pairs"] == []  # nothing was changed
    new = await client.post(f"{path}/collide", json={"moved": [{"body": 1, "pose": BACK}], "new": True, "detail": True})
    assert new.json()["pairs"] == [{"first": 0, "second": 1, "relation": "touching", "detail": "EC"}]


async def test_pieces_are_those_of_the_engine(client: httpx.AsyncClient) -> None:
    answer = (await client.post("/v1/clip/segments/scene", json={"bodies": BODIES, "segments": SEGMENTS})).json()
    assert answer["pieces"] == [
        {
            "segment": 0,
            "body": 0,
            "start": [0, 0.5],
            "end": [1, 0.5],
            "t": [1 / 6, 1 / 3],
            "faces": [0, 1],
            "ranks": [0, 1],
        },
        {
            "segment": 0,
            "body": 1,
            "start": [3, 0.5],
            "end": [4, 0.5],
            "t": [2 / 3, 5 / 6],
            "faces": [0, 1],
            "ranks": [2, 3],
        },
    ]
    assert answer["accuracy"]["decisions"] == "exact"
    nothing = await client.post("/v1/clip/segments/scene", json={"bodies": [], "segments": SEGMENTS, "keep": "any"})
    assert nothing.json()["met"] == [False, False]


async def test_the_binary_lane(client: httpx.AsyncClient) -> None:
    path = await put(client)
    moved = json.dumps([{"body": 1, "pose": BACK}])
    scene = engine.Scene([engine.Aabb([0, 0], [1, 1])] * 2, [None, engine.Pose(np.eye(2), [1, 0])])
    points, segments = np.array(POINTS, np.float64), np.array(SEGMENTS, np.float64)
    answer = await client.post(
        f"{path}/binary/contains", params={"moved": moved}, content=points.tobytes(), headers=OCTETS
    )
    rows = np.frombuffer(answer.content, "<i8").reshape(-1, 3)
    assert rows.tolist() == [[0, 0, 1], [1, 0, 0], [1, 1, 0]]
    assert answer.headers["geometry-accuracy"].startswith("decisions=exact")
    for keep in ("all", "first"):
        query = {"moved": moved, "keep": keep}
        answer = await client.post(
            f"{path}/binary/clip/segments", params=query, content=segments.tobytes(), headers=OCTETS
        )
        found: Any = scene.clip_segments(segments, keep=keep)  # type: ignore[call-overload]
        table = np.frombuffer(answer.content, "<f8").reshape(-1, 8)
        np.testing.assert_array_equal(table[:, :2], np.column_stack([found.source, found.body]))
        np.testing.assert_array_equal(table[:, 2:], np.column_stack([found.t, found.start, found.end]))
    answer = await client.post(
        f"{path}/binary/clip/segments", params={"keep": "any"}, content=segments.tobytes(), headers=OCTETS
    )
    assert np.frombuffer(answer.content, np.int8).tolist() == [1, 0]
    wrong = await send(client, f"{path}/binary/contains", points, moved="{")
    check_problem(wrong, 422, "invalid_request")


@pytest.mark.parametrize(
    ("moved", "code", "pointer"),
    [
        ([{"body": 2, "pose": BACK}], "index_out_of_range", "/moved/0/body"),
        ([{"body": 1, "pose": BACK}] * 2, "index_out_of_range", "/moved/1/body"),
        (
            [{"body": 1, "pose": {"rotation": np.eye(3).tolist(), "translation": [0, 0, 0]}}],
            "wrong_dimension",
            "/moved/0/pose",
        ),
        ([{"body": 1, "pose": {**BACK, "rotation": [[2, 0], [0, 1]]}}], "not_rigid", "/moved/0/pose/rotation"),
    ],
)
async def test_names_what_cannot_move(client: httpx.AsyncClient, moved: Any, code: str, pointer: str) -> None:
    path = await put(client)
    for question, asked in (
        ("contains", {"points": POINTS}),
        ("collide", {}),
        ("clip/segments", {"segments": SEGMENTS}),
    ):
        problem = check_problem(await client.post(f"{path}/{question}", json={**asked, "moved": moved}), 422, code)
        assert problem["errors"][0]["pointer"] == pointer


async def test_names_what_is_not_taken(client: httpx.AsyncClient) -> None:
    check_problem(await client.post("/v1/scenes", json={"bodies": []}), 422, "empty_geometry")
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1}
    mixed = await client.post("/v1/scenes", json={"bodies": [{"solid": SQUARE}, {"solid": ball}]})
    assert check_problem(mixed, 422, "wrong_dimension")["errors"][0]["pointer"] == "/bodies/1/solid"
    waves = {"type": "implicit", "terms": [{"powers": [2, 0], "coefficient": 1}]}
    refused = await client.post(
        "/v1/clip/segments/scene", json={"bodies": [*BODIES, {"solid": waves}], "segments": SEGMENTS}
    )
    problem = check_problem(refused, 422, "unsupported_solid")
    assert problem["errors"][0]["pointer"] == "/bodies/2/solid"
    assert problem["detail"].startswith("bodies[2].solid: no segment is cut on an implicit")
    path = await put(client)
    check_problem(await client.post(f"{path}/contains", json={"points": [[0, 0, 0]]}), 422, "wrong_dimension")


def test_the_folder_keeps_scenes_too(tmp_path: Any) -> None:
    turned = engine.Pose([[0.6, -0.8], [0.8, 0.6]], [1, 2])
    scene = engine.Scene([engine.Aabb([0, 0], [1, 1]), engine.Sphere([0, 0], 1)], [None, turned])
    name, is_new = Store(10**6, tmp_path).put(scene)
    assert is_new
    found = Store(10**6, tmp_path).get_scene(name)
    assert (len(found), found.poses) == (2, (None, turned))
    assert found.collide().first.tolist() == scene.collide().first.tolist()  # type: ignore[union-attr]
