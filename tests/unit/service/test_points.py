"""Which points lie in a solid, what bounds it, and the textbook's methods beside ours."""

from __future__ import annotations

from typing import Any

import httpx
import numpy as np
import pytest

from service.schemas.points import BoundsResponse, CompareResponse, ContainsResponse, ContainsSceneResponse
from tests.unit.service.asking import SPHERE, check_problem

pytestmark = pytest.mark.anyio
BOX = {"type": "aabb", "min": [0, 0], "max": [1, 1]}


async def test_points_are_in_on_the_boundary_or_out(client: httpx.AsyncClient) -> None:
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 5}
    points = [[0, 0, 0], [3, 4, 0], [3, 4, 5e-324], [-5, -0.0, 0]]
    answer = await client.post("/v1/contains", json={"solid": ball, "points": points})
    assert answer.status_code == 200
    assert answer.json()["contained"] == [True, True, False, True]
    assert answer.json()["boundary"] == [1, 3]
    assert answer.json()["accuracy"]["decisions"] == "exact"
    assert answer.json()["accuracy"]["items"] == 4
    ContainsResponse.model_validate_json(answer.content)


async def test_large_and_small_requests_agree(client: httpx.AsyncClient) -> None:
    points = np.random.default_rng(1).random((3000, 3)).tolist()
    whole = await client.post("/v1/contains", json={"solid": SPHERE, "points": points})
    parts = [
        (await client.post("/v1/contains", json={"solid": SPHERE, "points": [point]})).json()["contained"][0]
        for point in points[:50]
    ]
    assert whole.json()["contained"][:50] == parts


async def test_a_stored_solid_is_used_by_its_id(client: httpx.AsyncClient) -> None:
    name = (await client.post("/v1/solids", json=SPHERE)).json()["id"]
    body = {"solid": {"type": "stored", "id": name}, "points": [[0, 0, 0], [2, 0, 0]]}
    assert (await client.post("/v1/contains", json=body)).json()["contained"] == [True, False]


@pytest.mark.parametrize("solid", [SPHERE, BOX])
async def test_no_points_no_answers(client: httpx.AsyncClient, solid: dict[str, Any]) -> None:
    answer = await client.post("/v1/contains", json={"solid": solid, "points": []})
    assert (answer.status_code, answer.json()["contained"], answer.json()["boundary"]) == (200, [], [])


async def test_scene_lists_the_bodies_of_each_point(client: httpx.AsyncClient) -> None:
    turned = {"solid": BOX, "pose": {"rotation": [[0, -1], [1, 0]], "translation": [2, 0]}}
    body = {"bodies": [{"solid": BOX}, turned], "points": [[0.5, 0.5], [1, 0.5], [9, 9]]}
    answer = await client.post("/v1/contains/scene", json=body)
    assert answer.status_code == 200, answer.text
    assert answer.json()["bodies"] == [[0], [0, 1], []]
    assert answer.json()["boundary"] == [[], [0, 1], []]
    ContainsSceneResponse.model_validate_json(answer.content)
    answer = await client.post("/v1/contains/scene", json={"bodies": [{"solid": BOX}], "points": []})
    assert answer.json()["bodies"] == []


SURFACE = {"type": "surface", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}


@pytest.mark.parametrize(
    ("body", "code", "pointer"),
    [
        ({"solid": SPHERE, "points": [[0, 0]]}, "wrong_dimension", "/points"),
        ({"solid": SURFACE, "points": []}, "unsupported_solid", "/solid"),
        ({"solid": SPHERE, "points": None}, "invalid_array", "/points"),
        ({"solid": SPHERE, "points": [[0, 0, 0], [0, 0, 0, 0]]}, "invalid_array", "/points/1"),
        ({"solid": SPHERE}, "missing_field", "/points"),
        ({"solid": SPHERE, "points": [], "verbose": True}, "unknown_field", "/verbose"),
        ({"solid": None, "points": []}, "invalid_request", "/solid"),
    ],
)
async def test_what_is_wrong_is_named(client: httpx.AsyncClient, body: dict[str, Any], code: str, pointer: str) -> None:
    problem = check_problem(await client.post("/v1/contains", json=body), 422, code)
    assert problem["errors"][0]["pointer"] == pointer


IDENTITY = {"rotation": [[1, 0], [0, 1]], "translation": [0, 0]}


