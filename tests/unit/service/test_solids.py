"""POST, GET and HEAD of stored solids, and the use of them in place of a solid."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.schemas.solids import StoredSolidSummary
from tests.unit.service.asking import SPHERE, check_problem

pytestmark = pytest.mark.anyio

SOLIDS: list[dict[str, Any]] = [
    {"type": "half_space", "normal": [0, 1], "offset": 0.5},
    SPHERE,
    {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]},
    {"type": "convex", "planes": [[1, 0, 0], [0, 1, 0]]},
    {"type": "polyhedron", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
     "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]},
    {"type": "surface", "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2, 3]]},
    {"type": "triangle", "vertices": [[0, 0], [1, 0], [0, 1]]},
    {"type": "polygon", "rings": [[[0, 0], [4, 0], [0, 4], [0, 0]], [[1, 1], [2, 1], [1, 2]]]},
    {"type": "implicit", "terms": [{"powers": [2, 0], "coefficient": -1}, {"powers": [0, 0], "coefficient": 1}]},
    {"type": "csg", "operation": "difference", "operands": [SPHERE, {**SPHERE, "radius": 0.5}]},
]  # fmt: skip


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: solid["type"])
async def test_every_solid_can_be_stored(client: httpx.AsyncClient, solid: dict[str, Any]) -> None:
    answer = await client.post("/v1/solids", json=solid)
    summary = answer.json()
    assert answer.status_code == 201, answer.text
    assert answer.headers["location"] == f"/v1/solids/{summary['id']}"
    assert answer.headers["etag"] == f'"{summary["id"]}"'
    assert summary["type"] == solid["type"]
    StoredSolidSummary.model_validate_json(answer.content)
    again = await client.post("/v1/solids", json=solid)
    assert (again.status_code, again.json()) == (200, summary)
    found = await client.get(answer.headers["location"])
    assert (found.status_code, found.json(), found.headers["etag"]) == (200, summary, answer.headers["etag"])
    there = await client.head(answer.headers["location"])
    assert (there.status_code, there.content) == (200, b"")
    stored = await client.post("/v1/solids", json={"type": "stored", "id": summary["id"]})
    assert (stored.status_code, stored.json()["id"]) == (200, summary["id"])


async def test_unknown_ids_are_to_be_put_again(client: httpx.AsyncClient) -> None:
    for name in ("0" * 64, "nonsense", "%00"):
        problem = check_problem(await client.get(f"/v1/solids/{name}"), 404, "unknown_solid")
        assert "put it again" in problem["detail"]
        assert (await client.head(f"/v1/solids/{name}")).status_code == 404
    body = {"type": "csg", "operation": "union", "operands": [SPHERE, {"type": "stored", "id": "0" * 64}]}
    problem = check_problem(await client.post("/v1/solids", json=body), 404, "unknown_solid")
    assert problem["errors"][0]["pointer"] == "/operands/1/id"


async def test_a_tree_of_stored_solids_has_the_name_of_the_tree_itself(client: httpx.AsyncClient) -> None:
    name = (await client.post("/v1/solids", json=SPHERE)).json()["id"]
    body = {"type": "csg", "operation": "union", "operands": [{"type": "stored", "id": name}]}
    answers = [await client.post("/v1/solids", json=tree) for tree in (body, {**body, "operands": [SPHERE]})]
    assert [answer.status_code for answer in answers] == [201, 200]


def nested(depth: int) -> bytes:
    """Return the JSON of a CSG tree of `depth` levels; built as text, since json.dumps gives up first."""
    leaf = b'{"type":"sphere","center":[0,0],"radius":1}'
    return b'{"type":"csg","operation":"union","operands":[' * depth + leaf + b"]}" * depth


@pytest.mark.parametrize(
    ("depth", "status", "code"), [(33, 422, "too_deep"), (90, 422, "too_deep"), (10_000, 400, "not_json")]
)
async def test_deep_trees_are_refused(client: httpx.AsyncClient, depth: int, status: int, code: str) -> None:
    headers = {"Content-Type": "application/json"}
    check_problem(await client.post("/v1/solids", content=nested(depth), headers=headers), status, code)
    assert (await client.post("/v1/solids", content=nested(32), headers=headers)).status_code == 201


async def test_trees_with_too_many_members_are_refused(client: httpx.AsyncClient) -> None:
    body = {"type": "csg", "operation": "union", "operands": [SPHERE] * 1000}
    check_problem(await client.post("/v1/solids", json=body), 422, "limit_exceeded")
    check_problem(await client.post("/v1/solids", json={**body, "operands": [SPHERE] * 1001}), 422, "limit_exceeded")


def implicit(*powers: float) -> dict[str, Any]:
    return {"type": "implicit", "terms": [{"powers": list(powers), "coefficient": 1}]}


OPEN = {"type": "polyhedron", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}


@pytest.mark.parametrize(
    ("solid", "code", "pointer"),
    [
        ([], "invalid_request", ""),
        ("sphere", "invalid_request", ""),
        ({}, "unknown_type", ""),
        ({"type": "ball"}, "unknown_type", ""),
        ({"type": 3}, "unknown_type", ""),
        ({"type": "sphere", "center": [0, 0]}, "missing_field", "/radius"),
        ({**SPHERE, "colour": 1}, "unknown_field", "/colour"),
        ({**SPHERE, "a/b": 1}, "unknown_field", "/a~1b"),
        ({**SPHERE, "sphere": 1}, "unknown_field", "/sphere"),
        ({**SPHERE, "radius": "1.5"}, "invalid_array", "/radius"),
        ({**SPHERE, "radius": True}, "invalid_array", "/radius"),
        ({**SPHERE, "radius": None}, "invalid_array", "/radius"),
        ({**SPHERE, "radius": -1}, "negative_radius", "/radius"),
        ({**SPHERE, "radius": 10**400}, "invalid_array", "/radius"),
        ({**SPHERE, "center": [0, 0, 0, 0]}, "invalid_array", "/center"),
        ({**SPHERE, "center": [0, 2**53 + 1, 0]}, "invalid_array", "/center/1"),
        ({"type": "aabb", "min": [0, 0], "max": [1, 1, 1]}, "wrong_dimension", "/max"),
        ({"type": "aabb", "min": [0, 2], "max": [1, 1]}, "min_above_max", "/min/1"),
        ({"type": "half_space", "normal": [0, 0], "offset": 1}, "zero_normal", "/normal"),
        ({"type": "convex", "planes": []}, "empty_geometry", "/planes"),
        ({"type": "convex", "planes": [[1, 0, 0], [0, 0, 1]]}, "zero_normal", "/planes/1"),
        (OPEN, "not_closed", "/faces/0"),
        ({**OPEN, "faces": [[0, 1, 3]]}, "index_out_of_range", "/faces/0/2"),
        ({**OPEN, "faces": [[0, 1, -1]]}, "index_out_of_range", "/faces/0/2"),
        ({**OPEN, "faces": [[0, 1, 1]]}, "repeated_index", "/faces/0"),
        ({**OPEN, "faces": [[0, 1]]}, "invalid_array", "/faces/0"),
        ({**OPEN, "faces": [[0, 1, 2], [0, 1, 2]]}, "inconsistent_orientation", "/faces/0"),
        ({**OPEN, "vertices": []}, "empty_geometry", "/vertices"),
        ({**OPEN, "vertices": [[0, 0], [1, 0], [0, 1]]}, "invalid_array", "/vertices/0"),
        ({"type": "polygon", "rings": [[[0, 0]]]}, "ring_too_short", "/rings/0"),
        ({"type": "polygon", "rings": [[[0, 0], [1, 0], [1, "x"]]]}, "invalid_array", "/rings/0/2/1"),
        ({"type": "triangle", "vertices": [[0, 0], [1, 0]]}, "invalid_array", "/vertices"),
        ({"type": "implicit", "terms": []}, "empty_geometry", "/terms"),
        (implicit(17, 0), "invalid_polynomial", "/terms/0/powers"),
        (implicit(1.0, 1), "invalid_array", "/terms/0/powers/0"),
        ({"type": "csg", "operation": "xor", "operands": [SPHERE]}, "invalid_request", "/operation"),
        ({"type": "csg", "operation": "union", "operands": []}, "empty_geometry", "/operands"),
        ({"type": "csg", "operation": "difference", "operands": [SPHERE]}, "invalid_operation", "/operands"),
        ({"type": "csg", "operation": "union", "operands": [SPHERE, SOLIDS[0]]}, "wrong_dimension", "/operands/1"),
        ({"type": "csg", "operation": "union", "operands": [SOLIDS[5]]}, "unsupported_solid", "/operands/0"),
        ({"type": "csg", "operation": "union", "operands": [OPEN]}, "not_closed", "/operands/0/faces/0"),
        ({"type": "stored", "id": "xyz"}, "invalid_request", "/id"),
        ({"type": "stored", "id": 3}, "invalid_request", "/id"),
    ],
)  # fmt: skip
async def test_what_is_wrong_is_named(client: httpx.AsyncClient, solid: object, code: str, pointer: str) -> None:
    problem = check_problem(await client.post("/v1/solids", json=solid), 422, code)
    assert problem["errors"][0]["pointer"] == pointer


@pytest.mark.parametrize("number", ["1e400", "-1e400", "NaN", "Infinity", "-Infinity"])
async def test_numbers_that_are_not_finite_are_named(client: httpx.AsyncClient, number: str) -> None:
    body = f'{{"type":"sphere","center":[0,{number},0],"radius":1}}'
    answer = await client.post("/v1/solids", content=body, headers={"Content-Type": "application/json"})
    assert check_problem(answer, 422, "not_finite")["errors"][0]["pointer"] == "/center/1"


async def test_a_client_that_knows_a_solid_is_told_so(client: httpx.AsyncClient) -> None:
    stored = await client.post("/v1/solids", json=SPHERE)
    path, tag = stored.headers["location"], stored.headers["etag"]
    for tags in (tag, f'"other", W/{tag}'):
        for method in ("GET", "HEAD"):
            answer = await client.request(method, path, headers={"If-None-Match": tags})
            assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", tag)
    assert (await client.get(path, headers={"If-None-Match": '"other"'})).status_code == 200
    gone = await client.get(f"/v1/solids/{'0' * 64}", headers={"If-None-Match": f'"{"0" * 64}"'})
    check_problem(gone, 404, "unknown_solid")
    again = await client.post("/v1/solids", json=SPHERE, headers={"If-None-Match": tag})
    assert again.status_code == 200


async def test_probes_may_ask_for_the_head_alone(client: httpx.AsyncClient) -> None:
    for path in ("/healthz", "/readyz"):
        answer = await client.head(path)
        assert (answer.status_code, answer.content) == (200, b"")
