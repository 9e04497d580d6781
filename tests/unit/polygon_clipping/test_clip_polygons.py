"""Sutherland-Hodgman against the rational reference: every vertex, every double, in 2D and 3D."""

from __future__ import annotations

import doctest
import itertools
import math
from typing import Any

import numpy as np
import pytest

from engine.errors import (
    CancelledError,
    DeadlineExceededError,
    EmptyGeometryError,
    InvalidArrayError,
    NotFiniteError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.polygon_clipping import clip_polygons as polygons_module
from engine.polygon_clipping.clip_polygons import (
    Batch,
    ClippedPolygons,
    PolygonStatus,
    clip_chunk,
    clip_polygons,
)
from engine.polygon_clipping.contours import as_contours
from engine.polygon_clipping.planes import kernel_scene, plan_of
from engine.running.budget import Budget, Cancel
from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere
from tests.reference.sutherland_hodgman import clip_contour, planes_of, rounded, same_cycle
from tests.unit.segment_clipping.scenes import as_json, nudged

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
OCTAHEDRON = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
CUBE_QUADS = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]


def check(contours: Any, region: Solid, clipped: ClippedPolygons | None = None) -> None:
    """Assert that each polygon of one contour is clipped as the reference clips it."""
    clipped = clip_polygons([[contour] for contour in contours], region) if clipped is None else clipped
    assert (clipped.status == PolygonStatus.CLIPPED).all()
    planes = planes_of(as_json(region))
    for i, contour in enumerate(contours):
        expected = rounded(clip_contour(np.asarray(contour).tolist(), planes))
        found = [ring.tolist() for ring in clipped.rings(i)]
        assert len(found) == bool(expected), (i, contour)
        assert not expected or same_cycle(found[0], expected), (i, contour)
    assert not np.signbit(clipped.vertices[clipped.vertices == 0.0]).any()


def rings_of(rng: np.random.Generator, n: int, dimension: int) -> dict[str, Any]:
    """Return n contours of each family, of 3 to 8 vertices, about as large as a unit box."""
    sizes = rng.integers(3, 9, n)
    free = [rng.uniform(-2, 2, (size, dimension)) for size in sizes]
    lattice = [rng.integers(-2, 3, (size, dimension)).astype(float) for size in sizes]
    angles = [np.sort(rng.uniform(0, 2 * math.pi, size)) for size in sizes]
    turned = [np.stack([1.5 * np.cos(a), 1.5 * np.sin(a), 0.3 * np.cos(a) + 0.1], 1)[:, :dimension] for a in angles]
    return {
        "free": free,
        "lattice": lattice,
        "nudged": [nudged(rng, ring) for ring in lattice],
        "round": turned,
        "far": [ring + 1e9 for ring in lattice],
        "huge": [ring * 1e300 for ring in free],
        "denormal": [ring * 1e-320 for ring in free],
        "mixed": [ring * 10.0 ** rng.integers(-300, 300, ring.shape) for ring in free],
    }


def regions_of(rng: np.random.Generator, dimension: int) -> list[Solid]:
    normals = rng.integers(-2, 3, (6, dimension)).astype(float)
    normals[~normals.any(axis=1), 0] = 1.0
    regions: list[Solid] = [
        HalfSpace([1, 2, -1][:dimension], 0.5),
        Aabb([-1] * dimension, [1] * dimension),
        Aabb(rng.uniform(-1, 0, dimension), rng.uniform(0, 1, dimension)),
        Convex(np.c_[normals, rng.integers(0, 3, 6)]),
        Convex(np.c_[rng.normal(size=(6, dimension)), rng.uniform(0, 1, 6)]),
    ]
    if dimension == 3:
        axes = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
        corners = rng.uniform(-1, 1, (4, 3))
        if np.linalg.det(corners[1:] - corners[0]) < 0:  # the reference wants faces counter-clockwise from outside
            corners = corners[[0, 2, 1, 3]]
        regions += [
            Polyhedron(corners, TETRAHEDRON),
            Polyhedron(axes, OCTAHEDRON),
            Polyhedron(list(itertools.product([-1.0, 1.0], repeat=3)), [face[::-1] for face in CUBE_QUADS]),
        ]
    return regions


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("family", ["free", "lattice", "nudged", "round", "far", "huge", "denormal", "mixed"])
def test_equals_the_reference(family: str, dimension: int, pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng([dimension, len(family)])
    n = 500 if pytestconfig.getoption("--full") else 12
    scale = {"huge": 1e300, "denormal": 1e-320}.get(family, 1.0)
    for region in regions_of(rng, dimension):
        contours = rings_of(rng, n, dimension)[family]
        match region:
            case Aabb() if scale != 1.0:
                region = Aabb(region.min * scale, region.max * scale)
            case Aabb() if family == "far":
                region = Aabb(region.min + 1e9, region.max + 1e9)
        check(contours, region)


def test_long_cascades_are_about_the_original_input() -> None:
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(30, 3))
    region = Convex(np.c_[normals / np.linalg.norm(normals, axis=1)[:, None], np.ones(30)])
    angles = np.linspace(0, 2 * math.pi, 5)[:-1]
    square = np.stack([2 * np.cos(angles), 2 * np.sin(angles), np.cos(angles) + 0.1], axis=1)
    check([square, square + rng.normal(size=(4, 3)) * 0.3], region)


