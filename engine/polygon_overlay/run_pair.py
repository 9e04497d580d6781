"""Runs the compiled overlay on one pair of polygons; of large ones without looking at most edges one by one.

Small overlays are called so often that what stands around the kernel counts, of which an array made, or a tuple with
names, takes a tenth of the whole call: nothing is made that is not asked for. For two small polygons the kernel is
called at once, and what it leaves stays bytes until it is asked for.
"""

from __future__ import annotations

import functools
from typing import Any, Final, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from engine.arrays import FlagArray, FloatArray, Int32Array, IntArray
from engine.budget import UNLIMITED, Budget
from engine.direct import entry_of
from engine.polygon_overlay.compiled.boundary.ring_nesting import PAIR, Nesting
from engine.polygon_overlay.compiled.kernel import DONE, FINISHED, NEEDS_CONTACTS, overlay_pairs
from engine.polygon_overlay.compiled.loading import Loaded, RingArrays
from engine.polygon_overlay.compiled.reducing import expand_rings, reduce_pair
from engine.polygon_overlay.compiled.ring_order import Output
from engine.polygon_overlay.compiled.workspace import (
    FEW_VERTICES,
    first_contacts,
    keep,
    more_contacts,
    scratch_for,
    scratch_for_few,
    spare,
)
from engine.polygon_overlay.implicit_rings import ImplicitRings, one_polygon
from engine.polygon_overlay.result import Overlay
from engine.solids.polygon import Polygon

NOT_REDUCED: Final = Loaded(0, 0, 0, 0.0)
"""What stands in the place of the result of reduce_pair."""
_MANY: Final = 500
"""Vertices of a pair from which on blocks of edges are looked at first."""
_MANY_IN_RING: Final = 64
"""The same by ring: blocks of small rings are no better than their edges."""
_BLOCK: Final = 16
_BLOCKS_GROW: Final = 10_000
"""Edges of a block, and vertices from which on it has twice as many: less to look at, and more around a crossing."""
_MOST: Final = 0.5
"""Part of all edges that may be looked at one by one so that leaving out the others pays."""
BY_CONTACT: Final = 300
_BY_VERTEX: Final = 200
"""Bytes of scratch and answer for each of them, at most."""
_FEW_CONTACTS: Final = 1024
UNNAMED: Final = Nesting(np.zeros(0, np.int64), np.zeros(0), PAIR)
"""That of two polygons."""
_INT32: Final = np.dtype(np.int32)
_INT64: Final = np.dtype(np.int64)
"""Types that numpy need not look up."""


_Rings = tuple[FloatArray, Int32Array, IntArray]


class FoundPair(NamedTuple):
    """What the kernel found for one pair; arrays are read-only, and no rings if it is OPEN.

    status: DONE, OPEN or MAY_CROSS. n_exact: pairs of edges beyond the filter. displacement: how far rounding moved a
    vertex at most. vertices, sources, ring_offsets, piece_offsets: those of `Found`.
    """

    status: int
    n_exact: int
    displacement: float
    vertices: FloatArray
    sources: Int32Array
    ring_offsets: IntArray
    piece_offsets: IntArray


def run_pair(
    subject: RingArrays, clip: RingArrays, kept: FlagArray, budget: Budget, nesting: Nesting = UNNAMED
) -> FoundPair:
    """Overlay two polygons, or the rings of one by a rule. Raises as `Budget.check` when the call must end."""
    n_vertices = len(subject.vertices) + len(clip.vertices)
    if (
        nesting.rule == PAIR
        and n_vertices >= _MANY
        and n_vertices >= _MANY_IN_RING * (len(subject.offsets) + len(clip.offsets) - 2)
    ):
        size = _BLOCK if n_vertices < _BLOCKS_GROW else 2 * _BLOCK
        found = run_blocks(subject, clip, size, int(_MOST * n_vertices), kept, budget)
        if found is not None:
            return found
    return cast("FoundPair", run_blocks(subject, clip, 0, 0, kept, budget, nesting))


