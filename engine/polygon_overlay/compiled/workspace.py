"""Scratch of the compiled overlay: few arrays by size, their rows by name.

The kernel takes their addresses and makes the rows itself: passing eighty arrays costs more than a small overlay.
"""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import merged
from engine.lanes.lanes import array_at
from engine.polygon_overlay.compiled.chain_faces import Components, Faces
from engine.polygon_overlay.compiled.chain_rings import Rings, Walk
from engine.polygon_overlay.compiled.chains import Chains, Loose, Stars
from engine.polygon_overlay.compiled.clearance import Rounded
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import Events, Unions
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import DEEPEST, LEAF, PORTION, BoxTree
from engine.polygon_overlay.compiled.loading import Given
from engine.polygon_overlay.compiled.ring_nesting import FloodFill
from engine.polygon_overlay.compiled.ring_order import Output, Ranking
from engine.types import IntArray

_pool: list[Scratch] = []
"""Unused scratch for any thread; the last used comes first, since its pages are in the cache."""
small_pool: list[Scratch] = []
"""Unused scratch for `FEW_VERTICES`, taken and returned without a check of its size."""
FEW_VERTICES: Final = 500
_MOST_POOLED: Final = 256_000_000
"""Most bytes that the pool retains; a fifth of most scratch was ever written to."""
_MORE_CONTACTS: Final = 2**15
_MANY_CONTACTS: Final = 2**15

Buffers = namedtuple(
    "Buffers",
    "vertex_floats vertex_integers ring_integers contact_floats contact_integers half_integers half_labels "
    "half_octets point_floats point_integers point_octets boxes tree tree_marks stack pairs ends",
)
"""Scratch by size: a row for each purpose, by vertex, ring, contact, half-chain and point of a boundary ring."""
_VERTEX_FLOATS, _VERTEX_INTEGERS, _RING_INTEGERS, _CONTACT_FLOATS, _CONTACT_INTEGERS = 2, 5, 7, 5, 17
_HALF_INTEGERS, _HALF_LABELS, _HALF_OCTETS = 11, 2, 4
_POINT_FLOATS, _POINT_INTEGERS, _POINT_OCTETS = 2, 6, 4
"""How many rows there are of each."""
_N_SIZES: Final = 7
_N_BUFFERS: Final = len(Buffers._fields)


class Workspace(NamedTuple):
    """Scratch by name, one tuple for each step in the order of the data flow; its arrays are rows of those of
    `Buffers`."""

    given: Given
    tree: BoxTree
    events: Events
    unions: Unions
    along: Along
    chains: Chains
    stars: Stars
    loose: Loose
    faces: Faces
    components: Components
    flood: FloodFill
    walk: Walk
    rings: Rings
    rounded: Rounded
    ranking: Ranking


Outcomes = namedtuple("Outcomes", "status counts displacement")
"""By pair: status (n,) int8; counts (n, 4) int64: pieces, rings, vertices, exactly decided edge pairs; displacement
(n,) float64: the largest distance by which rounding moved a vertex."""


@dataclass(frozen=True, slots=True)
class Scratch:
    """Arrays that the kernel writes to, for pairs of at most n_vertices vertices, n_rings rings and n_contacts
    contacts. outcome: room for the outcome of one pair. addresses: sizes and addresses of buffers and output, which
    `workspace_at` and `output_at` read."""

    n_bytes: int
    n_vertices: int
    n_rings: int
    n_contacts: int
    buffers: Buffers
    output: Output
    outcome: Outcomes
    addresses: IntArray


