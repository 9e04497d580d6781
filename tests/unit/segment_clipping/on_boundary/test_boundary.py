"""Segments on polygons and polyhedra, several pieces each, against the rational reference."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb
from tests.reference.shapes import box, union_of
from tests.unit.segment_clipping.scenes import (
    assert_exact,
    assert_same_uncompiled,
    check,
    families,
    random_segments,
    through,
)

FAMILIES = ["random", "lattice", "targets", "tiny", "long", "mixed", "denormal", "chords"]
COMB = [[-2, -1], [2, -1], [2, 2], [1, 2], [1, 0], [0, 0], [0, 2], [-1, 2], [-1, 0], [-2, 0]]
SQUARE = [[-2, -2], [2, -2], [2, 2], [-2, 2]]


def solid_of(json: dict[str, Any]) -> Polyhedron:
    return Polyhedron(json["vertices"], json["faces"])


def polygons() -> list[Solid]:
    return [
        Polygon([COMB]),
        Polygon([SQUARE, [[-1, -1], [-1, 1], [1, 1], [1, -1]]]),  # a hole
        Polygon([SQUARE, [[0, 0], [3, 0], [3, 3], [0, 3]]]),  # rings that cross
        Polygon([SQUARE, SQUARE, [[0, 0], [1, 0], [1, 1]]]),  # cancels, the walls stay
        Polygon([[[-1, -1], [1, 1], [1, -1], [-1, 1]]]),  # a bow
        Polygon([[[0, 0], [1, 1], [1, 1], [2, 0], [1, 1], [-1, -1]]]),  # spikes and repeated vertices
        Polygon([[[-1.3, -0.7], [1.1, -0.9], [0.2, 0.3], [1.7, 1.9], [-0.8, 1.2]]]),
    ]


def polyhedra() -> list[Solid]:
    cube = box((-1, -1, -1), (2, 2, 2))
    return [
        solid_of(cube),
        solid_of(union_of(cube, box((0, 0, 0), (1, 1, 1)))),  # a hole inside
        solid_of(union_of(cube, box((0, 0, 0), (3, 1, 1)))),  # crosses itself
        solid_of(union_of(cube, box((2, -1, -1), (3, 2, 2)))),  # two faces back to back
        solid_of(union_of(cube, cube)),  # cancels, the walls stay
        solid_of(union_of(box((-1, -1, 0), (1, 1, 0)))),  # flat
        Polyhedron([[-1, -1, -1], [1, 1, 1], [2, 2, 2], [0, 0, 0]], [[0, 1, 2], [2, 1, 0], [0, 1, 3], [3, 1, 0]]),
        Polyhedron(
            [[-1, -1, -1.1], [1.3, -1, -1], [0.1, 1.7, -1], [0.1, 0.2, -0.3], [0.2, 0.1, 1.9]],
            [[0, 1, 4], [1, 2, 4], [2, 0, 4], [1, 0, 3], [2, 1, 3], [0, 2, 3]],
        ),
        Polyhedron(
            list(itertools.product([-1.0, 1.0], repeat=3)),
            [[2, 6, 4, 0], [5, 7, 3, 1], [4, 5, 1, 0], [3, 7, 6, 2], [1, 3, 2, 0], [6, 7, 5, 4]],
        ),
    ]


REGIONS = {2: polygons, 3: polyhedra}


def vertices_of(region: Solid) -> Any:
    assert isinstance(region, (Polygon, Polyhedron))
    corners = region.vertices
    return np.concatenate([corners, (corners + np.roll(corners, 1, axis=0)) / 2])


@pytest.mark.some(8)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("family", FAMILIES)
def test_equals_the_reference(family: str, dimension: int, pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng([dimension, FAMILIES.index(family)])
    n = 400 if pytestconfig.getoption("--full") else 8
    for region in REGIONS[dimension]():
        check(families(rng, vertices_of(region), n)[family], region)


@pytest.mark.parametrize("dimension", [2, 3])
def test_convex_regions_agree_with_their_boundary(dimension: int) -> None:
    """A box as a box and as a polygon or polyhedron: two methods, one answer."""
    rng = np.random.default_rng(dimension)
    corners = np.array(list(itertools.product([-1.0, 2.0], repeat=dimension)))
    region: Solid = solid_of(box([-1] * 3, [2] * 3)) if dimension == 3 else Polygon([corners[[0, 2, 3, 1]]])
    segments = np.concatenate(list(families(rng, corners, 60).values()))
    by_boundary = clip_segments(segments, region)
    by_planes = clip_segments(segments, Aabb([-1] * dimension, [2] * dimension))
    for name in ("source", "start", "end", "t"):
        np.testing.assert_array_equal(getattr(by_boundary, name), getattr(by_planes, name))


@pytest.mark.parametrize("dimension", [2, 3])
def test_walls_at_the_end_of_the_doubles(dimension: int) -> None:
    """No coordinate lies beyond the walls, and no way to them has a length that a double holds."""
    most = np.finfo(np.float64).max
    rng = np.random.default_rng(dimension)
    places = np.array([-most, -most / 2, -1.0, 0.0, 5e-324, 1.0, most / 2, np.nextafter(most, 0), most])
    segments = places[rng.integers(0, len(places), (40, 2, dimension))]
    for low, high in itertools.product([-most, -1.0, 0.0], [most, np.nextafter(most, 0)]):
        corners = np.array(list(itertools.product([low, high], repeat=dimension)))
        check(segments, solid_of(box([low] * 3, [high] * 3)) if dimension == 3 else Polygon([corners[[0, 2, 3, 1]]]))


def test_pieces_by_hand() -> None:
    frame = Polygon([SQUARE, [[-1, -1], [-1, 1], [1, 1], [1, -1]]])
    cases: list[tuple[Any, list[tuple[float, float]], list[tuple[int, int]]]] = [
        ([[-4, 0], [4, 0]], [(0.25, 0.375), (0.625, 0.75)], [(3, 4), (6, 1)]),  # through the hole
        ([[-4, 1], [4, 1]], [(0.25, 0.75)], [(3, 1)]),  # along an edge of the hole
        ([[0, 0], [0.5, 0]], [], []),  # within the hole
        ([[0, 0], [1, 0]], [(1.0, 1.0)], [(6, -1)]),  # ends on the hole's edge
        ([[-4, 0], [0, 4]], [(0.5, 0.5)], [(2, 2)]),  # touches a corner
        ([[1, 0], [1, 0]], [(0.0, 1.0)], [(-1, -1)]),  # a point on an edge
    ]
    pieces = clip_segments(np.array([case[0] for case in cases], float), frame)
    for i, (_, t, faces) in enumerate(cases):
        mine = pieces.source == i
        assert [tuple(row) for row in pieces.t[mine]] == t, i
        assert [tuple(row) for row in pieces.faces[mine]] == faces, i


def test_polygonal_faces_are_reported_as_given() -> None:
    pieces = clip_segments([[[-2.0, 0.1, 0.2], [2.0, 0.1, 0.2]]], polyhedra()[-1])
    assert pieces.faces.tolist() == [[4, 5]]


def test_pieces_and_gaps_part_the_segment() -> None:
    rng = np.random.default_rng(1)
    for region in (*polygons(), *polyhedra()):
        segments = random_segments(rng, 50, region.dimension)
        pieces = clip_segments(segments, region)
        assert (np.diff(pieces.source) >= 0).all()
        same = np.diff(pieces.source) == 0
        assert (pieces.t[1:, 0][same] > pieces.t[:-1, 1][same]).all()
        assert (pieces.t[:, 0] <= pieces.t[:, 1]).all()


@pytest.mark.full
@pytest.mark.data
def test_menger_sponge(data: Path, pytestconfig: pytest.Config) -> None:
    mesh = np.load(data / "meshes" / "syn_menger2.npz")
    sponge = Polyhedron(mesh["vertices"], mesh["faces"])
    rng = np.random.default_rng(2)
    n = 200 if pytestconfig.getoption("--full") else 1
    low, high = sponge.vertices.min(axis=0), sponge.vertices.max(axis=0)
    free = rng.uniform(low - 1, high + 1, (n, 2, 3))
    lattice = rng.integers(low - 1, high + 2, (n, 2, 3)).astype(float)
    along = through(rng, sponge.vertices, n)
    segments = np.concatenate([free, lattice, along])
    assert_exact(clip_segments(segments, sponge), segments, sponge)


@pytest.mark.data
def test_large_meshes_agree_with_point_location(data: Path) -> None:
    from engine.containment.locate import locate

    mesh = np.load(data / "meshes" / "c3d_spot.npz")
    spot = Polyhedron(mesh["vertices"], mesh["faces"])
    rng = np.random.default_rng(3)
    low, high = spot.vertices.min(axis=0), spot.vertices.max(axis=0)
    segments = rng.uniform(low, high, (300, 2, 3))
    pieces = clip_segments(segments, spot)
    t = rng.uniform(0, 1, (300, 20))
    points = segments[:, None, 0] + t[..., None] * (segments[:, 1] - segments[:, 0])[:, None]
    inside = np.zeros(t.shape, bool)
    for source, (first, last) in zip(pieces.source, pieces.t):
        inside[source] |= (first <= t[source]) & (t[source] <= last)
    assert (inside.ravel() == (locate(points.reshape(-1, 3), spot) >= 0)).all()


def test_uncompiled_is_the_same() -> None:
    assert_same_uncompiled(__name__)


def uncompiled_sample() -> None:
    rng = np.random.default_rng(5)
    for region in (polygons()[1], polyhedra()[1]):
        for family in families(rng, vertices_of(region), 2).values():
            check(family, region)
