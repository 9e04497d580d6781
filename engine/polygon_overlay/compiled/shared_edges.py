"""What remains of the edges of many polygons where neighbours share theirs.

Each boundary, with the interior on its left, winds once around its interior and not around the rest. The sum of all
winds around each point as often as polygons contain it. In it two edges with the same ends in opposite directions
cancel, so the union is where what remains winds (K. Hormann, A. Agathos, 2001), whatever polygons they are.
"""

from __future__ import annotations

from typing import Final

from engine.compiling.jit import inline, kernel
from engine.types import FlagArray, Int8Array, Int32Array, IntArray

_NONE: Final = -1
_POLL: Final = 0x3FFF
_MOST_PROBES: Final = 1 << 10
"""Most slots that are looked at for an edge: more are taken by many equal edges alone."""


@inline
def _hash_of(places: IntArray, vertex: int) -> int:
    """Return a hash of a vertex from the bits of its coordinates."""
    h = places[vertex, 0] * 0x1E3779B97F4A7C15 ^ places[vertex, 1] * 0x3F58476D1CE4E5B9
    return int(h ^ (h >> 29))


@inline
def _slot_of(h: int, mask: int) -> int:
    """Return the first slot of a hash in a table of mask + 1 slots."""
    return (h * 0x14D049BB133111EB >> 31) & mask


@inline
def _are_same(places: IntArray, u: int, v: int) -> bool:
    """Return whether two vertices are equal."""
    return bool((places[u, 0] == places[v, 0]) & (places[u, 1] == places[v, 1]))


@kernel
def cancel_edges(
    places: IntArray, tails: Int32Array, heads: Int32Array, sample: int, table: Int32Array, state: Int8Array,
    stop: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Set state (n,), zero on entry, to 1 for edges that cancel in pairs; return the numbers of edges seen and of those
    cancelled. Edge e runs from vertex tails[e] to heads[e]; places (n, 2) int64: the bits of all coordinates. sample:
    if not 0, only edges without these bits in their hash are seen, and equal ones cancel in either direction. table: a
    power of two of slots, at least 2 n. Ends early, with -1 for the last number, if two edges are equal in one
    direction (polygons overlap), or very many share a slot; or if `stop` is set."""
    mask, n_seen, n_cancelled = len(table) - 1, 0, 0
    table[:] = _NONE
    for e in range(len(tails)):
        if e & _POLL == 0 and stop[0] != 0:
            break
        h = _hash_of(places, tails[e]) + _hash_of(places, heads[e])
        if h >> 7 & sample != 0:
            continue
        n_seen += 1
        slot = _slot_of(h, mask)
        for _ in range(_MOST_PROBES + 1):
            f = table[slot]
            if f == _NONE:
                break
            is_pair = _are_same(places, tails[e], heads[f]) and _are_same(places, heads[e], tails[f])
            is_twin = _are_same(places, tails[e], tails[f]) and _are_same(places, heads[e], heads[f])
            if is_twin and sample == 0 and state[f] == 0:
                return n_seen, -1
            if (is_pair or is_twin) and state[f] == 0:
                state[e] = state[f] = 1
                n_cancelled += 2
                break
            slot = (slot + 1) & mask
        if state[e] == 0:
            if table[slot] != _NONE:
                return n_seen, -1
            table[slot] = e
    return n_seen, n_cancelled


@kernel
def trace_rings(
    places: IntArray, tails: Int32Array, heads: Int32Array, table: Int32Array, state: Int8Array, links: Int32Array,
    edges: Int32Array, rings: IntArray, stop: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Join the edges with state 0, as many of which begin at each place as end there, to closed rings; return the
    numbers of edges and of rings, written to edges (n,) and, as offsets, rings (n + 1,). links (2, n): scratch; others
    as in `cancel_edges`. The result is incomplete if `stop` is set."""
    mask, n, n_rings = len(table) - 1, 0, 0
    following, first = links[0], links[1]  # by edge the next from its place; by edge in the table the first of these
    table[:] = _NONE
    for e in range(len(tails) - 1, -1, -1):
        if state[e] == 0:
            slot = _slot_of(_hash_of(places, tails[e]), mask)
            while table[slot] != _NONE and not _are_same(places, tails[table[slot]], tails[e]):  # bound: as above
                slot = (slot + 1) & mask
            if table[slot] == _NONE:
                table[slot], first[e] = e, _NONE
            following[e], first[table[slot]] = first[table[slot]], e
    rings[0] = 0
    for start in range(len(tails)):
        e = start
        while state[e] == 0 and stop[0] == 0:  # bound: each edge once
            state[e], edges[n] = 1, e
            n += 1
            if _are_same(places, heads[e], tails[start]):
                n_rings += 1
                rings[n_rings] = n
                break
            slot = _slot_of(_hash_of(places, heads[e]), mask)
            while not _are_same(places, tails[table[slot]], heads[e]):  # bound: an edge begins there
                slot = (slot + 1) & mask
            at = table[slot]
            while state[first[at]] != 0:  # bound: each edge is passed once
                first[at] = following[first[at]]
            e = first[at]
    return n, n_rings
