"""POST /v1/collide and /v1/collide/scene."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.schemas.bodies import CollideResponse, CollideSceneResponse
from tests.unit.service.asking import SPHERE, check_problem

pytestmark = pytest.mark.anyio
CUBE = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
SQUARE = {"type": "aabb", "min": [0, 0], "max": [1, 1]}
TETRAHEDRON = {
    "type": "polyhedron",
    "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
}


def moved(*translation: float) -> dict[str, Any]:
    return {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": list(translation)}


async def collide(client: httpx.AsyncClient, **body: Any) -> dict[str, Any]:
    answer = await client.post("/v1/collide", json=body)
    assert answer.status_code == 200, answer.text
    CollideResponse.model_validate_json(answer.content)
    found: dict[str, Any] = answer.json()
    return found


async def test_one_pair_has_one_answer_with_its_witness(client: httpx.AsyncClient) -> None:
    found = await collide(client, first=CUBE, second={**CUBE, "min": [1, 0, 0], "max": [2, 1, 1]})
    (answer,) = found["collisions"]
    assert answer["relation"] == "touching"
    assert answer["witness"]["piercing"] is False
    assert found["accuracy"]["decisions"] == "exact"


async def test_every_pose_has_its_answer(client: httpx.AsyncClient) -> None:
    poses = [moved(2, 0, 0), moved(1, 0, 0), moved(0.5, 0, 0), moved(0, 0, 0)]
    found = await collide(client, first=CUBE, second=TETRAHEDRON, poses=poses)
    relations = [answer["relation"] for answer in found["collisions"]]
    assert relations == ["disjoint", "touching", "overlapping", "overlapping"]
    assert ["witness" in answer for answer in found["collisions"]] == [False, True, True, True]
    assert (await collide(client, first=CUBE, second=TETRAHEDRON, poses=[]))["collisions"] == []


async def test_a_body_within_the_other_is_named(client: httpx.AsyncClient) -> None:
    small = {**CUBE, "min": [0.25, 0.25, 0.25], "max": [0.5, 0.5, 0.5]}
    (answer,) = (await collide(client, first=small, second=CUBE))["collisions"]
    assert answer["relation"] == "first_inside_second"
    assert (answer["witness"]["kind"], answer["witness"]["containing"]) == ("containment", "second")


async def test_scene_lists_colliding_pairs(client: httpx.AsyncClient) -> None:
    bodies = [{"solid": CUBE}, {"solid": CUBE, "pose": moved(1, 0, 0)}, {"solid": CUBE, "pose": moved(0, 0.5, 0)}]
    answer = await client.post("/v1/collide/scene", json={"bodies": bodies})
    assert answer.status_code == 200, answer.text
    assert answer.json()["pairs"] == [
        {"first": 0, "second": 1, "relation": "touching"},
        {"first": 0, "second": 2, "relation": "overlapping"},
        {"first": 1, "second": 2, "relation": "touching"},
    ]
    CollideSceneResponse.model_validate_json(answer.content)
    answer = await client.post("/v1/collide/scene", json={"bodies": bodies, "skip": [[0, 1]]})
    assert [(pair["first"], pair["second"]) for pair in answer.json()["pairs"]] == [(0, 2), (1, 2)]
    answer = await client.post("/v1/collide/scene", json={"bodies": bodies, "only": [[2, 0]]})
    assert [(pair["first"], pair["second"]) for pair in answer.json()["pairs"]] == [(0, 2)]
    assert (await client.post("/v1/collide/scene", json={"bodies": []})).json()["pairs"] == []
    bodies[1]["pose"] = moved(1.25, 0, 0)
    answer = await client.post("/v1/collide/scene", json={"bodies": bodies, "only": [[0, 1], [0, 2]], "gap": 0.5})
    assert answer.json()["pairs"] == [
        {"first": 0, "second": 1, "relation": "disjoint", "distance": 0.25},
        {"first": 0, "second": 2, "relation": "overlapping", "distance": 0.0},
    ]


async def test_the_eight_relations_are_told_when_asked_for(client: httpx.AsyncClient) -> None:
    half = {**CUBE, "max": [1, 1, 0.5]}
    found = await collide(client, first=half, second=CUBE, detail=True)
    assert [answer["detail"] for answer in found["collisions"]] == ["TPP"]
    poses = [moved(0, 0, 0), moved(0, 0, 0.25), moved(0, 0, 1), moved(0, 0, 2)]
    found = await collide(client, first=CUBE, second=half, poses=poses, detail=True)
    assert [answer["detail"] for answer in found["collisions"]] == ["TPPi", "TPPi", "EC", "DC"]
    assert "detail" not in (await collide(client, first=CUBE, second=half, detail=False))["collisions"][0]
    flat = {**CUBE, "max": [1, 1, 0]}
    assert "detail" not in (await collide(client, first=CUBE, second=flat, detail=True))["collisions"][0]
    bodies = [{"solid": CUBE}, {"solid": CUBE}, {"solid": half}, {"solid": flat}]
    answer = await client.post("/v1/collide/scene", json={"bodies": bodies, "detail": True})
    assert answer.status_code == 200, answer.text
    CollideSceneResponse.model_validate_json(answer.content)
    details = {(pair["first"], pair["second"]): pair.get("detail") for pair in answer.json()["pairs"]}
    assert details == {(0, 1): "EQ", (0, 2): "TPPi", (1, 2): "TPPi", (0, 3): None, (1, 3): None, (2, 3): None}


SCALED = {"rotation": [[2, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [0, 0, 0]}


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"second": SQUARE}, "wrong_dimension", "/second"),
        ({"first": {"type": "convex", "planes": [[1, 0, 0, 0]]}}, "unsupported_pair", "/first"),
        ({"second": {"type": "surface", "vertices": [[0, 0, 0]], "faces": [[0, 0, 0]]}}, "repeated_index",
         "/second/faces/0"),
        ({"poses": [moved(0, 0, 0), SCALED]}, "not_rigid", "/poses/1/rotation"),
        ({"poses": [moved(0, 0)]}, "wrong_dimension", "/poses/0"),
        ({"poses": [{"rotation": [[1, 0], [0, 1]], "translation": [0, 0]}]}, "wrong_dimension", "/poses/0"),
        ({"poses": [{"rotation": [[1, 0, 0], [0, 1, 0]], "translation": [0, 0, 0]}]}, "wrong_dimension", "/poses/0"),
        ({"poses": [{"rotation": [[1, 0, 0], [0, 1], [0, 0, 1]], "translation": [0, 0, 0]}]}, "invalid_array",
         "/poses/0/rotation/1"),
        ({"poses": None}, "invalid_request", "/poses"),
        ({"detail": 1}, "invalid_request", "/detail"),
        ({"first": {"type": "surface", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]},
          "second": CUBE, "detail": True}, "unsupported_solid", "/first"),
        ({"poses": {}}, "invalid_request", "/poses"),
    ],
)  # fmt: skip
async def test_what_is_wrong_is_named(
    client: httpx.AsyncClient, change: dict[str, Any], code: str, pointer: str
) -> None:
    answer = await client.post("/v1/collide", json={"first": CUBE, "second": SPHERE, **change})
    assert check_problem(answer, 422, code)["errors"][0]["pointer"] == pointer


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"bodies": [{"solid": CUBE}, {"solid": SQUARE}]}, "wrong_dimension", "/bodies/1/solid"),
        ({"bodies": [{"solid": CUBE, "pose": SCALED}]}, "not_rigid", "/bodies/0/pose/rotation"),
        ({"only": [[0, 2]]}, "index_out_of_range", "/only/0"),
        ({"skip": [[0, -1]]}, "index_out_of_range", "/skip/0/1"),
        ({"skip": [[0]]}, "invalid_array", "/skip/0"),
        ({"skip": [[0, 1.0]]}, "invalid_array", "/skip/0/1"),
    ],
)
async def test_what_is_wrong_in_a_scene_is_named(
    client: httpx.AsyncClient, change: dict[str, Any], code: str, pointer: str
) -> None:
    answer = await client.post("/v1/collide/scene", json={"bodies": [{"solid": CUBE}, {"solid": CUBE}], **change})
    assert check_problem(answer, 422, code)["errors"][0]["pointer"].startswith(pointer)


async def test_those_who_need_no_witness_say_so(client: httpx.AsyncClient) -> None:
    poses = [moved(2, 0, 0), moved(1, 0, 0), moved(0.5, 0, 0)]
    for options, has_witness in (
        ({"witness": False}, False),
        ({"boolean": True}, False),
        ({"boolean": True, "witness": False}, False),
        ({"witness": True}, True),
    ):
        many = (await collide(client, first=CUBE, second=TETRAHEDRON, poses=poses, **options))["collisions"]
        assert ["witness" in answer for answer in many] == [False, has_witness, has_witness]
        assert [answer["relation"] == "disjoint" for answer in many] == [True, False, False]
        (one,) = (await collide(client, first=CUBE, second=TETRAHEDRON, **options))["collisions"]
        assert ("witness" in one, one["relation"] == "disjoint") == (has_witness, False)
    found = (await collide(client, first=CUBE, second=CUBE, poses=poses, witness=False, detail=True))["collisions"]
    assert [answer["detail"] for answer in found] == ["DC", "EC", "PO"]
    body = {"bodies": [{"solid": CUBE}, {"solid": TETRAHEDRON}], "boolean": True}
    answer = await client.post("/v1/collide/scene", json=body)
    assert answer.json()["pairs"] == [{"first": 0, "second": 1, "relation": "touching"}]
    answer = await client.post("/v1/collide", json={"first": CUBE, "second": CUBE, "boolean": True, "detail": True})
    assert check_problem(answer, 422, "invalid_input")["errors"][0]["pointer"] == "/detail"
