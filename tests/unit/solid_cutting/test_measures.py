"""volume, area, centroid: shells of known nesting against rationals, scales, other solids, refusals."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

import engine
from engine.running.budget import Budget
from engine.solid_cutting.boundary import boundary
from engine.solids.convexity import star_side
from tests.reference.cutting import moment, nearest, points_of, signed_volume
from tests.unit.solid_cutting.bodies import CUBE, block, joined, star


def boxes_within(draw: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray, int]]:
    """Return blocks with low, high, depth: beside each other, and within each other, some flush with walls."""
    made, x = [], 0
    for _ in range(int(draw.integers(1, 4))):
        size = int(draw.integers(4, 12))
        low, high, depth = np.array([x, 0, 0]), np.array([x + size, *draw.integers(4, 12, 2)]), 0
        while True:
            made.append((low, high, depth))
            inner = low + 1, high - draw.integers(1, 3, 3)
            inner[0][draw.integers(3)] -= draw.integers(2)  # flush with one wall, or with none
            if (inner[1] - inner[0] < 2).any() or draw.random() < 0.3:
                break
            low, high, depth = *inner, depth + 1
        x += size + int(draw.integers(0, 2))
    return made


@pytest.mark.parametrize("seed", range(40))
def test_sums_of_shells(seed: int) -> None:
    draw = np.random.default_rng(seed)
    boxes = boxes_within(draw)
    parts = [(block(low, high), CUBE[:, ::-1] if draw.random() < 0.5 else CUBE) for low, high, _ in boxes]
    vertices, faces = joined(parts)
    vertices = vertices * 2.0 ** int(draw.integers(-300, 300)) if seed % 4 == 1 else vertices
    vertices = vertices + 1e14 if seed % 4 == 2 else vertices
    vertices = vertices / 7 + 1.0 / 3 if seed % 4 == 3 else vertices
    points = points_of(vertices)
    volume, moments = Fraction(0), [Fraction(0)] * 3
    for number, (_, _, depth) in enumerate(boxes):
        own = faces[12 * number : 12 * number + 12]
        sign = (-1) ** depth * (1 if signed_volume(points, own) > 0 else -1)
        volume += sign * signed_volume(points, own)
        moments = [total + sign * moment(points, own, axis) for axis, total in enumerate(moments)]
    order = draw.permutation(len(faces))
    body = engine.Polyhedron(vertices, faces[order])
    assert engine.volume(body) == nearest(volume)
    assert engine.centroid(body).tolist() == [nearest(total / volume) for total in moments]


def test_a_mesh_that_is_not_convex() -> None:
    vertices, faces = star(7)
    points = points_of(vertices)
    for turned in (faces, faces[:, ::-1]):
        assert engine.volume(engine.Polyhedron(vertices, turned)) == nearest(signed_volume(points, faces))
    assert engine.volume(engine.Polyhedron(vertices * 1e-120, faces)) == 0.0
    with pytest.raises(engine.NotRepresentableError):
        engine.volume(engine.Polyhedron(vertices * 1e140, faces))


def test_cubes_that_share_edges_corners_and_walls() -> None:
    """Vertices at one place are one: edges of four faces, and faces twice."""
    cells = [(0, 0, 0), (1, 1, 0), (2, 2, 1), (0, 1, 1), (1, 0, 0), (1, 2, 0), (0, 0, 1)]
    for count in range(1, len(cells) + 1):
        parts = [(block(np.array(cell), np.array(cell) + 1), CUBE) for cell in cells[:count]]
        assert engine.volume(engine.Polyhedron(*joined(parts))) == count
        turned = engine.Polyhedron(*joined([(corners, faces[:, ::-1]) for corners, faces in parts]))
        assert engine.volume(turned) == count


def test_stars_are_told_without_looking_for_crossings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two nested ones, and a star from whose middle a face is seen from behind, are looked at as any other."""
    vertices, faces = star(3)
    bodies = [engine.Polyhedron(vertices + 5.0, faces), engine.Polyhedron(vertices, faces[:, ::-1])]
    nested = engine.Polyhedron(*joined([(vertices, faces), (vertices / 4, faces)]))
    bent = engine.Polyhedron(np.where(np.arange(len(vertices))[:, None] == 8, -0.5 * vertices, vertices), faces)
    assert [star_side(each) for each in (*bodies, nested, bent)] == [-1, 1, 0, 0]
    assert engine.volume(nested) == nearest(signed_volume(points_of(vertices), faces) * Fraction(63, 64))
    found = [boundary(body, Budget(None)) for body in bodies]
    monkeypatch.setattr("engine.solid_cutting.boundary.star_side", lambda body: 0)
    for body, known in zip(bodies, found):
        copy = boundary(engine.Polyhedron(body.vertices, body.triangles), Budget(None))
        assert (copy.triangles == known.triangles).all()
        assert not known.touches
        assert not copy.touches


