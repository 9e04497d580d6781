"""GeoJSON in questions over HTTP, and poses as matrix, quaternion or rotation: what is taken, said and refused."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest

from tests.unit.service.asking import check_problem

pytestmark = pytest.mark.anyio
SQUARE = [[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]
HOLE = [[0.5, 0.5], [0.5, 1.5], [1.5, 1.5], [1.5, 0.5], [0.5, 0.5]]
BESIDE = [[1, 1], [3, 1], [3, 3], [1, 3], [1, 1]]
POLYGON = {"type": "Polygon", "coordinates": [SQUARE, HOLE]}
TALL = {"type": "Polygon", "coordinates": [[[*at, 300.5] for at in SQUARE]]}


def feature(geometry: Any, **members: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": {"name": "x"}, "geometry": geometry, **members}


def collection(*geometries: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "bbox": [0, 0, 3, 3], "features": [*map(feature, geometries)]}


@pytest.mark.parametrize(("solid", "inside"), [
    (POLYGON, [False, True, False]),
    (feature(POLYGON, id=7, bbox=[0, 0, 2, 2]), [False, True, False]),
    ({"type": "MultiPolygon", "coordinates": [[SQUARE], [BESIDE]]}, [True, True, True]),  # united, not xor-ed
    (collection({"type": "Polygon", "coordinates": [SQUARE]}, None, {"type": "Polygon", "coordinates": [BESIDE]}),
     [True, True, True]),
    ({"type": "GeometryCollection", "geometries": [POLYGON]}, [False, True, False]),
    ({"type": "csg", "operation": "union", "operands": [POLYGON, {"type": "aabb", "min": [0, 0], "max": [1, 1]}]},
     [True, True, False]),
])  # fmt: skip
async def test_geojson_is_a_solid(client: httpx.AsyncClient, solid: Any, inside: list[bool]) -> None:
    answer = await client.post("/v1/contains", json={"solid": solid, "points": [[1, 1], [0.25, 1], [2.5, 2.5]]})
    assert answer.status_code == 200, answer.text
    assert answer.json()["contained"] == inside
    assert "notes" not in answer.json()["accuracy"]
    stored = await client.post("/v1/solids", json=solid)
    assert stored.json()["type"] in ("polygon", "csg")


async def test_geojson_in_place_of_points_segments_lines_and_polygons(client: httpx.AsyncClient) -> None:
    box = {"type": "aabb", "min": [0, 0], "max": [2, 2]}
    points = collection(
        {"type": "Point", "coordinates": [1, 1]}, {"type": "MultiPoint", "coordinates": [[2, 1], [9, 9]]}
    )
    answer = await client.post("/v1/contains", json={"solid": box, "points": points})
    assert (answer.json()["contained"], answer.json()["boundary"]) == ([True, True, False], [1])
    bodies = [{"solid": box}, {"solid": POLYGON}]
    scene = await client.post("/v1/contains/scene", json={"bodies": bodies, "points": points})
    assert scene.json()["bodies"] == [[0], [0, 1], []]
    line = {"type": "LineString", "coordinates": [[-1, 1], [3, 1]]}
    answer = await client.post("/v1/clip/segments", json={"region": POLYGON, "segments": line})
    assert [piece["t"] for piece in answer.json()["pieces"]] == [[0.25, 0.375], [0.625, 0.75]]
    answer = await client.post("/v1/clip/segments/scene", json={"bodies": bodies, "segments": line, "keep": "any"})
    assert answer.json()["met"] == [True]
    long = {"type": "MultiLineString", "coordinates": [[[-1, 1], [1, 1], [1, 9]], [[5, 5], [6, 6]]]}
    answer = await client.post("/v1/clip/lines", json={"region": box, "lines": long})
    assert [piece["positions"] for piece in answer.json()["pieces"]] == [[[0, 1], [1, 1], [1, 2]]]
    half = {"type": "half_space", "normal": [-1, 0], "offset": 1}
    for polygons in (collection(POLYGON, POLYGON), [POLYGON, feature(POLYGON)], [POLYGON, [SQUARE[:-1], HOLE[:-1]]]):
        answer = await client.post("/v1/clip/polygons", json={"region": half, "polygons": polygons})
        assert answer.status_code == 200, answer.text
        assert [len(each["rings"]) for each in answer.json()["polygons"]] == [2, 2]
    overlay = {"subject": feature(POLYGON), "clip": {"type": "Polygon", "coordinates": [BESIDE]}}
    answer = await client.post("/v1/overlay", json={**overlay, "operation": "intersection"})
    assert answer.json()["area"] == 0.75


async def test_altitudes_are_left_out_of_the_plane_and_told(client: httpx.AsyncClient) -> None:
    at = {"type": "MultiPoint", "coordinates": [[1, 1, 5], [9, 9, 5]]}
    answer = await client.post("/v1/contains", json={"solid": TALL, "points": at})
    assert answer.json()["contained"] == [True, False]
    assert [note.partition(":")[0] for note in answer.json()["accuracy"]["notes"]] == ["the polygons", "points"]
    cube = {"type": "aabb", "min": [0, 0, 0], "max": [9, 9, 4]}
    answer = await client.post("/v1/contains", json={"solid": cube, "points": at})
    assert answer.json()["contained"] == [False, False]
    assert "notes" not in answer.json()["accuracy"]
    lines = {"type": "MultiLineString", "coordinates": [[[-1, 1, 2], [3, 1, 2]], [[0, 0, 1], [1, 1, 1], [5, 1, 1]]]}
    answer = await client.post(
        "/v1/clip/lines", json={"region": {"type": "aabb", "min": [0, 0], "max": [2, 2]}, "lines": lines}
    )
    assert [len(piece["positions"]) for piece in answer.json()["pieces"]] == [2, 3]
    assert len(answer.json()["accuracy"]["notes"]) == 1
    flat = await client.post("/v1/contains", json={"solid": POLYGON, "points": [[1, 1, 5]]})
    check_problem(flat, 422, "wrong_dimension")  # a list of numbers is no map


@pytest.mark.parametrize(("path", "question", "code", "pointer"), [
    ("contains", {"solid": {"type": "LineString", "coordinates": [[0, 0], [1, 1]]}, "points": []}, "unknown_type",
     "/solid"),
    ("contains", {"solid": {"type": "Polygon", "coordinates": 7}, "points": []}, "invalid_array", "/solid/coordinates"),
    ("contains", {"solid": {"type": "Polygon", "coordinates": [[[0, 0], [1, True], [1, 1]]]}, "points": []},
     "invalid_array", "/solid/coordinates/0/1/1"),
    ("contains", {"solid": {"type": "Polygon"}, "points": []}, "invalid_array", "/solid/coordinates"),
    ("contains", {"solid": collection(POLYGON, {"type": "Point", "coordinates": [0, 0]}), "points": [[1, 1]]},
     "unsupported_solid", "/solid/features/1/geometry/type"),
    ("contains", {"solid": collection(None), "points": [[1, 1]]}, "empty_geometry", ""),
    ("contains", {"solid": POLYGON, "points": {"type": "MultiPoint", "coordinates": [[0, 0], [1, "a"]]}},
     "invalid_array", "/points/coordinates/1/1"),
    ("contains", {"solid": POLYGON, "points": {"type": "Nonsense"}}, "invalid_array", "/points/type"),
    ("contains", {"solid": POLYGON, "points": {}}, "invalid_array", "/points/type"),
    ("contains", {"solid": POLYGON, "points": collection(None)}, "invalid_array", "/points/features/0/geometry"),
    ("clip/segments", {"region": POLYGON, "segments": {"type": "LineString", "coordinates": [[0, 0], [1, 1], [2, 2]]}},
     "invalid_array", "/segments/coordinates"),
    ("clip/polygons", {"region": POLYGON, "polygons": POLYGON}, "invalid_array", "/polygons"),
])  # fmt: skip
async def test_what_is_wrong_in_geojson_has_its_place(
    client: httpx.AsyncClient, path: str, question: Any, code: str, pointer: str
) -> None:
    problem = check_problem(await client.post(f"/v1/{path}", json=question), 422, code)
    assert problem["errors"][0]["pointer"] == pointer, problem


async def test_deep_and_many_are_refused(client: httpx.AsyncClient, app: Any) -> None:
    deep: Any = {"type": "Point", "coordinates": [0, 0]}
    for _ in range(60):
        deep = {"type": "GeometryCollection", "geometries": [deep]}
    problem = check_problem(
        await client.post("/v1/contains", json={"solid": POLYGON, "points": deep}), 422, "invalid_array"
    )
    assert "levels deep" in problem["detail"]
    app.state.settings = app.state.settings.model_copy(update={"max_points": 2, "max_rings": 1, "max_polygons": 1})
    many = {"type": "MultiPoint", "coordinates": [[0, 0]] * 3}
    check_problem(await client.post("/v1/contains", json={"solid": TALL, "points": many}), 422, "limit_exceeded")
    check_problem(await client.post("/v1/contains", json={"solid": POLYGON, "points": []}), 422, "limit_exceeded")
    half = {"type": "half_space", "normal": [-1, 0], "offset": 1}
    answer = await client.post("/v1/clip/polygons", json={"region": half, "polygons": collection(TALL, TALL)})
    check_problem(answer, 422, "limit_exceeded")


async def test_long_geojson_goes_through_the_fast_decoder(client: httpx.AsyncClient) -> None:
    ring = [[i / 100, 0.0] for i in range(2000)] + [[20.0, 1.0], [0.0, 1.0], [0.0, 0.0]]
    points = {"coordinates": [[i / 100, 0.5] for i in range(2000)], "type": "MultiPoint"}
    body = json.dumps({"solid": {"coordinates": [ring], "type": "Polygon"}, "points": points})
    answer = await client.post("/v1/contains", content=body, headers={"content-type": "application/json"})
    assert answer.status_code == 200, answer.text
    assert all(answer.json()["contained"])


CUBE = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
UP = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]
PRINTED = [[0.866025, -0.5, 0], [0.5, 0.866025, 0], [0, 0, 1]]


async def test_poses_as_people_have_them(client: httpx.AsyncClient) -> None:
    turn = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    poses = [
        {"matrix": UP}, {"quaternion": [1, 0, 0, 0], "translation": [0, 0, 1]}, {"rotation": turn},
        {"quaternion": [1, 0, 0, 1]}, {"rotation": PRINTED, "rounded": True}, {"rotation": PRINTED, "tolerance": 1e-5},
    ]  # fmt: skip
    answer = await client.post("/v1/collide", json={"first": CUBE, "second": CUBE, "poses": poses})
    relations = [each["relation"] for each in answer.json()["collisions"]]
    assert relations == ["touching"] * 4 + ["overlapping"] * 2
    for pose in poses:
        bodies = [{"solid": CUBE}, {"solid": CUBE, "pose": pose}]
        pairs = (await client.post("/v1/collide/scene", json={"bodies": bodies})).json()["pairs"]
        assert pairs[0]["relation"] == relations[poses.index(pose)]
    square = {"type": "aabb", "min": [0, 0], "max": [1, 1]}
    flat = {"first": square, "second": square, "poses": [{"matrix": [[1, 0, 3], [0, 1, 0], [0, 0, 1]]}]}
    assert (await client.post("/v1/clearance", json=flat)).json()["clearances"][0]["distance"] == 2.0


@pytest.mark.parametrize(("pose", "code", "words"), [
    ({}, "invalid_request", "one of rotation, quaternion and matrix, got none"),
    ({"translation": [0, 0, 0]}, "invalid_request", "got none"),
    ({"matrix": UP, "quaternion": [1, 0, 0, 0]}, "invalid_request", "got quaternion and matrix"),
    ({"matrix": UP, "translation": [0, 0, 0]}, "invalid_request", "leave translation out"),
    ({"rotation": PRINTED}, "not_rigid", "by rounded=True"),
    ({"quaternion": [0, 0, 0, 0]}, "not_rigid", "length 0"),
    ({"quaternion": [1, 0, 0]}, "invalid_array", "4"),
    ({"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}, "wrong_dimension", "3D"),
    ({"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]}, "not_rigid", "must be 0 ... 0 1"),
])  # fmt: skip
async def test_poses_that_are_none_are_refused_by_name(
    client: httpx.AsyncClient, pose: Any, code: str, words: str
) -> None:
    answer = await client.post("/v1/collide", json={"first": CUBE, "second": CUBE, "poses": [pose]})
    problem = check_problem(answer, 422, code)
    assert words in problem["detail"]
    assert problem["errors"][0]["pointer"].startswith("/poses/0")


@pytest.mark.parametrize(("polygons", "code", "pointer"), [
    ([POLYGON, [[[0, 0], [1, "a"], [1, 1]]]], "invalid_array", "/polygons/1/0/1/1"),
    ([[SQUARE], POLYGON, [SQUARE, []]], "empty_geometry", "/polygons/2/1"),
    ([POLYGON, 7], "invalid_request", "/polygons/1"),
    ({"type": "GeometryCollection", "geometries": [POLYGON, [[[0, 0], [1, None], [1, 1]]]]}, "invalid_array",
     "/polygons/geometries/1/0/1/1"),
    (collection(POLYGON, {"type": "Polygon", "coordinates": [[[0, 0], [1, "a"], [1, 1]]]}), "invalid_array",
     "/polygons/features/1/geometry/coordinates/0/1/1"),
    (collection(POLYGON, None), "empty_geometry", "/polygons/features/1"),
])  # fmt: skip
async def test_pointers_into_a_list_of_polygons(
    client: httpx.AsyncClient, polygons: Any, code: str, pointer: str
) -> None:
    half = {"type": "half_space", "normal": [-1, 0], "offset": 1}
    problem = check_problem(
        await client.post("/v1/clip/polygons", json={"region": half, "polygons": polygons}), 422, code
    )
    assert problem["errors"][0]["pointer"] == pointer, problem


async def test_collections_in_place_of_subjects_and_clips(client: httpx.AsyncClient) -> None:
    """As `overlay_batch` takes them: a member a polygon, an empty one where a feature has no geometry."""
    beside = {"type": "Polygon", "coordinates": [BESIDE]}
    many = {"type": "GeometryCollection", "geometries": [beside, POLYGON, beside]}
    body = {"subjects": collection(POLYGON, None, POLYGON), "clips": many, "operation": "intersection"}
    answer = await client.post("/v1/overlay/batch", json=body)
    assert [len(each["pieces"]) for each in answer.json()["overlays"]] == [1, 0, 1], answer.text
    listed = {**body, "subjects": [POLYGON, {"type": "polygon", "rings": []}, POLYGON], "clips": many["geometries"]}
    assert (await client.post("/v1/overlay/batch", json=listed)).json()["overlays"] == answer.json()["overlays"]


BAD = {"type": "Polygon", "coordinates": [[[0, 0], [1, "a"], [1, 1]]]}


@pytest.mark.parametrize(("subjects", "code", "pointer"), [
    (collection(POLYGON, BAD), "invalid_array", "/subjects/features/1/geometry/coordinates/0/1/1"),
    ({"type": "GeometryCollection", "geometries": [POLYGON, None]}, "invalid_request", "/subjects/geometries/1"),
    ({"type": "GeometryCollection", "geometries": [POLYGON, {"type": "x"}]}, "unknown_type",
     "/subjects/geometries/1"),
    ({"type": "GeometryCollection", "geometries": [{"type": "Polygon", "coordinates": [SQUARE]}, {**POLYGON, "type":
     "polygon"}]}, "missing_field", "/subjects/geometries/1/rings"),
    ({"type": "GeometryCollection", "geometries": 7}, "invalid_array", "/subjects"),
    (POLYGON, "invalid_array", "/subjects"),
    ({"type": ["Feature"]}, "invalid_array", "/subjects"),
    ({}, "invalid_array", "/subjects"),
])  # fmt: skip
async def test_pointers_into_collections_of_subjects(
    client: httpx.AsyncClient, subjects: Any, code: str, pointer: str
) -> None:
    body = {"subjects": subjects, "clips": [POLYGON, POLYGON], "operation": "union"}
    problem = check_problem(await client.post("/v1/overlay/batch", json=body), 422, code)
    assert problem["errors"][0]["pointer"] == pointer, problem


async def test_a_matrix_at_fault_is_named_as_a_matrix(client: httpx.AsyncClient) -> None:
    poses = [{"matrix": [[2, 0, 0, 0], *UP[1:]]}]
    problem = check_problem(
        await client.post("/v1/collide", json={"first": CUBE, "second": CUBE, "poses": poses}), 422, "not_rigid"
    )
    assert problem["errors"][0]["pointer"] == "/poses/0/matrix"


async def test_null_is_called_null(client: httpx.AsyncClient) -> None:
    for coordinates in (None, [[None]]):
        solid = {"type": "Polygon", "coordinates": coordinates}
        answer = await client.post("/v1/contains", json={"solid": solid, "points": []})
        assert "NoneType" not in check_problem(answer, 422, "invalid_array")["detail"]
