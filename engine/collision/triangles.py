"""Public: pairs of triangles in batches."""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray, Int8Array
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.exact_body import Corners, on_lattice
from engine.collision.meshes.exact_triangles import classify_exact
from engine.collision.meshes.mesh_arrays import lattice_shift
from engine.collision.meshes.triangle_triangle import APART
from engine.collision.meshes.triangle_triangle_3d import relate_triangles_3d
from engine.collision.planar.outline_outline import collide_outline_outline
from engine.collision.planar.triangle_triangle_2d import relate_triangles_2d
from engine.collision.result import Work
from engine.errors import InvalidArrayError, WrongDimensionError
from engine.parallel import Budget, Cancel, Progress, run_chunks
from engine.solids.checks import as_point_groups
from engine.solids.triangle import Triangle
from engine.types import Accuracy, Relation


def collide_triangles(
    first: object,
    second: object,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Int8Array | tuple[Int8Array, Accuracy]:
    """Decide how each of many triangles lies to its partner, exactly.

    In the plane triangles are solids, with all five relations; in space they are surfaces: disjoint or touching.

    Parameters: first, second: ``(n_pairs, 3, d)`` float64, d 2 or 3, either orientation. workers, deadline, cancel,
    progress (items are pairs), report: as everywhere.
    Returns: ``(n_pairs,) int8`` of `Relation`; with report=True a pair of it and an `Accuracy`.
    Boundary: one common point is enough to touch. Degenerate: a triangle without area is the segment or point it
    covers, which has no interior: it may lie inside another, and never overlaps.
    Accuracy: exact for all finite input. Cost: constant per pair; what orientation tests leave undecided by their
    exponents, some 100 us.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, DeadlineExceededError, CancelledError.
    Source: see the modules triangle_triangle_2d and triangle_triangle.

    >>> collide_triangles([[[0, 0], [4, 0], [0, 4]]], [[[1, 1], [2, 1], [1, 2]]]).tolist()
    [2]
    """
    a = as_point_groups(first, 3, None, ("first",))
    b = as_point_groups(second, 3, None, ("second",))
    if len(a) != len(b):
        raise InvalidArrayError(f"first and second must be equally many, got {len(a)} and {len(b)}", ("second",))
    if len(a) and a.shape[2] != b.shape[2]:
        raise WrongDimensionError(f"first is {a.shape[2]}D, second {b.shape[2]}D; both need one dimension", ("second",))
    is_planar = a.shape[2] == 2
    relations = np.empty(len(a), np.int8)
    n_open: list[int] = []
    with Budget(deadline, cancel) as budget:

        def task(start: int, stop: int) -> None:
            part = relations[start:stop]
            with np.errstate(all="ignore"):  # uncompiled runs only
                (relate_triangles_2d if is_planar else relate_triangles_3d)(a[start:stop], b[start:stop], part)
            still_open = start + np.flatnonzero(part == UNSETTLED)
            n_open.append(len(still_open))
            for item in still_open.tolist():
                budget.check()
                relations[item] = _settled(a[item], b[item], budget)

        run_chunks(task, len(a), budget=budget, workers=workers, progress=progress)
    if not report:
        return relations
    method = "separating_edges" if is_planar else "orientation_signs"
    return relations, Accuracy("exact", None, len(a), sum(n_open), sum(n_open), method)


def _settled(t: FloatArray, u: FloatArray, budget: Budget) -> Relation:
    """Return the relation of one pair by integer or rational arithmetic."""
    if t.shape[1] == 2:
        return collide_outline_outline(Triangle(t), Triangle(u), None, None, Work(budget, witness=False)).relation
    shift = lattice_shift(np.concatenate([t, u]))
    how = classify_exact(_on_lattice(t, shift), _on_lattice(u, shift))
    return Relation.DISJOINT if how == APART else Relation.TOUCHING


def _on_lattice(triangle: FloatArray, shift: int) -> Corners:
    a, b, c = (tuple(on_lattice(x, shift) for x in corner) for corner in triangle.tolist())
    return a, b, c