def test_degenerate_contours_by_hand() -> None:
    box = Aabb([0, 0], [2, 2])
    cases: list[tuple[Any, Any]] = [
        ([[0, 0], [0, 0], [1, 0], [1, 1], [0, 0]], [[0, 0], [1, 0], [1, 1]]),  # repeated vertices
        ([[-1, 0], [0, 1], [-1, 2]], [[0, 1]]),  # touches in a point
        ([[0, 0], [0, 2], [-1, 1]], [[0, 0], [0, 2]]),  # touches along an edge
        ([[1, 1], [3, 1]], [[1, 1], [2, 1]]),  # two vertices: a segment there and back
        ([[1, 1]], [[1, 1]]),
        ([[3, 3], [4, 3], [3, 4]], []),
        ([[1, 1], [3, 1], [1, 1], [1, 2]], [[1, 1], [2, 1], [1, 1], [1, 2]]),  # a spike is cut twice at one point
    ]
    clipped = clip_polygons([[case[0]] for case in cases], box)
    assert [[ring.tolist() for ring in clipped.rings(i)] for i in range(len(cases))] == [
        [case[1]] if case[1] else [] for case in cases
    ]


def test_rings_of_one_polygon_stay_together() -> None:
    outer, hole, gone = [[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [1, 2], [2, 1]], [[5, 5], [6, 5], [5, 6]]
    clipped = clip_polygons([Polygon([outer, gone, hole]), Polygon([gone]), [hole]], HalfSpace([-1, 0], 3))
    assert clipped.polygon_offsets.tolist() == [0, 2, 2, 3]
    assert clipped.contours.tolist() == [0, 2, 0]
    assert [ring.tolist() for ring in clipped.rings(0)] == [[[0, 0], [3, 0], [3, 4], [0, 4]], hole]
    assert clipped.may_have_bridges.tolist() == [False, False, False]


def test_bridges_are_announced() -> None:
    comb = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]
    square, hole = [[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [1, 3], [3, 3], [3, 1]]
    triangle = [[0, 0], [4, 0], [0, 4]]
    cases = {
        "falls apart": ([comb], [0, 1], -2.0, True),
        "touches the bottom of the notch": ([comb], [0, -1], 1.0, True),
        "below the notch": ([comb], [0, -1], 0.5, False),
        "convex": ([triangle], [1, 0], -1.0, False),
        "through a vertex": ([triangle], [1, -1], 0.0, False),
        "hole and shell": ([square, hole], [0, 1], -2.0, True),
        "shell only": ([square, hole], [0, 1], -0.5, False),
        "not cut at all": ([square, hole], [0, 1], 0.0, False),
        "along an edge of the hole": ([square, hole], [0, -1], 3.0, True),
    }
    for name, (rings, normal, offset, expected) in cases.items():
        assert clip_polygons([rings], HalfSpace(normal, offset)).may_have_bridges.tolist() == [expected], name


def test_arrays_of_triangles_and_any_workers() -> None:
    rng = np.random.default_rng(5)
    triangles = rng.uniform(-1, 1, (300, 3, 3))
    box = Aabb([-0.5] * 3, [0.5] * 3)
    results = [clip_polygons(triangles, box, workers=workers) for workers in (1, 3)]
    results.append(clip_polygons([[triangle] for triangle in triangles.tolist()], box))
    for name in ClippedPolygons.__slots__:
        for other in results[1:]:
            np.testing.assert_array_equal(getattr(results[0], name), getattr(other, name))
    again = clip_polygons([results[0].rings(i) for i in range(300) if results[0].rings(i)], box)
    np.testing.assert_array_equal(again.vertices, results[0].vertices)


def test_convex_polyhedra_are_certified() -> None:
    corners = np.array(list(itertools.product([0.0, 1.0], repeat=3)))
    quads = [face[::-1] for face in CUBE_QUADS]
    triangle = [[-1, 0.5, 0.5], [2, 0.5, 0.25], [0.5, 2, 0.5]]
    for faces in (quads, CUBE_QUADS):  # also turned inside out
        check([triangle], Polyhedron(corners, quads), clip_polygons([[triangle]], Polyhedron(corners, faces)))
    dented = np.vstack([corners, [[0.5, 0.5, 0.75]]])
    top = next(face for face in quads if all(corners[v, 2] == 1 for v in face))
    fan = [[top[k], top[(k + 1) % 4], 8] for k in range(4)]
    concave = Polyhedron(dented, [face for face in quads if face is not top] + fan)
    double = Polyhedron(np.vstack([corners, corners]), quads + [[v + 8 for v in face] for face in quads])
    flat = Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])
    for solid, told in ((concave, "both sides of face"), (double, "even number of times"), (flat, "no interior")):
        with pytest.raises(UnsupportedSolidError, match=told) as caught:
            clip_polygons([[triangle]], solid)
        assert caught.value.where[:2] == ("region", "faces")


