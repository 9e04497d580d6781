"""Whatever is passed for an argument: an answer or an `EngineError` with a message, never another exception."""

from __future__ import annotations

import collections
import contextlib
import datetime
import inspect
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import engine

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
BOX = engine.Aabb([0, 0, 0], [1, 1, 1])
POLYHEDRON = engine.Polyhedron(VERTICES, FACES)
POLYGON = engine.Polygon([[[0, 0], [4, 0], [4, 3]]])
POINT = [[0.1, 0.1, 0.1]]
SEGMENT = [[[0, 0, 0], [1, 1, 1]]]
NOTHING: dict[str, Any] = {"type": "FeatureCollection", "features": []}
SQUARE = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}
LAYER = {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": SQUARE, "properties": {"a": 1}}]}
WIDTH = {"min_width": 1.0, "wrap": None}
NO_LINES: dict[str, Any] = {"type": "FeatureCollection", "features": [
    {"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 1]]}}]}  # fmt: skip


def nested(depth: int) -> list[Any]:
    found: list[Any] = []
    for _ in range(depth):
        found = [found]
    return found


MALFORMED: dict[str, Any] = {
    "none": None,
    "text": "abc",
    "bytes": b"abc",
    "true": True,
    "negative": -1,
    "fraction of one": 1.5,
    "nan": float("nan"),
    "infinity": float("inf"),
    "endless integer": 10**6000,
    "mapping": {"a": 1},
    "set": {1, 2},
    "range": range(3),
    "type": int,
    "ragged": [[0, 0, 0], [1, 1]],
    "no items": [],
    "empty rows": [[], []],
    "nested too deep": nested(5000),
    "deep beside a number": [[nested(5000), 0, 0]],
    "objects": np.array([[0, None, 1]], object),
    "no axes": np.array(1.0),
    "no columns": np.zeros((3, 0)),
    "five axes": np.zeros((1, 1, 1, 1, 1)),
    "complex": np.zeros((2, 3), complex),
    "times": np.zeros((2, 3), "M8[s]"),
    "time": [[datetime.date(2026, 1, 1), 1, 2]],
    "masked": np.ma.masked_array(np.zeros((2, 3)), mask=True),
    "masked integers": np.ma.masked_array(np.array([[0, 1, 2]]), mask=[[0, 1, 0]]),
    "booleans": np.zeros((3, 3), bool),
    "list of booleans": [[True, False, True]],
    "list of nan": [[float("nan")] * 3],
    "list of infinity": [[float("inf"), 0, 0]],
    "integer beyond float64": [[10**400, 0, 0]],
    "endless integer in a list": [[10**6000, 0, 0]],
    "integer between floats": [[2**53 + 1, 0, 0]],
    "decimals": [[Decimal(1)] * 3],
    "fractions": [[Fraction(1, 3)] * 3],
    "numbers as text": [["1", "2", "3"]],
    "negative index": [[-1, 0, 1]],
    "huge index": [[0, 1, 10**9]],
    "index as float": [[0.0, 1.0, 2.0]],
    "unsigned overflow": np.array([[2**64 - 1, 0, 1]], np.uint64),
    "structured": np.zeros(3, [("a", "f8")]),
    "solid": BOX,
    "octets": bytearray(b"abcdefgh"),
    "view of bytes": memoryview(b"abcdefgh"),
    "views of bytes": [memoryview(b"abcdefgh")] * 2,
    "view of numbers": memoryview(np.zeros((2, 3))),
    "list of bytes": [b"ab", b"cd"],
    "list of text": ["ab", "cd"],
    "list of none": [None, None],
    "list of solids": [BOX, POLYGON],
    "list of sets": [{1, 2}, {3}],
    "array in a tuple": (np.zeros((2, 3)), "x"),
    "array and offsets": (np.zeros((2, 3)), np.array([0, 5])),
    "object array": np.array([BOX, None], object),
    "object without axes": np.array(None),
    "text array": np.array(["a", "b"]),
    "bytes array": np.array([b"a", b"b"]),
    "one boolean": np.array(True),
    "many booleans": np.ones(7, bool),
    "huge integers": np.array([2**63, 2**64 - 1], np.uint64),
    "huge objects": np.array([10**30], object),
    "float32": np.float32(1.5),
    "long double": np.array([1.5], np.longdouble),
    "frozen set": frozenset({"a"}),
    "mapping by number": {0: None, 10**30: 1},
    "mapping of lists": {"type": [], "features": {}},
    "collection": {"type": "FeatureCollection", "features": [None, 1, {"type": "Feature"}]},
    "geometry": {"type": "Polygon", "coordinates": [[None]]},
    "function": len,
    "generator": (x for x in [1, 2]),
    "deque": collections.deque([[0, 0, 0]]),
    "exception": ValueError("x"),
}

CALLS: dict[str, Callable[[Any], object]] = {
    "HalfSpace(normal)": lambda x: engine.HalfSpace(x, 1),
    "HalfSpace(offset)": lambda x: engine.HalfSpace([1, 0, 0], x),
    "Sphere(center)": lambda x: engine.Sphere(x, 1),
    "Sphere(radius)": lambda x: engine.Sphere([0, 0, 0], x),
    "Aabb(min)": lambda x: engine.Aabb(x, [1, 1, 1]),
    "Convex": engine.Convex,
    "Triangle": engine.Triangle,
    "Polyhedron(vertices)": lambda x: engine.Polyhedron(x, FACES),
    "Polyhedron(faces)": lambda x: engine.Polyhedron(VERTICES, x),
    "Surface(faces)": lambda x: engine.Surface(VERTICES, x),
    "Polygon": engine.Polygon,
    "Polygon(one ring)": lambda x: engine.Polygon([x]),
    "Implicit": engine.Implicit,
    "Implicit(one term)": lambda x: engine.Implicit([x]),
    "Implicit(powers of a term)": lambda x: engine.Implicit([{"powers": x, "coefficient": 1}]),
    "Implicit(coefficient)": lambda x: engine.Implicit([{"powers": [1, 0], "coefficient": x}]),
    "Implicit(powers)": lambda x: engine.Implicit(powers=x, coefficients=[1]),
    "Implicit(coefficients)": lambda x: engine.Implicit(powers=[[1, 0]], coefficients=x),
    "Implicit.from_callable(function)": lambda x: engine.Implicit.from_callable(x, 3),
    "Implicit.from_callable(dimension)": lambda x: engine.Implicit.from_callable(len, x),
    "Csg(operation)": lambda x: engine.Csg(x, [BOX, BOX]),
    "Csg(operands)": lambda x: engine.Csg("union", x),
    "Csg(one operand)": lambda x: engine.Csg("union", [BOX, x]),
    "Pose(rotation)": lambda x: engine.Pose(x, [0, 0, 0]),
    "Pose(translation)": lambda x: engine.Pose(np.eye(3), x),
    "Pose.identity": engine.Pose.identity,
    "locate(points)": lambda x: engine.locate(x, BOX),
    "locate(solid)": lambda x: engine.locate(POINT, x),
    "contains(points)": lambda x: engine.contains(x, BOX),
    "contains(solid)": lambda x: engine.contains(POINT, x),
    "locate_scene(solids)": lambda x: engine.locate_scene(POINT, x),
    "locate_scene(one solid)": lambda x: engine.locate_scene([], [BOX, x]),
    "locate_scene(poses)": lambda x: engine.locate_scene([], [BOX], x),
    "locate_scene(one pose)": lambda x: engine.locate_scene([], [BOX], [x]),
    "bounds": engine.bounds,
    "clip_segments(segments)": lambda x: engine.clip_segments(x, BOX),
    "clip_segments(region)": lambda x: engine.clip_segments(np.zeros((0, 2, 3)), x),
    "hits(segments)": lambda x: engine.hits(x, POLYHEDRON),
    "hits(surface)": lambda x: engine.hits(np.zeros((0, 2, 3)), x),
    "hits(keep)": lambda x: engine.hits(SEGMENT, POLYHEDRON, keep=x),
    "clip_polygons(polygons)": lambda x: engine.clip_polygons(x, BOX),
    "clip_polygons(one polygon)": lambda x: engine.clip_polygons([x], BOX),
    "clip_polygons(region)": lambda x: engine.clip_polygons([], x),
    "overlay(subject)": lambda x: engine.overlay(x, POLYGON),
    "overlay(clip)": lambda x: engine.overlay(POLYGON, x),
    "overlay(operation)": lambda x: engine.overlay(POLYGON, POLYGON, x),
    "collide(second)": lambda x: engine.collide(engine.Surface(VERTICES, FACES), x),
    "collide(first_pose)": lambda x: engine.collide(BOX, BOX, first_pose=x),
    "collide_poses(rotations)": lambda x: engine.collide_poses(BOX, BOX, x, np.zeros((0, 3))),
    "collide_poses(translations)": lambda x: engine.collide_poses(BOX, BOX, np.zeros((0, 3, 3)), x),
    "collide_scene(solids)": engine.collide_scene,
    "collide_scene(poses)": lambda x: engine.collide_scene([BOX], x),
    "collide_scene(skip)": lambda x: engine.collide_scene([BOX, BOX], skip=x),
    "collide_scene(only)": lambda x: engine.collide_scene([BOX, BOX], only=x),
    "collide_triangles(first)": lambda x: engine.collide_triangles(x, [VERTICES[:3]]),
}

OPTIONS: dict[str, Callable[..., object]] = {
    "locate": lambda **given: engine.locate([], BOX, **given),
    "contains": lambda **given: engine.contains([], BOX, **given),
    "locate_scene": lambda **given: engine.locate_scene([], [BOX], **given),
    "bounds": lambda **given: engine.bounds(BOX, **given),
    "clip_segments": lambda **given: engine.clip_segments([], BOX, **given),
    "hits": lambda **given: engine.hits([], POLYHEDRON, **given),
    "Scene.hits": lambda **given: engine.Scene([POLYHEDRON]).hits(SEGMENT, **given),
    "clip_polygons": lambda **given: engine.clip_polygons([], BOX, **given),
    "overlay": lambda **given: engine.overlay(POLYGON, POLYGON, **given),
    "collide": lambda **given: engine.collide(BOX, BOX, **given),
    "collide_scene": lambda **given: engine.collide_scene([BOX, BOX], **given),
    "collide_triangles": lambda **given: engine.collide_triangles([], [], **given),
    "collide_poses": lambda **given: engine.collide_poses(BOX, BOX, [np.eye(3)], [[0, 0, 0]], **given),
    "clearance": lambda **given: engine.clearance(BOX, BOX, **given),
    "clearance_poses": lambda **given: engine.clearance_poses(BOX, BOX, [np.eye(3)], [[0, 0, 0]], **given),
    "distances": lambda **given: engine.distances(POINT, BOX, **given),
    "Scene.distances": lambda **given: engine.Scene([BOX]).distances(POINT, **given),
    "clip_lines": lambda **given: engine.clip_lines([], BOX, **given),
    "overlay_batch": lambda **given: engine.overlay_batch([POLYGON], [POLYGON], **given),
    "union_all": lambda **given: engine.union_all([POLYGON], **given),
    "Scene.locate": lambda **given: engine.Scene([BOX]).locate(POINT, **given),
    "Scene.collide": lambda **given: engine.Scene([BOX, BOX]).collide(**given),
    "Scene.clip_segments": lambda **given: engine.Scene([BOX]).clip_segments(SEGMENT, **given),
    "compare": lambda **given: engine.compare("contains", POINT, BOX, **given),
    "volume": lambda **given: engine.volume(POLYHEDRON, **given),
    "area": lambda **given: engine.area(POLYHEDRON, **given),
    "centroid": lambda **given: engine.centroid(POLYHEDRON, **given),
    "section": lambda **given: engine.section(POLYHEDRON, [0.5], **given),
    "cut": lambda **given: engine.cut(POLYHEDRON, BOX, **given),
    "overlap_volume": lambda **given: engine.overlap_volume(POLYHEDRON, BOX, **given),
    "iou": lambda **given: engine.iou(POLYHEDRON, BOX, **given),
    "filled": lambda **given: engine.filled([[[0, 0], [1, 0], [0, 1]]], "positive", **given),
    "Polyhedron": lambda **given: engine.Polyhedron(VERTICES, FACES, **given),
    "Surface": lambda **given: engine.Surface(VERTICES, FACES, **given),
    "overlay_features": lambda **given: engine.layers.overlay_features(LAYER, LAYER, **given),
    "clip_features": lambda **given: engine.layers.clip_features(LAYER, LAYER, **given),
    "join_features": lambda **given: engine.layers.join_features(LAYER, LAYER, **given),
    "dissolve_features": lambda **given: engine.layers.dissolve_features(LAYER, **given),
    "nearest_features": lambda **given: engine.layers.nearest_features(LAYER, LAYER, **given),
    "split_features": lambda **given: engine.layers.split_features(LAYER, NO_LINES, **given),
    "locate_features": lambda **given: engine.layers.locate_features(NOTHING, LAYER, **given),
}


FLAGS = ("report", "signed", "nearest", "rays", "boolean", "witness", "witnesses", "detail", "outside", "exclusive")
POSE = engine.Pose.identity(3)
POSES: dict[str, Any] = {"rotations": [np.eye(3)], "translations": [[0, 0, 0]]}
PAIR: dict[str, Any] = {"first": BOX, "second": POLYHEDRON}
SCENE = engine.Scene([BOX, POLYHEDRON])
POINTS: dict[str, Any] = {"type": "FeatureCollection", "features": [
    {"type": "Feature", "geometry": {"type": "Point", "coordinates": [0.5, 0.5]}, "properties": None}]}  # fmt: skip
OFF = b"OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
ASKED: dict[str, dict[str, Any]] = {
    "Aabb": {"min": [0, 0], "max": [1, 1]},
    "Convex": {"planes": [[1, 0, 0]]},
    "Csg": {"operation": "union", "operands": [BOX]},
    "HalfSpace": {"normal": [1, 0], "offset": 0},
    "Implicit": {"terms": None, "powers": [[1, 0]], "coefficients": [1.0]},
    "Implicit.from_callable": {"function": len, "dimension": 2},
    "Polygon": {"rings": [[[0, 0], [1, 0], [0, 1]]]},
    "Polyhedron": {"vertices": VERTICES, "faces": FACES},
    "Polygon.from_lines": {"lines": [[[0, 0], [1, 0]]]},
    "Pose": {"rotation": np.eye(3), "translation": [0, 0, 0], "tolerance": 1e-12, "rounded": False},
    "Pose.from_axis_angle": {"axis": [0, 0, 1], "angle": 1.0, "translation": [0, 0, 0]},
    "Pose.from_rpy": {"rpy": [0, 0, 1], "translation": [0, 0, 0]},
    "Poses": {"rotations": [np.eye(3)], "translations": [[0, 0, 0]], "tolerance": 1e-12, "rounded": False},
    "Poses.from_quaternions": {"wxyz": [[1, 0, 0, 0]], "translations": [[0, 0, 0]], "xyzw": None},
    "Poses.from_axis_angle": {"axes": [[0, 0, 1]], "angles": [1.0], "translations": [[0, 0, 0]]},
    "Poses.from_rpy": {"rpy": [[0, 0, 1]], "translations": [[0, 0, 0]]},
    "Pose.identity": {"dimension": 3},
    "Pose.from_quaternion": {"wxyz": [1, 0, 0, 0], "translation": [0, 0, 0], "xyzw": None},
    "Pose.from_matrix": {"matrix": np.eye(4), "tolerance": 1e-12, "rounded": False},
    "Scene": {"solids": [BOX], "poses": [None]},
    "Scene.moved": {"self": SCENE, "poses": {0: POSE}},
    "Scene.distances": {"self": SCENE, "points": POINT, "within": 1.0},
    "distances": {"points": POINT, "solid": BOX, "to": "boundary", "within": 1.0, "pose": POSE},
    "Scene.locate": {"self": SCENE, "points": POINT},
    "Scene.collide": {"self": SCENE, "moved": [1], "skip": None, "only": None, "gap": 0.5},
    "Scene.clip_segments": {"self": SCENE, "segments": SEGMENT, "keep": "all"},
    "Scene.hits": {"self": engine.Scene([POLYHEDRON]), "segments": SEGMENT, "keep": "all"},
    "Sphere": {"center": [0, 0], "radius": 1},
    "Surface": {"vertices": VERTICES, "faces": FACES},
    "Triangle": {"vertices": [[0, 0], [1, 0], [0, 1]]},
    "bounds": {"solid": BOX},
    "area": {"solid": POLYHEDRON},
    "centroid": {"solid": POLYHEDRON},
    "volume": {"solid": POLYHEDRON},
    "cut": {"solid": POLYHEDRON, "region": BOX, "keep": "inside", "measures": False},
    "section": {"solid": POLYHEDRON, "planes": [0.5], "normal": None, "measures": False},
    "overlap_volume": {**PAIR, "first_pose": POSE, "second_pose": POSE},
    "iou": {**PAIR, "first_pose": POSE, "second_pose": POSE},
    "clearance": {**PAIR, "first_pose": POSE, "second_pose": POSE, "at_least": 0.5},
    "clearance_poses": {**PAIR, **POSES, "at_least": 0.5},
    "clip_lines": {"lines": [[[0, 0], [1, 1]]], "region": POLYGON, "keep": "inside"},
    "clip_polygons": {"polygons": [POLYGON], "region": engine.Aabb([0, 0], [1, 1])},
    "clip_segments": {"segments": SEGMENT, "region": BOX},
    "collide": {**PAIR, "first_pose": POSE, "second_pose": POSE},
    "collide_poses": {**PAIR, **POSES},
    "collide_scene": {"solids": [BOX, BOX], "poses": [None, POSE], "skip": None, "only": None, "gap": 0.5},
    "collide_triangles": {"first": [VERTICES[:3]], "second": [VERTICES[:3]]},
    "compare": {"operation": "contains", "arguments": POINT, "method": None},
    "contains": {"points": POINT, "solid": BOX},
    "filled": {"rings": [[[0, 0], [1, 0], [0, 1]]], "rule": "non_zero"},
    "hits": {"segments": SEGMENT, "surface": POLYHEDRON, "keep": "all"},
    "inspect": {"mesh": (VERTICES, FACES), "weld": None, "orient": False, "fill_t_junctions": False},
    "layers.dissolve_features": {"layer": LAYER, "by": ["a"], "coverage": False, "gaps": "keep", "grid": 1.0, **WIDTH},
    "layers.clip_features": {"layer": LAYER, "mask": LAYER, "keep": "outside", "grid": 1.0, **WIDTH},
    "layers.FeatureStream": {"operation": "clip", "layer": LAYER},
    "layers.nearest_features": {"left": LAYER, "right": LAYER, "max_distance": 1.0},
    "layers.split_features": {"layer": LAYER, "lines": NO_LINES, "min_width": 1.0},
    "layers.join_features": {"left": LAYER, "right": LAYER, "predicate": "dwithin", "distance": 1.0},
    "layers.locate_features": {"points": POINTS, "polygons": LAYER},
    "layers.overlay_features": {"left": LAYER, "right": LAYER, "how": "union", "grid": 1.0, **WIDTH},
    "layers.polygon_of": {"geometry": SQUARE},
    "locate": {"points": POINT, "solid": BOX},
    "locate_scene": {"points": POINT, "solids": [BOX], "poses": [None]},
    "overlay": {"subject": POLYGON, "clip": POLYGON, "operation": "union", "grid": None},
    "overlay_batch": {"subjects": [POLYGON], "clips": [POLYGON], "operation": "union"},
    "polygons": {"coordinates": [[0, 0], [1, 0], [0, 1]], "ring_offsets": [0, 3], "polygon_offsets": [0, 1]},
    "read_mesh": {"file": OFF, "file_format": "off"},
    "read_layer": {"file": b'{"type": "Point", "coordinates": [0, 0]}'},
    "split": {"polygon": POLYGON, "lines": [[[0, 0], [1, 1]]]},
    "union_all": {"polygons": [POLYGON], "grid": None},
}
"""A good question of everything that is public, options left out that many have: those are below."""
SHARED = {"workers", "deadline", "cancel", "progress", "report", *FLAGS, "others", "options"}
ELSEWHERE = {
    "default_workers",
    "release",
    "warm",
    "layers.overlay",
    "layers.dissolve",
    "layers.sjoin",
    "layers.clip",
    "layers.sjoin_nearest",
    "layers.FeatureRows",
    "layers.slivers",
    "layers.split",
}
"""Without arguments; looked at below; of frames: tests/unit/layers/test_frames.py; an answer."""


def asks(name: str) -> Callable[..., object]:
    """Return a public function, or a constructor of a class, by the name under which it is public."""
    found: Any = engine
    for part in name.split("."):
        found = getattr(found, part)
    return found  # type: ignore[no-any-return]


def test_everything_public_is_asked_with_all_its_arguments() -> None:
    solids = {name for name in engine.__all__ if isinstance(asks(name), type) and issubclass(asks(name), engine.Solid)}
    functions = {name for name in engine.__all__ if inspect.isfunction(asks(name))}
    of_layers = {f"layers.{name}" for name in engine.layers.__all__}
    assert (solids | functions | of_layers | {"Pose", "Scene"}) - {"Solid"} <= ASKED.keys() | ELSEWHERE
    for name, given in ASKED.items():
        assert set(inspect.signature(asks(name)).parameters) - SHARED == given.keys(), name


PLACES = [(name, argument) for name, given in ASKED.items() for argument in given if argument != "self"]


@pytest.mark.parametrize(("name", "argument"), PLACES, ids=map(".".join, PLACES))
def test_any_value_of_any_argument_is_taken_or_refused(name: str, argument: str) -> None:
    ask, given = asks(name), ASKED[name]
    call = (lambda operation, arguments, method: engine.compare(operation, arguments, BOX, method=method)) if (
        name == "compare"
    ) else ask  # fmt: skip
    call(**given)
    for kind, value in MALFORMED.items():
        bad = [value] if kind in ("generator", "one-tuple") else [value, [value], (value, value)]
        for each in bad:
            message = "taken"
            try:
                with np.errstate(all="ignore"):
                    call(**{**given, argument: each})
            except engine.EngineError as error:
                message = str(error)
            except Exception as error:
                raise AssertionError(f"{kind}, {each!r:.60}: {type(error).__name__}: {error}") from error
            assert 0 < len(message) < 700, kind


def test_warm_looks_at_its_arguments_first() -> None:
    for value in (None, "x", 0, -1, 1.5, True, [2], np.zeros(2)):
        with pytest.raises(engine.InvalidInputError, match="processes must be"):
            engine.warm(processes=value)  # type: ignore[arg-type]
    for value in ("x", 1, [len]):
        with pytest.raises(engine.InvalidInputError, match="progress must be"):
            engine.warm(value)  # type: ignore[arg-type]


def taken_by(name: str) -> set[str]:
    """Return the parameters of a public function, or of a method of `Scene`."""
    home, _, own = name.rpartition(".")
    function = getattr(engine.Scene if home else engine, own, None) or getattr(engine.layers, own)
    return set(inspect.signature(function).parameters)


FLAGGED = [(name, flag) for name, call in OPTIONS.items() for flag in FLAGS if flag in taken_by(name)]


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_an_argument_is_taken_or_refused_with_a_short_message(call: Callable[[Any], object]) -> None:
    for name, value in MALFORMED.items():
        message = "taken"
        try:
            call(value)
        except engine.EngineError as error:
            message = str(error)
        except Exception as error:
            raise AssertionError(f"{name}: {type(error).__name__}: {error}") from error
        assert 0 < len(message) < 700, name


@pytest.mark.parametrize(("operation", "flag"), FLAGGED)
def test_a_flag_is_a_bool(operation: str, flag: str) -> None:
    for value in (True, False, np.True_, np.False_):
        OPTIONS[operation](**{flag: value})
    for name, value in MALFORMED.items():
        if name != "true":
            with pytest.raises(engine.InvalidInputError, match=f"^{flag} must be True or False, got "):
                OPTIONS[operation](**{flag: value})


@pytest.mark.parametrize("option", ["workers", "deadline", "cancel", "progress"])
@pytest.mark.parametrize("call", OPTIONS.values(), ids=OPTIONS.keys())
def test_an_option_is_taken_or_refused(call: Callable[..., object], option: str) -> None:
    if option not in taken_by(next(name for name in OPTIONS if OPTIONS[name] is call)):
        return
    for name, value in MALFORMED.items():
        if option == "progress" and callable(value):
            continue  # called, and then its own errors are the caller's
        try:
            with contextlib.suppress(engine.EngineError):
                call(**{option: value})
        except Exception as error:
            raise AssertionError(f"{name}: {type(error).__name__}: {error}") from error
