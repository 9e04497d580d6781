"""What remains of segments, lines and polygons."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.schemas.clipping import ClipLinesResponse, ClipPolygonsResponse, ClipSegmentsResponse
from tests.unit.service.asking import SPHERE, check_problem

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


HALF = {"type": "half_space", "normal": [-1, 0], "offset": 1}
TRIANGLE = [[0, 0], [4, 0], [0, 4]]


async def test_each_polygon_has_its_entry(client: httpx.AsyncClient) -> None:
    polygons = [[TRIANGLE], [[[2, 0], [4, 0], [4, 4]]], [[[2, 0], [3, 0], [3, 1]], TRIANGLE]]
    answer = await client.post("/v1/clip/polygons", json={"region": HALF, "polygons": polygons})
    assert answer.status_code == 200, answer.text
    kept = [[0, 0], [1, 0], [1, 3], [0, 4]]
    assert [entry["rings"] for entry in answer.json()["polygons"]] == [[kept], [], [kept]]
    assert [entry["contours"] for entry in answer.json()["polygons"]] == [[0], [], [1]]
    assert {entry["status"] for entry in answer.json()["polygons"]} == {"clipped"}
    ClipPolygonsResponse.model_validate_json(answer.content)


async def test_concave_contours_may_have_bridges(client: httpx.AsyncClient) -> None:
    comb = [[0, 0], [4, 0], [4, 4], [0, 4], [3, 3], [0, 2]]
    body = {"region": {**HALF, "normal": [1, 0], "offset": -1}, "polygons": [[comb[::-1]], [TRIANGLE]]}
    entries = (await client.post("/v1/clip/polygons", json=body)).json()["polygons"]
    assert isinstance(entries[0]["may_have_bridges"], bool)
    assert entries[1]["may_have_bridges"] is False


async def test_contours_in_space_need_not_be_planar(client: httpx.AsyncClient) -> None:
    box = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
    body = {"region": box, "polygons": [[[[0, 0, 0], [2, 0, 0], [2, 2, 1], [0, 2, 0.5]]]]}
    (entry,) = (await client.post("/v1/clip/polygons", json=body)).json()["polygons"]
    assert len(entry["rings"][0]) >= 4


@pytest.mark.parametrize("region", [HALF, {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}])
async def test_no_polygons_no_entries(client: httpx.AsyncClient, region: dict[str, Any]) -> None:
    answer = await client.post("/v1/clip/polygons", json={"region": region, "polygons": []})
    assert (answer.status_code, answer.json()["polygons"]) == (200, [])


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"region": SPHERE}, "unsupported_solid", "/region"),
        ({"polygons": [TRIANGLE]}, "invalid_array", "/polygons/0/0/0"),
        ({"polygons": [[1]] * 3000}, "invalid_array", "/polygons/0/0"),  # long: decoded into an array at first
        ({"polygons": [[]]}, "empty_geometry", "/polygons/0"),
        ({"polygons": [[[]]]}, "empty_geometry", "/polygons/0/0"),
        ({"polygons": {}}, "invalid_request", "/polygons"),
        ({"polygons": [[TRIANGLE], [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]]}, "wrong_dimension", "/polygons/1/0"),
    ],
)
async def test_what_is_wrong_with_polygons_is_named(
    client: httpx.AsyncClient, change: dict[str, object], code: str, pointer: str
) -> None:
    body = {"region": HALF, "polygons": [[TRIANGLE]], **change}
    problem = check_problem(await client.post("/v1/clip/polygons", json=body), 422, code)
    assert problem["errors"][0]["pointer"] == pointer