def test_empty_queries_and_report() -> None:
    box = Aabb([0, 0, 0], [1, 1, 1])
    for nothing in ([], np.zeros((0, 3, 3))):
        clipped, accuracy = clip_polygons(nothing, box, report=True)
        assert (len(clipped), clipped.vertices.shape, clipped.ring_offsets.tolist()) == (0, (0, 3), [0])
        assert (accuracy.decisions, accuracy.n_items, accuracy.method) == ("exact", 0, "sutherland_hodgman")


def test_zeros_of_either_sign_are_one() -> None:
    rng = np.random.default_rng(5)
    for dimension in (2, 3):
        rings = rng.integers(-2, 3, (200, 9, dimension)) * 1.0
        negative = np.where(rings == 0.0, -0.0, rings)
        kept = negative.copy()
        for region in regions_of(rng, dimension):
            first, second = clip_polygons(rings, region), clip_polygons(negative, region)
            for name in ClippedPolygons.__slots__:
                np.testing.assert_array_equal(getattr(first, name), getattr(second, name), err_msg=str(region))
            assert not np.signbit(second.vertices[second.vertices == 0.0]).any()
        assert negative.tobytes() == kept.tobytes()


def test_refuses_what_it_cannot_take() -> None:
    box, ring = Aabb([0, 0], [1, 1]), [[0, 0], [1, 1], [0, 1]]
    cases: list[tuple[Any, Any, type[Exception], Any]] = [
        ([[ring]], Sphere([0, 0], 1), UnsupportedSolidError, ("region",)),
        ([[ring]], Polygon([ring]), UnsupportedSolidError, ("region",)),
        ([[[[0, 0, 0], [1, 1, 1], [0, 1, 1]]]], box, WrongDimensionError, ("polygons", 0, 0)),
        ([[ring], [[[0, 0], [1, math.nan], [1, 1]]]], box, NotFiniteError, ("polygons", 1, 0, 1, 1)),
        (np.array([ring, [[0, 0], [1, math.nan], [1, 1]]]), box, NotFiniteError, ("polygons", 1, 1, 1)),
        (np.array([ring, [[0, 0], [1, 1], [-math.inf, 1]]]), box, NotFiniteError, ("polygons", 1, 2, 0)),
        ([[ring], []], box, EmptyGeometryError, ("polygons", 1)),
        ([[ring, []]], box, EmptyGeometryError, ("polygons", 0, 1)),
        ([1], box, InvalidArrayError, ("polygons", 0)),
        ("ring", box, InvalidArrayError, ("polygons",)),
        ([Polygon([ring])], Aabb([0] * 3, [1] * 3), WrongDimensionError, ("polygons", 0)),
    ]
    for polygons, region, error, where in cases:
        with pytest.raises(error) as caught:
            clip_polygons(polygons, region)
        assert caught.value.where == where
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError):
        clip_polygons([[ring]], box, cancel=cancel)
    with pytest.raises(DeadlineExceededError):
        clip_polygons([[ring]], box, deadline=0.0)


def test_the_example() -> None:
    assert doctest.testmod(polygons_module) == (0, 3)


def test_a_raised_flag_ends_a_chunk() -> None:
    """The kernel stopping for it does not pass for a lack of room, of which more and more would be made."""
    region, budget, offsets = Aabb([-1, -1], [1, 1]), Budget(), np.arange(6)
    contours = as_contours(np.ones((5, 3, 2)), 2)
    plan = plan_of(region, budget.check)
    scene = kernel_scene(plan, contours.vertices, 1.0, budget.check)
    assert scene is not None
    budget.flag[0] = 1
    found = np.zeros(5, np.int64), np.zeros(5, np.uint8), offsets[1:] > 9, np.zeros(5, np.int8)
    with pytest.raises(CancelledError):
        clip_chunk(Batch(contours, plan, scene, *found), 0, 5, budget)


def test_large_numbers_are_clipped_without_a_warning() -> None:
    rings = np.random.default_rng(7).uniform(-1e200, 1e200, (2, 5, 2))
    for _ in range(2):  # with nothing kept, and with a plan
        check(rings, box := Aabb([-1e199, -1e199], [1e199, 1e199]), clip_polygons(rings, box))
        clip_polygons(rings, box)
