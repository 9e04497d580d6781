"""POST /v1/layers/overlay, /v1/layers/union and /v1/layers/contains."""

from __future__ import annotations

import json
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

import engine
from service.app import create_app
from service.convert import areas
from service.schemas.clipping import LayersResponse
from service.settings import Settings
from tests.unit.layers.cells import collection, layer, rows
from tests.unit.layers.test_features import cells_of
from tests.unit.service.asking import check_problem, client_of

pytestmark = pytest.mark.anyio
RNG = np.random.default_rng(1)
LEFT, RIGHT = layer(RNG, 12, 9), layer(RNG, 9, 9)
ONE: dict[str, Any] = collection(LEFT)
OTHER: dict[str, Any] = collection(RIGHT)
SIDES = {"left": ONE, "right": OTHER}
AREA = ONE["features"][0]
NUMBERS = list(range(2000))
"""So many are read as an array."""


async def test_rows_are_those_of_sets(client: httpx.AsyncClient) -> None:
    crs = {"type": "name", "properties": {"name": "EPSG:3857"}}
    body = {**SIDES, "left": {**SIDES["left"], "crs": crs}, "operation": "union"}
    answer = await client.post("/v1/layers/overlay", json=body, headers={"Content-Type": "application/geo+json"})
    assert (answer.status_code, answer.headers["content-type"]) == (200, "application/geo+json"), answer.text
    found = answer.json()
    assert (found["type"], found["crs"], found["collapsed"]) == ("FeatureCollection", crs, 0)
    told = [(f.get("left", {}).get("index", -1), f.get("right", {}).get("index", -1)) for f in found["features"]]
    expected = rows(LEFT, RIGHT, "union")
    assert told == [(i, j) for i, j, _ in expected]
    assert [cells_of(f["geometry"]) for f in found["features"]] == [cells for _, _, cells in expected]
    LayersResponse.model_validate_json(answer.content)


async def test_large_layers_leave_in_parts(client: httpx.AsyncClient) -> None:
    squares = collection([frozenset({(x, y)}) for x in range(25) for y in range(25)], text="x" * 40)
    answer = await client.post("/v1/layers/overlay", json={"left": squares, "right": squares, "operation": "identity"})
    assert answer.status_code == 200, answer.text
    assert len(answer.json()["features"]) == 625
    assert len(answer.content) > 150_000
    whole = await client.post("/v1/layers/union", json={"layer": squares})
    (feature,) = whole.json()["features"]
    assert feature["properties"] == {"count": 625}
    assert feature["geometry"]["coordinates"] == [[[0, 0], [25, 0], [25, 25], [0, 25], [0, 0]]]


async def test_integers_of_any_size_pass_through(client: httpx.AsyncClient) -> None:
    square = collection([frozenset({(0, 0)})], big=10**30)
    answer = await client.post(
        "/v1/layers/overlay", json={"left": square, "right": square, "operation": "intersection"}
    )
    assert json.loads(answer.content)["features"][0]["properties"]["big_1"] == 10**30


@pytest.mark.parametrize(
    ("path", "change", "code", "pointer"),
    [
        ("overlay", {"left": {"type": "Polygon"}}, "invalid_input", "/left"),
        ("overlay", {"operation": "xor"}, "invalid_request", "/operation"),
        ("overlay", {"right": {**OTHER, "crs": 1}, "left": {**ONE, "crs": 2}}, "invalid_input", "/right/crs"),
        ("overlay", {"right": {**OTHER, "features": [1]}}, "invalid_input", "/right/features/0"),
        ("union", {"layer": {**ONE, "type": NUMBERS}}, "invalid_input", "/layer"),
        ("union", {"layer": {**ONE, "features": NUMBERS}}, "invalid_input", "/layer"),
        ("union", {"layer": {**ONE, "features": [{"type": NUMBERS}]}}, "invalid_input", "/layer/features/0"),
        (
            "union",
            {"layer": {**ONE, "features": [{**AREA, "geometry": {"type": NUMBERS}}]}},
            "unsupported_solid",
            "/layer/features/0",
        ),
        (
            "union",
            {"layer": {**ONE, "features": [{**AREA, "properties": NUMBERS}]}},
            "invalid_input",
            "/layer/features/0",
        ),
        (
            "overlay",
            {"right": {**OTHER, "crs": NUMBERS}, "left": {**ONE, "crs": NUMBERS[1:]}},
            "invalid_input",
            "/right/crs",
        ),
        ("overlay", {"operation": NUMBERS}, "invalid_request", "/operation"),
        ("union", {"by": ["a", 1]}, "invalid_request", "/by/1"),
        ("contains", {"points": ONE}, "unsupported_solid", "/points/features/0"),
    ],
)
async def test_what_is_wrong_is_named(
    client: httpx.AsyncClient, path: str, change: dict[str, Any], code: str, pointer: str
) -> None:
    base: dict[str, Any] = {
        "overlay": {**SIDES, "operation": "union"},
        "union": {"layer": SIDES["left"]},
        "contains": {"points": collection([]), "polygons": SIDES["right"]},
    }[path]
    problem = check_problem(await client.post(f"/v1/layers/{path}", json={**base, **change}), 422, code)
    assert problem["errors"][0]["pointer"] == pointer