def run_blocks(
    subject: RingArrays, clip: RingArrays, size: int, n_most: int, kept: FlagArray, budget: Budget,
    nesting: Nesting = UNNAMED,
) -> FoundPair | None:  # fmt: skip
    """Overlay two polygons in blocks of ``size`` edges, of which fewer than n_most may be looked at one by one.

    None where more edges are near others, or where the pair is not DONE: rounded rings that nothing vouches for are to
    be arranged again, with all their vertices. Size 0: all edges one by one, and never None. Raises as `Budget.check`
    when the call must end.
    """
    n_vertices, n_rings = len(subject.vertices) + len(clip.vertices), len(subject.offsets) + len(clip.offsets) - 2
    sides = subject, one_polygon(len(subject.offsets) - 1), clip, one_polygon(len(clip.offsets) - 1)
    reduced, n_contacts, n_out, n_out_rings = NOT_REDUCED, _FEW_CONTACTS, 0, 0
    if not size:
        n_contacts, n_out, n_out_rings = first_contacts(n_vertices), 8 + n_vertices, 2
    if n_vertices >= _MANY:
        budget.take(_BY_VERTEX * n_vertices)
    while True:  # bound: each turn makes room, geometrically
        scratch = scratch_for(n_vertices, n_rings, n_contacts, n_out, n_out_rings)
        if size:
            reduced = entry_of(reduce_pair)(subject, clip, size, n_most, kept, budget.flag, scratch.words)
            if reduced.n == 0:
                budget.check()
                keep(scratch)
                return None
        (status, counts, displacement), output = scratch.outcome, scratch.output
        _, needs, n, n_found, n_pieces, _, n_left_out = entry_of(overlay_pairs)(
            *sides, 0, reduced, kept, nesting, budget.flag, scratch.words, scratch.outcome
        )
        budget.check()
        if needs == FINISHED:
            break
        keep(scratch)
        if needs == NEEDS_CONTACTS:
            n_contacts = more_contacts(scratch.n_contacts)
            budget.take(BY_CONTACT * n_contacts)
        else:
            n_out_rings, n_out = int(counts[0, 1]), int(counts[0, 2])
    made = None
    if not size or status.item(0) == DONE:
        if size:
            found = _expanded(output, n + n_left_out, n_found, subject, clip, budget)
        else:
            found = _copied(output.vertices, n), _copied(output.sources, n), _copied(output.rings, n_found + 1)
        pieces = _copied(output.pieces, n_pieces + 1)
        made = FoundPair(status.item(0), counts.item(3), displacement.item(0), *found, pieces)
    keep(scratch)
    return made


def _expanded(output: Output, n: int, n_rings: int, subject: RingArrays, clip: RingArrays, budget: Budget) -> _Rings:
    """Return vertices, sources and offsets of rings, n vertices in all, with what was left out of them."""
    made: Any = np.empty((n, 2)), np.empty((n, 2), _INT32), np.empty(n_rings + 1, _INT64)
    entry_of(expand_rings)(
        output.vertices, output.sources, output.rings, subject.vertices, clip.vertices, budget.flag, *made
    )
    budget.check()
    for array in made:
        array.setflags(False)  # as in _copied
    return cast("_Rings", made)


def _copied(array: npt.NDArray[Any], n: int) -> npt.NDArray[Any]:
    """Return the first rows of an array, as a read-only array of their own."""
    made: Any = array[:n].copy()
    made.setflags(False)  # write: by its name it takes twice as long
    return cast("npt.NDArray[Any]", made)


def overlay_few(subject: Polygon, clip: Polygon, kept: FlagArray) -> Overlay | None:
    """Return the overlay of two polygons, without a limit; None of more vertices, or where the kernel leaves doubt."""
    first, second = RingArrays(subject.vertices, subject.ring_offsets), RingArrays(clip.vertices, clip.ring_offsets)
    if len(first.vertices) + len(second.vertices) > FEW_VERTICES:
        return None
    scratch = scratch_for_few()
    items = one_polygon(len(first.offsets) - 1), one_polygon(len(second.offsets) - 1)
    _, needs, n, n_rings, n_pieces, _, _ = entry_of(overlay_pairs)(
        first, items[0], second, items[1], 0, NOT_REDUCED, kept, UNNAMED, UNLIMITED.flag, scratch.words, scratch.outcome
    )
    status, _, displacement = scratch.outcome
    is_done, moved_by, left = needs == FINISHED and status.item(0) == DONE, displacement.item(0), scratch.output
    vertices, sources, rings = left.vertices[:n].tobytes(), left.sources[:n].tobytes(), None
    if n_rings != 1:
        rings = left.rings[: n_rings + 1].tobytes(), left.pieces[: n_pieces + 1].tobytes()
    spare.append(scratch)
    if not is_done:
        return None
    told: dict[str, Any] = {"_later": functools.partial(_fields, first, second, vertices, sources, rings)}
    if moved_by > 0.0:
        told |= {"rounds": 1, "largest_displacement": moved_by}
    result = object.__new__(Overlay)
    object.__setattr__(result, "__dict__", told)
    return result


def _fields(
    subject: RingArrays, clip: RingArrays, vertices: bytes, sources: bytes, rings: tuple[bytes, bytes] | None
) -> dict[str, Any]:
    """Return the fields of an `Overlay` that are made when one of them is asked for."""
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
