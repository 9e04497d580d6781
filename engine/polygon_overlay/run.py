"""Runs the compiled overlay on pairs of polygons, and gathers what it leaves as flat arrays."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np

from engine.arrays import FlagArray, FloatArray, IntArray, read_only
from engine.budget import Budget
from engine.direct import entry_of
from engine.polygon_overlay.compiled.boundary.ring_nesting import AGAIN, Nesting
from engine.polygon_overlay.compiled.kernel import DONE, NEEDS_CONTACTS, NEEDS_OUTPUT, overlay_pairs
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.compiled.workspace import Outcomes, first_contacts, keep, more_contacts, scratch_for
from engine.polygon_overlay.found import Found, one_pair, put_together, ring_sizes
from engine.polygon_overlay.grid import Grid, as_it_stays, from_units, snap_vertices, snapped_to_units
from engine.polygon_overlay.implicit_rings import NOTHING, ImplicitRings
from engine.polygon_overlay.polygon_arrays import PolygonArrays
from engine.polygon_overlay.result import Overlay, made_overlay
from engine.polygon_overlay.rounds import settle_rings
from engine.polygon_overlay.run_pair import BY_CONTACT, NOT_REDUCED, UNNAMED, run_pair
from engine.predicates.scaling import exponent_of, scaled_back, shifted
from engine.solids.ragged import summed
from engine.types import OPEN

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]

KEPT: Final = {  # by the label of a face: in neither, in the subject, in the clip, in both
    "intersection": (False, False, False, True),
    "union": (False, True, True, True),
    "difference": (False, True, False, False),
    "symmetric_difference": (False, True, True, False),
}
KEPT_ARRAYS: Final = {name: np.array(kept, np.uint8) for name, kept in KEPT.items()}
EACH_PART: Final = np.arange(4, dtype=np.uint8)
"""Keeps what lies in the subject alone, in the clip alone and in both, as parts 1, 2 and 3 of one result."""


def run_kernel(
    subjects: PolygonArrays, clips: PolygonArrays, kept: FlagArray, budget: Budget, nesting: Nesting = UNNAMED
) -> Found:
    """Overlay polygons pair by pair. Raises as `Budget.check` when the call must end.

    kept: as `overlay_pairs` takes it, one of `KEPT_ARRAYS`, or `EACH_PART`.
    nesting: of the rings of subjects, to be arranged each as a source of its own, as `overlay_pairs` takes it.
    """
    n = len(subjects.polygon_offsets) - 1
    n_vertices, n_rings = map(sum, zip(subjects.most(), clips.most(), strict=True))
    sides = RingArrays(*subjects[:2]), subjects.polygon_offsets, RingArrays(*clips[:2]), clips.polygon_offsets
    outcomes = Outcomes(np.empty(n, np.int8), np.empty((n, 4), np.int64), np.empty(n))
    reached = 0
    parts: list[list[Any]] = []
    n_contacts = first_contacts(n_vertices)
    n_out, n_out_rings = 8 * n + len(subjects.vertices) + len(clips.vertices), 2 * n
    while reached < n:  # bound: each turn goes on, or makes room for one pair, geometrically
        scratch = scratch_for(n_vertices, n_rings, n_contacts, n_out, n_out_rings)
        n_known = sum(len(part[2]) - 1 for part in parts)
        reached, needs, filled, n_filled, n_pieces, n_evidence, _ = entry_of(overlay_pairs)(
            *sides, reached, NOT_REDUCED, kept, nesting, budget.flag, scratch.words, outcomes
        )
        budget.check()
        sizes = filled, filled, n_filled + 1, n_pieces + 1, n_evidence
        parts.append([array[:size].copy() for array, size in zip(scratch.output, sizes, strict=True)])
        parts[-1][4][:, 0] += n_known
        keep(scratch)
        if needs == NEEDS_CONTACTS:
            n_contacts = more_contacts(scratch.n_contacts)
            budget.take(BY_CONTACT * n_contacts)
        elif needs == NEEDS_OUTPUT:
            n_out_rings, n_out = (max(m, int(outcomes.counts[reached, k])) for k, m in ((1, n_out_rings), (2, n_out)))
    return Found(*outcomes, *(parts[0] if len(parts) == 1 else put_together(parts)))


def overlay_compiled(
    subject: RingArrays, clip: RingArrays, operation: Operation, budget: Budget, nesting: Nesting = UNNAMED,
    grid: Grid | None = None,
) -> tuple[Overlay, int] | None:  # fmt: skip
    """Return the overlay of one pair and the number of pairs of edges beyond the filter; None where it is left open.

    grid: whose units coordinates are in; those of the overlay are not. A scene outside of the kernel's range is brought
    into it by a power of two where that is exact.
    """
    found, exponent = run_pair(subject, clip, KEPT_ARRAYS[operation], budget, nesting), 0
    if found.status == OPEN:
        exponent = exponent_of(subject.vertices, clip.vertices)
        if exponent == 0 or grid is not None:
            return None
        first, second = shifted(subject.vertices, -exponent), shifted(clip.vertices, -exponent)
        if first is None or second is None:
            return None
        near = RingArrays(first, subject.offsets), RingArrays(second, clip.offsets)
        found = run_pair(*near, KEPT_ARRAYS[operation], budget, nesting)
        if found.status == OPEN:
            return None
    result: Overlay | None = None
    exact = ImplicitRings(subject, clip, found.sources, found.ring_offsets)
    known = None
    if found.status == DONE and grid is None:
        result = as_overlay(found.vertices, found.piece_offsets, found.displacement, exact)
    elif found.status == DONE and grid is not None:
        known = snap_vertices(found.vertices, found.ring_offsets, found.piece_offsets, budget)
        result = as_it_stays(found, known, grid, len(subject.vertices))
    if result is None:
        rings = found.ring_offsets, found.piece_offsets
        rounded = one_pair(found.vertices, *rings, found.displacement, found.n_exact, found.sources, found.status)
        snap = grid and functools.partial(snapped_to_units, known=known)
        result = settle_rings(rounded, exact, arranged_again, exponent == 0, budget, snap)
        if result is None:
            return None
        if grid is not None:
            result = from_units(result, grid, len(subject.vertices), arranged_again, budget)
    if exponent:
        vertices, doubtful = scaled_back(result.vertices, exponent)
        if doubtful.any() or not np.isfinite(vertices).all():
            return None
        moved = result.largest_displacement
        displacement = float(np.nextafter(np.ldexp(moved, exponent), np.inf)) if moved else 0.0
        result = replace(result, vertices=read_only(vertices), largest_displacement=displacement)
    return result, found.n_exact


def arranged_again(rings: Found, budget: Budget) -> Found:
    """Arrange the rings of each pair, each a source of its own."""
    n_rings = rings.counts[:, 1]
    items = summed(n_rings)
    shells = np.repeat(rings.piece_offsets[:-1], np.diff(rings.piece_offsets))
    subjects = PolygonArrays(read_only(rings.vertices), read_only(rings.ring_offsets), items)
    none = PolygonArrays(*NOTHING, read_only(np.zeros_like(items)))
    nesting = Nesting(shells - np.repeat(items[:-1], n_rings), ring_sizes(rings)[shells], AGAIN)
    return run_kernel(subjects, none, KEPT_ARRAYS["union"], budget, nesting)


def as_overlay(vertices: FloatArray, piece_offsets: IntArray, displacement: float, exact: ImplicitRings) -> Overlay:
    """Return an `Overlay` whose rounded rings have the structure of the exact ones; all arrays are read-only."""
    told = {"largest_displacement": displacement, "rounds": int(displacement > 0.0)}
    return made_overlay(vertices, exact.offsets, piece_offsets, exact, **told)
