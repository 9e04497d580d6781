"""Labels of the faces of two polygons, carried along the rings: bit 0 inside the subject, bit 1 inside the clip.

The label to the left of a chain and its source mask tell that to its right. Where a ring passes a simple node, the
label to its left changes by the mask of the ring that it crosses, whose label there is then known as well: so one ring
after another is walked. At other nodes the star tells the label of each half-chain in it. The first label of each
component is that of the face it lies in, so components are taken from the outside in.

              e|                 Left of chain c it is L. Beyond ring e it is L ^ mask(e), which is left of c + 1;
          L    |  L ^ mask(e)    right of e as it rises here, left of it if it falls.
     ---c----->o---c + 1--->
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

from engine.arrangement.union_find import root_of
from engine.jit import called, inline, merged
from engine.polygon_overlay.compiled.boundary.chain_faces import NOTHING
from engine.polygon_overlay.compiled.boundary.chains import ALONE, is_live, origin, standing
from engine.polygon_overlay.compiled.edge_contacts import BEGINS

BOUNDS: Final = 1
INSIDE: Final = 2
SEEN: Final = 4
FORKED: Final = 8
LABELLED: Final = 16
_OF_CLIP: Final = 128
"""Bits of the state of a half-chain: its chain bounds a region, its own face is in the result, it was walked, rings
meet where it begins, its ring has a label or will have, its ring is one of the clip's."""
_LABEL: Final = 5
"""The lower of the two bits of the label."""

Labels = namedtuple("Labels", "queue beyond")
"""Scratch by ring: rings yet to be walked, each as one of its chains; and of the one that stands for a component the
half-chain whose face the component lies in, or NOTHING."""


@merged
def label_of(state: int) -> int:
    """Return the label of the face of a half-chain whose state has one."""
    return (state >> _LABEL) & 3


@merged
def _enter(state: Any, kept: Any, half: int, label: int, mask: int) -> None:
    """Enter the label to the left of a half-chain, and to the right of it, which is that of its twin."""
    beyond = label ^ mask
    bounds = BOUNDS * (kept[label] != kept[beyond])
    stays = state[half] & (_OF_CLIP | LABELLED)
    state[half] = stays | bounds | INSIDE * (kept[label] != 0) | label << _LABEL
    state[half ^ 1] = stays | bounds | INSIDE * (kept[beyond] != 0) | beyond << _LABEL


@merged
def _chains_of(w: Any, chain: int, sizes: tuple[int, int, int, int]) -> tuple[int, int]:
    """Return the first chain of the ring of a chain, and the end of its last."""
    n_rings, n_chains, _, _ = sizes
    ring = w.given.edges.ring[w.chains.first[chain]]
    end = n_chains if ring + 1 == n_rings else w.chains.at[w.given.tops[ring + 1]]
    return w.chains.at[w.given.tops[ring]], end


@inline
def _take(w: Any, state: Any, chain: int, n: int, sizes: tuple[int, int, int, int]) -> int:
    """Put the ring of a chain in the queue of n rings unless it was there; return how many these are then."""
    if state[2 * chain] & LABELLED:
        return n
    first, end = _chains_of(w, chain, sizes)
    for half in range(2 * first, 2 * end):
        state[half] |= LABELLED
    w.labels.queue[n] = chain
    return n + 1


@called
def _go_around(w: Any, state: Any, kept: Any, half: int, n: int, sizes: tuple[int, int, int, int]) -> int:
    """Enter the labels around the node where a half-chain of known label begins, and take the rings that pass there."""
    chains, stars = w.chains, w.stars
    node = origin(chains, half)
    first, last, at, label = stars.starts[node], stars.ends[node], stars.place[half], label_of(state[half])
    w.faces.fan[node] = 1
    for _ in range(last - first):
        at = at + 1 if at + 1 < last else first
        other = stars.half[at]
        mask = chains.mask[other >> 1]
        label ^= mask  # order: to the right of it is what was to the left of the one before
        _enter(state, kept, other, label, mask)
        chain = other >> 1
        while chain >= 0:  # bound: the chains that coincide
            n = _take(w, state, chain, n, sizes)
            chain = chains.twin[chain]
    return n


