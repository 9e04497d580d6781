"""POST /v1/clip/segments and /v1/clip/lines."""

from __future__ import annotations

import httpx
import pytest

from service.schemas.clipping import ClipLinesResponse, ClipSegmentsResponse
from tests.unit.service.asking import check_problem

pytestmark = pytest.mark.anyio
BOX = {"type": "aabb", "min": [0, 0], "max": [2, 2]}


async def test_pieces_come_with_their_ends_and_faces(client: httpx.AsyncClient) -> None:
    segments = [[[-1, 1], [3, 1]], [[5, 5], [6, 6]], [[0.5, 0.5], [1, 1]]]
    answer = await client.post("/v1/clip/segments", json={"region": BOX, "segments": segments})
    assert answer.status_code == 200
    assert answer.json()["pieces"] == [
        {"segment": 0, "start": [0.0, 1.0], "end": [2.0, 1.0], "t": [0.25, 0.75], "faces": [0, 1]},
        {"segment": 2, "start": [0.5, 0.5], "end": [1.0, 1.0], "t": [0.0, 1.0], "faces": [-1, -1]},
    ]
    accuracy = answer.json()["accuracy"]
    assert (accuracy["decisions"], accuracy["coordinates_ulp"], accuracy["items"]) == ("exact", 0.5, 3)
    ClipSegmentsResponse.model_validate_json(answer.content)


async def test_no_segments_no_pieces(client: httpx.AsyncClient) -> None:
    answer = await client.post("/v1/clip/segments", json={"region": BOX, "segments": []})
    assert (answer.status_code, answer.json()["pieces"]) == (200, [])


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"segments": [[[0, 0], [1, 1]], [[0, 0, 0], [1, 1, 1]]]}, "invalid_array", "/segments/1/0"),
        ({"segments": [[[0, 0, 0], [1, 1, 1]]]}, "wrong_dimension", "/segments"),
        ({"segments": [[[0, 0]]]}, "invalid_array", "/segments/0"),
        ({"region": {**BOX, "min": [3, 0]}}, "min_above_max", "/region/min/0"),
        ({"region": {"type": "surface", "vertices": [[0, 0, 0]] * 3, "faces": [[0, 1, 2]]}}, "unsupported_solid", ""),
        ({"region": {"type": "half_space", "normal": [0, 0], "offset": 1}}, "zero_normal", "/region/normal"),
        ({"region": {"type": "sphere", "center": [0, 0], "radius": -1}}, "negative_radius", "/region/radius"),
    ],
)
async def test_what_is_wrong_is_named(
    client: httpx.AsyncClient, change: dict[str, object], code: str, pointer: str
) -> None:
    body = {"region": BOX, "segments": [[[0, 0], [1, 1]]], **change}
    problem = check_problem(await client.post("/v1/clip/segments", json=body), 422, code)
    assert problem["errors"][0]["pointer"].startswith(pointer)


async def test_lines_stay_connected(client: httpx.AsyncClient) -> None:
    lines = [[[-1, 1], [1, 1], [1, 3]], [[5, 5], [6, 6]], [[2, -1], [2, 0], [3, 0], [2, 2]]]
    answer = await client.post("/v1/clip/lines", json={"region": BOX, "lines": lines})
    assert answer.status_code == 200
    assert answer.json()["pieces"] == [
        {"line": 0, "positions": [[0, 1], [1, 1], [1, 2]], "segments": [0, 1], "t": [0.5, 0.5], "faces": [0, 3]},
        {"line": 2, "positions": [[2, 0], [2, 0]], "segments": [0, 1], "t": [1, 0], "faces": [2, 1]},
        {"line": 2, "positions": [[2, 2], [2, 2]], "segments": [2, 2], "t": [1, 1], "faces": [1, -1]},
    ]
    ClipLinesResponse.model_validate_json(answer.content)
    none = await client.post("/v1/clip/lines", json={"region": BOX, "lines": []})
    assert (none.status_code, none.json()["pieces"]) == (200, [])
    problem = check_problem(
        await client.post("/v1/clip/lines", json={"region": BOX, "lines": [lines[0], [[1, 1]]]}), 422, "invalid_array"
    )
    assert problem["errors"][0]["pointer"] == "/lines/1"
