"""overlap_volume and iou: convex polygons and bodies by kernels, each value the double nearest to the exact one."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import engine
from engine.collision.collide import posed
from engine.collision.exact_images import image_plane
from engine.running.budget import Budget
from engine.solid_cutting.exact_measures import exact_volume, mesh_of_half_spaces
from tests.reference.cutting import (
    convex_overlap,
    convex_overlap_of_space,
    cut_volume,
    nearest,
    points_of,
    ring_area,
    signed_volume,
)
from tests.unit.solid_cutting.bodies import CUBE, block, joined, star


def rectangles(draw: np.random.Generator, n: int, kind: int) -> np.ndarray:
    """Return rectangles (n, 4, 2): turned, on a lattice, thin, far away."""
    middle, angle, size = draw.uniform(0, 3, (n, 2)), draw.uniform(0, 2 * np.pi, n), draw.uniform(0.5, 3, (n, 2))
    if kind == 1:
        angle, middle, size = np.zeros(n), np.round(middle * 4) / 4, np.round(size * 2) / 2 + 0.5
    size[:, 1] *= 1e-7 if kind == 2 else 1
    middle = middle * 1e-9 + 5e5 if kind == 3 else middle
    u = np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, None]
    v = np.stack([-u[:, :, 1], u[:, :, 0]], axis=2)
    ways = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    corners = middle[:, None] + ways[:, :1] * size[:, None, :1] * u + ways[:, 1:] * size[:, None, 1:] * v
    return np.ascontiguousarray(corners[:, ::-1] if kind % 2 else corners)


def triangles(draw: np.random.Generator, n: int) -> np.ndarray:
    """Return triangles (n, 3, 2) of a small lattice, either way round, some flat."""
    return draw.integers(0, 4, (n, 3, 2)).astype(float)


def ratio(both: Fraction, first: Fraction, second: Fraction) -> float:
    union = first + second - both
    return nearest(both / union) if union else 0.0


@pytest.mark.parametrize("kind", range(8))
def test_arrays_of_convex_polygons(kind: int) -> None:
    draw = np.random.default_rng(kind)
    if kind < 4:
        first, second = rectangles(draw, 40, kind), rectangles(draw, 40, kind)
    elif kind == 4:  # the same, its corners turned on, and an ulp away
        first = rectangles(draw, 40, 0)
        second = np.where(draw.random((40, 1, 1)) < 0.5, np.roll(first, 1, axis=1), np.nextafter(first, -9))
    elif kind == 6:  # corners on sides
        first = rectangles(draw, 40, 0)
        second = (first + np.roll(first, 1, axis=1)) / 2
    elif kind == 7:  # on a lattice: corners on sides and on each other, sides on each other
        first, second = (triangles(draw, 40) for _ in range(2))
    else:  # a side in common
        first = rectangles(draw, 40, 0)
        second = np.concatenate([first[:, [1, 0]], draw.uniform(0, 3, (40, 1, 2))], axis=1)
    scale = 2.0 ** int(draw.integers(-60, 60))
    first, second = first * scale, second * scale
    areas: Any = engine.overlap_volume(first, second)
    ratios: Any = engine.iou(first, second)
    for row, (one, other) in enumerate(zip(first, second)):
        both, own = convex_overlap(one, other), [abs(ring_area(points_of(ring))) for ring in (one, other)]
        assert areas[row] == nearest(both)
        assert ratios[row] == ratio(both, *own)


def test_boxes_by_centre_size_and_angle() -> None:
    boxes = np.array([[1.0, 2.0, 4.0, 2.0, 0.0], [0.0, 0.0, 2.0, 2.0, 0.3]])
    corners = np.array([[[-1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [-1.0, 3.0]]])
    assert engine.iou(boxes[:1], corners).tolist() == [1.0]  # type: ignore[union-attr]
    turned: Any = engine.overlap_volume(boxes[1:], np.array([[[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]]))
    assert turned == pytest.approx([4.0], rel=1e-14)
    large = np.array([[0.0, 0.0, 2.0**1020, 2.0**-1000, 0.0]])
    assert engine.iou(large, large * [1, 1, 0.5, 1, 1]).tolist() == [0.5]  # type: ignore[union-attr]
    for wrong in ([0.0, 0.0, 1.0, 1.0, np.nan], [1.7e308, 0.0, 1.7e308, 1.0, 0.0]):
        with pytest.raises(engine.InvalidInputError):
            engine.iou(np.array([wrong]), boxes[:1])
    with pytest.raises(engine.UnsupportedPairError, match="as many"):
        engine.iou(boxes, boxes[:1])


def test_arrays_of_other_polygons_and_long_rings() -> None:
    """A pentagram, an arrow, 20 corners on a circle: not for the kernel."""
    turns = np.arange(5) * 4 * np.pi / 5
    pentagram = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    arrow = np.array([[0.0, -1.0], [2.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.25, -0.5]])
    pairs = np.stack([pentagram, arrow]), np.stack([arrow, arrow + 0.25])
    made: Any = engine.iou(*pairs)
    for value, one, other in zip(made, *pairs):
        polygons = [engine.Polygon([ring]) for ring in (one, other)]
        parts: list[Any] = [engine.overlay(*pair) for pair in (polygons, *([each, each] for each in polygons))]
        both, *own = (part.area_exact for part in parts)
        assert value == ratio(both, *own) == engine.iou(*polygons)
    angles = np.arange(20) * np.pi / 10
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    moved = circle + np.array([0.5, 0.125])
    both, own = convex_overlap(circle, moved), [ring_area(points_of(ring)) for ring in (circle, moved)]
    assert engine.iou(circle[None], moved[None]).tolist() == [ratio(both, *own)]  # type: ignore[union-attr]


def bodies(draw: np.random.Generator) -> Any:
    kind, middle, size = draw.integers(4), draw.uniform(-0.5, 0.5, 3), draw.uniform(0.2, 1.5, 3)
    if kind == 0:
        return engine.Aabb(middle - size, middle + size)
    if kind == 1:  # on a lattice
        middle, size = draw.integers(-2, 3, 3) / 2, draw.integers(1, 4, 3) / 2
        return engine.Aabb(middle - size, middle + size)
    if kind == 2:
        return engine.Polyhedron(block(middle - size, middle + size), CUBE[:, ::-1] if draw.random() < 0.5 else CUBE)
    rows = draw.normal(size=(8, 3))
    return engine.Convex(np.concatenate([np.c_[rows, draw.uniform(0.3, 1.2, 8)], engine.Aabb([-1] * 3, [1] * 3).rows]))


def poses(draw: np.random.Generator) -> Any:
    kind, move, angle = draw.integers(4), draw.integers(-2, 3, 3) / 2, draw.uniform(0, 6)
    flat = [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    turn = engine.Pose.from_quaternion(draw.normal(size=4), draw.uniform(-0.5, 0.5, 3))
    return [None, engine.Pose(np.eye(3), move), engine.Pose(flat, [0.25, 0.5, 0.0]), turn][kind]


def exact(first: Any, second: Any, moves: tuple[Any, Any]) -> list[Fraction]:
    """Return what two convex bodies have in common, and each alone, by double description."""
    rows = [
        [[*normal, offset] for row in rows_of(body) for normal, offset in [moved(row, posed(move, body, "pose"))]]
        for body, move in zip((first, second), moves)
    ]
    meshes = [mesh_of_half_spaces(some, Budget()) for some in (rows[0] + rows[1], *rows)]
    return [Fraction(0) if mesh is None else exact_volume(mesh) for mesh in meshes]


def moved(row: Any, pose: Any) -> Any:
    *normal, offset = map(Fraction, row)
    return image_plane((tuple(normal), offset), pose)


def rows_of(body: Any) -> Any:
    if isinstance(body, engine.Polyhedron):
        return engine.Aabb(body.vertices.min(axis=0), body.vertices.max(axis=0)).rows.tolist()
    return (body.rows if isinstance(body, engine.Aabb) else body.planes).tolist()


@pytest.mark.parametrize("seed", range(12))
def test_convex_bodies_under_poses(seed: int) -> None:
    draw = np.random.default_rng(seed)
    moves = poses(draw), poses(draw)
    first, second = ([bodies(draw) for _ in range(8)] for _ in range(2))
    second[0] = first[0]
    limits: Any = {"first_pose": moves[0], "second_pose": moves[1]}
    volumes: Any = engine.overlap_volume(first, second, **limits)
    ratios: Any = engine.iou(first, second, **limits)
    for row, pair in enumerate(zip(first, second)):
        both, *own = exact(*pair, moves)
        assert volumes[row] == nearest(both)
        assert ratios[row] == ratio(both, *own)
    assert engine.iou(first[1], second[1], **limits) == ratios[1]


@pytest.mark.parametrize("ask", [engine.overlap_volume, engine.iou])
def test_each_pair_has_poses_of_its_own(ask: Any) -> None:
    """Also where kernels leave a pair open: flat boxes, and a mesh that is not convex."""
    draw = np.random.default_rng(5)
    first, second = ([*(bodies(draw) for _ in range(6)), box] for box in (engine.Polyhedron(*star(2)), bodies(draw)))
    first[3] = engine.Aabb([-1, -1, 0], [1, 1, 0])
    turns, moves = ([poses(draw) for _ in range(7)] for _ in range(2))
    turns[2] = moves[4] = None
    alone = [
        ask(one, other, first_pose=turn, second_pose=move)
        for one, other, turn, move in zip(first, second, turns, moves)
    ]
    assert ask(first, second, first_pose=turns, second_pose=moves).tolist() == alone
    shared = [ask(first[0], second[0], first_pose=turns[0], second_pose=move) for move in moves]
    assert ask(first[0], second[0], first_pose=turns[0], second_pose=moves).tolist() == shared
    many = engine.Poses([move for move in moves if move is not None])
    assert ask(first[0], second[0], second_pose=many).tolist() == [
        ask(first[0], second[0], second_pose=move) for move in many
    ]
    assert ask([], [], first_pose=[]).tolist() == ask(first[0], second[0], second_pose=[]).tolist() == []
    with pytest.raises(engine.InvalidArrayError, match="second_pose has 6 poses for 7 pairs"):
        ask(first, second, second_pose=moves[:6])


def test_a_small_overlap_and_bodies_apart_by_edges_alone() -> None:
    """Corner in corner by 2^-20; and two rods that no face parts, but a plane through an edge of each."""
    unit, tiny = engine.Aabb([0, 0, 0], [1, 1, 1]), 2.0**-20
    corner = engine.Pose(np.eye(3), [1 - tiny, 1 - tiny, 1 - tiny])
    small: Any = engine.overlap_volume([unit, unit], [unit, unit], second_pose=corner)
    assert small.tolist() == [tiny**3] * 2
    rod = engine.Aabb([-4, -0.25, -0.25], [4, 0.25, 0.25])
    ways = [engine.Pose.from_quaternion(some, [0, 0, 0]) for some in ([1, 0.4, 0, 0], [1, 0, 0.4, 1])]
    for height in (0.6, 0.65, 0.68, 0.7):
        apart = engine.Pose(ways[1].rotation, [0.0, 0.05, height])
        both, *_ = exact(rod, rod, (ways[0], apart))
        assert engine.overlap_volume(rod, rod, first_pose=ways[0], second_pose=apart) == nearest(both)


@pytest.mark.parametrize("height", [0.3, -0.5])
def test_the_ratio_of_a_mesh_is_the_nearest_double(height: float) -> None:
    vertices, faces = star(3)
    points = points_of(vertices)
    both, _ = cut_volume(points, faces, [0, 0, -1, height])
    box = engine.Aabb([-9, -9, -9], [9, 9, height])
    own = signed_volume(points, faces), Fraction(18 * 18) * (Fraction(height) + 9)
    assert engine.iou(engine.Polyhedron(vertices, faces), box) == ratio(both, *own)


def test_heights_in_any_order_are_as_planes_one_by_one() -> None:
    """Through vertices, beside them, twice; a star, nested cubes, and cubes that share an edge, one inside out."""
    cubes = joined([(block([0] * 3, [9] * 3), CUBE), (block([1] * 3, [4] * 3), CUBE), (block([5] * 3, [8] * 3), CUBE)])
    edges = joined([(block([0] * 3, [2] * 3), CUBE), (block([2, 2, 0], [4, 4, 2]), CUBE[:, ::-1])])
    for vertices, faces in (star(5), cubes, edges):
        body = engine.Polyhedron(vertices, faces)
        draw = np.random.default_rng(1)
        for normal in ([0.0, 0.0, 1.0], [0.5, -1.0, 0.25]):
            levels = np.unique(vertices @ normal)
            heights = np.concatenate([levels[:6], draw.uniform(levels[0], levels[-1], 4), levels[:2]])
            draw.shuffle(heights)
            made: Any = engine.section(body, heights, normal=normal)
            alone: Any = [engine.section(body, [engine.HalfSpace(normal, -height)]) for height in heights.tolist()]
            assert made.areas.tolist() == [area for each in alone for area in each.areas.tolist()]
            assert made.vertices.tolist() == [place for each in alone for place in each.vertices.tolist()]
            assert np.diff(made.plane_offsets).tolist() == [len(each.areas) for each in alone]


def test_edges_in_common_whose_product_underflows() -> None:
    first = np.array([[[0.0, 1.0], [0.0, 0.0], [1e-170, 0.0], [1e-170, 1.0]]])
    second = first * [1.0, 2.0]
    assert engine.overlap_volume(first, second).tolist() == [1e-170]  # type: ignore[union-attr]
    assert engine.iou(first, second).tolist() == [0.5]  # type: ignore[union-attr]


def test_ratios_whose_bounds_are_wider_than_the_areas() -> None:
    """Needles an ulp apart."""
    x = np.array([-0.47560801199137287, -0.992304348800618, -0.9960269889680463, -0.8355143332074377])
    y = np.array([8.796573304017959e-17, 1.2382277396093705e-17, 8.905187952675274e-18, -5.494686515215683e-17])
    first = np.stack([x, y], axis=1)[None]
    x[0], y[1:] = np.nextafter(x[0], -9.0), np.nextafter(y[1:], [-9.0, 9.0, -9.0])
    second = np.stack([x, y], axis=1)[None]
    both, own = convex_overlap(first[0], second[0]), [ring_area(points_of(ring[0])) for ring in (first, second)]
    assert engine.iou(first, second).tolist() == [ratio(both, *map(abs, own))]  # type: ignore[union-attr]


@pytest.mark.parametrize("far", [2.0**200, 1e308])
def test_ratios_of_polygons_that_no_power_of_two_scales_exactly(far: float) -> None:
    """An L of a thin long bar and a thin high one, and a box on the high one."""
    thin, low, high = 1e-300, 1e-180 if far < 1e300 else 1e-300, 1e180 if far < 1e300 else 1e308
    bar = [(0, 0), (far, 0), (far, low), (thin, low), (thin, high), (0, high)]
    box = [(0, -high), (thin, -high), (thin, high), (0, high)]
    w, h, f, g = (Fraction(x) for x in (thin, high, far, low))
    expected = nearest(w * h / (2 * w * h + f * g - w * g))
    assert engine.iou(np.array([bar]), np.array([box])).tolist() == [expected]  # type: ignore[union-attr]
    assert engine.iou(engine.Polygon([bar]), engine.Polygon([box])) == expected


def test_a_solid_that_was_in_a_scene_is_overlapped() -> None:
    """What a collision keeps with a solid is not what an overlap keeps with it."""
    corners = [[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
    faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    cubes = [engine.Polyhedron(corners, faces) for _ in range(2)]
    engine.collide_scene(cubes)
    assert engine.overlap_volume(cubes[0], cubes[1]) == 1.0
    engine.collide(cubes[0], cubes[1])
    assert engine.iou(cubes[0], cubes[1]) == 1.0


def _outward(places: list[np.ndarray], faces: np.ndarray) -> Any:
    """Return meshes for the reference, each with its faces outwards."""
    points = [points_of(vertices) for vertices in places]
    return [(each, faces if signed_volume(each, faces) > 0 else faces[:, ::-1]) for each in points]


def test_bounds_of_bodies_far_below_one_do_not_underflow() -> None:
    """Tetrahedra of 1e-60, an ulp apart: their ratio is close to the middle of two doubles."""
    v = [[8.845028912493791e-61, -5.499615686538552e-63, -1.6838143968410575e-60],
         [8.436627082696915e-61, 4.162484797134742e-61, 8.734155452519467e-61],
         [-3.366274663766816e-61, 8.281565184266096e-61, -1.0610649200016748e-60],
         [5.6999981086545936e-61, -4.903803096280569e-61, 6.743517049201465e-61]]  # fmt: skip
    ulps = [[-1, -1, -1], [1, 1, 1], [-1, 1, 1], [-1, -1, -1]]
    vertices = np.array(v)
    moved = np.nextafter(vertices, np.array(ulps, float))
    rows = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    meshes = _outward([vertices, moved], rows)
    expected = ratio(convex_overlap_of_space(*meshes), *(signed_volume(*mesh) for mesh in meshes))
    first, second = (engine.Polyhedron(each, rows) for each in (vertices, moved))
    assert engine.iou(first, second) == expected


def test_polyhedra_thinner_than_doubles_lie_are_convex_all_the_same() -> None:
    """A tetrahedron whose mean corner rounds out of it; a flat one; only what is not convex is refused."""
    vertices = np.array([[0.19999999999999998, 0.26666666666666666, 0.3333333333333333],
                         [-0.0666666666666667, 0.4666666666666666, 0.0],
                         [0.19999999999999998, 0.26666666666666666, 0.6666666666666666],
                         [-0.3333333333333333, 0.6666666666666666, 0.6666666666666666]])  # fmt: skip
    rows = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    thin, flat = engine.Polyhedron(vertices, rows), engine.Polyhedron(vertices * [1.0, 1.0, 0.0], rows)
    other = engine.Polyhedron(vertices * 2.0 - vertices[0], rows)
    meshes = _outward([thin.vertices, other.vertices], rows)
    both, own = convex_overlap_of_space(*meshes), [signed_volume(*mesh) for mesh in meshes]
    assert engine.overlap_volume(thin, other) == nearest(both)
    assert engine.iou(other, thin) == ratio(both, *own)
    assert (engine.overlap_volume(thin, thin), engine.iou(thin, thin)) == (nearest(own[0]), 1.0)
    hollow = engine.Polyhedron(*joined([(block([-2] * 3, [2] * 3), CUBE), (block([-1] * 3, [1] * 3), CUBE)]))
    assert engine.overlap_volume(hollow, thin) == 0.0
    for pair in ((flat, thin), (hollow, flat), (flat, flat)):
        assert engine.overlap_volume(*pair) == engine.iou(*pair) == 0.0
    with pytest.raises(engine.UnsupportedPairError, match="cut one of them into convex parts"):
        engine.overlap_volume(hollow, hollow)
