"""cut and section: hard planes against rationals, closedness by index and position, nesting, scales, regions."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import permutations
from typing import Any

import numpy as np
import pytest

import engine
from engine.running.budget import Budget
from engine.solid_cutting.boundary import boundary
from engine.solid_cutting.cut_measures import volume_in_fractions
from engine.solid_cutting.ears import bridge_of
from tests.reference.cutting import cut_volume, nearest, points_of
from tests.unit.solid_cutting.bodies import CUBE, block, joined, star, subdivided, turned

BODIES: dict[str, Any] = {
    "block": lambda draw: joined([(block([0, 0, 0], draw.integers(1, 6, 3)), CUBE)]),
    "cavities": lambda draw: joined([(block([0] * 3, [9] * 3), CUBE), (block([1, 2, 1], [7, 8, 8]), CUBE[:, ::-1]),
                                     (block([2, 3, 3], [5, 6, 7]), CUBE)]),
    "star": lambda draw: star(int(draw.integers(99))),
    "flush": lambda draw: joined([(block([0] * 3, [4] * 3), CUBE), (block([4, 1, 1], [7, 3, 3]), CUBE),
                                  (block([1, 1, 1], [3, 3, 4]), CUBE[:, ::-1])]),
    "edges": lambda draw: joined([(block(low, np.array(low) + 2), CUBE)
                                  for low in ([0, 0, 0], [2, 2, 0], [2, 0, 2], [0, 2, 2])]),
    "columns": lambda draw: joined([(block([i, j, 0], [i + 1, j + 1, int(draw.integers(1, 4))]), CUBE)
                                    for i in range(2) for j in range(2)]),
    "facets": lambda draw: subdivided(*subdivided(turned(block([0] * 3, draw.integers(1, 6, 3))), CUBE)),
}  # fmt: skip


def plane(draw: np.random.Generator, vertices: np.ndarray, kind: int) -> tuple[np.ndarray, float]:
    """Return a plane through a vertex, an ulp beside one, through three, or anywhere."""
    at = vertices[draw.integers(len(vertices))]
    normal = np.eye(3)[draw.integers(3)] * draw.choice([-1, 1])
    if kind == 2:
        normal = draw.integers(-2, 3, 3) + np.array([0, 0, 0.5])
    elif kind == 3:
        a, b, c = vertices[draw.choice(len(vertices), 3, replace=False)]
        normal = np.cross(b - a, c - a) if np.cross(b - a, c - a).any() else np.array([1.0, 1, 0])
    elif kind == 4:
        normal, at = draw.normal(size=3), 0.5 * (at + vertices[0])
    offset = -float(normal @ at)
    return normal.astype(float), float(np.nextafter(offset, np.inf)) if kind == 1 else offset


def assert_closed(faces: np.ndarray) -> None:
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    sides = sides[sides[:, 0] != sides[:, 1]]
    _, numbers = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    assert not np.bincount(numbers.reshape(-1), np.sign(sides[:, 1] - sides[:, 0])).any()


@pytest.mark.parametrize("seed", range(90))
def test_hard_cuts(seed: int) -> None:
    draw = np.random.default_rng(seed)
    vertices, faces = list(BODIES.values())[seed % len(BODIES)](draw)
    vertices = vertices * 2.0 ** int(draw.integers(-200, 200)) if seed % 7 == 1 else vertices
    vertices = vertices + 1e14 if seed % 7 == 2 and (vertices == np.round(vertices)).all() else vertices
    normal, offset = plane(draw, vertices, seed % 5)
    body, half = engine.Polyhedron(vertices, faces), engine.HalfSpace(normal, offset)
    points = points_of(vertices)
    parts: Any = engine.cut(body, half, keep="both")
    row = np.array([*normal, offset])
    for part, side in zip(parts, (row, -row), strict=True):
        volume, area_squared = cut_volume(points, faces, side.tolist())
        assert part.volume == nearest(volume)
        assert bool(part) is (volume > 0)
        if part:
            assert_closed(part.faces)
            _, at = np.unique(part.vertices, axis=0, return_inverse=True)
            assert_closed(at.reshape(-1)[part.faces])
            assert engine.Polyhedron(part.vertices, part.faces) == part.solid
            assert set(part.origins[part.origins < 0].tolist()) <= {-1}
    sections: Any = engine.section(body, half)
    _, area_squared = cut_volume(points, faces, row.tolist())
    scale = 1 << 1200
    exact = Fraction(math.isqrt(int(area_squared * scale * scale)), scale)
    assert sum(map(Fraction, sections.areas)) == pytest.approx(exact, rel=1e-14)
    if len(sections.areas) == 1:
        assert sections.areas[0] == nearest(exact)
    flat = sum(engine.area(polygon) for polygon in sections.polygons(0)) if seed % 7 != 2 else sections.areas.sum()
    assert flat == pytest.approx(float(sections.areas.sum()), rel=1e-8)


def test_a_vertex_on_the_plane_is_outside_and_nothing_flat_is_left() -> None:
    cube = engine.Polyhedron(block([0] * 3, [1] * 3), CUBE)
    top: Any = engine.cut(cube, engine.HalfSpace([0, 0, 1], -1))
    assert not top
    assert top.volume == top.area == 0.0
    with pytest.raises(engine.EmptyGeometryError):
        _ = top.solid
    whole: Any = engine.cut(cube, engine.HalfSpace([0, 0, -1], 1))
    assert (whole.volume, whole.n_collapsed, (whole.origins < 0).sum()) == (1.0, 0, 2)
    upper: Any = engine.section(cube, engine.HalfSpace([0, 0, -1], 1))
    assert upper.areas.tolist() == [1.0]
    assert len(engine.section(cube, engine.HalfSpace([0, 0, 1], -1)).areas) == 0  # type: ignore[union-attr]
    corner: Any = engine.section(cube, [[0, 0, 0], [1, 1, 1]])
    assert len(corner.areas) == 0
    diagonal: Any = engine.section(cube, [[0, 0, 0], [1, 1, 0], [0, 0, 1]])
    assert diagonal.areas.tolist() == [math.sqrt(2)]


def test_scaled_bodies_have_the_same_topology() -> None:
    vertices, faces = star(3)
    cuts = [engine.cut(engine.Polyhedron(vertices * s, faces), engine.HalfSpace([1, 2, 3], 0.5 * s)) for s in
            (2.0**-40, 1.0, 2.0**30)]  # fmt: skip
    assert all((each.faces == cuts[0].faces).all() for each in cuts)
    assert all((each.origins == cuts[0].origins).all() for each in cuts)


def test_heights_are_one_sweep_with_the_same_answers() -> None:
    body = engine.Polyhedron(*star(5))
    heights = np.linspace(-2, 2, 23)
    together: Any = engine.section(body, heights, normal=[1, 0.5, 0.25])
    assert len(together) == 23
    for number, height in enumerate(heights):
        alone: Any = engine.section(body, engine.HalfSpace([1, 0.5, 0.25], -height))
        first, last = together.plane_offsets[number : number + 2]
        assert together.areas[first:last].tolist() == alone.areas.tolist()
        rings = together.ring_offsets[together.piece_offsets[[first, last]]]
        assert (together.vertices[rings[0] : rings[1]] == alone.vertices).all()


def test_boxes_and_convex_regions_leave_what_planes_one_by_one_do() -> None:
    vertices, faces = star(11)
    body = engine.Polyhedron(vertices, faces)
    low, high = [-0.4, -0.5, -0.3], [0.6, 0.5, 0.4]
    part: Any = engine.cut(body, engine.Aabb(low, high))
    assert_closed(part.faces)
    rows = engine.Aabb(low, high).rows
    same: Any = engine.cut(body, engine.Convex(rows))
    assert same.volume == part.volume == engine.overlap_volume(body, engine.Aabb(low, high))
    outside: Any = [engine.cut(body, engine.HalfSpace(-row[:3], -row[3])) for row in rows]
    assert part.volume < min(engine.volume(body) - each.volume for each in outside)
    tetrahedron = engine.Polyhedron(
        [[-1, -1, -1], [2, 0, 0], [0, 2, 0], [0, 0, 2]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    )
    both: Any = engine.cut(body, tetrahedron)
    assert_closed(both.faces)
    with pytest.raises(engine.UnsupportedSolidError, match="not convex"):
        engine.cut(body, body)


def region_of(draw: np.random.Generator, vertices: np.ndarray, kind: int) -> Any:
    """Return a box of whole numbers, between vertices, or anywhere; or planes of `plane`, a vertex or the middle in."""
    if kind == 0:
        low = draw.integers(-1, 4, 3)
        return engine.Aabb(low.astype(float), (low + draw.integers(1, 5, 3)).astype(float))
    if kind < 3:
        a, b = vertices[draw.choice(len(vertices), 2, replace=False)] + (draw.normal(size=3) if kind == 2 else 0.0)
        return engine.Aabb(np.minimum(a, b), np.maximum(a, b))
    rows = [(*normal, d) for normal, d in (plane(draw, vertices, int(draw.integers(5))) for _ in range(4))]
    at = vertices.mean(axis=0) if kind == 3 else vertices[draw.integers(len(vertices))]
    return engine.Convex([np.array(row) * (-1 if np.dot(row[:3], at) + row[3] < 0 else 1) for row in rows])


@pytest.mark.parametrize("seed", range(60))
def test_what_is_inside_and_outside_several_planes_is_the_whole(seed: int) -> None:
    draw = np.random.default_rng(seed)
    name = list(BODIES)[seed % len(BODIES)]
    vertices, faces = BODIES[name](draw)
    body, region = engine.Polyhedron(vertices, faces), region_of(draw, vertices, seed // len(BODIES) % 5)
    inside, outside = engine.cut(body, region, keep="both")
    assert outside == engine.cut(body, region, keep="outside")
    volumes = [volume_in_fractions(part._points, part._triangles) if part else 0 for part in (inside, outside)]
    with Budget(None) as budget:
        assert sum(volumes) == volume_in_fractions(*boundary(body, budget)[:2])
    assert bool(outside) is (volumes[1] > 0)
    if not outside:
        return
    assert_closed(outside.faces)
    _, at = np.unique(outside.vertices, axis=0, return_inverse=True)
    assert_closed(at.reshape(-1)[outside.faces])
    points = vertices.min(axis=0) + draw.random((60, 3)) * np.ptp(vertices, axis=0)
    is_out = (engine.locate(points, body) > 0) & (engine.locate(points, region) < 0)
    assert (engine.locate(points, outside.solid) == np.where(is_out, 1, -1)).all()
    if name in ("block", "cavities") and seed // len(BODIES) % 5 == 0:  # coordinates that are not rounded
        assert "nothing is wrong" in repr(engine.inspect((outside.vertices, outside.faces)))


def test_outside_a_region_without_interior_is_the_whole_and_a_flush_one_leaves_nothing_flat() -> None:
    cube = engine.Polyhedron(block([0] * 3, [4] * 3), CUBE)
    flat: Any = engine.cut(cube, engine.Aabb([1, 1, 2], [3, 3, 2]), keep="outside")
    assert (flat.volume, flat.area, set(flat.origins.tolist())) == (64.0, 96.0, set(range(len(CUBE))))
    corner: Any = engine.cut(cube, engine.Aabb([2, 2, 2], [4, 4, 4]), keep="outside")
    assert (corner.volume, corner.area) == (56.0, 96.0)
    cavity: Any = engine.cut(cube, engine.Aabb([1, 1, 1], [3, 3, 3]), keep="outside")
    assert (cavity.volume, cavity.area) == (56.0, 96.0 + 24.0)
    assert not engine.cut(cube, engine.Aabb([0, 0, 0], [4, 4, 4]), keep="outside")
    slab: Any = engine.cut(cube, engine.Aabb([0, 0, 1], [4, 4, 3]), keep="outside")
    assert (slab.volume, slab.area) == (32.0, 2 * (32.0 + 16.0))


def test_overlaps() -> None:
    unit = engine.Aabb([0, 0, 0], [1, 1, 1])
    quarter = engine.Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [1, 0, 0])
    assert engine.iou(unit, unit, second_pose=quarter) == 1.0
    half = engine.Pose(np.eye(3), [0.5, 0.25, 0])
    assert engine.overlap_volume(unit, unit, second_pose=half) == 0.375
    assert engine.iou(unit, engine.Aabb([1, 0, 0], [2, 1, 1])) == 0.0
    cube = engine.Polyhedron(block([0] * 3, [1] * 3), CUBE)
    assert engine.overlap_volume(cube, unit, first_pose=half) == 0.375
    hollow = engine.Polyhedron(*joined([(block([-1] * 3, [2] * 3), CUBE), (block([0] * 3, [1] * 3), CUBE)]))
    assert engine.overlap_volume(hollow, engine.Aabb([0, 0, 0], [2, 1, 1])) == 1.0
    assert engine.overlap_volume(engine.Aabb([0, 0, 0], [2, 1, 1]), hollow, second_pose=half) == 1.25
    with pytest.raises(engine.UnsupportedPairError, match="convex parts"):
        engine.overlap_volume(hollow, hollow)
    squares = np.array([[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]] * 3)
    moved = squares + np.array([[[0.0, 0.0]], [[1.0, 1.0]], [[2.0, 0.0]]])
    assert engine.iou(squares, moved).tolist() == [1.0, 1 / 7, 0.0]  # type: ignore[union-attr]
    pairs: Any = engine.overlap_volume([unit, unit], [unit, engine.Aabb([0.5, 0, 0], [2, 1, 1])])
    assert pairs.tolist() == [1.0, 0.5]


def test_overlaps_of_turned_bodies_do_not_depend_on_how_they_are_given() -> None:
    box = engine.Aabb([-1, -0.5, 0], [1, 0.5, 2])
    mesh = engine.Polyhedron(block(box.min, box.max), CUBE)
    rows = engine.Convex(box.rows)
    pose = engine.Pose.from_quaternion([1, 0.3, 0.2, 0.1], [0.5, 0.2, 0.1])
    values = {engine.iou(one, other, second_pose=pose) for one in (box, mesh, rows) for other in (box, mesh, rows)}
    assert len(values) == 1
    assert 0.1 < values.pop() < 0.9
    straight = [
        engine.iou(box, other)
        for other in (engine.Aabb([0, 0, 0], [3, 3, 3]), engine.Convex(engine.Aabb([0, 0, 0], [3, 3, 3]).rows))
    ]
    assert straight[0] == straight[1] == float(Fraction(1, 30))


def test_holes_that_touch_each_other_at_their_leftmost_corners() -> None:
    """A prism has its cross-section as a cavity: three share an upright edge, in every order, and turned about it."""
    flat = [[(6, 1), (7, 2)], [(7, 3), (7, 4)], [(7, 5), (6, 7)]]
    faces = np.array([(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)])
    for order in permutations(range(3)):
        for way in (1, -1):
            parts = [(block([0, 0, 0], [9, 9, 9]) - [4, 4, 0], CUBE)]
            for k in order:
                ring = [(4, 4), *flat[k]]
                parts.append((np.array([(way * (x - 4), y - 4, z) for z in (1, 8) for x, y in ring], float), faces))
            vertices, rows = joined(parts)
            vertices[8:, 0] += (way < 0) * 1.0
            body, level = engine.Polyhedron(vertices, rows), engine.HalfSpace([0, 0, 1], -5)
            part: Any = engine.cut(body, level)
            assert_closed(part.faces)
            holes = [abs((a - 4) * (d - 4) - (b - 4) * (c - 4)) / 2 for (a, b), (c, d) in flat]
            areas: Any = engine.section(body, level)
            assert areas.areas.tolist() == [81 - sum(holes)]
            assert part.volume == 81 * 4 - 3 * sum(holes)


@pytest.mark.parametrize("number", [float, Fraction])
def test_a_bridge_ends_at_the_corner_that_has_the_hole_inside(number: Any) -> None:
    """A square, a hole in it that is joined by corners 4 and 7 of one place, and a hole that touches it there."""
    places = [(0, 0), (9, 0), (9, 9), (0, 9), (4, 4), (6, 7), (7, 5), (4, 4), (0, 0), (4, 4), (7, 2), (6, 1)]
    ring = [0, 4, 5, 6, 7, 8, 1, 2, 3]
    before, after = np.arange(12), np.arange(12)
    for cycle in (ring, [9, 10, 11]):
        for one, other in zip(cycle, [*cycle[1:], cycle[0]]):
            after[one], before[other] = other, one
    x, y = ([number(place[axis]) for place in places] for axis in range(2))
    bridge: Any = getattr(bridge_of, "py_func", bridge_of)
    assert bridge(x, y, before, after, 0, 9) == 7


def test_overlaps_of_different_dimensions_and_shapes_are_refused() -> None:
    triangle = engine.Polygon([[[0, 0], [1, 0], [1, 1]]])
    cube = engine.Polyhedron(block([0] * 3, [1] * 3), CUBE)
    flat, box = engine.Aabb([0, 0], [1, 1]), engine.Aabb([0, 0, 0], [1, 1, 1])
    region = engine.Convex([[1, 0, 0], [0, 1, 0], [-1, -1, 1]])
    for first, second in ((triangle, box), (box, triangle), (cube, flat), (cube, region), (region, box), (box, flat)):
        for ask in (engine.overlap_volume, engine.iou):
            with pytest.raises(engine.WrongDimensionError, match="one dimension"):
                ask(first, second)
    with pytest.raises(engine.WrongDimensionError, match="first must hold positions of 2"):
        engine.iou(np.zeros((2, 4, 3)), np.zeros((2, 4, 3)))
    for n_corners in range(3):
        with pytest.raises(engine.InvalidInputError, match="3 or more"):
            engine.iou(np.zeros((2, 4, 2)), np.zeros((2, n_corners, 2)))
    line = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])
    assert engine.iou(line, line).tolist() == [0.0, 1.0]  # type: ignore[union-attr]


@pytest.mark.parametrize("exponent", [-1000, -560, -400, 0, 400, 560, 1000])
def test_ratios_do_not_depend_on_the_scale(exponent: int) -> None:
    """The areas and volumes themselves are below the least double, or beyond the largest."""
    scale = 2.0**exponent
    squares = np.array([[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]]) * scale
    assert engine.iou(squares, squares + scale).tolist() == [1 / 7]  # type: ignore[union-attr]
    one, other = engine.Polygon([squares[0]]), engine.Aabb([scale, scale], [3 * scale, 3 * scale])
    assert engine.iou(one, other) == 1 / 7
    vertices, faces = star(3)
    body, box = (engine.Polyhedron(vertices, faces), engine.Aabb([-1] * 3, [1] * 3))
    scaled = engine.Polyhedron(vertices * scale, faces), engine.Aabb([-scale] * 3, [scale] * 3)
    assert abs(exponent) > 900 or engine.iou(*scaled) == engine.iou(body, box)
    if exponent > 512:
        with pytest.raises(engine.NotRepresentableError, match="pair 0"):
            engine.overlap_volume(squares, squares)


def test_bodies_at_the_ends_of_the_doubles() -> None:
    for high in (1e308, 1.7e308):
        body = engine.Polyhedron(block([-high] * 3, [high] * 3), CUBE)
        assert engine.centroid(body).tolist() == [0.0] * 3
        assert engine.overlap_volume(body, engine.Aabb([0, 0, 0], [1, 2, 3])) == 6.0
        with pytest.raises(engine.NotRepresentableError):
            engine.volume(body)


def test_regions_and_normals_that_do_not_fit_are_refused_by_name() -> None:
    cube = engine.Polyhedron(block([0] * 3, [1] * 3), CUBE)
    with pytest.raises(engine.UnsupportedSolidError, match="a region of cut is not a sphere; give a half_space"):
        engine.cut(cube, engine.Sphere([0, 0, 0], 1))
    with pytest.raises(engine.InvalidInputError, match="normal goes with heights"):
        engine.section(cube, [engine.HalfSpace([0, 0, 1], -0.5)], normal=[1, 0, 0])


def test_a_plane_that_is_not_there_is_named() -> None:
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    body = engine.Polyhedron(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    for number in (1, -1):
        with pytest.raises(IndexError, match=f"there are 1 planes, got number {number}"):
            engine.section(body, [0.5]).polygons(number)
