"""Every message says what to do, in the words of the request."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest

from tests.unit.service.asking import SPHERE, check_problem, resolve

pytestmark = pytest.mark.anyio
JSON = {"Content-Type": "application/json"}
SQUARE = {"type": "polygon", "rings": [[[0, 0], [1, 0], [1, 1]]]}
DISC = {"type": "sphere", "center": [0, 0], "radius": 1}
CONVEX = {"type": "convex", "planes": [[1, 0, 0, 1]]}
TURN = {"rotation": [[2, 0, 0], [0, 2, 0], [0, 0, 2]], "translation": [0, 0, 0]}
STILL = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [0, 0, 0]}


@pytest.mark.parametrize(
    ("body", "code", "says"),
    [
        (b"", "not_json", "send a JSON object"),
        (b" \n", "not_json", "send a JSON object"),
        (b"\xef\xbb\xbf{}", "not_json", "byte order mark"),
        ('{"solid": 1}'.encode("utf-16"), "not_json", "UTF-8"),
        (b'{"solid": 1, "solid": 2}', "not_json", 'key "solid"'),
        (b'{"points": [' + b"[1, 2, 3]," * 999 + b'[1, 2, 3]], "points": []}', "not_json", 'key "points"'),
        (b'{"solid": {"type": "sphere", "center": [0, 1e400], "radius": 1}}', "not_finite", "1.8e308"),
        (b'{"solid": {"type": "stored", "id": "abc"}}', "invalid_request", "64 hexadecimal digits"),
        (b'{"solid": {"type": "LineString", "coordinates": []}}', "unknown_type", "/v1/clip/lines"),
        (b'{"solid": {"type": "csg", "operation": "xor", "operands": []}}', "invalid_request", "'xor'"),
    ],
)
async def test_bodies(client: httpx.AsyncClient, body: bytes, code: str, says: str) -> None:
    answer = await client.post("/v1/contains", content=body, headers=JSON)
    assert says in check_problem(answer, 400 if code == "not_json" else 422, code)["detail"]


@pytest.mark.parametrize(
    ("path", "body", "pointer", "says"),
    [
        ("collide", {"first": SPHERE, "second": SPHERE, "poses": [STILL, TURN]}, "/poses/1/rotation", "poses[1].rot"),
        ("collide/scene", {"bodies": [SPHERE, DISC]}, "/bodies/1/solid", "bodies[1].solid is 2D"),
        ("collide/scene", {"bodies": [SPHERE, CONVEX]}, "/bodies/1/solid", "bodies[1].solid is a convex"),
        ("contains/scene", {"bodies": [SPHERE, DISC], "points": []}, "/bodies/1/solid", "bodies[1]"),
        ("overlay", {"subject": SQUARE, "clip": SQUARE, "operation": "xor"}, "/operation", "symmetric_difference"),
    ],
)
async def test_places(client: httpx.AsyncClient, path: str, body: dict[str, Any], pointer: str, says: str) -> None:
    if "bodies" in body:
        body = {**body, "bodies": [{"solid": solid} for solid in body["bodies"]]}
    problem = check_problem(await client.post(f"/v1/{path}", json=body), 422, problem_code(path, body))
    assert problem["errors"][0]["pointer"] == pointer
    assert resolve(body, pointer)
    assert says in problem["detail"]


def problem_code(path: str, body: dict[str, Any]) -> str:
    if path == "overlay":
        return "invalid_request"
    if path == "collide":
        return "not_rigid"
    return "unsupported_pair" if CONVEX in [item["solid"] for item in body["bodies"]] else "wrong_dimension"


@pytest.mark.parametrize("place", ["field", "type", "id"])
async def test_a_long_text_does_not_come_back(client: httpx.AsyncClient, place: str) -> None:
    long = "x" * 500_000
    body = {
        "field": {"solid": SPHERE, long: 1},
        "type": {"solid": {"type": long}},
        "id": {"solid": {"type": "stored", "id": long}},
    }
    answer = await client.post("/v1/contains", content=json.dumps(body[place]), headers=JSON)
    assert answer.status_code == (400 if place == "field" else 422)  # the decoder takes no such name
    assert len(answer.content) < 3_000
