"""Hard points by family, seeded: what rounding, ties and degenerate faces could get wrong in a polyhedron.

``python -m tests.hard.points`` writes cases/locate/points.npz: generated solids, some points of every family, and the
exact answers by tests/reference/many_points.py.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tests.reference.many_points import locate_points

Array = np.ndarray[Any, Any]
STORED = Path(__file__).resolve().parent / "cases" / "locate" / "points.npz"
TINY = (0.0, 5e-324, -5e-324, 1e-320, -1e-310, 2.0**-1022, -(2.0**-1040))


def generator(*words: str) -> np.random.Generator:
    """Return the random numbers that belong to some names."""
    return np.random.default_rng([zlib.crc32(word.encode()) for word in words])


def moved_by_ulps(points: Array, random: np.random.Generator) -> Array:
    """Return the points, each moved by up to 4 ulp along each axis."""
    moved = points.copy()
    steps = random.choice([-4, -3, -2, -1, 0, 0, 0, 1, 2, 3, 4], points.shape)
    for turn in range(1, 5):
        moved = np.where(np.abs(steps) >= turn, np.nextafter(moved, np.where(steps > 0, np.inf, -np.inf)), moved)
    return moved


def _on_faces(vertices: Array, faces: Array, n: int, random: np.random.Generator) -> Array:
    weights = random.integers(1, 8, (n, 3)).astype(float)
    weights /= weights.sum(axis=1, keepdims=True)
    return (vertices[faces[random.integers(0, len(faces), n)]] * weights[:, :, None]).sum(axis=1)


def _on_edges(vertices: Array, faces: Array, n: int, random: np.random.Generator) -> Array:
    face, corner = faces[random.integers(0, len(faces), n)], random.integers(0, 3, n)
    a, b = vertices[face[np.arange(n), corner]], vertices[face[np.arange(n), (corner + 1) % 3]]
    part = random.integers(1, 8, (n, 1)) / 8.0
    return a * (1.0 - part) + b * part


def _on_vertices(vertices: Array, faces: Array, n: int, random: np.random.Generator) -> Array:
    return vertices[faces.ravel()[random.integers(0, faces.size, n)]]


def _along_axes(on: Callable[..., Array]) -> Callable[..., Array]:
    """Return points whose rays along an axis meet what `on` draws."""

    def draw(vertices: Array, faces: Array, n: int, random: np.random.Generator) -> Array:
        points, axis = on(vertices, faces, n, random), random.integers(0, 3, n)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        far = random.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), points.shape)
        other = _on_vertices(vertices, faces, n, random)  # at the height of a vertex: through faces edge-on
        height = np.where(random.random((n, 1)) < 0.5, far, other)
        points[np.arange(n), axis] = height[np.arange(n), axis]
        return points

    return draw


def _lattice(vertices: Array, faces: Array, n: int, random: np.random.Generator) -> Array:
    """Return points whose every coordinate is a vertex's."""
    return np.stack([random.choice(vertices[:, axis], n) for axis in range(3)], axis=1)


def _near(vertices: Array, faces: Array, n: int, random: np.random.Generator) -> Array:
    spread = np.ptp(vertices, axis=0).max() * 10.0 ** -random.uniform(1, 14, (n, 1))
    return _on_faces(vertices, faces, n, random) + random.normal(size=(n, 3)) * spread


def _denormal(vertices: Array, faces: Array, n: int, random: np.random.Generator) -> Array:
    """Return points with denormal or smallest normal numbers along one, two or three axes."""
    points = _lattice(vertices, faces, n, random)
    is_tiny = random.random((n, 3)) < 0.6
    return np.where(is_tiny, random.choice(TINY, (n, 3)), points)


FAMILIES: dict[str, Callable[..., Array]] = {
    "vertex": _on_vertices,
    "edge": _on_edges,
    "face": _on_faces,
    "ray through a vertex": _along_axes(_on_vertices),
    "ray through an edge": _along_axes(_on_edges),
    "ray through a face": _along_axes(_on_faces),
    "lattice": _lattice,
    "near": _near,
    "denormal": _denormal,
}


