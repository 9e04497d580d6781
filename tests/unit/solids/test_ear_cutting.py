"""Polygonal faces: the rule against a plain second implementation, refusals, extremes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import engine
from engine.running.budget import Budget
from engine.solids.ear_cutting import UNSURE, cut_faces, cut_ring
from tests.reference.exact import vector
from tests.reference.solids import cut_face

QUAD = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]


def cut(points: object) -> list[tuple[int, int, int]]:
    """Cut one face through the public way and return its triangles as they are stored."""
    array = np.asarray(points, np.float64)
    surface = engine.Surface(array, [list(range(len(array)))])
    assert surface.triangle_faces.tolist() == [0] * (len(array) - 2)
    return [tuple(row) for row in surface.triangles.tolist()]


def rotated_to_first(triangles: list[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    """Return each triangle from its smallest index on, orientation preserved."""
    turned = []
    for triangle in triangles:
        start = triangle.index(min(triangle))
        turned.append((*triangle[start:], *triangle[:start]))
    return turned  # type: ignore[return-value]


def star(n: int, seed: int, lift: float) -> np.ndarray:
    """Return a star-shaped ring around the z axis, tilted, its vertices `lift` off their plane."""
    rng = np.random.default_rng(seed)
    angles, radii = 2.0 * np.pi * np.arange(n) / n, rng.uniform(0.2, 1.0, n)
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles), lift * rng.normal(size=n)], axis=1)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.roll(ring @ rotation, int(rng.integers(n)), axis=0)


def test_a_convex_face_becomes_a_fan_about_its_last_vertex() -> None:
    assert cut(QUAD) == [(3, 0, 1), (3, 1, 2)]
    hexagon = [[math.cos(a), math.sin(a), 0.0] for a in np.arange(6) * math.pi / 3]
    assert cut(hexagon) == [(5, 0, 1), (5, 1, 2), (5, 2, 3), (5, 3, 4)]
    assert cut(hexagon[::-1]) == [(5, 0, 1), (5, 1, 2), (5, 2, 3), (5, 3, 4)]


@pytest.mark.parametrize("n", [4, 5, 6, 9, 20])
@pytest.mark.parametrize("lift", [0.0, 0.01])
def test_agrees_with_the_plain_rule(n: int, lift: float) -> None:
    for seed in range(12):
        ring = star(n, seed, lift)
        expected = cut_face([vector(point) for point in ring], list(range(n)))
        assert rotated_to_first(cut(ring)) == rotated_to_first(expected)


@pytest.mark.parametrize("exponent", [-1070, -600, 600, 1020])
def test_scale_does_not_matter(exponent: int) -> None:
    ring = np.round(star(9, 3, 0.1) * 16.0)  # whole numbers: scaling is exact even down to denormals
    assert cut(np.ldexp(ring, exponent)) == cut(ring)
    assert cut(np.ldexp(np.array(QUAD), exponent)) == cut(QUAD)


def test_vertices_on_straight_sides_are_kept() -> None:
    ring = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0], [0, 2, 0], [0, 1, 0]]
    for shift in range(8):
        turned = ring[shift:] + ring[:shift]
        triangles = cut(turned)
        area = 0
        for a, b, c in triangles:
            (ax, ay, _), (bx, by, _), (cx, cy, _) = turned[a], turned[b], turned[c]
            twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            assert twice > 0
            area += twice
        assert area == 8
        assert {index for triangle in triangles for index in triangle} == set(range(8))
        expected = cut_face([vector(point) for point in turned], list(range(8)))
        assert rotated_to_first(triangles) == rotated_to_first(expected)


def test_a_tie_of_areas_takes_the_first_axis() -> None:
    # not plane: along x the corner at vertex 0 is reflex, along y it is convex; the areas are equal
    ring = np.array([[2.0, 2.0, 1.0], [0.0, 0.0, 0.0], [4.0, 4.0, 1.0], [0.0, 0.0, 4.0]])
    expected = cut_face([vector(point) for point in ring], [0, 1, 2, 3])
    assert rotated_to_first(cut(ring)) == rotated_to_first(expected)
    for seed in range(60):
        ring = np.random.default_rng(seed).integers(-2, 3, (5, 3)).astype(float)
        try:
            expected = cut_face([vector(point) for point in ring], list(range(5)))
            found = cut(ring)
        except (ValueError, engine.FaceNotSimpleError):
            continue
        assert rotated_to_first(found) == rotated_to_first(expected)


def test_the_certificate_for_many_faces_changes_nothing() -> None:
    rings = [star(6, seed, 0.05) for seed in range(30)] + [np.array(QUAD) + i for i in range(5)]
    vertices = np.concatenate(rings)
    offsets = np.append(0, np.cumsum([len(ring) for ring in rings]))
    indices = np.arange(len(vertices))
    together, faces = cut_faces(vertices, offsets, indices, indices, Budget())
    one_by_one = []
    for i_ring, ring in enumerate(rings):
        ears = cut_ring(ring, UNSURE, i_ring, np.arange(len(ring)), Budget()).tolist()
        one_by_one += [[offsets[i_ring] + corner for corner in ear] for ear in ears]
    assert together.reshape(-1, 3).tolist() == one_by_one
    assert faces.tolist() == [i_ring for i_ring, ring in enumerate(rings) for _ in range(len(ring) - 2)]


def test_a_pentagram_is_not_taken_for_convex() -> None:
    order = [0, 2, 4, 1, 3]  # turns left at every corner, twice around
    ring = [[math.cos(2 * math.pi * i / 5), math.sin(2 * math.pi * i / 5), 0.0] for i in order]
    with pytest.raises(engine.FaceNotSimpleError, match="side 0-1 meets side 2-3"):
        cut(ring)


@pytest.mark.parametrize(
    ("ring", "words"),
    [
        ([[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 1, 0]], "side 4-5 meets side 6-7"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], "no area"),
        ([[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 0, 0], [0, 4, 0]], "meets side"),  # a vertex on a side
        ([[0, 0, 0], [4, 0, 0], [4, 4, 0], [4, 2, 0], [0, 2, 0]], "turns back on itself"),  # a spike
        ([[0, 0, 0], [4, 0, 0], [4, 0, 0], [4, 4, 0]], "stands still"),  # two indices, one position
        ([[0, 0, 0], [2, 0, 0], [4, 2, 0], [2, 0, 0], [2, 4, 0], [0, 4, 0]], "turns back|meets"),
    ],
)
def test_faces_that_are_not_simple_are_refused(ring: list[list[int]], words: str) -> None:
    with pytest.raises(engine.FaceNotSimpleError, match=words) as info:
        engine.Surface([*QUAD, *ring], [[0, 1, 2], list(range(4, 4 + len(ring)))])
    assert info.value.where == ("faces", 1)
    assert "faces[1]" in str(info.value)
    assert "cut it into triangles" in str(info.value)


def comb(n: int) -> np.ndarray:
    """Return a comb of n corners, its teeth pointing up."""
    x = np.arange(n - 2)[::-1]
    teeth = np.stack([x, np.where(x % 2 == 1, 1.0, 10.0), 0.0 * x], axis=1)
    return np.concatenate([[[0.0, 0.0, 0.0], [n - 3.0, 0.0, 0.0]], teeth])


def spiral(n: int) -> np.ndarray:
    """Return a band of n corners that winds twenty times."""
    t = np.linspace(1.0, 40.0 * np.pi, n // 2)
    inner, outer = (np.stack([r * np.cos(t), r * np.sin(t), 0.0 * t], axis=1) for r in (t, t + 2.0))
    return np.concatenate([inner, outer[::-1]])


def zigzag(n: int) -> np.ndarray:
    """Return a thin band of n corners that goes up and down."""
    x = np.arange(n // 2)
    low = np.stack([x, x % 2 * 100.0, 0.0 * x], axis=1)
    return np.concatenate([low, (low + np.array([0.0, 1.5, 0.0]))[::-1]])


@pytest.mark.parametrize("make", [comb, spiral, zigzag])
@pytest.mark.parametrize("shift", [0, 7])
def test_rings_that_wind_are_cut_by_the_plain_rule(make: Callable[[int], np.ndarray], shift: int) -> None:
    ring = np.roll(make(40), shift, axis=0)
    expected = cut_face([vector(point) for point in ring], list(range(40)))
    assert rotated_to_first(cut(ring)) == rotated_to_first(expected)


@pytest.mark.parametrize("make", [comb, spiral, zigzag, lambda n: 4096.0 * star(n, 4, 0.0)])
def test_faces_of_many_corners_are_cut(make: Callable[[int], np.ndarray]) -> None:
    n = 3000
    ring = np.round(make(n) * 64.0)  # whole numbers: areas are exact
    for points in (ring, ring[:, [2, 0, 1]], ring[::-1]):
        triangles = np.array(cut(points))
        edges = points[triangles[:, 1:]] - points[triangles[:, :1]]
        areas = np.cross(edges[:, 0], edges[:, 1])[:, np.argmax(np.abs(np.cross(edges[0, 0], edges[0, 1])))]
        whole = np.cross(points[1:-1] - points[0], points[2:] - points[0]).sum(axis=0)
        assert (areas > 0).all() or (areas < 0).all()
        assert abs(areas.sum()) == np.abs(whole).max()
        sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        counts = np.unique(sides, axis=0, return_counts=True)[1]
        assert np.bincount(counts).tolist() == [0, n, n - 3]  # sides once, diagonals twice


def test_coordinates_of_all_sizes_are_settled() -> None:
    far, near = 2.0**1000, 2.0**-1000
    ring = [[0, 0, 0], [far, 0, 0], [far, far, 0], [near, 2 * near, 0], [near, far, 0], [0, far, 0]]
    expected = cut_face([vector(point) for point in ring], list(range(6)))
    assert rotated_to_first(cut(ring)) == rotated_to_first(expected)


def test_a_side_that_many_others_part_is_found() -> None:
    ring = comb(3000)
    ring[1500] = [1498.0, -1e-9, 0.0]  # through the back of the comb
    with pytest.raises(engine.FaceNotSimpleError, match=r"side 0-1 meets side (1499-1500|1500-1501)"):
        cut(ring)


def test_a_constructor_ends_at_its_deadline() -> None:
    ring = star(2000, 1, 0.0)
    for kind in (engine.Surface, engine.Polyhedron):
        with pytest.raises(engine.DeadlineExceededError):
            kind(ring, [list(range(2000)), list(range(2000))[::-1]], deadline=0.0)
    cancel = engine.Cancel()
    cancel.set()
    with pytest.raises(engine.CancelledError):
        engine.Surface(ring, [list(range(2000))], cancel=cancel)


def test_a_box_of_quads_is_the_box_of_triangles() -> None:
    corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    box = engine.Polyhedron(corners, faces)
    assert box.n_faces == 6
    assert box.triangles.shape == (12, 3)
    assert box.triangle_faces.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    assert box.face_offsets.tolist() == [0, 4, 8, 12, 16, 20, 24]
    mixed = engine.Polyhedron(corners, [*faces[:5], [1, 5, 7], [7, 3, 1]])
    assert mixed.triangle_faces.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 6]
