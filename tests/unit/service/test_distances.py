"""POST /v1/distances and its binary lane; distances from the bodies of a stored scene."""

from __future__ import annotations

from typing import Any

import httpx
import numpy as np
import pytest

import engine

pytestmark = pytest.mark.anyio

BOX = {"type": "aabb", "min": [0, 0, 0], "max": [2, 2, 2]}
POINTS = [[3, 1, 1], [1, 1, 0.5], [5, 6, 1], [2, 1, 1]]
OCTETS = {"content-type": "application/octet-stream"}


async def ask(client: httpx.AsyncClient, **question: Any) -> tuple[int, Any]:
    answer = await client.post("/v1/distances", json={"solid": BOX, "points": POINTS, **question})
    return answer.status_code, answer.json()


async def test_distances_from_the_solid_from_its_boundary_and_with_a_sign(client: httpx.AsyncClient) -> None:
    status, answer = await ask(client)
    assert status == 200
    assert answer["distances"] == [1.0, 0.0, 5.0, 0.0]
    assert answer["accuracy"]["decisions"] == "exact"
    assert not {"within", "nearest"} & answer.keys()
    assert (await ask(client, to="boundary"))[1]["distances"] == [1.0, 0.5, 5.0, 0.0]
    assert (await ask(client, signed=True))[1]["distances"] == [1.0, -0.5, 5.0, 0.0]


async def test_within_counts_the_distance_itself(client: httpx.AsyncClient) -> None:
    _, answer = await ask(client, within=5)
    assert answer["within"] == [True] * 4
    assert "distances" not in answer
    assert (await ask(client, within=4.999999999999999))[1]["within"] == [True, True, False, True]


async def test_nearest_points_with_faces_and_features_under_a_pose(client: httpx.AsyncClient) -> None:
    pose = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [1, 0, 0]}
    _, answer = await ask(client, nearest=True, pose=pose, points=[[3.5, 1, 0.5], [1.5, 1, 1], [4, 3, 3]])
    assert answer["nearest"] == [[3, 1, 0.5], [1.5, 1, 1], [3, 2, 2]]
    assert answer["faces"] == [1, -1, 1]
    assert answer["features"] == [
        {"kind": "face", "indices": [1]}, {"kind": "inside", "indices": []}, {"kind": "vertex", "indices": [7]},
    ]  # fmt: skip


WAYS = [[[0, 0], [4, 0], [4, 3]], [[9, 9], [9, 5]]]


@pytest.mark.parametrize(
    "lines",
    [WAYS, {"type": "MultiLineString", "coordinates": WAYS},
     {"type": "Feature", "geometry": {"type": "MultiLineString", "coordinates": WAYS}, "properties": None}],
)  # fmt: skip
async def test_lines_of_the_plane_in_place_of_a_solid(client: httpx.AsyncClient, lines: Any) -> None:
    question = {"lines": lines, "points": [[5, 1], [9, 12], [12, 9]]}
    answer = await client.post("/v1/distances", json={**question, "nearest": True})
    assert answer.status_code == 200, answer.text
    assert answer.json()["distances"] == [1.0, 3.0, 3.0]
    assert answer.json()["nearest"] == [[4, 1], [9, 9], [9, 9]]
    assert answer.json()["features"] == [{"kind": "edge", "indices": [1, 2]}, *[{"kind": "vertex", "indices": [3]}] * 2]
    answer = await client.post("/v1/distances", json={**question, "within": 2.9999999999999996})
    assert answer.json()["within"] == [True, False, False]


@pytest.mark.parametrize(
    ("question", "pointer"),
    [
        ({}, ""),
        ({"lines": WAYS, "solid": BOX}, ""),
        ({"lines": []}, "/lines"),
        ({"lines": [WAYS[0], [[1, 1]]]}, "/lines/1"),
        ({"lines": [[[0, 0, 0], [1, 1, 1]]]}, "/lines/0/0"),
        ({"lines": WAYS, "signed": True}, "/signed"),
    ],
)
async def test_what_is_no_target_is_refused(client: httpx.AsyncClient, question: Any, pointer: str) -> None:
    answer = await client.post("/v1/distances", json={"points": [[1, 1]], **question})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == pointer
    assert "Value error" not in answer.text


@pytest.mark.parametrize(
    ("question", "pointer"),
    [
        ({"within": -1}, "/within"),
        ({"within": 1, "signed": True}, "/within"),
        ({"points": [[0, 0]]}, "/points"),
        ({"solid": {"type": "csg", "operation": "union", "operands": [BOX]}}, "/solid"),
        ({"to": "face"}, "/to"),
    ],
)
async def test_faults_name_the_element(client: httpx.AsyncClient, question: dict[str, Any], pointer: str) -> None:
    status, answer = await ask(client, **question)
    assert status == 422
    assert answer["errors"][0]["pointer"].startswith(pointer)


async def test_raw_points_get_the_same_answers(client: httpx.AsyncClient) -> None:
    name = (await client.post("/v1/solids", json=BOX)).json()["id"]
    raw = np.array(POINTS, "<f8").tobytes()
    path = f"/v1/solids/{name}/distances"
    answer = await client.post(path, content=raw, headers=OCTETS, params={"signed": "true"})
    assert np.frombuffer(answer.content).tolist() == [1.0, -0.5, 5.0, 0.0]
    answer = await client.post(path, content=raw, headers=OCTETS, params={"within": "1"})
    assert list(answer.content) == [1, 1, 0, 1]


async def test_the_nearest_body_of_a_stored_scene(client: httpx.AsyncClient) -> None:
    bodies = [{"solid": BOX}, {"solid": {"type": "sphere", "center": [9, 1, 1], "radius": 1}}]
    name = (await client.post("/v1/scenes", json={"bodies": bodies})).json()["id"]
    points = [[3, 1, 1], [7, 1, 1]]
    answer = (await client.post(f"/v1/scenes/{name}/distances", json={"points": points})).json()
    assert answer["distances"] == [1.0, 1.0]
    assert answer["bodies"] == [0, 1]
    assert answer["nearest"] == [[2, 1, 1], [8, 1, 1]]
    answer = (await client.post(f"/v1/scenes/{name}/distances", json={"points": points, "within": 0.5})).json()
    assert answer["within"] == [False, False]
    assert not {"distances", "bodies", "nearest"} & answer.keys()
    raw: dict[str, Any] = {"content": np.array(points, "<f8").tobytes(), "headers": OCTETS}
    answer = await client.post(f"/v1/scenes/{name}/binary/distances", params={"within": 1}, **raw)
    assert list(answer.content) == [1, 1]
    answer = await client.post(f"/v1/scenes/{name}/binary/distances", **raw)
    assert np.frombuffer(answer.content).reshape(-1, 5).tolist() == [[1, 0, 2, 1, 1], [1, 1, 8, 1, 1]]
    moved = [{"body": 1, "pose": {"rotation": np.eye(3).tolist(), "translation": [-5, 0, 0]}}]
    answer = (await client.post(f"/v1/scenes/{name}/distances", json={"points": points, "moved": moved})).json()
    assert answer["bodies"] == [1, 1]
    assert answer["distances"] == engine.distances(points, engine.Sphere([4, 1, 1], 1)).tolist()