async def test_the_feature_at_fault_is_named(client: httpx.AsyncClient) -> None:
    given = collection([frozenset({(0, 0)})] * 3)
    given["features"][1]["geometry"]["coordinates"][0][0] = [[1, 1, 5, 7]] * 4
    answer = await client.post("/v1/layers/union", json={"layer": given})
    problem = check_problem(answer, 422, "wrong_dimension")
    assert "layer.features[1] (id 'f1') has positions" in problem["detail"]
    assert problem["errors"][0]["pointer"] == "/layer/features/1"


def small_squares(n: int) -> dict[str, Any]:
    return collection([frozenset({(x % 50, x // 50)}) for x in range(n)])


COPIED: dict[str, tuple[str, dict[str, Any]]] = {
    "properties": (
        "overlay",
        {"left": collection([frozenset({(0, 0)})] * 2, t=["x" * 100_000] * 4), "right": small_squares(1)},
    ),
    "names": ("overlay", {"left": collection([None] * 3, **{"n" * 1000: 1}), "right": collection([])}),
    "id": ("overlay", {"left": collection([None] * 3), "right": collection([])}),
    "geometry": ("contains", {"polygons": small_squares(9)}),
    "by": ("union", {"layer": collection([None] * 2000), "by": ["n"] + ["m" * 1000 + str(k) for k in range(30)]}),
}
COPIED["id"][1]["left"]["features"][1]["id"] = "x" * 90_000
COPIED["geometry"][1]["points"] = {
    "type": "FeatureCollection",
    "features": [{"type": "Feature", "geometry": {"type": "Point", "coordinates": [1, 1], "bbox": "x" * 90_000}}] * 2,
}


@pytest.mark.parametrize("name", COPIED)
async def test_what_rows_copy_is_counted_before_it_is_copied(
    app: FastAPI, anyio_backend: str, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path, question = COPIED[name]
    question = {"operation": "union", **question} if path == "overlay" else question
    async with client_of(app) as client:
        whole = await client.post(f"/v1/layers/{path}", json=question)
        assert whole.status_code == 200, whole.text
        most = 9 * len(whole.content) // 10
        if name == "names":
            most = len(whole.content) // 2
        app.state.settings = app.state.settings.model_copy(update={"max_answer_bytes": most})
        monkeypatch.setattr(areas, "geometry_of", None)  # no row may be made
        detail = check_problem(await client.post(f"/v1/layers/{path}", json=question), 422, "answer_too_large")[
            "detail"
        ]
        assert "fewer features" in detail
        assert "shorter properties" in detail


@pytest.mark.parametrize("big", [1, 2**70])
@pytest.mark.parametrize(
    ("path", "place", "member"),
    [
        ("overlay", "/left/features/0/id", "NaN"),
        ("union", "/layer/features/0/id", "NaN"),
        ("overlay", "/left/crs/a", "-Infinity"),
        ("union", "/layer/features/0/properties/a/0", "1e400"),
        ("contains", "/points/features/0/id", "Infinity"),
    ],
)
async def test_what_is_no_json_does_not_leave(
    client: httpx.AsyncClient, path: str, place: str, member: str, big: int
) -> None:
    base: dict[str, Any] = {
        "overlay": {"left": small_squares(2), "right": small_squares(1), "operation": "union"},
        "union": {"layer": small_squares(2)},
        "contains": {"points": collection([]), "polygons": small_squares(1)},
    }[path]
    value: Any = base
    for part in place.split("/")[1:2]:
        value = value[part]
    if path == "contains":
        value["features"] = [{"type": "Feature", "geometry": {"type": "Point", "coordinates": [0, 0]}}]
    value["features"][0]["properties"] = {"a": [0], "big": big}
    value["crs"] = {"a": 0}
    value["features"][0]["id"] = 0
    inner = value
    *parts, last = place.split("/")[2:]
    for part in parts:
        inner = inner[int(part) if isinstance(inner, list) else part]
    inner[int(last) if isinstance(inner, list) else last] = "HERE"
    text = json.dumps(base).replace('"HERE"', member)
    answer = await client.post(f"/v1/layers/{path}", content=text, headers={"Content-Type": "application/json"})
    assert check_problem(answer, 422, "not_finite")["errors"][0]["pointer"] == place


@pytest.mark.full
async def test_one_feature_of_many_parts_and_rings(client: httpx.AsyncClient) -> None:
    """It is written in parts, and reads as one."""
    apart = collection([frozenset((3 * x, 3 * y) for x in range(90) for y in range(90))])
    (feature,) = (await client.post("/v1/layers/union", json={"layer": apart})).json()["features"]
    assert len(feature["geometry"]["coordinates"]) == 8100
    assert cells_of({**feature["geometry"], "coordinates": feature["geometry"]["coordinates"][:3]})
    ring = [[0, 0], [400, 0], [400, 400], [0, 400], [0, 0]]
    holes = [[[x, y], [x, y + 1], [x + 1, y + 1], [x, y]] for x in range(1, 399, 4) for y in range(1, 399, 4)]
    area = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring, *holes]}}
    layer = {"type": "FeatureCollection", "features": [area]}
    (feature,) = (await client.post("/v1/layers/union", json={"layer": layer})).json()["features"]
    assert len(feature["geometry"]["coordinates"]) == 1 + len(holes)
    assert [len(hole) for hole in feature["geometry"]["coordinates"][1:]] == [4] * len(holes)
    region = {"type": "polygon", "rings": [ring[:-1], *holes]}
    overlaid = await client.post("/v1/overlay", json={"subject": region, "clip": region, "operation": "union"})
    (piece,) = overlaid.json()["pieces"]
    assert len(piece["holes"]) == len(holes)


async def test_streams_are_answered_in_parts_and_name_lines(client: httpx.AsyncClient) -> None:
    first = json.dumps({"operation": "clip", "layer": collection([frozenset({(0, 0)})])})
    headers = {"content-type": "application/x-ndjson"}

    def point(x: Any) -> str:
        return json.dumps({"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [x, 0.5]}})

    async def asked(*lines: str, **more: Any) -> httpx.Response:
        content = "\n".join([first, *lines]).encode()
        return await client.post("/v1/layers/stream", content=content, headers=headers, **more)

    answer = await asked(*(point(k / 1000) for k in range(5000)))
    rows = [json.loads(line) for line in answer.text.splitlines()]
    assert answer.headers["content-type"] == "application/x-ndjson"
    assert [row["layer"]["index"] for row in rows] == list(range(1001))
    late = (await asked(*(point(0.5) for _ in range(2500)), "", point("x"))).text.splitlines()
    assert len(late) == 2001
    error = json.loads(late[-1])
    assert (error["type"], error["code"], error["errors"][0]["pointer"]) == ("Error", "invalid_array", "/2502")
    assert error["detail"].startswith("line 2503: ")
    for lines, code in ((["{"], "not_json"), ([point("x")], "invalid_array")):
        assert (await asked(*lines)).json()["code"] == code
    for body, status in ((b"", 422), (b"[1]", 422), (b'{"operation": "zip", "layer": 1}', 422), (b"{", 400)):
        assert (await client.post("/v1/layers/stream", content=body, headers=headers)).status_code == status
    answer = await client.post("/v1/layers/stream", content=first)
    assert (answer.status_code, answer.headers["accept-post"][:20]) == (415, "application/x-ndjson")
    for empty in ("\r\n\n", "\x1e\n"):  # before the first line
        content = f"{empty}{first}\r\n{point(0.5)}\n\n\x1e{point(0.25)}".encode()
        answer = await client.post("/v1/layers/stream", content=content, headers=headers)
        assert [json.loads(line)["layer"]["index"] for line in answer.text.splitlines()] == [0, 1]
    own = first[:-1] + ', "self": 1}'
    answer = await client.post("/v1/layers/stream", content=own, headers=headers)
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid_input")
    wrap, ring = first[:-1] + ', "wrap": 180}', [[0, 80], [120, 80], [-120, 80]]
    pole = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    content = "\n".join([wrap, *(point(0.5) for _ in range(2100)), json.dumps(pole)])
    late = (await client.post("/v1/layers/stream", content=content, headers=headers)).text.splitlines()
    assert json.loads(late[-1])["detail"].startswith("line 2102: stream.features[2100] has a ring")


async def test_a_stored_layer_serves_streams(client: httpx.AsyncClient) -> None:
    rings = [[[x, 0], [x + 2, 0], [x + 2, 2], [x, 2]] for x in (0, 1)]
    bodies = [{"type": "polygon", "rings": [ring]} for ring in rings]
    one = (await client.post("/v1/solids", json=bodies[0])).json()["id"]
    both = (await client.post("/v1/scenes", json={"bodies": [{"solid": body} for body in bodies]})).json()["id"]
    posed = {"bodies": [{"solid": bodies[0], "pose": {"rotation": [[1, 0], [0, 1]], "translation": [1, 0]}}]}
    moved = (await client.post("/v1/scenes", json=posed)).json()["id"]
    ball = (await client.post("/v1/solids", json={"type": "sphere", "center": [0, 0], "radius": 1})).json()["id"]
    point = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [1.5, 1]}}

    async def ask(layer: Any) -> httpx.Response:
        first = {"operation": "contains", "layer": layer}
        content = "\n".join(map(json.dumps, (first, point))).encode()
        return await client.post("/v1/layers/stream", content=content, headers={"content-type": "application/x-ndjson"})

    for name, ids in ((one, [0]), (both, [0, 1])):
        rows = [json.loads(line) for line in (await ask({"type": "stored", "id": name})).text.splitlines()]
        assert [row["polygon"]["id"] for row in rows] == ids
    for given, status, code in (
        ({"type": "stored", "id": "0" * 64}, 404, "unknown_scene"), ({"type": "stored"}, 422, "invalid_request"),
        ({"type": "stored", "id": ball}, 422, "unsupported_solid"),
        ({"type": "stored", "id": moved}, 422, "unsupported_solid"),
    ):  # fmt: skip
        check_problem(await ask(given), status, code)


@pytest.mark.parametrize("rings", [[[[0, 0], [8, 4], [8, 0], [0, 3]]], [[[0, 0], [8, 0], [4, 0]]],
                                   [[[0, 0], [2, 0], [2, 2]], [[5, 0], [9, 0], [9, 4]]]])  # fmt: skip
async def test_a_stored_layer_has_the_boundary_of_its_polygon(client: httpx.AsyncClient, rings: Any) -> None:
    name = (await client.post("/v1/solids", json={"type": "polygon", "rings": rings})).json()["id"]
    first = {"operation": "contains", "layer": {"type": "stored", "id": name}}
    points = [[x / 2, y / 2] for x in range(19) for y in range(9)]
    features = [{"type": "Feature", "geometry": {"type": "Point", "coordinates": at}} for at in points]
    answer = await client.post(
        "/v1/layers/stream", content="\n".join(map(json.dumps, [first, *features])).encode(),
        headers={"content-type": "application/x-ndjson"},
    )  # fmt: skip
    rows = [json.loads(line) for line in answer.text.splitlines()]
    expected = enumerate(engine.locate(points, engine.Polygon(rings)).tolist())
    assert [(row["point"]["index"], int(not row["boundary"])) for row in rows] == [
        each for each in expected if each[1] >= 0
    ]


async def test_lines_of_a_stream_are_measured_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    first = json.dumps({"operation": "clip", "layer": collection([frozenset({(0, 0)})])})
    feature = '{"type": "Feature", "properties": {"a": ["%s"]}, "geometry": null}'
    async with client_of(create_app(Settings(concurrency=1, max_body_bytes=10_000))) as client:
        for lines, status in (([feature % ("x" * 9_000)] * 200, 200), ([feature % "x", feature % ("x" * 10_000)], 413)):
            content = "\n".join([first, *lines]).encode()
            answer = await client.post(
                "/v1/layers/stream", content=content, headers={"content-type": "application/x-ndjson"}
            )
            assert answer.status_code == status
    assert answer.json()["detail"].startswith("line 3 is longer than 10000 bytes")