@pytest.mark.parametrize(
    ("bodies", "code", "pointer"),
    [
        ([], "empty_geometry", "/bodies"),
        ([{"solid": SPHERE}, {"solid": SURFACE}], "unsupported_solid", "/bodies/1/solid"),
        ([{"solid": BOX}, {"solid": SPHERE}], "wrong_dimension", "/bodies/1/solid"),
        ([{"solid": BOX, "pose": None}], "invalid_request", "/bodies/0/pose"),
        ([{"solid": BOX}, {"solid": BOX, "pose": {**IDENTITY, "rotation": [[1, 0], [0, 2]]}}], "not_rigid",
         "/bodies/1/pose/rotation"),
        ([{"solid": BOX, "pose": {**IDENTITY, "translation": [0, 0, 0]}}], "wrong_dimension",
         "/bodies/0/pose/translation"),
        ([{"solid": SPHERE, "pose": IDENTITY}], "wrong_dimension", "/bodies/0/pose"),
        ([{"solid": {**BOX, "max": [1, -1]}}], "min_above_max", "/bodies/0/solid/min/1"),
    ],
)  # fmt: skip
async def test_what_is_wrong_in_a_scene_is_named(
    client: httpx.AsyncClient, bodies: list[Any], code: str, pointer: str
) -> None:
    problem = check_problem(await client.post("/v1/contains/scene", json={"bodies": bodies, "points": []}), 422, code)
    assert problem["errors"][0]["pointer"] == pointer


async def test_box_and_sphere(client: httpx.AsyncClient) -> None:
    triangle = {"type": "triangle", "vertices": [[0, 0], [4, 0], [4, 3]]}
    answer = await client.post("/v1/bounds", json={"solid": triangle})
    assert answer.status_code == 200, answer.text
    assert answer.json()["aabb"] == {"min": [0.0, 0.0], "max": [4.0, 3.0]}
    assert answer.json()["sphere"] == {"center": [2.0, 1.5], "radius": 2.5}
    BoundsResponse.model_validate_json(answer.content)


@pytest.mark.parametrize(
    ("solid", "code", "pointer"),
    [
        ({"type": "half_space", "normal": [1, 0], "offset": 0}, "unsupported_solid", "/solid"),
        ({"type": "convex", "planes": [[1, 0, 0]]}, "unsupported_solid", "/solid/planes"),
        (
            {"type": "convex", "planes": [[1, 0, -1], [-1, 0, 0], [0, 1, 0], [0, -1, 1]]},
            "empty_geometry",
            "/solid/planes",
        ),
        ({"type": "aabb", "min": [-1.7e308, -1.7e308], "max": [1.7e308, 1.7e308]}, "not_representable", ""),
    ],
)
async def test_what_has_no_bounds_is_refused(
    client: httpx.AsyncClient, solid: dict[str, object], code: str, pointer: str
) -> None:
    problem = check_problem(await client.post("/v1/bounds", json={"solid": solid}), 422, code)
    assert problem["errors"][0]["pointer"] == pointer
    name = (await client.post("/v1/solids", json=solid)).json()["id"]
    problem = check_problem(await client.post("/v1/bounds", json={"solid": {"type": "stored", "id": name}}), 422, code)
    assert problem["errors"][0]["pointer"] in ("/solid", "")


CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
BODY = {"type": "polyhedron", "vertices": CORNERS, "faces": FACES}
UNIT_BOX = {"type": "aabb", "min": [0, 0], "max": [1, 3]}
BALL = {"type": "sphere", "center": [0, 0], "radius": 1}


@pytest.mark.parametrize(
    ("question", "method"),
    [
        ({"operation": "contains", "solid": BODY, "points": [[0.1, 0.1, 0.1], [1, 1, 1]]}, "half-line"),
        ({"operation": "collide", "first": BODY, "second": BODY, "method": "volumes first"}, "volumes first"),
        ({"operation": "clip_segments", "region": UNIT_BOX, "segments": [[[-1, 1], [3, 1]]]}, "Cohen-Sutherland"),
        (
            {"operation": "clip_polygons", "region": UNIT_BOX, "polygons": [[[0, 0], [4, 0], [0, 4]]]},
            "Sutherland-Hodgman",
        ),
    ],
)
async def test_both_answer(client: httpx.AsyncClient, question: dict[str, Any], method: str) -> None:
    answer = await client.post("/v1/compare", json=question)
    assert answer.status_code == 200, answer.text
    found = CompareResponse.model_validate_json(answer.content)
    assert found.method == method
    assert method in found.methods
    assert (found.differing.tolist(), found.accuracy.decisions) == ([], "exact")


@pytest.mark.parametrize(
    ("question", "code"),
    [
        ({"operation": "contains", "solid": BODY}, "invalid_request"),
        ({"operation": "contains", "solid": BALL, "points": [[0, 0]]}, "unsupported_solid"),
        ({"operation": "clip_segments", "region": UNIT_BOX, "segments": [], "method": "x"}, "invalid_operation"),
    ],
)
async def test_what_is_not_compared_is_refused(client: httpx.AsyncClient, question: dict[str, Any], code: str) -> None:
    check_problem(await client.post("/v1/compare", json=question), 422, code)
