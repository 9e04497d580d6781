"""The union of polygons that share edges and do not overlap (a coverage), without arranging what they share.

What remains of all edges after those of neighbours cancel (`compiled/shared_edges.py`) is arranged. Where it winds once
is the union; if it winds more often anywhere, polygons overlap, and all edges are arranged instead: then only they tell
from which input an edge of the union comes. Winding numbers after K. Hormann, A. Agathos, 2001.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.arrangement.simple_rings import find_rings
from engine.compiling.jit import entry_of
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import LEFT_OUT, RingArrays
from engine.polygon_overlay.compiled.ring_nesting import Nesting, Rule
from engine.polygon_overlay.compiled.shared_edges import cancel_edges, trace_rings
from engine.polygon_overlay.implicit_rings import NO_RINGS, ImplicitRings, edges_along, one_polygon
from engine.polygon_overlay.pair_arrays import PolygonArrays
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.run import EACH_PART, as_overlay, run_kernel
from engine.running.budget import Budget
from engine.solids.ragged import next_in_rings
from engine.types import read_only

_LEAST: Final = 256
"""Fewest edges for which to look for shared ones."""
_MOST: Final = 1 << 12
"""Most edges of one polygon: of larger ones few are shared."""
_MANY: Final = 1 << 16
"""Number of edges from which those of a sample have a small table."""
_SAMPLE: Final = 31
"""Bits that are 0 in the hashes of sampled edges: one of 32."""


def union_of_coverage(polygons: PolygonArrays, budget: Budget, is_claimed: bool = False) -> tuple[Overlay, int] | None:
    """Return the union and the number of pairs of edges decided exactly; None if few edges are shared (is_claimed: none
    is too few), the edges of one polygon do not only meet in vertices between consecutive ones, or polygons overlap."""
    vertices, n = polygons.vertices, len(polygons.vertices)
    if not n or (not is_claimed and (n < _LEAST or len(polygons.polygon_offsets) < 3)):
        return None
    places, starts = vertices.view(np.int64), np.arange(n, dtype=np.int32)
    ends = next_in_rings(polygons.ring_offsets).astype(np.int32)
    table, state = np.empty(2 << (n - 1).bit_length(), np.int32), np.zeros(n, np.int8)
    cancel, few = entry_of(cancel_edges), table if n < _MANY else table[: len(table) >> 4]
    n_seen, n_cancelled = cancel(places, starts, ends, _SAMPLE, few, state, budget.flag)
    if n_cancelled < 0 and few is not table:  # of whole numbers the hashes are such that more are in the sample
        state[:] = 0
        n_seen, n_cancelled = cancel(places, starts, ends, _SAMPLE, table, state, budget.flag)
    if 2 * n_cancelled < n_seen and not is_claimed:
        return None
    following, sides = np.empty(n, np.int64), np.zeros(n, np.int8)
    n_known = entry_of(find_rings)(vertices, *polygons[1:], n if is_claimed else _MOST, following, sides, budget.flag)
    budget.check()
    if n_known < np.count_nonzero(np.diff(polygons.polygon_offsets)):
        return None
    is_left, state[:] = sides > 0, 0
    tails, heads = np.where(is_left, starts, ends), np.where(is_left, ends, starts)
    if cancel(places, tails, heads, 0, table, state, budget.flag)[1] < 0:
        return None
    edges, rings = np.empty(n, np.int32), np.empty(n + 1, np.int64)
    links = np.empty((2, n), np.int32)
    n_left, n_rings = entry_of(trace_rings)(places, tails, heads, table, state, links, edges, rings, budget.flag)
    budget.check()
    edges, offsets = edges[:n_left], read_only(rings[: n_rings + 1])
    left = PolygonArrays(read_only(vertices[tails[edges]]), offsets, one_polygon(n_rings))
    nesting = Nesting(np.zeros(n_rings, np.int64), np.zeros(0), int(Rule.ONCE))
    pair = run_kernel(left, PolygonArrays(*NO_RINGS, one_polygon(0)), EACH_PART, budget, nesting)
    is_done = pair.status[0] == PairStatus.DONE and not pair.displacement[0] and (pair.evidence[:, 1] == 1).all()
    if not is_done or (pair.sources[:, 1] >= 0).any():
        return None
    named, along = tails[edges[pair.sources[:, 0]]], edges[edges_along(pair.sources)]
    sources = read_only(np.column_stack([named, np.where(along == named, -1, LEFT_OUT - 1 - along)]).astype(np.int32))
    exact = ImplicitRings(RingArrays(*polygons[:2]), NO_RINGS, sources, read_only(pair.ring_offsets))
    result = as_overlay(read_only(pair.vertices), read_only(pair.piece_offsets), 0.0, exact)
    return result, int(pair.counts[0, 3])