def scratch_for(n_vertices: int, n_rings: int, n_contacts: int, n_out: int, n_out_rings: int) -> Scratch:
    """Return scratch of at least these sizes, from the pool or new; the caller hands it back by `return_scratch`.
    n_out, n_out_rings: least room for vertices and rings in the output, which always fits one pair of the other sizes:
    a contact adds at most a vertex and a ring. Pages that are not written to cost nothing; fresh pages cost more than
    the kernel does."""
    try:
        pooled: Scratch | None = _pool.pop()
    except IndexError:  # no check before: another thread may be quicker
        pooled = None
    if pooled is not None and (
        pooled.n_vertices < n_vertices or pooled.n_rings < n_rings or pooled.n_contacts < n_contacts
    ):
        n_vertices, n_rings = max(n_vertices, pooled.n_vertices), max(n_rings, pooled.n_rings)
        n_contacts, pooled = max(n_contacts, pooled.n_contacts), None
    if pooled is not None and len(pooled.output.vertices) >= n_out and len(pooled.output.rings) > n_out_rings:
        return pooled
    n_out, n_out_rings = max(n_out, n_vertices + n_contacts), max(n_out_rings, n_contacts)
    rings, pieces = np.empty(n_out_rings + 1, np.int64), np.empty(n_out_rings + 1, np.int64)
    rings[0] = pieces[0] = 0
    evidence = np.empty((n_out, 2), np.int64)
    output = Output(np.empty((n_out, 2)), np.empty((n_out, 2), np.int32), rings, pieces, evidence)
    outcome = Outcomes(np.empty(1, np.int8), np.empty((1, 4), np.int64), np.empty(1))
    if pooled is not None:
        n_vertices, n_rings, n_contacts, buffers = pooled.n_vertices, pooled.n_rings, pooled.n_contacts, pooled.buffers
    else:
        buffers = buffers_for(n_vertices, n_rings, n_contacts)
    n_bytes = sum(array.nbytes for array in (*buffers, *output))
    addresses = addresses_of(buffers, output)
    return Scratch(n_bytes, n_vertices, n_rings, n_contacts, buffers, output, outcome, addresses)


