"""Runs the compiled overlay on pairs of polygons, and gathers what it leaves as flat arrays."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, Literal, NamedTuple, cast

import numpy as np

from engine.arrays import FloatArray, Int8Array, Int32Array, IntArray, read_only
from engine.parallel import Budget
from engine.polygon_overlay.compiled.kernel import DONE, NEEDS_CONTACTS, NEEDS_OUTPUT
from engine.polygon_overlay.compiled.ring_labels import RingBits
from engine.polygon_overlay.compiled.workspace import Outcomes, keep, more_contacts, scratch_for
from engine.polygon_overlay.implicit_rings import ImplicitRings, RingArrays
from engine.polygon_overlay.nearest import leave_nearest
from engine.polygon_overlay.result import Output, Overlay
from engine.polygon_overlay.ring_bits import assign_bits, boxes_of, rings_meant
from engine.polygon_overlay.rounds import ArrangedAgain, RoundedRings, settle_rings
from engine.polygon_overlay.run_pair import (
    BY_CONTACT,
    NO_BITS,
    NOT_REDUCED,
    OVERLAY_PAIRS,
    FoundPair,
    entry_of,
    run_pair,
)
from engine.predicates.scaling import exponent_of, scaled_back, shifted
from engine.types import OPEN

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]

KEPT: Final = {  # by the label of a face: in neither, in the subject, in the clip, in both
    "intersection": (False, False, False, True),
    "union": (False, True, True, True),
    "difference": (False, True, False, False),
    "symmetric_difference": (False, True, True, False),
}
KEPT_ARRAYS: Final = {name: np.array(kept, np.uint8) for name, kept in KEPT.items()}


class Polygons(NamedTuple):
    """Some polygons as flat arrays: vertices (n, 2) float64, rings by vertex offsets, polygons by ring offsets.

    most_vertices, most_rings: of one polygon.
    """

    vertices: FloatArray
    ring_offsets: IntArray
    polygon_offsets: IntArray
    most_vertices: int
    most_rings: int


class Found(NamedTuple):
    """What the kernel found for some pairs, one after another.

    status: (pairs,) int8, DONE, OPEN or MAY_CROSS; counts: (pairs, 4) int64, pieces, rings, vertices and pairs of edges
    beyond the filter; displacement: (pairs,) float64. vertices, sources: of all pairs that are not OPEN; ring_offsets
    into them; piece_offsets: into the rings. evidence: by ring, of pairs whose rings are sources of their own.
    """

    status: Int8Array
    counts: IntArray
    displacement: FloatArray
    vertices: FloatArray
    sources: Int32Array
    ring_offsets: IntArray
    piece_offsets: IntArray
    evidence: IntArray


def gathered(vertices: Sequence[FloatArray], ring_offsets: Sequence[IntArray]) -> Polygons:
    """Return polygons, given by the arrays of each, as flat arrays; at least one polygon, and none without a ring.

    Joined as bytes: numpy takes three times as long to put small arrays one after another.
    """
    n = len(vertices)
    joined = np.frombuffer(b"".join(cast("Sequence[bytes]", vertices))).reshape(-1, 2)
    offsets = np.frombuffer(b"".join(cast("Sequence[bytes]", ring_offsets)), np.int64)
    if len(offsets) == 2 * n:  # one ring each
        sizes = offsets[1::2]
        return Polygons(joined, summed(sizes), read_only(np.arange(n + 1)), int(sizes.max()), 1)
    starts = np.flatnonzero(offsets == 0)  # of each polygon's: no ring is empty
    ends = np.append(starts[1:], len(offsets)) - 1
    sizes, n_rings = offsets[ends], ends - starts
    first_vertices = np.cumsum(sizes) - sizes
    ring_starts = np.delete(offsets + np.repeat(first_vertices, n_rings + 1), ends)
    rings = read_only(np.append(ring_starts, len(joined)))
    return Polygons(joined, rings, summed(n_rings), int(sizes.max()), int(n_rings.max()))


_EMPTY: Final = Polygons(
    read_only(np.zeros((0, 2))), read_only(np.zeros(1, np.int64)), read_only(np.zeros(2, np.int64)), 0, 0
)


def run_kernel(
    subjects: Polygons, clips: Polygons, operation: Operation, budget: Budget, bits: RingBits = NO_BITS
) -> Found:
    """Overlay polygons pair by pair. Raises as `Budget.check` when the call must end.

    bits: of the rings of subjects to be arranged each as a source of its own, as `overlay_pairs` takes them.
    """
    n = len(subjects.polygon_offsets) - 1
    n_vertices, n_rings = subjects.most_vertices + clips.most_vertices, subjects.most_rings + clips.most_rings
    first, second = RingArrays(*subjects[:2]), RingArrays(*clips[:2])
    outcomes = Outcomes(np.empty(n, np.int8), np.empty((n, 4), np.int64), np.empty(n))
    reached = 0
    parts: list[list[Any]] = []
    n_contacts = max(256, 4 * n_vertices)
    n_out, n_out_rings = 8 * n + len(subjects.vertices) + len(clips.vertices), 2 * n
    while reached < n:  # bound: each turn goes on, or makes room for one pair, geometrically
        scratch = scratch_for(n_vertices, n_rings, n_contacts, n_out, n_out_rings)
        reached, needs, filled, n_filled, n_pieces, used, _ = entry_of(OVERLAY_PAIRS)(
            first,
            subjects.polygon_offsets,
            second,
            clips.polygon_offsets,
            reached,
            NOT_REDUCED,
            KEPT_ARRAYS[operation],
            bits,
            budget.flag,
            scratch.buffers,
            outcomes,
            scratch.output,
        )
        budget.check()
        sizes = filled, filled, n_filled + 1, n_pieces + 1, n_filled if len(bits.bits) else 0
        parts.append([array[:size].copy() for array, size in zip(scratch.output, sizes, strict=True)])
        keep(scratch, n_vertices, used, filled)
        if needs == NEEDS_CONTACTS:
            n_contacts = more_contacts(scratch.n_contacts)
            budget.take(BY_CONTACT * n_contacts)
        elif needs == NEEDS_OUTPUT:
            n_out_rings, n_out = (max(m, int(outcomes.counts[reached, k])) for k, m in ((1, n_out_rings), (2, n_out)))
    return Found(*outcomes, *(parts[0] if len(parts) == 1 else put_together(parts)))


def put_together(parts: Sequence[Sequence[Any]]) -> list[Any]:
    """Return vertices, sources, ring offsets, piece offsets and evidence of some parts as those of one."""
    vertices, sources, ring_offsets, piece_offsets, evidence = zip(*parts, strict=True)
    offsets = chained(ring_offsets), chained(piece_offsets)
    return [np.concatenate(vertices), np.concatenate(sources), *offsets, np.concatenate(evidence)]


def summed(sizes: IntArray) -> IntArray:
    """Return where each of some parts put one after another begins, and the end of the last; read-only."""
    offsets = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=offsets[1:])
    return read_only(offsets)


def chained(offsets: Sequence[IntArray]) -> IntArray:
    """Return the offsets of several arrays put one after another."""
    return summed(np.concatenate([np.zeros(0, np.int64), *(each[1:] - each[:-1] for each in offsets)]))


def overlay_compiled(
    subject: RingArrays, clip: RingArrays, operation: Operation, output: Output, budget: Budget
) -> tuple[Overlay, int] | None:
    """Return the overlay of one pair and the number of pairs of edges beyond the filter; None where it is left open.

    A scene outside of the kernel's range is brought into it by a power of two where that is exact.
    """
    found, exponent = run_pair(subject, clip, KEPT_ARRAYS[operation], budget), 0
    if found.status == OPEN:
        exponent = exponent_of(subject.vertices, clip.vertices)
        if exponent == 0:
            return None
        first, second = shifted(subject.vertices, -exponent), shifted(clip.vertices, -exponent)
        if first is None or second is None:
            return None
        near = RingArrays(first, subject.offsets), RingArrays(second, clip.offsets)
        found = run_pair(*near, KEPT_ARRAYS[operation], budget)
        if found.status == OPEN:
            return None
    exact = ImplicitRings(subject, clip, found.sources, found.ring_offsets)
    if found.status == DONE:
        result = as_overlay(found.vertices, found.piece_offsets, found.displacement, exact, output)
    else:
        rounded = _rounded(found)
        if output == "valid":
            settled = settle_rings(rounded, exact, functools.partial(_arranged_again, budget), exponent == 0, budget)
        else:
            settled = leave_nearest(rounded, exact, budget)
        if settled is None:
            return None
        result = settled
    if exponent:
        vertices, doubtful = scaled_back(result.vertices, exponent)
        if doubtful.any() or not np.isfinite(vertices).all():
            return None
        moved = result.largest_displacement
        displacement = float(np.nextafter(np.ldexp(moved, exponent), np.inf)) if moved else 0.0
        result = replace(result, vertices=read_only(vertices), largest_displacement=displacement)
    return result, found.n_exact


def _rounded(found: FoundPair) -> RoundedRings:
    """Return what was found for one pair as the outcome of a round."""
    return RoundedRings(
        vertices=found.vertices,
        ring_offsets=found.ring_offsets,
        piece_offsets=found.piece_offsets,
        displacement=found.displacement,
        is_valid=found.status == DONE,
        has_crossings=bool((found.sources[:, 1] >= 0).any()),
    )


def _arranged_again(budget: Budget, rings: RoundedRings) -> ArrangedAgain | None:
    """Arrange rounded rings, each a source of its own; None where that is left open, or bits do not suffice."""
    subject = Polygons(
        read_only(rings.vertices),
        read_only(rings.ring_offsets),
        read_only(np.array([0, rings.n_rings])),
        len(rings.vertices),
        rings.n_rings,
    )
    boxes = boxes_of(rings.vertices, rings.ring_offsets)
    bits = assign_bits(boxes, rings.piece_offsets, budget)
    if bits is None:
        return None
    found = run_kernel(subject, _EMPTY, "union", budget, bits)
    if found.status[0] == OPEN:
        return None

    def evidence(other: RingBits) -> IntArray:
        return run_kernel(subject, _EMPTY, "union", budget, other).evidence  # bits decide nothing: the same rings

    boxes_found = boxes_of(found.vertices, found.ring_offsets)
    meant = rings_meant(bits, found.evidence, boxes, rings.piece_offsets, boxes_found, evidence, budget)
    if meant is None:
        return None
    one = FoundPair(int(found.status[0]), int(found.counts[0, 3]), float(found.displacement[0]), *found[3:7])
    return ArrangedAgain(_rounded(one), meant)


def as_overlay(
    vertices: FloatArray,
    piece_offsets: IntArray,
    displacement: float,
    exact: ImplicitRings,
    output: Output,
) -> Overlay:
    """Return an `Overlay` whose rounded rings have the structure of the exact ones; all arrays are read-only."""
    offsets = exact.offsets
    n_pieces = len(piece_offsets) - 1
    result = object.__new__(Overlay)
    vars(result).update(  # as Overlay(...) does one by one, which takes 2 us
        vertices=vertices,
        ring_offsets=offsets,
        piece_offsets=piece_offsets,
        output=output,
        may_be_invalid=output == "nearest" and displacement > 0.0,
        n_pieces_exact=n_pieces,
        n_holes_exact=len(offsets) - 1 - n_pieces,
        exact=exact,
        largest_displacement=displacement,
        rounds=int(displacement > 0.0),
    )
    return result
