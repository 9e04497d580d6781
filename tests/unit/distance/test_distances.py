"""Distances of points: every number, face and feature is that of rational arithmetic, near boundaries and on them."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import isqrt
from typing import Any

import numpy as np
import pytest

import engine
from engine.errors import EmptyGeometryError, InvalidInputError, InvalidOperationError, UnsupportedSolidError

Vector = tuple[Fraction, ...]
BOX_FACES = [
    (a, *rest) for a, b, c, d in ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
    for rest in ((b, c), (c, d))
]  # fmt: skip
CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)[[0, 4, 2, 6, 1, 5, 3, 7]]
SPIKES = np.array([[3, 0, 0], [0, 0.5, 0], [-3, 0.1, 0], [0, -0.5, 0], [0.2, 0, 1.7], [0.1, 0, -2.9]], float)
SPIKE_FACES = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (1, 0, 5), (2, 1, 5), (3, 2, 5), (0, 3, 5)]


def exact(point: Any) -> Vector:
    return tuple(Fraction(float(x)) for x in point)


def minus(a: Vector, b: Vector) -> Vector:
    return tuple(x - y for x, y in zip(a, b))


def dot(a: Vector, b: Vector) -> Fraction:
    return sum((x * y for x, y in zip(a, b)), Fraction(0))


def along(a: Vector, u: Vector, t: Fraction) -> Vector:
    return tuple(x + t * y for x, y in zip(a, u))


def on_edge(q: Vector, a: Vector, b: Vector) -> Vector:
    u = minus(b, a)
    size = dot(u, u)
    return along(a, u, min(max(dot(minus(q, a), u) / size, Fraction(0)), Fraction(1))) if size else a


def on_triangle(q: Vector, corners: Sequence[Vector]) -> Vector:
    """Return the nearest point of a triangle, of an edge given as one."""
    feet = [on_edge(q, corners[k], corners[(k + 1) % len(corners)]) for k in range(len(corners))]
    if len(q) == 3:
        a, u, v = corners[0], minus(corners[1], corners[0]), minus(corners[2], corners[0])
        w = minus(q, a)
        uu, uv, vv, wu, wv = dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v)
        size = uu * vv - uv * uv
        if size:
            s, t = (vv * wu - uv * wv) / size, (uu * wv - uv * wu) / size
            if s >= 0 and t >= 0 and s + t <= 1:
                return along(along(a, u, s), v, t)
    return min(feet, key=lambda p: dot(minus(q, p), minus(q, p)))


def nearest_root(square: Fraction) -> float:
    """Return the double nearest to the root of a rational, the smallest denormal in place of 0."""
    if not square:
        return 0.0
    n, shift = square.numerator * square.denominator, 2400
    root = isqrt(n << shift)
    low, high = (float(Fraction(root + k, square.denominator << shift // 2)) for k in (0, 1))
    assert low == high or root * root == n << shift
    return low or 5e-324


def check(points: Any, solid: Any, parts: list[list[Vector]], signs: Any, **options: Any) -> None:
    """Assert all answers about the boundary of a solid, given as triangles or edges; signs: of `locate`, or None."""
    array = np.asarray(points, float)
    plain = engine.distances(array, solid, to="boundary", **options)
    named = engine.distances(array, solid, to="boundary", nearest=True, **options)
    signed = plain if signs is None else engine.distances(array, solid, signed=True, **options)
    for item, point in enumerate(array):
        q = exact(point)
        feet = [on_triangle(q, part) for part in parts]
        squares = [dot(minus(q, foot), minus(q, foot)) for foot in feet]
        least = min(squares)
        face, expected = squares.index(least), nearest_root(least)
        assert plain[item] == named.distance[item] == expected, (point, expected)
        assert signed[item] == (-expected if signs is not None and signs[item] > 0 else expected)
        assert named.face[item] == face, point
        assert named.point[item].tolist() == [float(x) for x in feet[face]], point
        for most in (expected, np.nextafter(expected, 0), np.nextafter(expected, np.inf)):
            within = engine.distances(array[item : item + 1], solid, to="boundary", within=float(most), **options)
            assert bool(within[0]) == (least <= Fraction(float(most)) ** 2), (point, most)


def hard_points(vertices: Any, faces: Any, n: int, seed: int) -> Any:
    """Return points on faces, edges and vertices, next doubles to them, near them, on a lattice, far away."""
    rng, points = np.random.default_rng(seed), []
    low, size = vertices.min(axis=0), np.ptp(vertices, axis=0)
    for k in range(n):
        corners = vertices[list(faces[rng.integers(len(faces))])]
        point = rng.dirichlet(np.ones(len(corners))) @ corners
        kind = k % 8
        if kind in (1, 5):
            point = (corners[0] + corners[1]) / 2
        elif kind in (2, 6):
            point = corners[0].copy()
        elif kind == 3:
            point = point + size.max() * 10.0 ** -rng.integers(1, 15) * rng.normal(size=len(point))
        elif kind == 4:
            point = low + size * np.round(rng.random(len(point)) * 6) / 4
        elif kind == 7:
            point = low + size * 10.0 ** rng.integers(0, 6) * rng.normal(size=len(point))
        if kind in (5, 6):
            axis = rng.integers(len(point))
            point[axis] = np.nextafter(point[axis], rng.choice([-np.inf, np.inf]))
        points.append(point)
    return np.array(points)


@pytest.mark.parametrize("shape", ["cube", "spikes"])
@pytest.mark.parametrize(
    ("scale", "offset"), [(1, 0), (1e-150, 0), (1e150, 0), (1e-310, 0), ((1, 1e5, 1), 0), (1, 1e9)]
)
def test_of_polyhedra(shape: str, scale: Any, offset: float) -> None:
    vertices, faces = (CUBE, BOX_FACES) if shape == "cube" else (SPIKES, SPIKE_FACES)
    vertices = vertices * scale + offset
    solid = engine.Polyhedron(vertices, faces)
    points = hard_points(vertices, faces, 24, seed=len(shape))
    parts = [[exact(vertices[k]) for k in face] for face in faces]
    check(points, solid, parts, engine.locate(points, solid))


def test_of_a_surface_with_faces_without_area_and_duplicates() -> None:
    rng = np.random.default_rng(3)
    vertices = rng.integers(-3, 4, (12, 3)) * 0.1
    faces = [face for face in rng.integers(0, 12, (30, 3)).tolist() if len(set(face)) == 3]
    faces += faces[:3]
    parts = [[exact(vertices[k]) for k in face] for face in faces]
    check(hard_points(vertices, faces, 40, seed=4), engine.Surface(vertices, faces), parts, None)


def test_of_polygons_boxes_triangles_and_lines_of_the_plane() -> None:
    shell, hole = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], float), np.array([[1, 1], [1, 2], [2.1, 2], [2, 1]])
    for rings in ([shell], [shell, hole], [hole * 0.1]):
        edges = [(ring[k], ring[(k + 1) % 4]) for ring in rings for k in range(4)]
        points = np.concatenate([hard_points(np.array(edges).reshape(-1, 2), np.arange(8).reshape(-1, 2), 24, 5),
                                 np.random.default_rng(6).integers(-2, 12, (20, 2)) / 2])  # fmt: skip
        solid = engine.Polygon(rings)
        check(points, solid, [[exact(p) for p in edge] for edge in edges], engine.locate(points, solid))
        if len(rings) == 1 and rings[0] is shell:
            box = engine.Aabb([0, 0], [4, 4])
            assert np.array_equal(
                engine.distances(points, box, signed=True), engine.distances(points, solid, signed=True)
            )
        lines = {"type": "MultiLineString", "coordinates": [ring.tolist() for ring in rings]}
        paths = [[exact(ring[k]), exact(ring[k + 1])] for ring in rings for k in range(3)]
        check(points, lines, paths, None)
    corners = np.array([[0.1, 0.2], [3, 0.4], [0.7, 2]])
    triangle, points = engine.Triangle(corners), hard_points(corners, [(0, 1), (1, 2)], 24, 8)
    edges = [[exact(corners[k]), exact(corners[(k + 1) % 3])] for k in range(3)]
    check(points, triangle, edges, engine.locate(points, triangle))


def test_of_a_flat_triangle_of_space_and_of_one_under_a_pose() -> None:
    corners = np.array([[0, 0, 0], [4, 0, 1], [0, 3, 1]], float)
    triangle, points = engine.Triangle(corners), hard_points(corners, [(0, 1, 2)], 24, 9)
    check(points, triangle, [[exact(p) for p in corners]], None)
    turn, move = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), np.array([8, -2, 0.5])
    moved = corners @ turn.T + move
    check(hard_points(moved, [(0, 1, 2)], 16, 10), triangle, [[exact(p) for p in moved]], None,
          pose=engine.Pose(turn, move))  # fmt: skip


@pytest.mark.parametrize(("far", "tolerance"), [(1e12, 1e-12), (3e13, 1e-12), (1.0, 1e-2), (1e9, 1e-6)])
def test_of_a_small_body_that_a_pose_brings_back_from_afar(far: float, tolerance: float) -> None:
    """The search looks in the body's own coordinates, where the point is known worse than the body is large, or lengths
    are not those of the pose."""
    rng = np.random.default_rng(7)
    for _ in range(4):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn = turn * np.sign(np.linalg.det(turn)) + rng.uniform(-0.2, 0.2, (3, 3)) * tolerance
        spikes = 0.01 * SPIKES + far * rng.normal(size=3)
        pose = engine.Pose(turn, -(turn @ spikes[0]) + 0.01 * rng.normal(size=3), tolerance=tolerance)
        rows, move = [exact(row) for row in pose.rotation], exact(pose.translation)
        image = [tuple(dot(row, exact(p)) + x for row, x in zip(rows, move)) for p in spikes]
        middle = np.array([[float(x) for x in p] for p in image]).mean(axis=0)
        points = middle + rng.normal(size=(6, 3)) * 0.03 * 10.0 ** rng.uniform(-1, 1.5, (6, 1))
        body = engine.Polyhedron(spikes, SPIKE_FACES)
        check(points, body, [[image[i] for i in face] for face in SPIKE_FACES], None, pose=pose)


@pytest.mark.parametrize("d", [2, 3])
def test_of_balls_and_half_spaces(d: int) -> None:
    rng = np.random.default_rng(d)
    points = np.concatenate([rng.normal(size=(12, d)) * 3, rng.integers(-6, 7, (30, d)), 5 * np.eye(d)])
    ball = engine.Sphere(np.zeros(d), 5.0)
    named, signed = (
        engine.distances(points, ball, to="boundary", nearest=True),
        engine.distances(points, ball, signed=True),
    )
    for item, point in enumerate(points):
        square = dot(exact(point), exact(point))
        low = Fraction(isqrt(int(square * 4**600)), 2**600)  # within 2^-600 of the root
        gap = low - 5 if square != 25 else Fraction(0)
        assert signed[item] == float(gap)
        assert named.distance[item] == abs(float(gap))
        if square:
            foot = [float(x * 5 / low) for x in exact(point)]
            assert named.point[item].tolist() == foot
    assert engine.distances(np.zeros((1, d)), ball, to="boundary", nearest=True).point.tolist() == [
        [5.0] + [0.0] * (d - 1)
    ]
    normal = np.array([3.0, 4.0, 12.0])[:d]
    half_space = engine.HalfSpace(normal, 0.7)
    signed = engine.distances(points, half_space, signed=True)
    for item, point in enumerate(points):
        height = dot(exact(normal), exact(point)) + Fraction(0.7)
        assert signed[item] == -np.sign(float(height)) * nearest_root(height**2 / dot(exact(normal), exact(normal)))


def test_of_convex_solids_as_of_the_box_they_are() -> None:
    box = engine.Aabb([-1, -1, -1], [1, 1, 1])
    rng = np.random.default_rng(11)
    points = np.concatenate([rng.normal(size=(12, 3)) * 2, rng.integers(-4, 5, (30, 3)) / 2])
    for options in ({"to": "boundary"}, {"signed": True}, {"to": "solid"}, {"within": 1.0}):
        convex: Any = engine.distances(points, engine.Convex(box.rows), **options)
        assert np.array_equal(convex, engine.distances(points, box, **options))
    with pytest.raises(EmptyGeometryError):
        engine.distances(points, engine.Convex([[1, 0, 0, -1], [-1, 0, 0, -1]]))


def test_a_distant_point_sees_no_unused_lane() -> None:
    """The blocks of 11 triangles are not full: what fills them up lies nearer to some point than any triangle."""
    fan = engine.Surface(
        [[0, 0, 0], *([np.cos(k), np.sin(k), 0.1 * k] for k in range(12))], [[0, k, k + 1] for k in range(1, 12)]
    )
    ways = np.array([[x, y, z] for x in (-1.0, 0.5, 1.0) for y in (-1.0, 0.5, 1.0) for z in (-2.0, 0.0, 1.0)])
    for size in (3e3, 1e9):
        told = engine.distances(size * ways, fan)
        least = np.linalg.norm(size * ways[:, None] - fan.vertices, axis=2).min(axis=1)
        assert (told <= least * (1.0 + 1e-12)).all()
        assert (told >= least - 2.0).all()


def test_many_ties_are_one_feature() -> None:
    """Around the apex of a fan all triangles are as near: their vertex is, and the least face is named."""
    angles = np.linspace(0, 2 * np.pi, 3000, endpoint=False)
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(3000)], axis=1)
    faces = [(3000, k, (k + 1) % 3000) for k in range(3000)]
    fan = engine.Surface(np.concatenate([rim, [[0, 0, 1]]]), faces)
    answer = engine.distances([[0, 0, 3.0], [0, 0, 1.0]], fan, nearest=True)
    assert answer.distance.tolist() == [2.0, 0.0]
    assert answer.face.tolist() == [0, 0]
    assert answer.feature(0) == answer.feature(1) == engine.Feature("vertex", (3000,))


def test_threads_ranges_and_options_give_the_same() -> None:
    rng = np.random.default_rng(12)
    solid, points = engine.Polyhedron(SPIKES, SPIKE_FACES), rng.normal(size=(5000, 3)) * 2
    whole = engine.distances(points, solid, signed=True, workers=2)
    assert np.array_equal(whole, engine.distances(points, solid, signed=True, workers=1))
    parts = [engine.distances(part, solid, signed=True) for part in np.array_split(points, 7)]
    assert np.array_equal(whole, np.concatenate(parts))
    named, accuracy = engine.distances(points, solid, nearest=True, report=True)
    assert np.array_equal(named.distance, np.maximum(whole, 0.0))
    inside = whole < 0
    assert np.array_equal(named.point[inside], points[inside])
    assert (named.kind[inside] == 4).all()
    assert accuracy.n_items == 5000
    assert accuracy.coordinates_ulp == 0.5
    assert engine.distances(np.zeros((0, 3)), solid).shape == (0,)


def test_a_scene_names_the_nearest_body() -> None:
    rng = np.random.default_rng(13)
    solids = [engine.Sphere(rng.normal(size=3) * 4, 0.5), engine.Aabb([0, 0, 0], [1, 1, 1]),
              engine.Polyhedron(SPIKES + 5, SPIKE_FACES), engine.Aabb([1, 0, 0], [2, 1, 1])]  # fmt: skip
    poses = [None, engine.Pose.from_quaternion([3, 1, 0, 0], [0, -4, 0]), None, None]
    points = np.concatenate([rng.normal(size=(40, 3)) * 5, [[1.0, 0.5, 0.5]]])
    answer = engine.Scene(solids, poses).distances(points)
    every = np.array([engine.distances(points, solid, pose=pose) for solid, pose in zip(solids, poses)])
    assert np.array_equal(answer.distance, every.min(axis=0))
    assert np.array_equal(answer.body, every.argmin(axis=0))
    with pytest.raises(EmptyGeometryError):
        engine.Scene([]).distances(points)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"within": -1.0}, InvalidInputError),
        ({"within": float("nan")}, InvalidInputError),
        ({"within": 1.0, "signed": True}, InvalidOperationError),
        ({"within": 1.0, "nearest": True}, InvalidOperationError),
        ({"to": "surface"}, InvalidOperationError),
        ({"signed": 1}, InvalidInputError),
    ],
)
def test_options_that_exclude_each_other_are_refused(options: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        engine.distances([[0, 0, 0]], engine.Aabb([0, 0, 0], [1, 1, 1]), **options)


def test_what_has_no_inside_no_point_or_no_distance_is_refused() -> None:
    sheet = engine.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(InvalidOperationError, match="no inside"):
        engine.distances([[0, 0, 1]], sheet, signed=True)
    with pytest.raises(EmptyGeometryError):
        engine.distances([[0, 0]], engine.Polygon([]))
    with pytest.raises(UnsupportedSolidError, match="distances"):
        engine.distances([[0, 0]], engine.Csg("union", [engine.Sphere([0, 0], 1)]))
    box = engine.Aabb([0, 0, 0], [1, 1, 1])
    engine.distances([[0, 0, 1]], box)
    for value in (np.nan, np.inf):
        with pytest.raises(InvalidInputError):
            engine.distances(np.array([[0.0, value, 0.0]]), box)  # a small batch


def test_no_points_have_no_nearest_points() -> None:
    for solid in (engine.Aabb([0, 0, 0], [1, 1, 1]), engine.Sphere([0, 0, 0], 1), engine.HalfSpace([0, 0, 1], 0)):
        none = engine.distances(np.zeros((0, 3)), solid, nearest=True)
        assert isinstance(none, engine.Distances)
        assert (len(none), none.point.shape, none.index.shape) == (0, (0, 3), (0, 2))


def test_points_in_the_plane_of_a_tiny_surface_far_out() -> None:
    """Lengths of 1e-200 in the plane x = 1e200: products of them underflow, no bound holds."""
    draw, numbers = np.random.default_rng(3), np.arange(16).reshape(4, 4)
    grid = np.stack([*np.meshgrid(np.arange(4), np.arange(4), indexing="ij"), np.zeros((4, 4))], axis=2).reshape(-1, 3)
    flat = grid + draw.normal(size=grid.shape) * 0.2
    starts = numbers[:-1, :-1].ravel()[:, None]
    faces = np.concatenate([starts + np.array([0, 4, 5]), starts + np.array([0, 5, 1])])
    vertices, points = flat * 1e-200, draw.normal(size=(8, 3))
    vertices[:, 0] = points[:, 0] = 1e200
    surface = engine.Surface(vertices, faces)
    made = np.asarray(engine.distances(points, surface))
    for point, distance in zip(points, made.tolist(), strict=True):
        above, below = (float(np.nextafter(distance, way)) for way in (np.inf, 0.0))
        assert [bool(engine.distances(point[None], surface, within=d)[0]) for d in (above, below)] == [True, False]
    vertices[:, 0] = points[:, 0] = 0.0
    assert np.array_equal(made, engine.distances(points, engine.Surface(vertices, faces)))


def test_within_is_exact_where_squares_underflow() -> None:
    """Both were True, as was 2.3789564940851e-130: over coordinates of 8e192 such lengths are below all doubles."""
    corners = [[4.2658214930176924e-148, 1.873690219446276e-148], [1.8716041872474847e-151, 4.310389764352137e-152],
               [6.595870684569362e-150, 7.455571912710052e-150]]  # fmt: skip
    flat = 8.460908021322254e192
    surface = engine.Surface([[*corner, flat] for corner in corners], [[0, 1, 2]])
    point = [1.593739625415637e-130, 1.7661902522463715e-130, flat]
    faces = [[[Fraction(x) for x in corner] for corner in surface.vertices.tolist()]]
    square = min(sum(((Fraction(x) - y) ** 2 for x, y in zip(point, corner)), Fraction(0)) for corner in faces[0])
    for limit in (2.3789564940851853e-130, 2.378956494085185e-130, 2.378956494085186e-130, 2.3789564940851e-130):
        assert engine.distances([point], surface, within=limit).tolist() == [square <= Fraction(limit) ** 2]
    assert {bool(engine.distances([point], surface, within=limit)[0]) for limit in (2.38e-130, 2.37e-130)} == {
        True,
        False,
    }
