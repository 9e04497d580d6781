"""POST /v1/layers/overlay, /v1/layers/union and /v1/layers/contains."""

from __future__ import annotations

import json
from typing import Any

import httpx
import numpy as np
import pytest

from service.schemas.layers import LayersResponse
from tests.unit.layers.cells import collection, layer, rows
from tests.unit.layers.test_features import cells_of
from tests.unit.service.asking import check_problem

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
    given["features"][1]["geometry"]["coordinates"][0][0][2] = [1, 1, 5]
    answer = await client.post("/v1/layers/union", json={"layer": given})
    problem = check_problem(answer, 422, "wrong_dimension")
    assert "layer.features[1] (id 'f1') has positions" in problem["detail"]
    assert problem["errors"][0]["pointer"] == "/layer/features/1"