@merged
def _walk_ring(w: Any, state: Any, kept: Any, begin: int, n: int, sizes: tuple[int, int, int, int], stop: Any) -> int:
    """Enter the labels of a ring, from a chain on whose label is known; return how many rings the queue then has."""
    chains, (first, end) = w.chains, _chains_of(w, begin, sizes)
    chain, label = begin, label_of(state[standing(chains, 2 * begin)])
    while True:  # bound: once around the ring
        if stop[0]:
            return n
        after = chain + 1 if chain + 1 < end else first
        across = chains.across[after]
        if across >= 0:
            other = across & ~1
            mask = 1 + (state[other] >> 7)
            label ^= mask
            if not state[other] & LABELLED:  # to its left is what is left, or right, of the chain after
                _enter(state, kept, other, label ^ (mask if across & 1 else chains.mask[after]), mask)
                n = _take(w, state, other >> 1, n, sizes)
        elif across != ALONE:
            if w.faces.fan[chains.head[chain]] == 0:
                n = _go_around(w, state, kept, standing(chains, 2 * chain + 1), n, sizes)
            label = label_of(state[standing(chains, 2 * after)])
        chain = after
        if chain == begin:
            return n
        if is_live(chains, chain):
            _enter(state, kept, 2 * chain, label, chains.mask[chain])


@merged
def _label_component(w: Any, state: Any, kept: Any, base: int, sizes: tuple[int, int, int, int], stop: Any) -> None:
    """Enter the labels of the component at place ``base`` of the queue, which is used from there on."""
    chains, stars, queue = w.chains, w.stars, w.labels.queue
    root = queue[base]
    beyond, node = w.labels.beyond[root], stars.node_of[root_of(w.unions.points, w.components.highest[root])]
    outer = stars.half[stars.ends[node] - 1]
    _enter(state, kept, outer, 0 if beyond == NOTHING else label_of(state[beyond]), chains.mask[outer >> 1])
    if w.unions.is_node[w.components.highest[root]] == BEGINS:
        first, end = _chains_of(w, outer >> 1, sizes)
        if end - first == 1:  # case: a ring that meets nothing
            state[2 * first] |= LABELLED
            state[2 * first + 1] |= LABELLED
            return
        n = _take(w, state, outer >> 1, base, sizes)
    else:
        n = _go_around(w, state, kept, outer, base, sizes)
    while n > base:  # bound: the rings of the component
        if stop[0]:
            return
        n = _walk_ring(w, state, kept, queue[n - 1], n - 1, sizes, stop)


@inline
def label_rings(w: Any, kept: Any, sizes: tuple[int, int, int, int], stop: Any) -> None:
    """Fill the state of all half-chains. kept: by label the part of the result that such a face is in, or 0.

    w: the `Workspace`, with components joined. sizes: the numbers of rings, chains, simple nodes and nodes.
    """
    n_rings, n_chains, n_simple, n_nodes = sizes
    chains, state, labels = w.chains, w.faces.state, w.labels
    for chain in range(n_chains):
        state[2 * chain] = state[2 * chain + 1] = _OF_CLIP * (chains.mask[chain] == 2)
    w.faces.fan[n_simple:n_nodes] = 0
    for ring in range(n_rings):
        root, n = ring if w.components.highest[ring] >= 0 else NOTHING, 0
        while root != NOTHING and not state[2 * chains.at[w.given.tops[root]]] & LABELLED:  # bound: those it lies in
            labels.queue[n] = root
            n, beyond = n + 1, labels.beyond[root]
            if beyond == NOTHING:
                break
            root = root_of(w.unions.rings, w.given.edges.ring[chains.first[beyond >> 1]])
        for k in range(n - 1, -1, -1):
            if stop[0]:
                return
            _label_component(w, state, kept, k, sizes, stop)
