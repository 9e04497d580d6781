"""Meshes and rings of every awkward kind, as plain arrays about as large as a unit to eight."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.answers.draws import Array, Draw, around

Mesh = tuple[Array, Array]
Rings = list[Array]
QUADS = np.array([[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])
BOX = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def corners(low: Array, high: Array) -> Array:
    """Return the corners of a box; bit k of a corner's number says low or high on axis k."""
    bits = np.arange(1 << len(low))[:, None] >> np.arange(len(low)) & 1
    return np.where(bits == 1, high, low).astype(float)


def merged(meshes: list[Mesh]) -> Mesh:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    return np.concatenate([v for v, _ in meshes]), np.concatenate([f + s for (_, f), s in zip(meshes, starts)])


def box(draw: Draw, quads: bool = False) -> Mesh:
    low = draw.spots(1, 3)[0]
    size = draw.whole(1, 5, 3).astype(float) if draw.chance(0.5) else draw.uniform(0.1, 5.0, 3)
    return corners(low, low + size), QUADS if quads else BOX


def tetrahedron(draw: Draw) -> Mesh:
    return draw.spots(4, 3), TETRAHEDRON


def subdivided(mesh: Mesh) -> Mesh:
    """Return each triangle cut into four."""
    vertices, faces = mesh
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    keys, of_edge = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_inverse=True)
    middles = 0.5 * vertices[keys // len(vertices)] + 0.5 * vertices[keys % len(vertices)]
    (p, q, r), (x, y, z) = faces.T, (len(vertices) + of_edge.reshape(-1, 3)).T
    parts = [(p, x, z), (x, q, y), (z, y, r), (x, y, z)]
    return np.concatenate([vertices, middles]), np.concatenate([np.stack(part, axis=1) for part in parts])


def ball(draw: Draw, times: int, bumps: float = 0.0) -> Mesh:
    """Return a sphere of 8 * 4^times triangles, convex without bumps."""
    octahedron = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    mesh = octahedron, np.array([[a, b, c] if (a + b + c) % 2 == 0 else [a, c, b] for a in (0, 1) for b in (2, 3)
                                 for c in (4, 5)])  # fmt: skip
    for _ in range(times):
        mesh = subdivided(mesh)
    x, y, z = mesh[0].T
    radii = (1.0 + bumps * draw.unit(len(x))) * draw.pick([1.0, 2.0, 3.0]) / np.sqrt(x * x + y * y + z * z)
    return mesh[0] * radii[:, None] + draw.pick([0.0, 1.0, 1 / 3]), mesh[1]


def bumpy(draw: Draw) -> Mesh:
    return ball(draw, draw.one(1, 3), 0.2)


def smooth(draw: Draw) -> Mesh:
    return ball(draw, draw.one(0, 3))


def star_cone(draw: Draw) -> Mesh:
    """Return a double cone over a star polygon {n/2}: it crosses itself along lines."""
    n = draw.pick([5, 7, 13])
    k = np.arange(n)
    ring = np.concatenate([around(2 * k * (4.0 / n)) * 3.0, np.zeros((n, 1))], axis=1)
    faces = [np.stack([k, (k + 1) % n, 0 * k + n], 1), np.stack([(k + 1) % n, k, 0 * k + n + 1], 1)]
    return np.concatenate([ring, [[0, 0, 2.0], [0, 0, -2.0]]]), np.concatenate(faces)


def soup(draw: Draw) -> Mesh:
    return merged([tetrahedron(draw) for _ in range(draw.one(2, 8))])


def touching_boxes(draw: Draw) -> Mesh:
    """Return lattice boxes that share walls, edges, corners, all, or cross: non-manifold, walls that cancel."""
    lows = draw.whole(-3, 2, draw.one(2, 6), 3).astype(float)
    return merged([(corners(low, low + draw.whole(1, 3, 3)), BOX) for low in lows])


def needle(draw: Draw) -> Mesh:
    vertices, faces = draw.pick([box, tetrahedron, smooth])(draw)
    return vertices * draw.pick([(1.0, 2.0**-20, 2.0**-20), (1e-9, 3.0, 1e-7), (1.0, 1.0, 2.0**-40)]), faces


def frame(draw: Draw) -> Mesh:
    """Return a square ring with a hole that others may pass through."""
    square, thick = 2.0 * SQUARE - 1.0, draw.pick([0.25, 0.5, 0.3])
    flat = [(square * 3.0, -thick), (square * (3.0 - 2 * thick), -thick), (square * 3.0, thick)]
    flat.append((square * (3.0 - 2 * thick), thick))
    vertices = np.concatenate([np.concatenate([xy, np.full((4, 1), z)], axis=1) for xy, z in flat])
    sides = [
        (a + k, a + m, b + m, b + k)
        for k, m in zip(range(4), (1, 2, 3, 0))
        for a, b in ((0, 8), (8, 12), (12, 4), (4, 0))
    ]
    return vertices, np.array([face for p, q, r, s in sides for face in ((p, q, r), (p, r, s))])


def hollow(draw: Draw) -> Mesh:
    low, high = np.full(3, -4.0), np.full(3, 4.0)
    return merged([(corners(low, high), BOX), (corners(low + 1.0, high - draw.pick([1.0, 2.5])), BOX[:, ::-1])])


MESHES: tuple[Callable[[Draw], Mesh], ...] = (
    box, tetrahedron, bumpy, smooth, star_cone, soup, touching_boxes, needle, frame, hollow,
)  # fmt: skip


def star(draw: Draw, n: int, rough: float = 0.7) -> Array:
    """Return a ring around a place near the origin, its radii anywhere."""
    turns = np.sort(draw.unit(n)) * 4.0
    return around(turns) * (3.0 * (1.0 - rough * draw.unit(n, 1))) + draw.uniform(-1.0, 1.0, 2)


def coast(draw: Draw, n: int) -> Array:
    """Return a ring of n vertices, evenly around and only as rough as their spacing."""
    turns = (np.arange(n) + 0.8 * draw.unit(n)) * (4.0 / n)
    wave = np.floor(turns * 8.0) % 2.0
    return around(turns) * (2.0 + 0.3 * wave + draw.unit(n) * (6.0 / n))[:, None] + draw.pick([0.0, 0.5, 1 / 3])


def round_ring(draw: Draw) -> Array:
    """Return a convex ring, in either direction: on a circle, a lattice square or triangle."""
    ring = draw.pick([around(np.sort(draw.unit(draw.one(3, 12))) * 4.0), SQUARE, draw.spots(3, 2)])
    return (ring * draw.pick([1.0, 2.0, 3.0]) + draw.whole(-2, 1, 2))[:: draw.pick([1, -1])]


def comb(draw: Draw) -> Array:
    teeth = draw.one(2, 9)
    x = np.arange(2.0 * teeth)
    ring = np.concatenate([np.stack([x, (x % 2) * 2 * teeth], axis=1), [[2 * teeth, -1.0], [-1.0, -1.0]]])
    return (ring if draw.chance(0.5) else ring[:, ::-1]) * (4.0 / teeth) - 4.0


def needle_ring(draw: Draw) -> Array:
    a, b = draw.spots(2, 2)
    return np.concatenate([[a, b], draw.nudged(np.array([b, a]), 3)])


def spiked(draw: Draw) -> Array:
    """Return a ring with a spike and repeated vertices."""
    ring = draw.spots(5, 2)
    return np.concatenate([ring[:2], draw.spots(1, 2), ring[1:], ring[-1:]])


def squares(draw: Draw, side: int, size: float) -> Rings:
    """Return a square full of square holes, side * side of them."""
    cells = [np.array([i, j]) * (8.0 / side) - 4.0 for i in range(side) for j in range(side)]
    return [SQUARE * 8.0 - 4.0, *(SQUARE * (8.0 / side * size) + cell for cell in cells)]


def large_coast(draw: Draw) -> Rings:
    return [coast(draw, draw.pick([1200, 2600]))]


def many_holes(draw: Draw) -> Rings:
    return squares(draw, draw.pick([12, 17]), draw.pick([0.5, 1.0]))


RINGS: tuple[Callable[[Draw], Rings], ...] = (
    lambda draw: [star(draw, draw.one(3, 24))],
    lambda draw: [star(draw, 9), star(draw, 5) * 0.25],
    lambda draw: [draw.spots(draw.one(3, 11), 2)],
    lambda draw: [draw.spots(draw.one(3, 7), 2) for _ in range(3)],
    lambda draw: [round_ring(draw)],
    lambda draw: [round_ring(draw), round_ring(draw)],
    lambda draw: [comb(draw)],
    lambda draw: [needle_ring(draw), needle_ring(draw)],
    lambda draw: [spiked(draw), SQUARE * 4.0, SQUARE[::-1] * 2.0],
    lambda draw: squares(draw, draw.one(1, 4), draw.pick([0.5, 1.0, 0.9])),
    lambda draw: [coast(draw, draw.one(40, 160))],
)  # fmt: skip
