"""Runs the compiled overlay on pairs of polygons, and gathers what it leaves as flat arrays."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from engine.clipping.implicit_rings import ImplicitRings, RingArrays
from engine.clipping.overlay_kernel import (
    DONE,
    NEEDS_CONTACTS,
    NEEDS_OUTPUT,
    OPEN,
    Workspace,
    overlay_pairs,
    workspace_for,
)
from engine.clipping.overlay_result import Overlay
from engine.clipping.scaling import exponent_of, scaled_back, shifted
from engine.errors import CancelledError
from engine.parallel import Budget

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]
Output = Literal["valid", "nearest"]

KEPT: Final = {  # by the label of a face: in neither, in the subject, in the clip, in both
    "intersection": (False, False, False, True),
    "union": (False, True, True, True),
    "difference": (False, True, False, False),
    "symmetric_difference": (False, True, True, False),
}
_KEPT_ARRAYS: Final = {name: np.array(kept, np.uint8) for name, kept in KEPT.items()}

_kept = threading.local()
_MOST_KEPT: Final = 120_000
"""Vertices, rings and contacts up to which a thread keeps its scratch: 50 MB."""


@dataclass(frozen=True, slots=True)
class Polygons:
    """Many polygons as flat arrays: vertices (n, 2) float64, rings by vertex offsets, polygons by ring offsets."""

    vertices: npt.NDArray[np.float64]
    ring_offsets: npt.NDArray[np.int64]
    polygon_offsets: npt.NDArray[np.int64]


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
    sources: npt.NDArray[np.int64]
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
    return frozen_polygons(np.concatenate([np.zeros((0, 2)), *vertices]), offsets, first_ring)


def frozen_polygons(
    vertices: npt.NDArray[np.float64], ring_offsets: npt.NDArray[np.int64], polygon_offsets: npt.NDArray[np.int64]
) -> Polygons:
    """Return `Polygons` over arrays of the one kind that kernels are compiled for."""
    doubles = np.ascontiguousarray(vertices, np.float64).reshape(-1, 2).view()
    rings, polygons = (np.ascontiguousarray(each, np.int64).view() for each in (ring_offsets, polygon_offsets))
    doubles.setflags(write=False)
    rings.setflags(write=False)
    polygons.setflags(write=False)
    return Polygons(doubles, rings, polygons)


def run_kernel(
    subjects: Polygons, clips: Polygons, start: int, stop: int, operation: Operation, budget: Budget
) -> Found:
    """Overlay the pairs start .. stop - 1. Raises as `Budget.check` when the call must end."""
    n = stop - start
    status, counts, displacement = np.full(n, OPEN, np.int8), np.zeros((n, 4), np.int64), np.zeros(n)
    n_vertices, n_rings = zip(_largest(subjects, start, stop), _largest(clips, start, stop))
    room, reached, parts = max(256, 4 * sum(n_vertices)), start, []
    output = (8 * n + 8 * sum(n_vertices), 2 * n + sum(n_vertices))  # pages that nothing is written to cost nothing
    scratch = _scratch(sum(n_vertices), sum(n_rings), room)
    while reached < stop:  # bound: each turn goes on, or makes room for one pair, geometrically
        arrays = (
            np.empty((output[0], 2)), np.empty((output[0], 2), np.int64),
            np.empty(output[1], np.int64), np.empty(output[1], np.int64),
        )  # fmt: skip
        with np.errstate(all="ignore"):
            reached, needs, *sizes = overlay_pairs(
                subjects.vertices,
                subjects.ring_offsets,
                subjects.polygon_offsets,
                clips.vertices,
                clips.ring_offsets,
                clips.polygon_offsets,
                start,
                stop,
                reached,
                _KEPT_ARRAYS[operation],
                budget.flag,
                scratch,
                status,
                counts,
                displacement,
                *arrays,
            )
        budget.check()
        if budget.flag[0]:
            raise CancelledError("another part of the call failed")  # the flag went up for that, not for time
        parts.append([arrays[0][: sizes[0]], arrays[1][: sizes[0]], arrays[2][: sizes[1]], arrays[3][: sizes[2]]])
        if needs == NEEDS_CONTACTS:
            room *= 4
            scratch = _scratch(sum(n_vertices), sum(n_rings), room)
        elif needs == NEEDS_OUTPUT:
            rings, vertices = (int(counts[reached - start, k]) for k in (1, 2))
            output = (max(2 * output[0], vertices), max(2 * output[1], rings))
    joined = parts[0] if len(parts) == 1 else [np.concatenate(each) for each in zip(*parts)]
    return Found(status, counts, displacement, *joined)


def _scratch(n_vertices: int, n_rings: int, n_contacts: int) -> Workspace:
    """Return scratch of at least that size: that of this thread's last call if it suffices, its memory is warm."""
    asked = (n_vertices, n_rings, n_contacts)
    size, kept = getattr(_kept, "scratch", ((0, 0, 0), None))
    if kept is not None and all(have >= need for have, need in zip(size, asked, strict=True)):
        return kept
    made = workspace_for(*asked)
    if n_vertices + n_rings + n_contacts <= _MOST_KEPT:
        _kept.scratch = asked, made
    return made


def _largest(polygons: Polygons, start: int, stop: int) -> tuple[int, int]:
    """Return the most vertices and the most rings of one of some polygons."""
    first_ring = polygons.polygon_offsets[start : stop + 1]
    most_vertices = np.diff(polygons.ring_offsets[first_ring]).max()
    return int(most_vertices), int(np.diff(first_ring).max())


def overlay_compiled(
    subject: RingArrays, clip: RingArrays, operation: Operation, output: Output, budget: Budget
) -> tuple[Overlay, int] | None:
    """Return the overlay of one pair and the number of pairs of edges beyond the filter; None where it is left open.

    A scene outside of the kernel's range is brought into it by a power of two where that is exact.
    """
    exponent = exponent_of(subject.vertices, clip.vertices)
    first, second = shifted(subject.vertices, -exponent), shifted(clip.vertices, -exponent)
    if first is None or second is None:
        return None
    found = run_kernel(
        frozen_polygons(first, subject.offsets, np.array([0, len(subject.offsets) - 1])),
        frozen_polygons(second, clip.offsets, np.array([0, len(clip.offsets) - 1])),
        0,
        1,
        operation,
        budget,
    )
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
