"""Calls the compiled overlay for pairs of polygons, and collects its output as flat arrays.

Small overlays are called so often that the Python around the kernel counts; one array or named tuple made takes a tenth
of the whole call. So `overlay_few` calls the kernel directly for two small polygons, and its output stays bytes until a
field is read.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any, Final, Literal, cast

import numpy as np

from engine.compiling.jit import entry_of
from engine.polygon_overlay.compiled.kernel import FINISHED, NEEDS_CONTACTS, NEEDS_OUTPUT, PairStatus, overlay_pairs
from engine.polygon_overlay.compiled.loading import Loaded, RingArrays
from engine.polygon_overlay.compiled.reducing import expand_rings, reduce_pair
from engine.polygon_overlay.compiled.ring_nesting import Nesting, Rule
from engine.polygon_overlay.compiled.workspace import (
    FEW_VERTICES,
    Outcomes,
    first_contacts,
    more_contacts,
    return_scratch,
    scratch_for,
    scratch_for_few,
    small_pool,
)
from engine.polygon_overlay.grid import Grid, from_units, snap_vertices, snapped_overlay, snapped_to_units
from engine.polygon_overlay.implicit_rings import NO_RINGS, ImplicitRings, one_polygon
from engine.polygon_overlay.pair_arrays import PairResults, PolygonArrays, concatenate_parts, ring_sizes
from engine.polygon_overlay.result import Overlay, build_overlay
from engine.polygon_overlay.rounds import make_valid_after_rounding
from engine.predicates.rational import exponent_of, scaled_back, shifted
from engine.running.budget import UNLIMITED, Budget
from engine.solids.polygon import Polygon
from engine.solids.ragged import summed
from engine.types import OPEN, FlagArray, FloatArray, IntArray, read_only

Operation = Literal["intersection", "union", "difference", "symmetric_difference"]

SELECTED: Final = {  # by the label of a face: in neither, in the subject, in the clip, in both
    "intersection": (False, False, False, True),
    "union": (False, True, True, True),
    "difference": (False, True, False, False),
    "symmetric_difference": (False, True, True, False),
}
SELECTED_ARRAYS: Final = {name: np.array(selected, np.uint8) for name, selected in SELECTED.items()}
EACH_PART: Final = np.arange(4, dtype=np.uint8)
"""Selection of three parts in one result: subject alone, clip alone and both, as parts 1, 2 and 3."""
NOT_REDUCED: Final = Loaded(0, 0, 0, 0.0)
"""In place of a result of `reduce_pair`: the pair is loaded in full."""
UNNAMED: Final = Nesting(np.zeros(0, np.int64), np.zeros(0), int(Rule.PAIR))
"""The nesting of two polygons, without provenance of rings."""
_MANY: Final = 500
"""Smallest number of vertices of a pair for which blocks of edges are tested first."""
_MANY_IN_RING: Final = 64
"""Smallest number of vertices a ring for that: blocks of small rings are no better than their edges."""
_BLOCK: Final = 16
_BLOCKS_GROW: Final = 10_000
"""Edges of a block (_BLOCK); number of vertices from which blocks are twice as large."""
_MOST: Final = 0.5
"""Largest fraction of edges that may be active for a reduction to pay."""
_BY_CONTACT: Final = 300
BY_VERTEX: Final = 200
"""Upper bounds in bytes of scratch and output."""
_FEW_CONTACTS: Final = 1024


def run_kernel(
    subjects: PolygonArrays, clips: PolygonArrays, selected: FlagArray, budget: Budget, nesting: Nesting = UNNAMED
) -> PairResults:
    """Overlay polygons pair by pair by the compiled kernel; raises as `Budget.check`. selected: by label 0 .. 3 the
    part of the result, one of `SELECTED_ARRAYS` or `EACH_PART`. nesting: fill rule for the rings of subjects, each a
    source of its own."""
    n_vertices, n_rings = map(sum, zip(subjects.largest_counts(), clips.largest_counts(), strict=True))
    is_plain = len(subjects.polygon_offsets) == 2 and nesting.rule == Rule.PAIR and selected[3] < 2
    if is_plain and n_vertices >= max(_MANY, _MANY_IN_RING * n_rings):
        size = _BLOCK if n_vertices < _BLOCKS_GROW else 2 * _BLOCK
        pairs = run_blocks(subjects, clips, (n_vertices, n_rings), selected, budget, UNNAMED, size)
        if pairs is not None:
            return pairs
    return cast("PairResults", run_blocks(subjects, clips, (n_vertices, n_rings), selected, budget, nesting))


def run_blocks(
    subjects: PolygonArrays, clips: PolygonArrays, largest: tuple[int, int], selected: FlagArray, budget: Budget,
    nesting: Nesting = UNNAMED, size: int = 0, max_active: float = _MOST,
) -> PairResults | None:  # fmt: skip
    """Overlay polygons pair by pair. largest: the largest numbers of vertices and rings of a pair; selected: by label
    the part.

    size: if not 0, there is one pair, reduced by blocks of so many edges; None is returned if a fraction ``max_active``
    or more of the edges is active, or the pair is not DONE: doubtful rounded rings are arranged with all their
    vertices.
    """
    n, (n_vertices, n_rings) = len(subjects.polygon_offsets) - 1, largest
    first, second = RingArrays(*subjects[:2]), RingArrays(*clips[:2])
    outcomes = Outcomes(np.empty(n, np.int8), np.empty((n, 4), np.int64), np.empty(n))
    reached, reduced = 0, NOT_REDUCED
    parts: list[list[Any]] = []
    n_contacts, n_out, n_out_rings = _FEW_CONTACTS, 0, 0
    if not size:
        n_contacts = first_contacts(n_vertices)
        n_out, n_out_rings = 8 * n + len(subjects.vertices) + len(clips.vertices), 2 * n
    while reached < n:  # bound: each turn advances, or makes room for one pair, geometrically
        scratch = scratch_for(n_vertices, n_rings, n_contacts, n_out, n_out_rings)
        if size:
            n_most = int(max_active * n_vertices)
            reduced = Loaded(*entry_of(reduce_pair)(first, second, size, n_most, budget.flag, scratch.addresses))
            if reduced.n == 0:
                budget.check()
                return_scratch(scratch)
                return None
        n_known = sum(len(part[2]) - 1 for part in parts)
        reached, needs, filled, n_filled, n_pieces, n_evidence, n_left_out = entry_of(overlay_pairs)(
            first, subjects.polygon_offsets, second, clips.polygon_offsets, reached, reduced, selected, nesting,
            budget.flag, scratch.addresses, outcomes,
        )  # fmt: skip
        budget.check()
        sizes = filled, filled, n_filled + 1, n_pieces + 1, n_evidence
        parts.append([array[:size].copy() for array, size in zip(scratch.output, sizes, strict=True)])
        parts[-1][4][:, 0] += n_known
        return_scratch(scratch)
        if needs == NEEDS_CONTACTS:
            n_contacts = more_contacts(scratch.n_contacts)
            budget.take(_BY_CONTACT * n_contacts)
        elif needs == NEEDS_OUTPUT:
            n_out_rings, n_out = (max(m, int(outcomes.counts[reached, k])) for k, m in ((1, n_out_rings), (2, n_out)))
        elif size and outcomes.status[0] != PairStatus.DONE:
            return None
        elif n_left_out:
            outcomes.counts[0, 2] += n_left_out
            parts[-1][:3] = _expand(parts[-1], n_left_out, first, second, budget)
    return PairResults(*outcomes, *(parts[0] if len(parts) == 1 else concatenate_parts(parts)))


def _expand(part: list[Any], n_left_out: int, subject: RingArrays, clip: RingArrays, budget: Budget) -> list[Any]:
    """Return vertices, sources and ring offsets of the kernel's output ``part``, with its n_left_out omitted vertices
    inserted."""
    n = len(part[0]) + n_left_out
    expanded = [np.empty((n, 2)), np.empty((n, 2), np.int32), np.empty_like(part[2])]
    entry_of(expand_rings)(*part[:3], subject.vertices, clip.vertices, budget.flag, *expanded)
    budget.check()
    return expanded


def _run_pair(
    subject: RingArrays, clip: RingArrays, operation: Operation, budget: Budget, nesting: Nesting
) -> PairResults:
    """Overlay one pair; the memory of large ones is charged to the budget first."""
    if (n_vertices := len(subject.vertices) + len(clip.vertices)) >= _MANY:
        budget.take(BY_VERTEX * n_vertices)
    first, second = (PolygonArrays(*side, one_polygon(len(side.offsets) - 1)) for side in (subject, clip))
    return run_kernel(first, second, SELECTED_ARRAYS[operation], budget, nesting)


def overlay_compiled(
    subject: RingArrays, clip: RingArrays, operation: Operation, budget: Budget, nesting: Nesting = UNNAMED,
    grid: Grid | None = None, made: PairResults | None = None,
) -> tuple[Overlay, int] | None:  # fmt: skip
    """Return the overlay of one pair and the number of exactly decided edge pairs; None if it is OPEN. grid:
    coordinates are in its units, and the result is snapped to it. made: the kernel's result, if known. A scene
    outside the kernel's range is scaled into it by a power of two, if that is exact."""
    pair, exponent = made or _run_pair(subject, clip, operation, budget, nesting), 0
    if pair.status[0] == OPEN:
        exponent = exponent_of(subject.vertices, clip.vertices)
        if exponent == 0 or grid is not None:
            return None
        first, second = shifted(subject.vertices, -exponent), shifted(clip.vertices, -exponent)
        if first is None or second is None:
            return None
        near = RingArrays(first, subject.offsets), RingArrays(second, clip.offsets)
        pair = _run_pair(*near, operation, budget, nesting)
        if pair.status[0] == OPEN:
            return None
    result: Overlay | None = None
    arrays: Any = pair[3:7]
    for array in arrays:
        array.setflags(False)  # write: by its name it takes twice as long
    exact = ImplicitRings(subject, clip, pair.sources, pair.ring_offsets)
    known = None
    if pair.status[0] == PairStatus.DONE and grid is None:
        result = as_overlay(pair.vertices, pair.piece_offsets, pair.displacement.item(), exact)
    elif pair.status[0] == PairStatus.DONE and grid is not None:
        known = snap_vertices(pair.vertices, pair.ring_offsets, pair.piece_offsets, budget)
        result = snapped_overlay(pair, known, grid, len(subject.vertices))
    if result is None:
        snap = grid and functools.partial(snapped_to_units, known=known)
        result = make_valid_after_rounding(pair, exact, rebuild_from_rounded_rings, exponent == 0, budget, snap)
        if result is None:
            return None
        if grid is not None:
            result = from_units(result, grid, len(subject.vertices), rebuild_from_rounded_rings, budget)
    if exponent:
        vertices, doubtful = scaled_back(result.vertices, exponent)
        if doubtful.any() or not np.isfinite(vertices).all():
            return None
        moved = result.largest_displacement
        displacement = float(np.nextafter(np.ldexp(moved, exponent), np.inf)) if moved else 0.0
        result = replace(result, vertices=read_only(vertices), largest_displacement=displacement)
    return result, int(pair.counts[0, 3])


