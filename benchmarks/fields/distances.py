"""How far are points from a mesh, and is it at most so far? In the box, near the surface, and so near that rounding
decides.

All are judged by rational arithmetic, easy rows on their first points.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from benchmarks.contest import Contest, Goals, Size, Task, field_of
from benchmarks.errors import distances, distances_from, same, squares_from
from benchmarks.workloads import Mesh, bumpy_sphere, document, generator, points_in_box

PEERS: dict[str, Goals] = {"open3d": (1.25, 2.0), "igl": (1.25, 2.0), "trimesh": (None, None)}
GAPS = {"on the surface": 0.0, "1e-12 away": 1e-12, "1e-9 away": 1e-9, "1e-6 away": 1e-6}
"""How far hard points are from the surface, over its radius, before their coordinates are rounded."""
LIMIT = 0.125


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
    exact = distances_from(points[: size.n(200, 12)], mesh)
    about = f"{len(mesh.faces):,} faces, points {'at a thousandth of the radius' if is_near else 'of the box'}"
    name = f"{name} faces, {'near' if is_near else 'in the box'}"
    return Contest("distances", name, False, points, exact, distances, field_of("point distances", mesh, PEERS, 1),
                   about, request=partial(asked, mesh, points))  # fmt: skip


def _hard(size: Size, name: str, gap: float) -> Contest:
    mesh = bumpy_sphere("distances", 1, 1)
    points = beside(mesh, gap, size.n(200, 12), generator(f"distances {gap}", size.seed))

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        other = beside(mesh, step, len(points), generator(f"distances {step}", size.seed))
        return other, distances_from(other, mesh)

    about = f"{len(mesh.faces)} faces, points off them by {gap:g} of the radius before rounding; a distance is wrong "
    about += "when it is off by more than a millionth of itself"
    exact = distances_from(points, mesh)
    return Contest("distances", name, True, points, exact, distances,
                   field_of("point distances", mesh, tuple(PEERS), 1), about, request=partial(asked, mesh, points),
                   moved=None if gap else moved, near=float(np.median(exact)) / 2.0)  # fmt: skip


def _within(size: Size) -> Contest:
    mesh = bumpy_sphere("distances", 1, 1)
    points = beside(mesh, LIMIT, size.n(200, 12), generator("distances within", size.seed))
    exact = np.array([square <= Fraction(LIMIT) ** 2 for square in squares_from(points, mesh)])

    def within(item: int) -> tuple[str, dict[str, Any]]:
        path, question = asked(mesh, points, item)
        return path, question | {"within": LIMIT}

    about = f"points off faces by {LIMIT} up to rounding: are they at most so far away?"
    return Contest("distances", "within the distance itself", True, points, exact, same,
                   field_of("points within", (mesh, LIMIT), tuple(PEERS), 1), about, request=within)  # fmt: skip