def scratch_for_few() -> Scratch:
    """Return scratch for one pair of up to `FEW_VERTICES` vertices; the caller appends it to `small_pool` later."""
    try:
        return small_pool.pop()
    except IndexError:  # as in scratch_for
        return scratch_for(FEW_VERTICES, FEW_VERTICES // 2, first_contacts(FEW_VERTICES), 0, 0)


def first_contacts(n_vertices: int) -> int:
    """Return the room for contacts to try first for a pair of n_vertices: few for large polygons, so that the scratch
    fits the pool."""
    return max(256, min(4 * n_vertices, n_vertices + _MORE_CONTACTS))


def more_contacts(n: int) -> int:
    """Return the room for contacts to try after n did not suffice: 8 n, or 2 n where memory may be refused."""
    return 8 * n if n < _MANY_CONTACTS else 2 * n


def return_scratch(scratch: Scratch) -> None:
    """Return scratch to the pool, or drop it if the pool would exceed `_MOST_POOLED` bytes."""
    if scratch.n_bytes + sum([other.n_bytes for other in _pool]) <= _MOST_POOLED:
        _pool.append(scratch)


def release() -> None:
    """Free the memory that calls cache for later ones: the workspaces of large overlays, at most 256 MB an array.

    Notes
    -----
    The next overlay allocates it again, 0.3 ms for each megabyte that it writes to.

    Examples
    --------
    >>> import engine
    >>> engine.release()
    """
    _pool.clear()
    small_pool.clear()


def buffers_for(n_vertices: int, n_rings: int, n_contacts: int) -> Buffers:
    """Allocate the buffers for pairs of at most n_vertices, n_rings and n_contacts."""
    n, k = n_vertices + 1, n_contacts + 8
    m = n + 2 * k  # points of all boundary rings: every vertex once, every end of a chain on two sides
    n_leaves = 1
    while n_leaves * LEAF < m:  # bound: 60 doublings
        n_leaves *= 2
    return Buffers(
        vertex_floats=np.empty((_VERTEX_FLOATS, n + 1)), vertex_integers=np.empty((_VERTEX_INTEGERS, n + 1), np.int32),
        ring_integers=np.empty((_RING_INTEGERS, n_rings + 1), np.int64), contact_floats=np.empty((_CONTACT_FLOATS, k)),
        contact_integers=np.empty((_CONTACT_INTEGERS, k + 1), np.int32),
        half_integers=np.empty((_HALF_INTEGERS, 2 * k + 1), np.int32),
        half_labels=np.empty((_HALF_LABELS, 2 * k + 1), np.int64),
        half_octets=np.empty((_HALF_OCTETS, 2 * k + 1), np.uint8), point_floats=np.empty((_POINT_FLOATS, m)),
        point_integers=np.empty((_POINT_INTEGERS, m), np.int32),
        point_octets=np.empty((_POINT_OCTETS, m), np.uint8), boxes=np.empty((m, 4)),
        tree=np.empty((2 * n_leaves, 4)), tree_marks=np.empty(2 * n_leaves, np.uint8),
        stack=np.empty((DEEPEST + 1, 2), np.int64), pairs=np.empty((PORTION, 2), np.int32),
        ends=np.empty((k + 1, 4), np.int32),
    )  # fmt: skip


def addresses_of(buffers: Buffers, output: Output) -> IntArray:
    """Return the sizes, then the addresses, of the arrays in buffers and output, int64 (read by `workspace_at`); the
    arrays must outlive the result."""
    sizes = (
        buffers.vertex_floats.shape[1], buffers.ring_integers.shape[1], buffers.contact_floats.shape[1],
        len(buffers.boxes), len(buffers.tree), len(output.vertices), len(output.rings),
    )  # fmt: skip
    return np.array([*sizes, *(array.ctypes.data for array in (*buffers, *output))])


@merged
def output_at(addresses: IntArray) -> Output:
    """Return the output arrays of a `Scratch` as views, from its ``addresses``."""
    n, n_rings, first = addresses[5], addresses[6], _N_SIZES + _N_BUFFERS
    return Output(
        array_at(addresses[first], (n, 2), np.float64), array_at(addresses[first + 1], (n, 2), np.int32),
        array_at(addresses[first + 2], (n_rings,), np.int64), array_at(addresses[first + 3], (n_rings,), np.int64),
        array_at(addresses[first + 4], (n, 2), np.int64),
    )  # fmt: skip


@merged
def workspace_at(addresses: IntArray) -> Workspace:
    """Return the rows of the buffers of a `Scratch` by name, as views; rows that share memory are never in use
    together."""
    n, n_rings, k, m, n_nodes = addresses[0], addresses[1], addresses[2], addresses[3], addresses[4]
    at = addresses[_N_SIZES : _N_SIZES + _N_BUFFERS]
    vx, v = array_at(at[0], (_VERTEX_FLOATS, n), np.float64), array_at(at[1], (_VERTEX_INTEGERS, n), np.int32)
    r, cx = array_at(at[2], (_RING_INTEGERS, n_rings), np.int64), array_at(at[3], (_CONTACT_FLOATS, k), np.float64)
    c, h = array_at(at[4], (_CONTACT_INTEGERS, k + 1), np.int32), array_at(at[5], (_HALF_INTEGERS, 2 * k + 1), np.int32)
    hl, hb = array_at(at[6], (_HALF_LABELS, 2 * k + 1), np.int64), array_at(at[7], (_HALF_OCTETS, 2 * k + 1), np.uint8)
    px, p = array_at(at[8], (_POINT_FLOATS, m), np.float64), array_at(at[9], (_POINT_INTEGERS, m), np.int32)
    pb, ends = array_at(at[10], (_POINT_OCTETS, m), np.uint8), array_at(at[16], (k + 1, 4), np.int32)
    boxes, nodes = array_at(at[11], (m, 4), np.float64), array_at(at[12], (n_nodes, 4), np.float64)
    node_marks, depths = array_at(at[13], (n_nodes,), np.uint8), array_at(at[14], (DEEPEST + 1, 2), np.int64)
    pairs = array_at(at[15], (PORTION, 2), np.int32)
    crossing_x, crossing_y, error = cx[3], cx[4], cx[1]
    return Workspace(
        given=Given(Edges(vx[0], vx[1], v[0], v[1], v[2], depths[DEEPEST]), v[3], r[0], r[1]),
        tree=BoxTree(boxes, pb[2], nodes, node_marks, p[2], depths[:DEEPEST], pairs),
        events=Events(c[0], c[1], c[2], cx[0], cx[1], cx[2], c[3], c[4], hb[0]),
        unions=Unions(p[3], pb[1], r[2]),
        along=Along(v[4], c[12], crossing_x, crossing_y, c[13]),
        chains=Chains(ends[:, 0], ends[:, 1], ends[:, 2], ends[:, 3], hl[1], c[5], c[6], p[1], c[7]),
        stars=Stars(p[4], c[13], c[14], c[15], h[0], h[1]),
        loose=Loose(h[3], hl[0], px[0], px[1]),
        faces=Faces(h[2], h[4], h[5], hb[1], hb[2], c[16]),
        components=Components(r[3], r[4], r[5]),
        flood=FloodFill(r[4], r[5], r[6], h[3], h[6], hl[0], h[7], h[8], h[9], h[10], c[9]),
        walk=Walk(h[6], c[8]),
        rings=Rings(p[0], p[5], pb[0], c[10], c[11]),
        rounded=Rounded(px[0], px[1], pb[3], crossing_x, crossing_y, error),
        ranking=Ranking(c[5], cx[0], cx[2], hb[0], c[6], c[7], c[8]),  # in place of chains and events
    )  # fmt: skip
