"""Segments that touch a boundary, settled without fractions, as these settle them."""

from __future__ import annotations

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from tests.reference.shapes import box, union_of
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


def _meshes() -> dict[str, Polyhedron]:
    """Meshes whose edges, corners and planes many segments run along: flush shells with T-vertices, coplanar faces of
    one shell, a plane that no axis shows, and a mesh 10^5 times longer than thick."""
    flush = union_of(box((0, 0, 0), (2, 2, 2)), box((2, 1, 1), (3, 3, 4)), box((0, 0, 2), (1, 1, 3)))
    grid = union_of(*(box((i, j, 0), (i + 1, j + 1, 1)) for i in range(2) for j in range(2)))
    ell = [[0, 0], [2, 0], [4, 0], [4, 2], [2, 2], [2, 4], [0, 4], [0, 2]]
    walls = [[i, (i + 1) % 8, 8 + (i + 1) % 8, 8 + i] for i in range(8)]
    faces = [[*range(7, -1, -1)], [*range(8, 16)], *walls]
    corners = np.array([[*p, z] for z in (0.0, 1.0) for p in ell])
    slanted = corners @ [[0.6, 0.8, 0.3], [-0.8, 0.6, 0.1], [0.1, -0.3, 1.0]]
    return {
        "flush": Polyhedron(flush["vertices"], flush["faces"]),
        "grid": Polyhedron(grid["vertices"], grid["faces"]),
        "ell": Polyhedron(corners, faces),
        "slanted": Polyhedron(slanted, faces),
        "long": Polyhedron(slanted * [1e5, 1.0, 1e-3], faces),
    }


@pytest.mark.parametrize("name", ["flush", "grid", "ell", "slanted", "long"])
def test_segments_along_a_mesh(name: str) -> None:
    """Its edges, parts of them and beyond them, segments in its planes and between its corners."""
    region, rng = _meshes()[name], np.random.default_rng(7)
    triangles = region.vertices[region.triangles]
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [2, 1]]])
    edges = sides[rng.permutation(len(sides))[:12]]
    way = edges[:, 1] - edges[:, 0]
    ends = [(0, 1), (-1, 2), (0.25, 0.75), (-1, 0.5), (1, 0)]
    along = [np.stack([edges[:, 0] + s * way, edges[:, 0] + t * way], axis=1) for s, t in ends]
    weights = rng.integers(-2, 4, (24, 2, 3)) / 2.0
    weights[:, :, 2] = 1.0 - weights[:, :, 0] - weights[:, :, 1]
    weights = weights[(weights[:, 0] != weights[:, 1]).any(axis=1)]
    inside = np.einsum("nkj,njd->nkd", weights, triangles[rng.integers(0, len(triangles), len(weights))])
    chords = region.vertices[rng.integers(0, len(region.vertices), (16, 2))]
    settled_by_signs(np.concatenate([*along, inside, chords[(chords[:, 0] != chords[:, 1]).any(axis=1)]]), region)
