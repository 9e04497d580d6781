"""Runs the compiled overlay on pairs of polygons, and gathers what it leaves as flat arrays."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from engine.clipping.implicit_rings import ImplicitRings, RingArrays
from engine.clipping.overlay_kernel import (
    DONE,
    NEEDS_CONTACTS,
    NEEDS_OUTPUT,
    overlay_pairs,
)
from engine.clipping.overlay_result import Overlay
from engine.clipping.overlay_workspace import keep, scratch_for
from engine.clipping.scaling import exponent_of, scaled_back, shifted
from engine.parallel import Budget

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]
Output = Literal["valid", "nearest"]
Scalar = TypeVar("Scalar", bound=np.generic)

KEPT: Final = {  # by the label of a face: in neither, in the subject, in the clip, in both
    "intersection": (False, False, False, True),
    "union": (False, True, True, True),
    "difference": (False, True, False, False),
    "symmetric_difference": (False, True, True, False),
}
_KEPT_ARRAYS: Final = {name: np.array(kept, np.uint8) for name, kept in KEPT.items()}


@dataclass(frozen=True, slots=True)
class Polygons:
    """Many polygons as flat arrays: vertices (n, 2) float64, rings by vertex offsets, polygons by ring offsets.

    n_vertices, n_rings: int64, by polygon.
    """

    vertices: npt.NDArray[np.float64]
    ring_offsets: npt.NDArray[np.int64]
    polygon_offsets: npt.NDArray[np.int64]
    n_vertices: npt.NDArray[np.int64]
    n_rings: npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Found:
    """What the kernel found for some pairs, one after another.

    status: (pairs,) int8, DONE or OPEN; counts: (pairs, 4) int64, pieces, rings, vertices and pairs of edges beyond the
    filter; displacement: (pairs,) float64. vertices, sources: of all pairs that are DONE; sizes: of their rings;
    piece_sizes: rings of their pieces.
    """

    status: npt.NDArray[np.int8]
    counts: npt.NDArray[np.int64]
    displacement: npt.NDArray[np.float64]
    vertices: npt.NDArray[np.float64]
    sources: npt.NDArray[np.int32]
    sizes: npt.NDArray[np.int64]
    piece_sizes: npt.NDArray[np.int64]


def gathered(vertices: Sequence[npt.NDArray[np.float64]], ring_offsets: Sequence[npt.NDArray[np.int64]]) -> Polygons:
    """Return polygons, given by the arrays of each, as flat arrays."""
    n_vertices = np.fromiter(map(len, vertices), np.int64, len(vertices))
    n_rings = np.fromiter(map(len, ring_offsets), np.int64, len(vertices)) - 1
    first_vertex, first_ring = np.zeros(len(vertices) + 1, np.int64), np.zeros(len(vertices) + 1, np.int64)
    np.cumsum(n_vertices, out=first_vertex[1:])
    np.cumsum(n_rings, out=first_ring[1:])
    if first_ring[-1] == len(vertices) and (n_rings == 1).all():
        offsets = first_vertex
    else:
        offsets = np.zeros(first_ring[-1] + 1, np.int64)
        offsets[1:] = np.concatenate([each[1:] for each in ring_offsets]) + np.repeat(first_vertex[:-1], n_rings)
    joined = np.concatenate([np.zeros((0, 2)), *vertices])
    return Polygons(as_frozen(joined), as_frozen(offsets), as_frozen(first_ring), n_vertices, n_rings)


def as_frozen(array: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    """Return an array of the one kind that kernels are compiled for: itself, a read-only view, or a copy."""
    array = np.ascontiguousarray(array)
    if array.flags.writeable:
        array = array.view()
        array.setflags(write=False)
    return array


def run_kernel(
    subjects: Polygons, clips: Polygons, start: int, stop: int, operation: Operation, budget: Budget
) -> Found:
    """Overlay the pairs start .. stop - 1. Raises as `Budget.check` when the call must end."""
    sides = [(each.n_vertices[start:stop], each.n_rings[start:stop]) for each in (subjects, clips)]
    n_vertices, n_rings = (sum(int(side[k].max()) for side in sides) for k in (0, 1))
    n_in_all = sum(int(side[0].sum()) for side in sides)
    return _run(_flat(subjects), _flat(clips), start, stop, n_vertices, n_rings, n_in_all, operation, budget)


def _flat(polygons: Polygons) -> tuple[npt.NDArray[np.generic], ...]:
    return polygons.vertices, polygons.ring_offsets, polygons.polygon_offsets


def _run(
    subjects: tuple[npt.NDArray[np.generic], ...],
    clips: tuple[npt.NDArray[np.generic], ...],
    start: int,
    stop: int,
    n_vertices: int,
    n_rings: int,
    n_in_all: int,
    operation: Operation,
    budget: Budget,
) -> Found:
    """Overlay the pairs start .. stop - 1, none of more vertices and rings than told; all of n_in_all vertices."""
    n = stop - start
    status, counts, displacement = np.empty(n, np.int8), np.empty((n, 4), np.int64), np.empty(n)
    reached, parts = start, []
    n_contacts = max(256, 4 * n_vertices)
    n_out, n_out_rings = 8 * n + n_in_all, 2 * n
    while reached < stop:  # bound: each turn goes on, or makes room for one pair, geometrically
        scratch = scratch_for(n_vertices, n_rings, n_contacts, n_out, n_out_rings)
        with np.errstate(all="ignore"):
            reached, needs, filled, n_filled, n_pieces, used = overlay_pairs(
                *subjects,
                *clips,
                start,
                stop,
                reached,
                _KEPT_ARRAYS[operation],
                budget.flag,
                scratch.buffers,
                status,
                counts,
                displacement,
                *scratch.output,
            )
        budget.check()
        vertices, sources, sizes, pieces = scratch.output
        parts.append(
            (vertices[:filled].copy(), sources[:filled].copy(), sizes[:n_filled].copy(), pieces[:n_pieces].copy())
        )
        keep(scratch, n_vertices, used, filled)
        if needs == NEEDS_CONTACTS:
            n_contacts = 2 * scratch.n_contacts
        elif needs == NEEDS_OUTPUT:
            n_out_rings, n_out = (max(n, int(counts[reached - start, k])) for k, n in ((1, n_out_rings), (2, n_out)))
    joined = parts[0] if len(parts) == 1 else [np.concatenate(each) for each in zip(*parts)]
    return Found(status, counts, displacement, *joined)


def overlay_compiled(
    subject: RingArrays, clip: RingArrays, operation: Operation, output: Output, budget: Budget
) -> tuple[Overlay, int] | None:
    """Return the overlay of one pair and the number of pairs of edges beyond the filter; None where it is left open.

    A scene outside of the kernel's range is brought into it by a power of two where that is exact.
    """
    found, exponent = _run_one(subject, clip, operation, budget), 0
    if found.status[0] != DONE:
        exponent = exponent_of(subject.vertices, clip.vertices)
        if exponent == 0:
            return None
        first, second = shifted(subject.vertices, -exponent), shifted(clip.vertices, -exponent)
        if first is None or second is None:
            return None
        found = _run_one(RingArrays(first, subject.offsets), RingArrays(second, clip.offsets), operation, budget)
        if found.status[0] != DONE:
            return None
    vertices, displacement = found.vertices, float(found.displacement[0])
    if exponent:
        vertices, doubtful = scaled_back(vertices, exponent)
        if doubtful.any() or not np.isfinite(vertices).all():
            return None
        displacement = float(np.nextafter(np.ldexp(displacement, exponent), np.inf)) if displacement else 0.0
    exact = ImplicitRings(subject, clip, found.sources, found.sizes)
    return as_overlay(vertices, found.sizes, found.piece_sizes, displacement, exact, output), int(found.counts[0, 3])


def _run_one(subject: RingArrays, clip: RingArrays, operation: Operation, budget: Budget) -> Found:
    n_rings = len(subject.offsets) + len(clip.offsets) - 2
    first, second = (
        (as_frozen(each.vertices), as_frozen(each.offsets), _one_polygon(len(each.offsets) - 1))
        for each in (subject, clip)
    )
    n_vertices = len(subject.vertices) + len(clip.vertices)
    return _run(first, second, 0, 1, n_vertices, n_rings, n_vertices, operation, budget)


@functools.lru_cache(64)
def _one_polygon(n_rings: int) -> npt.NDArray[np.int64]:
    """Return the ring offsets of one polygon."""
    offsets = np.array([0, n_rings])
    offsets.setflags(write=False)
    return offsets


def as_overlay(
    vertices: npt.NDArray[np.float64],
    sizes: npt.NDArray[np.int64],
    piece_sizes: npt.NDArray[np.int64],
    displacement: float,
    exact: ImplicitRings,
    output: Output,
) -> Overlay:
    """Return an `Overlay` whose rounded rings have the structure of the exact ones."""
    ring_offsets, piece_offsets = np.zeros(len(sizes) + 1, np.int64), np.zeros(len(piece_sizes) + 1, np.int64)
    np.cumsum(sizes, out=ring_offsets[1:])
    np.cumsum(piece_sizes, out=piece_offsets[1:])
    for array in (vertices, ring_offsets, piece_offsets):
        array.setflags(write=False)
    return Overlay(
        vertices=vertices,
        ring_offsets=ring_offsets,
        piece_offsets=piece_offsets,
        output=output,
        may_be_invalid=output == "nearest" and displacement > 0.0,
        n_pieces_exact=len(piece_sizes),
        n_holes_exact=len(sizes) - len(piece_sizes),
        collapsed=(),
        pieces_joined=0,
        pieces_parted=0,
        holes_joined=0,
        holes_parted=0,
        rounds=int(displacement > 0.0),
        vertices_moved=0,
        largest_displacement=displacement,
        snapped=False,
        exact=exact,
    )
