"""What people hold in place of our classes: GeoJSON, shapely, geopandas, trimesh and other meshes, matrices."""

from __future__ import annotations

from collections import UserDict
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import engine
from engine.solids import shapes
from engine.solids.poses import as_pose

SQUARE = [[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]
HOLE = [[0.5, 0.5], [0.5, 1.5], [1.5, 1.5], [1.5, 0.5], [0.5, 0.5]]
BESIDE = [[1, 1], [3, 1], [3, 3], [1, 3], [1, 1]]
POLYGON = {"type": "Polygon", "coordinates": [SQUARE, HOLE]}
CORNERS = np.array([(x, y, z) for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
TRIANGLES = np.array([
    (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
    (1, 3, 7), (1, 7, 5),
])  # fmt: skip


def feature(geometry: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": {}, "geometry": geometry}


def area(solid: Any) -> float:
    return engine.union_all([solid]).area


@pytest.mark.parametrize(("held", "expected"), [
    (POLYGON, 3.0),
    ({"type": "MultiPolygon", "coordinates": [[SQUARE], [BESIDE]]}, 7.0),  # united, not xor-ed: 4 + 4 - 1
    (feature(POLYGON), 3.0),
    ({"type": "FeatureCollection", "features": [feature({"type": "Polygon", "coordinates": [ring]})
                                                for ring in (SQUARE, BESIDE)] + [feature(None)]}, 7.0),
    ({"type": "GeometryCollection", "geometries": [POLYGON, {"type": "Polygon", "coordinates": [HOLE]}]}, 4.0),
    (SimpleNamespace(__geo_interface__=POLYGON), 3.0),
    (np.array(SQUARE), 4.0),
    ([SQUARE, HOLE], 3.0),
    ([(0, 0), (2, 0), (2, 2)], 2.0),
])  # fmt: skip
def test_a_polygon_from_what_people_hold(held: Any, expected: float) -> None:
    assert area(held) == expected


def test_altitudes_are_left_out_of_plane_questions_and_told() -> None:
    tall = {"type": "Polygon", "coordinates": [[[*at, 99.5] for at in SQUARE]]}
    with pytest.warns(UserWarning, match="the polygons: altitudes"):
        assert area(tall) == 4.0
    points = {"type": "MultiPoint", "coordinates": [[1, 1, 7], [2, 1, 7]]}
    with pytest.warns(UserWarning, match="points: altitudes"):
        assert engine.locate(points, [SQUARE]).tolist() == [1, 0]
    lines = {"type": "LineString", "coordinates": [[-1, 1, 7], [3, 1, 8]]}
    with pytest.warns(UserWarning, match="lines: altitudes"):
        assert engine.clip_lines(lines, [SQUARE]).vertices.tolist() == [[0, 1], [2, 1]]
    with pytest.warns(UserWarning, match="segments: altitudes"):
        assert engine.clip_segments(lines, [SQUARE]).t.tolist() == [[0.25, 0.75]]
    cube = engine.Aabb((0, 0, 0), (9, 9, 9))
    assert engine.locate(points, cube).tolist() == [1, 1]  # in space they are coordinates


def test_segments_of_geojson_have_two_positions() -> None:
    with pytest.raises(engine.InvalidArrayError, match=r"segments\[0\] is no line of 2 positions; clip_lines"):
        engine.clip_segments({"type": "LineString", "coordinates": [[0, 0], [1, 1], [2, 0]]}, POLYGON)


def test_a_polygon_is_made_of_any_geojson() -> None:
    parts = {"type": "FeatureCollection", "features": [
        feature({"type": "Polygon", "coordinates": [ring]}) for ring in (SQUARE, BESIDE)]}  # fmt: skip
    assert area(engine.Polygon(parts)) == 7.0
    assert engine.Polygon(SimpleNamespace(__geo_interface__=feature(POLYGON))).n_rings == 2
    with pytest.raises(engine.UnsupportedSolidError, match="a LineString is no solid: clip_lines takes lines"):
        engine.Polygon({"type": "LineString", "coordinates": [[0, 0], [1, 1]]})
    with pytest.raises(engine.InvalidArrayError, match="rings must be a list of rings"):
        engine.Polygon({"rings": [SQUARE]})
    with pytest.raises(engine.DeadlineExceededError):
        engine.Polygon(parts, deadline=0)


def test_shapely_and_geopandas_are_taken() -> None:
    shapely, geopandas = pytest.importorskip("shapely"), pytest.importorskip("geopandas")
    boxes = [shapely.box(0, 0, 2, 2), shapely.box(1, 1, 3, 3)]
    assert area(boxes[0]) == 4.0
    assert area(shapely.MultiPolygon([boxes[0], shapely.box(5, 5, 6, 6)])) == 5.0
    assert area(geopandas.GeoSeries(boxes)) == area(geopandas.GeoDataFrame(geometry=boxes)) == 7.0
    assert engine.locate([(0.5, 0.5), (2.0, 1.0), (9, 9)], boxes[0]).tolist() == [1, 0, -1]
    assert engine.overlay(*boxes, "intersection").area == 1.0
    assert engine.collide(boxes[0], shapely.box(2, 0, 3, 1)).relation == engine.Relation.TOUCHING


def test_lists_of_polygons_from_what_people_hold() -> None:
    rings = [{"type": "Polygon", "coordinates": [ring]} for ring in (SQUARE, BESIDE)]
    collection = {"type": "FeatureCollection", "features": [*map(feature, rings), feature(None)]}
    assert engine.union_all(collection).area == 7.0
    assert engine.union_all([POLYGON, np.array(BESIDE)]).area == 6.25  # of the hole a quarter is covered
    areas = engine.overlay_batch(collection, [[SQUARE], [SQUARE], [SQUARE]], "intersection").areas
    assert areas.tolist() == [4.0, 1.0, 0.0]
    box = engine.Aabb((0, 0), (1, 1))
    whole = engine.clip_polygons([engine.Polygon([SQUARE]), engine.Polygon([SQUARE, HOLE])], box)
    assert engine.clip_polygons([{"type": "Polygon", "coordinates": [SQUARE]}, feature(POLYGON)], box) == whole
    with pytest.raises(engine.UnsupportedSolidError, match=r"polygons\[1\] must be a solid") as error:
        engine.union_all([POLYGON, 7])
    assert error.value.where == ("polygons", 1)
    geopandas = pytest.importorskip("geopandas")
    shapely = pytest.importorskip("shapely")
    series = geopandas.GeoSeries([shapely.box(0, 0, 2, 2), shapely.box(1, 1, 3, 3), None])
    assert engine.union_all(series).area == 7.0


class Block:
    def __init__(self, kind: str, data: Any) -> None:
        self.type, self.data = kind, data


class Tensor:
    def __init__(self, values: Any) -> None:
        self.values = values

    def numpy(self) -> Any:
        return self.values


MESHES = {
    "trimesh": SimpleNamespace(vertices=CORNERS, faces=TRIANGLES),
    "open3d": SimpleNamespace(vertices=CORNERS, triangles=TRIANGLES),
    "open3d tensors": SimpleNamespace(
        vertex={"positions": Tensor(CORNERS.astype(np.float32))}, triangle={"indices": Tensor(TRIANGLES)}
    ),
    "pyvista": SimpleNamespace(points=CORNERS, faces=np.insert(TRIANGLES, 0, 3, axis=1).ravel()),
    "meshio": SimpleNamespace(points=CORNERS, cells=[Block("vertex", [[0]]), Block("triangle", TRIANGLES)]),
    "pair": (CORNERS, TRIANGLES),
    "pair of lists": (CORNERS.tolist(), TRIANGLES.tolist()),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_from_what_people_hold(name: str) -> None:
    solid = shapes.as_solid(MESHES[name], "solid")
    assert engine.locate([(0.5, 0.5, 0.5), (1, 0.5, 0.5), (2, 2, 2)], solid).tolist() == [1, 0, -1]
    assert engine.locate([(0.5, 0.5, 0.5)], MESHES[name]).tolist() == [1]


def test_trimesh_itself_is_taken() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    assert engine.contains([(0, 0, 0), (0.5, 0, 0), (1, 0, 0)], box).tolist() == [True, True, False]
    assert engine.collide(box, engine.Sphere((1, 0, 0), 0.5)).relation == engine.Relation.TOUCHING


@pytest.mark.parametrize(("held", "kind", "where", "words"), [
    (None, engine.UnsupportedSolidError, ("solid",), "solid must be a solid"),
    ("nonsense", engine.UnsupportedSolidError, ("solid",), "got str 'nonsense'"),
    ({"type": "sphere"}, engine.UnsupportedSolidError, ("solid",), "solid must be a solid"),
    ({"type": "LineString", "coordinates": [[0, 0], [1, 1]]}, engine.UnsupportedSolidError, ("solid", "type"),
     "clip_lines"),
    ({"type": "Polygon"}, engine.InvalidArrayError, ("solid", "coordinates"), "nested lists"),
    ({"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, float("nan")]]]}, engine.NotFiniteError, None, "nan"),
    ({"type": "FeatureCollection", "features": 7}, engine.InvalidInputError, None, "must be GeoJSON"),
    (SimpleNamespace(points=CORNERS, faces=np.array([3, 0, 1])), engine.InvalidArrayError, ("solid", "faces"), "is 3"),
    (SimpleNamespace(points=CORNERS, cells=[Block("tetra", [[0, 1, 2, 3]])]), engine.UnsupportedSolidError,
     ("solid", "cells"), "tetra"),
    ((CORNERS, TRIANGLES[:-1]), engine.NotClosedError, None, "edge"),
])  # fmt: skip
def test_what_is_none_of_these_is_refused_by_name(held: Any, kind: type, where: Any, words: str) -> None:
    with pytest.raises(kind, match=words) as error:
        shapes.as_solid(held, "solid")
    assert where is None or error.value.where == where
    assert error.value.where[:1] == ("solid",)


def test_a_collection_nested_too_deep_is_refused() -> None:
    deep: Any = POLYGON
    for _ in range(100):
        deep = {"type": "GeometryCollection", "geometries": [deep]}
    with pytest.raises(engine.InvalidInputError):
        shapes.as_solid(deep, "solid")


POINTS = {"type": "MultiPoint", "coordinates": [[1, 1], [2, 1]]}
LINES = {"type": "MultiLineString", "coordinates": [[[-1, 1], [3, 1]], [[0, 0], [2, 2], [4, 2]]]}


def test_points_and_lines_of_geojson() -> None:
    assert engine.locate(POINTS, POLYGON).tolist() == [-1, 0]
    assert engine.locate(feature({"type": "Point", "coordinates": [0, 1]}), POLYGON).tolist() == [0]
    pieces, same = (
        engine.clip_lines(LINES, POLYGON),
        engine.clip_lines(LINES["coordinates"], engine.Polygon([SQUARE, HOLE])),
    )
    assert pieces.vertices.tolist() == same.vertices.tolist()
    with pytest.raises(engine.InvalidInputError, match="where Points are expected"):
        engine.locate(LINES, POLYGON)


STEP = engine.Pose(np.eye(3), (1.0, 0.0, 0.0))
MATRIX = np.array([[1.0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


@pytest.mark.parametrize(
    "held", [STEP, MATRIX, MATRIX.tolist(), (np.eye(3), (1.0, 0, 0)), [np.eye(3).tolist(), [1, 0, 0]]]
)
def test_a_pose_from_what_people_hold(held: Any) -> None:
    assert as_pose(held, 3, "pose") == STEP
    cube = engine.Aabb((0, 0, 0), (1, 1, 1))
    assert engine.collide(cube, cube, second_pose=held).relation == engine.Relation.TOUCHING
    assert engine.clearance(cube, cube, second_pose=held).distance == 0.0


def test_a_rotation_of_scipy_is_taken() -> None:
    turn = SimpleNamespace(as_matrix=lambda: np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    assert as_pose(turn, 3, "pose").rotation.tolist() == [[0, -1, 0], [1, 0, 0], [0, 0, 1]]


@pytest.mark.parametrize("many", [[STEP, MATRIX], np.array([MATRIX, MATRIX]), (STEP, STEP)])
def test_many_poses_in_one_argument(many: Any) -> None:
    cube = engine.Aabb((0, 0, 0), (1, 1, 1))
    expected = engine.collide_poses(cube, cube, np.broadcast_to(np.eye(3), (2, 3, 3)), [(1, 0, 0)] * 2)
    assert engine.collide_poses(cube, cube, many).tolist() == expected.tolist()
    assert engine.clearance_poses(cube, cube, many).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("many", "words"), [
    (7, "list of poses"), ([7], r"poses\[0\] must be a Pose"), (np.zeros((1, 4, 4)), "must be 0 ... 0 1"),
    ([np.diag([2.0, 1, 1, 1])], "is no rotation"),
])  # fmt: skip
def test_wrong_poses_are_named(many: Any, words: str) -> None:
    cube = engine.Aabb((0, 0, 0), (1, 1, 1))
    with pytest.raises(engine.EngineError, match=words):
        engine.collide_poses(cube, cube, many)


def box_ring(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]


def test_parts_that_share_an_edge_become_one() -> None:
    """The wall between two parts stayed, unless a third part overlapped one of them."""
    beside = [box_ring(0, 0, 2, 2), box_ring(2, 0, 4, 2)]
    for rings in (beside, [*beside, box_ring(3, 1, 5, 3)]):
        parts = {"type": "MultiPolygon", "coordinates": [[ring] for ring in rings]}
        assert engine.locate([(2, 1), (2, 0), (0, 1)], parts).tolist() == [1, 0, 0]
        inner = engine.Aabb((1.5, 0.5), (2.5, 1.5))
        assert engine.collide(inner, parts).relation == engine.Relation.FIRST_INSIDE_SECOND


def test_a_point_without_coordinates_shifts_no_row() -> None:
    points = {"type": "FeatureCollection", "features": [
        feature({"type": "Point", "coordinates": [1, 1]}), feature(None)]}  # fmt: skip
    with pytest.raises(engine.EngineError) as error:
        engine.locate(points, POLYGON)
    assert error.value.where == ("points", "features", 1, "geometry")


@pytest.mark.parametrize(
    "vertices", [CORNERS + 0.5j, CORNERS > 0, np.ma.masked_equal(CORNERS, 1.0), CORNERS.astype(str)]
)
def test_meshes_pass_the_checks_of_their_constructor(vertices: Any) -> None:
    with pytest.raises(engine.InvalidArrayError):
        shapes.as_solid(SimpleNamespace(vertices=vertices, faces=TRIANGLES), "solid")


def test_a_path_leads_to_the_position_at_fault() -> None:
    bad = {"type": "Polygon", "coordinates": [SQUARE, [[0.5, 0.5], [0.5, 1.5], [float("nan"), 1], [0.5, 0.5]]]}
    with pytest.raises(engine.NotFiniteError) as error:
        shapes.as_solid({"type": "FeatureCollection", "features": [feature(POLYGON), feature(bad)]}, "solid")
    assert error.value.where == ("solid", "features", 1, "geometry", "coordinates", 1, 2, 0)


def test_lines_and_boundaries_are_bodies() -> None:
    square = engine.Polygon([SQUARE])
    inside = engine.Sphere((0.5, 1.0), 0.25)
    assert engine.clearance(square, inside).distance == 0.0
    assert engine.clearance(square.boundary, inside).distance == 0.25
    assert engine.collide(square.boundary, inside).relation == engine.Relation.DISJOINT
    assert engine.collide(square.boundary, engine.Sphere((0.5, 1.0), 0.5)).relation == engine.Relation.TOUCHING
    assert engine.locate([(1, 1), (2, 1), (3, 1)], square.boundary).tolist() == [-1, 0, -1]
    lines = engine.Polygon.from_lines(LINES)
    assert lines == engine.Polygon.from_lines(LINES["coordinates"])
    assert engine.clearance(lines, engine.Sphere((0, 3), 0)).distance == 2.0
    assert engine.Polygon([]).boundary == engine.Polygon([])
    for bad, kind in (
        (7, engine.InvalidArrayError),
        ([[(0, 0)]], engine.RingTooShortError),
        (POLYGON, engine.EngineError),
    ):
        with pytest.raises(kind):
            engine.Polygon.from_lines(bad)


def test_collections_that_share_their_members_are_walked_once() -> None:
    shared: Any = POLYGON
    for _ in range(25):
        shared = {"type": "GeometryCollection", "geometries": [shared, shared]}
    assert area(shared) == 3.0


class Cancelling(UserDict[str, Any]):
    """GeoJSON, or a rotation of scipy, that has its call cancelled when it is read."""

    def __init__(self, value: Any, cancel: engine.Cancel) -> None:
        super().__init__(value)
        self.cancel, self.n_read = cancel, 0

    def get(self, key: str, default: Any = None) -> Any:
        self.cancel.set()
        self.n_read += 1
        return super().get(key, default)

    @property
    def __geo_interface__(self) -> Any:
        return self

    def as_matrix(self) -> Any:
        self.get("")
        return np.eye(3)


MANY = 5000
SQUARE_BOX, CUBE_BOX = engine.Aabb((0, 0), (1, 1)), engine.Aabb((0, 0, 0), (1, 1, 1))
ASKED: dict[str, Any] = {
    "locate": lambda one, cancel: engine.locate([(0, 0)], within(one), cancel=cancel),
    "locate points": lambda one, cancel: engine.locate(within(one), SQUARE_BOX, cancel=cancel),
    "collide": lambda one, cancel: engine.collide(within(one), SQUARE_BOX, cancel=cancel),
    "clearance": lambda one, cancel: engine.clearance(within(one), SQUARE_BOX, cancel=cancel),
    "clip_lines": lambda one, cancel: engine.clip_lines(within(one), SQUARE_BOX, cancel=cancel),
    "clip_segments": lambda one, cancel: engine.clip_segments(within(one), SQUARE_BOX, cancel=cancel),
    "clip_polygons": lambda one, cancel: engine.clip_polygons([one] * MANY, SQUARE_BOX, cancel=cancel),
    "overlay": lambda one, cancel: engine.overlay(within(one), within(one), cancel=cancel),
    "overlay_batch": lambda one, cancel: engine.overlay_batch([one] * MANY, [one] * MANY, cancel=cancel),
    "union_all": lambda one, cancel: engine.union_all([one] * MANY, cancel=cancel),
    "bounds": lambda one, cancel: engine.bounds(within(one), cancel=cancel),
    "collide_scene": lambda one, cancel: engine.collide_scene([one] * MANY, cancel=cancel),
    "locate_scene": lambda one, cancel: engine.locate_scene([(0, 0)], [one] * MANY, cancel=cancel),
    "collide_poses": lambda one, cancel: engine.collide_poses(CUBE_BOX, CUBE_BOX, [one] * MANY, cancel=cancel),
    "clearance_poses": lambda one, cancel: engine.clearance_poses(CUBE_BOX, CUBE_BOX, [one] * MANY, cancel=cancel),
    "poses of a scene": lambda one, cancel: engine.collide_scene([CUBE_BOX] * MANY, [one] * MANY, cancel=cancel),
    "poses of bodies": lambda one, cancel: engine.locate_scene(
        [(0, 0, 0)], [CUBE_BOX] * MANY, [one] * MANY, cancel=cancel
    ),
}  # fmt: skip


def within(one: Any) -> Any:
    return {"type": "GeometryCollection", "geometries": [one] * MANY}


@pytest.mark.parametrize("name", ASKED)
def test_arguments_are_read_within_the_deadline(name: str) -> None:
    """A switch that is set while the first item is read ends the call before all are."""
    kind = {"locate points": "Point", "clip_lines": "LineString", "clip_segments": "LineString"}.get(name, "Polygon")
    coordinates = {"Point": [0, 0], "LineString": [[0, 0], [1, 1]]}.get(kind, [[[0, 0], [1, 0], [0, 1], [0, 0]]])
    cancel = engine.Cancel()
    one = Cancelling({"type": kind, "coordinates": coordinates}, cancel)
    with pytest.raises(engine.CancelledError):
        ASKED[name](one, cancel)
    assert 0 < one.n_read < 4 * MANY / 2


def test_collections_that_share_members_end() -> None:
    """Each level has the one below twice: 2^30 geometries in a kilobyte."""
    shared: Any = {"type": "Point", "coordinates": [1, 1]}
    for _ in range(30):
        shared = {"type": "GeometryCollection", "geometries": [shared, shared]}
    with pytest.raises(engine.InvalidInputError, match="there several times"):
        engine.locate(shared, SQUARE_BOX)
    area: Any = {"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}
    for _ in range(30):
        area = {"type": "GeometryCollection", "geometries": [area, area]}
    assert engine.locate([(0.5, 0.5), (3, 3)], area).tolist() == [1, -1]
    few = {"type": "GeometryCollection", "geometries": [{"type": "MultiPoint", "coordinates": [[1, 1], [3, 3]]}] * 3}
    assert engine.locate({"type": "GeometryCollection", "geometries": [few, few]}, SQUARE_BOX).tolist() == [0, -1] * 6


@pytest.mark.parametrize("lines", [
    {"type": "LineString", "coordinates": [0, 0]}, {"type": "LineString", "coordinates": np.zeros(3)},
    {"type": "MultiLineString", "coordinates": [[[]]]}, {"type": "LineString", "coordinates": [[[0, 0]]]},
])  # fmt: skip
def test_lines_that_are_none_are_refused(lines: Any) -> None:
    with pytest.raises(engine.InvalidInputError):
        engine.clip_lines(lines, SQUARE_BOX)


def test_a_property_that_raises_is_an_error_of_ours() -> None:
    class Broken:
        @property
        def __geo_interface__(self) -> Any:
            raise KeyError("gone")

    with pytest.raises(engine.InvalidInputError, match="does not give its GeoJSON"):
        engine.Polygon(Broken())