def rebuild_from_rounded_rings(rings: PairResults, budget: Budget) -> PairResults:
    """Arrange the rounded rings of each pair: a face is inside if it is inside a shell and in none of its holes (rule
    AGAIN). Each ring is a source of its own."""
    n_rings = rings.counts[:, 1]
    items = summed(n_rings)
    shells = np.repeat(rings.piece_offsets[:-1], np.diff(rings.piece_offsets))
    subjects = PolygonArrays(read_only(rings.vertices), read_only(rings.ring_offsets), items)
    none = PolygonArrays(*NO_RINGS, read_only(np.zeros_like(items)))
    nesting = Nesting(shells - np.repeat(items[:-1], n_rings), ring_sizes(rings)[shells], int(Rule.AGAIN))
    return run_kernel(subjects, none, SELECTED_ARRAYS["union"], budget, nesting)


def as_overlay(vertices: FloatArray, piece_offsets: IntArray, displacement: float, exact: ImplicitRings) -> Overlay:
    """Make an `Overlay` whose rounded rings, all in read-only arrays, have the topology of the exact ones.
    displacement: the largest by rounding, 0.0 if none."""
    fields = {"largest_displacement": displacement, "rounds": int(displacement > 0.0)}
    return build_overlay(vertices, exact.offsets, piece_offsets, exact, **fields)


