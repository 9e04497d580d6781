"""How far are points from a mesh, and is it at most so far? In the box, near the surface, and so near that rounding
decides.

All are judged by rational arithmetic, easy rows on their first points.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from benchmarks.contest import Contest, Goals, Size, Task, field_of
from benchmarks.errors import distances, same
from benchmarks.workloads import Mesh, bumpy_sphere, document, generator, points_in_box
from engine.predicates.rational import cross, dot, minus, nearest_with_root

PEERS: dict[str, Goals] = {"open3d": (1.25, 2.0), "igl": (1.25, 2.0), "trimesh": (None, None)}
GAPS = {"on the surface": 0.0, "1e-12 away": 1e-12, "1e-9 away": 1e-9, "1e-6 away": 1e-6}
"""How far hard points are from the surface, over its radius, before their coordinates are rounded."""
LIMIT = 0.125
Vector = Sequence[Any]


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows, all with one thread."""
    for name, gap in GAPS.items():
        yield Task(name, partial(_hard, size, name, gap), gap == 0.0)
    yield Task("within the distance itself", partial(_within, size), True)
    for name, times in (("1k", 3), ("20k", 5)):
        yield Task(f"{name} faces, in the box", partial(_easy, size, name, times, False), name == "20k")
        yield Task(f"{name} faces, near", partial(_easy, size, name, times, True))


def asked(mesh: Mesh, points: np.ndarray, item: int) -> tuple[str, dict[str, Any]]:
    question = {"solid": document(mesh), "points": [points[item].tolist()], "to": "boundary"}
    return "/v1/distances", question


def beside(mesh: Mesh, gap: float, n: int, draw: np.random.Generator) -> np.ndarray:
    """Return points off faces by `gap`, up to rounding, on either side."""
    corners = mesh.vertices[mesh.faces[draw.integers(0, len(mesh.faces), n)]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals *= draw.choice([-gap, gap], n)[:, None] / np.linalg.norm(normals, axis=1)[:, None]
    return np.einsum("nk,nkd->nd", draw.dirichlet([2.0, 2.0, 2.0], n), corners) + normals


def _easy(size: Size, name: str, times: int, is_near: bool) -> Contest:
    mesh, n = bumpy_sphere(f"distances {name}", 1, times), size.n(100_000, 500)
    points = points_in_box(mesh, n, size.seed)
    if is_near:
        points = beside(mesh, 1e-3, n, generator(f"distances {name}", size.seed))
    exact = _exact(points[: size.n(200, 12)], mesh)
    about = f"{len(mesh.faces):,} faces, points {'at a thousandth of the radius' if is_near else 'of the box'}"
    name = f"{name} faces, {'near' if is_near else 'in the box'}"
    return Contest("distances", name, False, points, exact, distances, field_of("point distances", mesh, PEERS, 1),
                   about, request=partial(asked, mesh, points))  # fmt: skip


def _hard(size: Size, name: str, gap: float) -> Contest:
    mesh = bumpy_sphere("distances", 1, 1)
    points = beside(mesh, gap, size.n(200, 12), generator(f"distances {gap}", size.seed))

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        other = beside(mesh, step, len(points), generator(f"distances {step}", size.seed))
        return other, _exact(other, mesh)

    about = f"{len(mesh.faces)} faces, points off them by {gap:g} of the radius before rounding; a distance is wrong "
    about += "when it is off by more than a millionth of itself"
    exact = _exact(points, mesh)
    return Contest("distances", name, True, points, exact, distances,
                   field_of("point distances", mesh, tuple(PEERS), 1), about, request=partial(asked, mesh, points),
                   moved=None if gap else moved, near=float(np.median(exact)) / 2.0)  # fmt: skip


def _within(size: Size) -> Contest:
    mesh = bumpy_sphere("distances", 1, 1)
    points = beside(mesh, LIMIT, size.n(200, 12), generator("distances within", size.seed))
    exact = np.array([square <= Fraction(LIMIT) ** 2 for square in squares(points, mesh)])

    def within(item: int) -> tuple[str, dict[str, Any]]:
        path, question = asked(mesh, points, item)
        return path, question | {"within": LIMIT}

    about = f"points off faces by {LIMIT} up to rounding: are they at most so far away?"
    return Contest("distances", "within the distance itself", True, points, exact, same,
                   field_of("points within", (mesh, LIMIT), tuple(PEERS), 1), about, request=within)  # fmt: skip


def _exact(points: np.ndarray, mesh: Mesh) -> np.ndarray:
    """Return the doubles nearest to the distances."""
    return np.array(
        [nearest_with_root(0, 1, s.numerator * s.denominator, s.denominator) for s in squares(points, mesh)]
    )


def squares(points: np.ndarray, mesh: Mesh) -> list[Fraction]:
    """Return the exact squared distances of points from a mesh. Faces whose boxes are certainly farther away than the
    nearest vertex are left out."""
    corners, result = mesh.vertices[mesh.faces], []
    low, high = corners.min(axis=1), corners.max(axis=1)
    for point in points:
        nearest = np.linalg.norm(mesh.vertices - point, axis=1).min() * (1 + 1e-9)
        near = np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0.0), axis=1) <= nearest
        p = [Fraction(x) for x in point.tolist()]
        faces = [[[Fraction(x) for x in corner] for corner in face] for face in corners[near].tolist()]
        result.append(min(_square([minus(corner, p) for corner in face]) for face in faces))
    return result


def _square(corners: Sequence[Vector]) -> Fraction:
    """Return the squared distance of a triangle from the origin."""
    a, b, c = corners
    normal = cross(minus(b, a), minus(c, a))
    if all(dot(normal, cross(corners[k], corners[(k + 1) % 3])) >= 0 for k in range(3)):
        return Fraction(dot(a, normal)) ** 2 / dot(normal, normal)
    result = []
    for k in range(3):
        start, way = corners[k], minus(corners[(k + 1) % 3], corners[k])
        t = min(max(Fraction(-dot(start, way)) / dot(way, way), Fraction(0)), Fraction(1))
        foot = [x + t * y for x, y in zip(start, way)]
        result.append(Fraction(dot(foot, foot)))
    return min(result)