def test_shells_in_a_common_edge_do_not_depend_on_the_order_of_faces() -> None:
    """Two boxes that look the same way share an edge, the second and the third one a wall."""
    ends = [((0, 0, 0), (64, 64, 64)), ((0, 2, 0), (64, 64, 62)), ((0, 2, 0), (64, 63, 62))]
    vertices, faces = joined([(block(low, high), CUBE[:, :: (1, 1, -1)[k]]) for k, (low, high) in enumerate(ends)])
    sizes = [np.prod(np.subtract(high, low)) for low, high in ends]
    for seed in range(20):
        order = np.random.default_rng(seed).permutation(len(faces))
        assert engine.volume(engine.Polyhedron(vertices, faces[order])) == sizes[0] - sizes[1] + sizes[2]


def test_faces_that_cross_are_refused_by_name() -> None:
    parts = [(block(np.zeros(3), np.full(3, 2)), CUBE), (block(np.ones(3), np.full(3, 3)), CUBE)]
    body = engine.Polyhedron(*joined(parts))
    for ask in (engine.volume, engine.centroid, lambda solid: engine.cut(solid, engine.HalfSpace([0, 0, 1], 0))):
        with pytest.raises(engine.InvalidInputError, match=r"faces\[\d+\] and faces\[\d+\] meet"):
            ask(body)
    assert engine.area(body) == 48.0


def test_areas_are_sums_of_roots() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    body = engine.Polyhedron(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert engine.area(body) == nearest(Fraction(3, 2) + Fraction(math.isqrt(3 << 400), 1 << 201))
    assert engine.area(engine.Surface(corners * 1e100, [[1, 2, 3]])) == pytest.approx(
        math.sqrt(3) / 2 * 1e200, rel=1e-15
    )


def test_other_solids() -> None:
    ball = engine.Sphere([1, 2, 3], 2)
    assert engine.volume(ball) == 33.51032163829113
    assert engine.area(ball) == 50.26548245743669
    assert engine.area(engine.Sphere([0, 0], 3)) == 28.274333882308138
    assert engine.centroid(ball).tolist() == [1, 2, 3]
    simplex = engine.Convex([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [-1, -1, -1, 1], [-1, 0, 0, 5]])
    assert engine.volume(simplex) == 1 / 6
    assert engine.centroid(simplex).tolist() == [0.25] * 3
    assert engine.area(simplex) == engine.area(
        engine.Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    )
    bowtie = engine.Polygon([[[0, 0], [2, 2], [2, 0], [0, 2]]])
    assert engine.area(bowtie) == 2.0
    assert engine.centroid(bowtie).tolist() == [1.0, 1.0]
    assert (
        engine.volume(
            engine.Convex([[1, 0, 0, 0], [-1, 0, 0, 0], [0, 1, 0, 0], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, -1, 1]])
        )
        == 0
    )
    for solid in (engine.HalfSpace([1, 0, 0], 0), engine.Convex([[1, 0, 0, 0]])):
        with pytest.raises(engine.UnsupportedSolidError):
            engine.volume(solid)
    with pytest.raises(engine.WrongDimensionError):
        engine.volume(engine.Aabb([0, 0], [1, 1]))
    with pytest.raises(engine.EmptyGeometryError):
        engine.centroid(engine.Polygon([[[0, 0], [1, 1]]]))