def overlay_few(subject: Polygon, clip: Polygon, selected: FlagArray) -> Overlay | None:
    """Return the overlay of two small polygons, without a deadline; None if they are large, or the pair is not DONE.
    selected: by label the part of the result."""
    first, second = RingArrays(subject.vertices, subject.ring_offsets), RingArrays(clip.vertices, clip.ring_offsets)
    if len(first.vertices) + len(second.vertices) > FEW_VERTICES:
        return None
    scratch = scratch_for_few()
    items = one_polygon(len(first.offsets) - 1), one_polygon(len(second.offsets) - 1)
    _, needs, n, n_rings, n_pieces, _, _ = entry_of(overlay_pairs)(
        first,
        items[0],
        second,
        items[1],
        0,
        NOT_REDUCED,
        selected,
        UNNAMED,
        UNLIMITED.flag,
        scratch.addresses,
        scratch.outcome,
    )
    status, _, displacement = scratch.outcome
    is_done, moved_by, left = (
        needs == FINISHED and status.item(0) == PairStatus.DONE,
        displacement.item(0),
        scratch.output,
    )
    vertices, sources, rings = left.vertices[:n].tobytes(), left.sources[:n].tobytes(), None
    if n_rings != 1:
        rings = left.rings[: n_rings + 1].tobytes(), left.pieces[: n_pieces + 1].tobytes()
    small_pool.append(scratch)
    if not is_done:
        return None
    fields: dict[str, Any] = {"_later": functools.partial(_fields, first, second, vertices, sources, rings)}
    if moved_by > 0.0:
        fields |= {"rounds": 1, "largest_displacement": moved_by}
    result = object.__new__(Overlay)
    object.__setattr__(result, "__dict__", fields)
    return result


def _fields(
    subject: RingArrays, clip: RingArrays, vertices: bytes, sources: bytes, rings: tuple[bytes, bytes] | None
) -> dict[str, Any]:
    """Return the fields of an `Overlay` by name. vertices, sources: the kernel's arrays as bytes; rings: offsets of
    rings and of pieces as bytes, None for a single ring."""
    places = np.frombuffer(vertices).reshape(-1, 2)
    ring_offsets, piece_offsets = one_polygon(len(places)), one_polygon(1)
    if rings is not None:
        ring_offsets, piece_offsets = (np.frombuffer(each, np.int64) for each in rings)
    exact = ImplicitRings(subject, clip, np.frombuffer(sources, np.int32).reshape(-1, 2), ring_offsets)
    n_pieces = len(piece_offsets) - 1
    return {
        "vertices": places, "ring_offsets": ring_offsets, "piece_offsets": piece_offsets, "exact": exact,
        "n_pieces_exact": n_pieces, "n_holes_exact": len(ring_offsets) - 1 - n_pieces,
    }  # fmt: skip
