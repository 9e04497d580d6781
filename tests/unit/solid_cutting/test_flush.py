"""Shells that lie on each other: boxes as cells of a lattice, counted; any order of faces, any way of cutting them."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np
import pytest

import engine
from engine.solid_cutting.cut_measures import volume_in_fractions
from tests.reference.cutting import nearest
from tests.unit.solid_cutting.bodies import CUBE, block, joined
from tests.unit.solid_cutting.test_cut import assert_closed

Box = tuple[tuple[int, ...], tuple[int, ...]]
_TILINGS: Any = [
    ([], [(0, 1, 2), (0, 2, 3)]),
    ([], [(0, 1, 3), (1, 2, 3)]),
    ([(1, 3)], [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]),
    ([(1, 1), (3, 2)], [(0, 1, 4), (1, 5, 4), (1, 2, 5), (2, 3, 5), (3, 4, 5), (3, 0, 4)]),
]
"""Of a square, corners 0 to 3, by points in it in quarters."""
_SHEAR = np.array([[2.0, -3.0, 5.0], [1.0, 4.0, -2.0], [-7.0, 1.0, 3.0]])


def faces_of(box: Box, draw: np.random.Generator) -> list[np.ndarray]:
    """Return the sides of a box as triangles, each side by one of the tilings."""
    low, high = np.array(box)
    made = []
    for axis, is_high in product(range(3), (False, True)):
        inner, rows = _TILINGS[draw.integers(len(_TILINGS))]
        corners = np.tile(high if is_high else low, (4 + len(inner), 1)).astype(float)
        places = np.array([(0, 0), (4, 0), (4, 4), (0, 4), *inner]) / 4
        for k in (1, 2):
            other = (axis + k) % 3
            corners[:, other] = low[other] + places[:, k - 1] * (high - low)[other]
        made += [corners[list(row if is_high else row[::-1])] for row in rows]
    return made


def body_of(boxes: list[Box], draw: np.random.Generator, shear: np.ndarray) -> engine.Polyhedron:
    """Return the boxes as shells of one polyhedron: turned either way, in any order."""
    parts = [faces_of(box, draw) for box in boxes]
    triangles = np.array([way for part, turn in zip(parts, draw.integers(2, size=len(parts)))
                          for way in (np.array(part)[:, ::-1] if turn else part)])  # fmt: skip
    vertices, numbers = np.unique(triangles.reshape(-1, 3) @ shear.T, axis=0, return_inverse=True)
    return engine.Polyhedron(vertices, draw.permutation(numbers.reshape(-1, 3)))


def cells_of(boxes: list[Box]) -> np.ndarray:
    """Return which cells of the lattice, from -1 on, an odd number of boxes holds."""
    cells = np.zeros((10, 10, 10), int)
    for low, high in boxes:
        cells[tuple(slice(a + 1, b + 1) for a, b in zip(low, high))] ^= 1
    return cells


def do_cross(boxes: list[Box]) -> bool:
    """Return whether a side of a box passes through one of another."""
    for one, other in combinations(boxes, 2):
        for (first, a), (second, b) in product(product(range(3), (0, 1)), repeat=2):
            third = 3 - first - second
            if first != second and other[0][first] < one[a][first] < other[1][first]:
                is_through = one[0][second] < other[b][second] < one[1][second]
                if is_through and max(one[0][third], other[0][third]) < min(one[1][third], other[1][third]):
                    return True
    return False


def boxes_of(draw: np.random.Generator, kind: int) -> list[Box]:
    if kind == 0:  # cells that share walls, edges and corners
        return [(cell, tuple(x + 1 for x in cell)) for cell in product(range(3), repeat=3) if draw.random() < 0.4]
    if kind == 1:  # within each other, flush with some walls
        low, high, boxes = np.zeros(3, int), draw.integers(3, 7, 3), []
        while (low < high).all() and len(boxes) < 4:
            boxes.append((tuple(low.tolist()), tuple(high.tolist())))
            low, high = low + draw.integers(0, 2, 3), high - draw.integers(0, 2, 3)
        return boxes
    corners = [np.sort(draw.integers(0, 4, (2, 3)), axis=0) for _ in range(4)]  # any: what crosses is refused
    return [(tuple(a.tolist()), tuple(b.tolist())) for a, b in corners if (a < b).all()] or [((0, 0, 0), (1, 1, 1))]


@pytest.mark.parametrize("seed", range(60))
def test_boxes_as_shells_are_their_cells(seed: int) -> None:
    draw = np.random.default_rng(seed)
    boxes = boxes_of(draw, seed % 3) or [((0, 0, 0), (1, 1, 1))]
    shear = _SHEAR if seed % 2 else np.eye(3)
    body, cells = body_of(boxes, draw, shear), cells_of(boxes)
    unit = abs(round(np.linalg.det(shear)))
    if do_cross(boxes):
        with pytest.raises(engine.InvalidInputError, match="pass through each other"):
            engine.volume(body)
        return
    assert engine.volume(body) == unit * cells.sum()
    if seed % 2 == 0:
        assert engine.area(body) == sum(np.abs(np.diff(cells, axis=axis)).sum() for axis in range(3))
    if cells.any():
        middle = [
            Fraction(int(2 * np.argwhere(cells)[:, k].sum() - cells.sum()), 2 * int(cells.sum())) for k in range(3)
        ]
        exact = [sum(Fraction(x) * y for x, y in zip(row, middle)) for row in shear.tolist()]
        assert engine.centroid(body).tolist() == [nearest(Fraction(x)) for x in exact]
    axis, height = int(draw.integers(3)), Fraction(int(draw.integers(0, 9)), 2)
    normal = np.round(np.linalg.inv(shear)[axis] * unit)
    half = engine.HalfSpace(normal, -float(height) * unit)
    shares = [[max(Fraction(0), min(Fraction(k), height) - k + 1) for k in range(10)]]
    shares.append([1 - share for share in shares[0]])
    for part, share in zip(engine.cut(body, half, keep="both")[::-1], shares, strict=True):
        volume = sum((x * int(cells.take(k, axis=axis).sum()) for k, x in enumerate(share)), Fraction(0))
        assert part.volume == nearest(unit * volume)
        assert bool(part) is (volume > 0)
        assert_cells_bound(part, cells, axis, share, seed % 2 == 0)
    upper: Any = engine.section(body, half)
    n_beyond = cells.take(int(height) + 1, axis=axis).sum()
    assert float(upper.areas.sum()) == pytest.approx(np.linalg.norm(normal) * n_beyond, rel=1e-14)


def assert_cells_bound(part: Any, cells: np.ndarray, axis: int, share: list[Fraction], is_straight: bool) -> None:
    """A part is closed by index and by position, no face lies on another, and its area is that of its cells."""
    if not part:
        assert (part.area, part.vertices.shape) == (0.0, (0, 3))
        return
    assert_closed(part.faces)
    _, at = np.unique(part.vertices, axis=0, return_inverse=True)
    assert_closed(at.reshape(-1)[part.faces])
    rows = np.sort(at.reshape(-1)[part.faces], axis=1)
    assert len(np.unique(rows, axis=0)) == len(rows)
    assert set(part.faces.ravel().tolist()) == set(range(len(part.vertices)))
    if is_straight:
        walls = [np.abs(np.diff(cells, axis=other)) for other in range(3) if other != axis]
        beside = sum(x * int(wall.take(k, axis=axis).sum()) for k, x in enumerate(share) for wall in walls)
        kept = [x > 0 for x in share] * np.moveaxis(cells, axis, -1)
        assert part.area == nearest(Fraction(beside + int(np.abs(np.diff(kept, axis=-1)).sum())))


def test_a_cavity_flush_with_walls_leaves_nothing_flat() -> None:
    ends = [((0, 0, 0), (1, 1, 2)), ((0, 0, 0), (1, 1, 1))]
    body = engine.Polyhedron(*joined([(block(*each), CUBE) for each in ends]))
    below, above = engine.cut(body, engine.HalfSpace([0, 0, -1.0], 0.5), keep="both")
    assert (bool(below), below.volume, below.area, below.faces.shape) == (False, 0.0, 0.0, (0, 3))
    assert (above.volume, above.area, engine.area(body)) == (1.0, 6.0, 6.0)
    assert set(above.origins.tolist()) <= set(range(24))
    assert "nothing is wrong" in repr(engine.inspect((above.vertices, above.faces)))
    twice = engine.Polyhedron(*joined([(block(*ends[0]), CUBE)] * 2))
    assert engine.volume(twice) == engine.area(twice) == 0.0
    assert not any(engine.cut(twice, engine.HalfSpace([0, 0, 1], -0.5), keep="both"))
    assert len(engine.section(twice, [0.5, 1.0]).areas) == 0  # type: ignore[union-attr]
    with pytest.raises(engine.EmptyGeometryError):
        engine.centroid(twice)


def test_crossings_of_edges_are_new_vertices_of_all_faces_that_meet_there() -> None:
    """The diagonals of a wall that two shells have in common cross where no double is."""
    corners = [np.array([(0, 0), (3, 0), (7, 5), (0, 4)]), np.array([(0, 0), (3, 0), (7, 5), (0, 4)])]
    walls = []
    for flat, low, high in zip(corners, (0.0, 0.0), (3.0, -2.0)):
        ring = [(*point, z) for z in (low, high) for point in flat.tolist()]
        walls.append(np.array(ring, float))
    bottom = [[(0, 1, 2), (0, 2, 3)], [(0, 1, 3), (1, 2, 3)]]
    top = [[(5, 4, 6), (6, 4, 7)], [(5, 4, 6), (6, 4, 7)]]
    sides = [row for a, b in pairwise([0, 1, 2, 3, 0]) for row in ((b, a, a + 4), (b, a + 4, b + 4))]
    parts = [(walls[k], np.array([*bottom[k], *top[k], *sides])) for k in range(2)]
    body = engine.Polyhedron(*joined(parts))
    assert engine.volume(body) == 5 * 21.5
    parted: Any = engine.cut(body, engine.HalfSpace([1.0, 0, 0], -1.0), keep="both")
    assert sum(volume_in_fractions(each._points, each._triangles) for each in parted) == Fraction(215, 2)
    for each in parted:
        assert_closed(each.faces)
        assert "nothing is wrong" in repr(engine.inspect((each.vertices, each.faces)))
    half = engine.Polyhedron(*joined([parts[0], (walls[0][[0, 1, 3, 4, 5, 7]], _PRISM)]))
    assert engine.volume(half) == 3 * (21.5 - 6)
    assert engine.area(half) == nearest_area(half)


_PRISM = np.array([(0, 1, 2), (3, 5, 4), (0, 3, 1), (1, 3, 4), (1, 4, 2), (2, 4, 5), (2, 5, 0), (0, 5, 3)])


def nearest_area(body: engine.Polyhedron) -> float:
    ring = [(3.0, 0.0), (7.0, 5.0), (0.0, 4.0)]
    prism = np.array([(*point, z) for z in (0.0, 3.0) for point in ring])
    return engine.area(engine.Polyhedron(prism, _PRISM))  # type: ignore[return-value]


def test_a_shell_may_touch_itself_along_a_line_within_its_faces() -> None:
    """A plate with a tent on it, upside down: an edge lies on a face, and a body beside it is cut there."""
    tent = np.array([(1, 0, 2), (3, 0, 2), (2, 0, 1), (1, 4, 2), (3, 4, 2), (2, 4, 1)], float)
    rows = np.array([(0, 1, 2), (5, 4, 3), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)])
    for faces in (rows, rows[:, ::-1]):
        body = engine.Polyhedron(*joined([(block([0, 0, 0], [4, 4, 1]), CUBE), (tent, faces)]))
        assert engine.volume(body) == 16 + 4
        assert engine.area(body) == nearest(Fraction(16 * 2 + 16 + 2 + 8)) + 2 * 4 * np.sqrt(2.0)
        lower, upper = engine.cut(body, engine.HalfSpace([0, 0, -1], 1), keep="both")
        assert (lower.volume, upper.volume) == (16.0, 4.0)


def test_faces_beside_one_that_an_edge_lies_across_are_cut_at_its_ends() -> None:
    """On a cube a wedge, of which one edge lies on a face, from one side of that to another, and nothing else."""
    wedge = np.array([(2, 0, 4), (4, 2, 4), (3, 1, 5), (2.5, 1.5, 6)])
    rows = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    body = engine.Polyhedron(*joined([(block([0] * 3, [4] * 3), CUBE), (wedge, rows)]))
    assert engine.volume(body) == nearest(64 + Fraction(1, 3))
    parts: Any = engine.cut(body, engine.HalfSpace([0, 0, 1], -1), keep="both")
    for part, volume in zip(parts, (48 + Fraction(1, 3), Fraction(16))):
        assert part.volume == nearest(volume)
        assert_closed(part.faces)


@pytest.mark.parametrize("scale", [1.0, 2.0**-664, 2.0**400])
def test_sides_with_points_on_them_are_filled_without_flat_triangles_at_any_scale(scale: float) -> None:
    """Boxes that share a part of a wall, whose corners lie on sides of the other's triangles."""
    faces = np.array([(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3),
                      (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)])  # fmt: skip
    boxes = [(block([0] * 3, [2] * 3), faces), (block([-1, 2, -1], [0, 3, 1]), faces)]
    vertices, rows = joined(boxes)
    vertices, numbers = np.unique(vertices, axis=0, return_inverse=True)
    body = engine.Polyhedron(vertices * scale, numbers.reshape(-1)[rows])
    assert (engine.centroid(body) / scale).tolist() == [0.7, 1.3, 0.8]  # type: ignore[operator]
    for height in (0.0, 1.0, 2.0):
        parts: Any = engine.cut(body, engine.HalfSpace([-1, 1, 1], -height * scale), keep="both")
        for part in parts:
            assert_closed(part.faces)