def hard_points(name: str, vertices: Array, faces: Array, n_each: int) -> Iterator[tuple[str, Array]]:
    """Yield every family: a third of its points as drawn, the others moved by some ulp."""
    for family, draw in FAMILIES.items():
        random = generator(name, family)
        points = draw(vertices, faces, n_each, random)
        yield family, np.concatenate([points[::3], moved_by_ulps(np.delete(points, np.s_[::3], axis=0), random)])


def _merged(parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return np.concatenate([v for v, _ in parts]), np.concatenate([f + s for (_, f), s in zip(parts, starts)])


def _box(low: tuple[float, ...], high: tuple[float, ...]) -> tuple[Array, Array]:
    corners = np.array([[(low, high)[bit >> k & 1][k] for k in range(3)] for bit in range(8)], float)
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return corners, np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))])


def _soup(n: int, flat: float) -> tuple[Array, Array]:
    random, faces = generator("soup", str(flat)), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    return _merged([(random.integers(-8, 9, (4, 3)) * np.array([1.0, 1.0, flat]), faces) for _ in range(n)])


def _star(n: int) -> tuple[Array, Array]:
    """Return a double cone over a star polygon {n/2}: crosses itself along lines, needles for large n."""
    turn = 4.0 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    k = np.arange(n)
    faces = [[np.stack([k, (k + 1) % n, 0 * k + n], 1), np.stack([(k + 1) % n, k, 0 * k + n + 1], 1)]]
    return np.concatenate([ring, [[0, 0, 1.0], [0, 0, -1.0]]]), np.concatenate(faces[0])


def generated_solids() -> dict[str, tuple[Array, Array]]:
    """Return vertices and triangles of generated solids: even-odd, crossing themselves, flat, far, tiny."""
    crossing = _merged([_box((0, 0, 0), (3, 3, 3)), _box((1, 1, 1), (4, 4, 2)), _box((-2, 0, 3), (1, 4, 4))])
    shared = _merged([_box((0, 0, 0), (2, 2, 2)), _box((2, 0, 0), (4, 2, 2)), _box((0, 0, 0), (2, 2, 2)),
                      _box((2, 2, 2), (3, 3, 3)), _box((-1, -1, -1), (5, 5, 5))])  # fmt: skip
    soup, flat, star = _soup(30, 1.0), _soup(30, 2.0**-40), _star(41)
    return {
        "boxes that cross": crossing,
        "boxes that share walls, edges and all": shared,
        "tetrahedra on a lattice": soup,
        "flat tetrahedra on a lattice": flat,
        "star": star,
        "star, offset 1e9": (star[0] * 1e3 + 1e9, star[1]),
        "tetrahedra, offset 1e6": (soup[0] / 3.0 + 1e6, soup[1]),
        "boxes, denormal": (crossing[0] * 2.0**-1070, crossing[1]),
        "star, denormal": (np.round(star[0] * 1000) * 5e-324, star[1]),
        "tetrahedra at the end of the range": (soup[0] * 2.0**1017, soup[1]),
        "tetrahedra, tiny": (soup[0] / 3.0 * 2.0**-500, soup[1]),
    }


def main() -> None:
    arrays: dict[str, Any] = {}
    for number, (name, (vertices, faces)) in enumerate(generated_solids().items()):
        points = np.concatenate([points for _, points in hard_points(name, vertices, faces, 60)])
        exact = locate_points(points, vertices, faces)
        of_solid = {"name": name, "vertices": vertices, "faces": faces, "points": points, "location": exact}
        arrays |= {f"{number}_{what}": value for what, value in of_solid.items()}
    np.savez_compressed(STORED, **arrays)


if __name__ == "__main__":
    main()
