"""Segments that touch a boundary, settled without fractions, as these settle them."""

from __future__ import annotations

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from tests.unit.segment_clipping.scenes import Floats, assert_exact

OCTAHEDRON = [(0.7, 0, 0), (-0.7, 0, 0), (0, 0.7, 0), (0, -0.7, 0), (0, 0, 0.7), (0, 0, -0.7)]
EIGHT = [[x, y, z][:: (-1) ** ((x % 2) + (y % 2) + (z % 2))] for x in (0, 1) for y in (2, 3) for z in (4, 5)]


def zigzag(n: int) -> Polygon:
    return Polygon([[*([i, (i % 2) * 1000] for i in range(n)), [n, -1], [0, -1]]])


def settled_by_signs(segments: Floats, region: Solid) -> None:
    """Assert that the answer is the reference's, and that the kernels gave it."""
    segments = np.array(segments, np.float64)
    pieces, accuracy = clip_segments(segments, region, report=True)
    assert accuracy.n_rational == 0
    assert_exact(pieces, segments, region)


def test_coordinates_that_are_midpoints_of_doubles() -> None:
    """Crossings at i + y / 1000 where 1000 divides y in units of half a last place: ties go to even."""
    for y in (24.2, 7.3, 24.25, 999.9):
        settled_by_signs([[[-1, y], [21, y]], [[21, y], [-1, y]]], zigzag(20))


def test_coordinates_that_are_zero() -> None:
    """Products that cancel exactly, on planes that no double-double holds."""
    region = Polyhedron(OCTAHEDRON, EIGHT)
    settled_by_signs([[[-1, -0.1, 0.3], [1, 0.1, -0.3]], [[-0.9, 0.3, -0.3], [0.9, -0.3, 0.3]]], region)


@pytest.mark.parametrize("region", [zigzag(8), Polygon([[[0, 0], [0.3, 0], [0.3, 0.3], [0, 0.3]]])])
def test_edges_of_the_plane(region: Polygon) -> None:
    """From corner to corner, along edges, from beyond them, and to the middle of others."""
    corners = region.vertices
    others = np.concatenate([corners, (corners + np.roll(corners, 1, axis=0)) / 2, corners * 1.5])
    settled_by_signs([[a, b] for a in corners for b in others if (a != b).any()], region)


def test_corners_and_sides_of_meshes() -> None:
    """Through corners and sides, along none of the faces, ending there and going on."""
    corners = np.array(OCTAHEDRON) / 0.7
    sides = (corners[:, None] + corners[None]).reshape(-1, 3) / 2
    ways = np.array([(0.25, 0.125, 0.75), (-0.125, 0.875, 0.25)])
    ends = [[a - s * way, a + t * way] for a in [*corners, *sides] for way in ways for s, t in [(0, 1), (1, 0), (1, 2)]]
    settled_by_signs(ends, Polyhedron(corners, EIGHT))


def test_chords_of_meshes() -> None:
    """Both ends on the boundary, which is met in its corners on the way, or not at all."""
    corners = np.array(OCTAHEDRON) / 0.7
    on_faces = np.array([(x, y, z) for x in (0.25, -0.25) for y in (0.25, -0.25) for z in (0.5, -0.5)])
    chords = [[a, b] for a in on_faces for b in on_faces if (np.sign(a) != np.sign(b)).any()]
    chords += [[a, -a] for a in corners] + [[a, b] for a in on_faces for b in corners if (a @ b) < 0]
    assert len(chords) > 20
    settled_by_signs(chords, Polyhedron(corners, EIGHT))
