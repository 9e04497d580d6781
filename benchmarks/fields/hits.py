"""Where do segments meet a mesh? First hits, all hits, segments within the surface; judged by rationals."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks import errors
from benchmarks.contest import Contest, Size, Task, field_of
from benchmarks.fields.containment import shifted
from benchmarks.fields.segments import hit_request
from benchmarks.workloads import Mesh, bumpy_sphere, generator, points_in_box

PEERS = ("open3d", "trimesh")
KINDS = {"first": ("first hits", errors.places), "all": ("hit counts", errors.same), "any": ("hits", errors.same)}
LATTICE = 64.0
THROUGH, WITHIN = "through vertices and edges", "within the surface"


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows, all with one thread."""
    for name in ("first", "all"):
        yield Task(f"{name}, random", partial(_easy, size, name), True)
        yield Task(f"{name}, {THROUGH}", partial(_hard, size, name, THROUGH), True)
    yield Task(f"any, {WITHIN}", partial(_hard, size, "any", WITHIN), True)


def _contest(name: str, place: str, mesh: Mesh, segments: np.ndarray, n_judged: int, about: str, is_hard: bool,
             moves: np.ndarray | None = None) -> Contest:  # fmt: skip
    """moves: by how far one unit of a step moves each end; in random directions if None."""
    kind, judge = KINDS[name]

    def exact(some: np.ndarray) -> np.ndarray:
        return errors.hits_of(some, mesh, name)

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        other = shifted(segments, 2.0, step) if moves is None else segments + 2.0 * step * moves
        return other[:n_judged], exact(other[:n_judged])

    return Contest("hits", f"{name}, {place}", is_hard, segments, exact(segments[:n_judged]), judge,
                   field_of(kind, mesh, PEERS, 1), about, request=partial(hit_request, mesh, segments, keep=name),
                   moved=moved if is_hard else None, near=0.0 if is_hard else None)  # fmt: skip


def _easy(size: Size, name: str) -> Contest:
    mesh, n = bumpy_sphere("hits", 1, 5), size.n(50_000, 500)
    segments = np.ascontiguousarray(points_in_box(mesh, 2 * n, size.seed).reshape(-1, 2, 3) * 1.2)
    about = f"{len(mesh.faces):,} faces, ends drawn at random in the box and beside it"
    return _contest(name, "random", mesh, segments, size.n(200, 20), about, False)


def _hard(size: Size, name: str, place: str) -> Contest:
    """Vertices are on a lattice; targets are vertices and middles of edges, exactly; segments are twice as long as the
    way to the target, from a point of the lattice, or lie between two points of one edge."""
    ball, n = bumpy_sphere("hits", 1, 2), size.n(400, 40)
    mesh = Mesh("ball", np.round(ball.vertices * LATTICE) / LATTICE, ball.faces)
    draw = generator(f"hits {place}", size.seed)
    faces = mesh.faces[draw.integers(0, len(mesh.faces), n)]
    a, b = mesh.vertices[faces[:, 0]], mesh.vertices[faces[:, 1]]
    if place == WITHIN:
        segments = np.stack([0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b], axis=1)
        outward = np.broadcast_to(segments.mean(axis=1, keepdims=True), segments.shape)
        sides = draw.choice([-1.0, 1.0], (n, 1, 1))
        about = f"{len(mesh.faces)} faces, each segment between two points of an edge: does it meet the surface? "
        about += "Rays of the peers leave out triangles seen edge-on"
        return _contest(name, place, mesh, segments, n, about, True, outward * sides)
    targets = np.where(draw.integers(0, 2, (n, 1)) == 0, a, 0.5 * (a + b))
    starts = np.round(draw.uniform(-3.0, 3.0, (n, 3)) * LATTICE) / LATTICE
    segments = np.stack([starts, 2.0 * targets - starts], axis=1)
    about = f"{len(mesh.faces)} faces, segments exactly through a vertex or the middle of an edge"
    return _contest(name, place, mesh, segments, n, about, True)
