"""POST /v1/clearance."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

pytestmark = pytest.mark.anyio

BOX = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
BALL = {"type": "sphere", "center": [4, 5, 1], "radius": 2}
STILL = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


async def ask(client: httpx.AsyncClient, **question: Any) -> tuple[int, Any]:
    answer = await client.post("/v1/clearance", json={"first": BOX, "second": BALL, **question})
    return answer.status_code, answer.json()


async def test_one_pair_with_points_and_features(client: httpx.AsyncClient) -> None:
    status, answer = await ask(client)
    assert status == 200
    assert answer["clearances"] == [
        {
            "distance": 3.0,
            "points": [[1.0, 1.0, 1.0], [2.8, 3.4, 1.0]],
            "features": [{"kind": "vertex", "indices": [7]}, {"kind": "ball", "indices": []}],
        }
    ]
    assert answer["accuracy"]["decisions"] == "exact"
    assert "clear" not in answer


async def test_bodies_that_meet_are_no_distance_apart(client: httpx.AsyncClient) -> None:
    assert (await ask(client, second=BOX))[1]["clearances"] == [{"distance": 0.0}]


async def test_at_least_counts_the_distance_itself(client: httpx.AsyncClient) -> None:
    assert (await ask(client, at_least=3))[1]["clear"] == [True]
    _, answer = await ask(client, at_least=3.0000000000000004)
    assert answer["clear"] == [False]
    assert "clearances" not in answer


async def test_many_poses(client: httpx.AsyncClient) -> None:
    poses = [{"rotation": STILL, "translation": [0, 0, z]} for z in (0, -1.5, 1e3)]
    distances = [item["distance"] for item in (await ask(client, poses=poses))[1]["clearances"]]
    assert distances[:2] == [3.0, 3.024937810560445]
    assert distances[2] > 998
    assert (await ask(client, poses=poses, at_least=4))[1]["clear"] == [False, False, True]


async def test_refusals_say_where(client: httpx.AsyncClient) -> None:
    status, problem = await ask(client, at_least=-1)
    assert (status, problem["errors"][0]["pointer"]) == (422, "/at_least")
    status, problem = await ask(client, second={"type": "convex", "planes": [[1, 0, 0, 0]]})
    assert (status, problem["code"]) == (422, "unsupported_pair")
    status, problem = await ask(
        client, poses=[{"rotation": [[2, 0, 0], [0, 2, 0], [0, 0, 2]], "translation": [0, 0, 0]}]
    )
    assert (status, problem["errors"][0]["pointer"]) == (422, "/poses/0/rotation")
