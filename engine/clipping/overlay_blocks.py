"""Runs the compiled overlay on one pair of large polygons without looking at most of their edges one by one."""

from __future__ import annotations

from types import FunctionType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from engine.clipping.overlay_expanding import expand_rings, expanded_offsets
from engine.clipping.overlay_kernel import DONE, FINISHED, NEEDS_CONTACTS, overlay_pairs
from engine.clipping.overlay_reducing import reduce_pair
from engine.clipping.overlay_workspace import keep, more_contacts, scratch_for
from engine.parallel import Budget

if TYPE_CHECKING:
    from engine.clipping.overlay_compiled import Polygons

Arrays = tuple[npt.NDArray[Any], ...]

_MANY: Final = 500
"""Vertices of a pair from which on blocks of edges are looked at first."""
_MANY_IN_RING: Final = 64
"""The same by ring: blocks of small rings are no better than their edges."""
_BLOCK: Final = 16
_BLOCKS_GROW: Final = 10_000
"""Edges of a block, and vertices from which on it has twice as many: less to look at, and more around a crossing."""
_MOST: Final = 0.5
"""Part of all edges that may be looked at one by one so that leaving out the others pays."""
_FEW_CONTACTS: Final = 1024
_NONE: Final = np.zeros(0, np.int64)

_overlay_pairs: Any = overlay_pairs
_reduce_pair: Any = reduce_pair
if isinstance(overlay_pairs, FunctionType):  # uncompiled: numpy warns of what overflows
    _overlay_pairs = np.errstate(all="ignore")(overlay_pairs)
    _reduce_pair = np.errstate(all="ignore")(reduce_pair)


def overlay_in_blocks(subject: Polygons, clip: Polygons, kept: npt.NDArray[np.uint8], budget: Budget) -> Arrays | None:
    """Overlay two polygons if they are large; return what `run_reduced` does."""
    n_vertices, n_rings = subject.most_vertices + clip.most_vertices, subject.most_rings + clip.most_rings
    if n_vertices < _MANY or n_vertices < _MANY_IN_RING * n_rings:
        return None
    size = _BLOCK if n_vertices < _BLOCKS_GROW else 2 * _BLOCK
    return run_reduced(subject, clip, size, int(_MOST * n_vertices), kept, budget)


def run_reduced(
    subject: Polygons, clip: Polygons, size: int, n_most: int, kept: npt.NDArray[np.uint8], budget: Budget
) -> Arrays | None:
    """Overlay two polygons in blocks of ``size`` edges, of which fewer than n_most may be looked at one by one.

    Returns the fields of `Found`; None where more edges are near others, or where the pair is not
    DONE: rounded rings that nothing vouches for are to be arranged again, with all their vertices.
    Raises as `Budget.check` when the call must end.
    """
    n_vertices, n_rings = subject.most_vertices + clip.most_vertices, subject.most_rings + clip.most_rings
    status, counts, displacement = np.empty(1, np.int8), np.empty((1, 4), np.int64), np.empty(1)
    n_contacts, n_out, n_out_rings = _FEW_CONTACTS, 0, 0
    while True:  # bound: each turn makes room, geometrically
        scratch = scratch_for(n_vertices, n_rings, n_contacts, n_out, n_out_rings)
        output = scratch.output
        reduced = _reduce_pair(*subject[:2], *clip[:2], size, n_most, kept, budget.flag, scratch.buffers)
        budget.check()
        if reduced[0] == 0:
            keep(scratch, n_vertices // 4, 0, 0)
            return None
        _, needs, n, n_found, n_pieces, used = _overlay_pairs(
            *subject[:3],
            *clip[:3],
            0,
            1,
            0,
            *reduced,
            kept,
            _NONE,
            _NONE,
            budget.flag,
            scratch.buffers,
            status,
            counts,
            displacement,
            *output,
        )
        budget.check()
        if needs == FINISHED:
            break
        if needs == NEEDS_CONTACTS:
            n_contacts = more_contacts(scratch.n_contacts)
        else:
            n_out_rings, n_out = int(counts[0, 1]), int(counts[0, 2])
    made = None
    if status[0] == DONE:
        few = output[0][:n], output[1][:n], output[2][:n_found]
        offsets = np.empty(n_found + 1, np.int64)
        counts[0, 2] = total = expanded_offsets(*few[1:], offsets)
        vertices, sources = np.empty((total, 2)), np.empty((total, 2), np.int32)
        expand_rings(*few, subject.vertices, clip.vertices, budget.flag, vertices, sources)
        budget.check()
        piece_offsets = np.add.accumulate(scratch.sizes[1][: n_pieces + 1])
        made = status, counts, displacement, vertices, sources, offsets, piece_offsets, _NONE
    keep(scratch, reduced[0] + n_vertices // 4, used, n)
    return made
