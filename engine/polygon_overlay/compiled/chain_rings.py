"""Boundary rings of the regions that a choice of labels keeps, walked over chains.

The same rules as in rings.py: a walk keeps to its own region, is cut into simple rings where it passes a node twice,
and lists the points where the boundary turns or rings meet.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.jit import inline, merged
from engine.polygon_overlay.compiled.chain_faces import find_label, join
from engine.polygon_overlay.compiled.chains import Chains, is_live, leaving_edge, origin, place_before
from engine.polygon_overlay.compiled.crossing_signs import Edges, orient, turn_of_edges
from engine.polygon_overlay.compiled.edge_contacts import POLL, root_of, unite
from engine.polygon_overlay.compiled.edge_tree import BENT, DOUBTFUL, RUN
from engine.polygon_overlay.compiled.ring_labels import RingLabels, verdict

MEETS: Final = 1


class Rings(NamedTuple):
    """point: united points, ring after ring; meets: MEETS where rings meet, RUN where those up to the next point are
    left out, DOUBTFUL where an edge up to there has that mark; offset: where each ring begins; region: a number of the
    region it bounds."""

    point: Any
    meets: Any
    offset: Any
    region: Any


@inline
def choose_boundary(
    chains: Chains, n_chains: int, cycle: Any, n_cycles: int, kept: Any, starts: Any, n_nodes: int, parent: Any,
    label: Any, regions: Any, inside: Any, bounds: Any, fan: Any, sources: RingLabels, stop: Any,
) -> None:  # fmt: skip
    """Fill ``inside`` by cycle, ``bounds`` by chain, ``fan`` (boundary chains) by node, and join regions.

    kept: (4,) uint8, whether a face of that label is in the result, unless ``sources`` has shells; then
    ``sources.gathered`` is filled by region. parent, label: the joined cycles; entry n_cycles is the unbounded face,
    whose label is 0. regions: forest of the cycles, those of one face joined already.
    """
    for chain in range(n_chains):
        if chain & POLL == 0 and stop[0]:
            return
        if is_live(chains, chain):
            join(parent, label, cycle[2 * chain], cycle[2 * chain + 1], chains.mask[chain])
    _, unbounded = find_label(parent, label, n_cycles)
    for i in range(n_cycles):
        if i & POLL == 0 and stop[0]:
            return
        mask = find_label(parent, label, i)[1] ^ unbounded
        inside[i] = verdict(sources.shells, mask)[0] if sources.shells.shape[0] > 0 else kept[mask]
    fan[:n_nodes] = 0
    for chain in range(n_chains):
        if chain & POLL == 0 and stop[0]:
            return
        bounds[chain] = 0
        if is_live(chains, chain):
            left, right = cycle[2 * chain], cycle[2 * chain + 1]
            if inside[left] == inside[right]:
                unite(regions, left, right)
            else:
                bounds[chain] = 1
                fan[chains.tail[chain]] += 1
                fan[chains.head[chain]] += 1
    if sources.shells.shape[0] > 0:
        for i in range(n_cycles):
            sources.gathered[i] = 0
        for i in range(n_cycles):
            if i & POLL == 0 and stop[0]:
                return
            mask = find_label(parent, label, i)[1] ^ unbounded
            sources.gathered[root_of(regions, i)] |= verdict(sources.shells, mask)[1]


@merged
def _following(
    chains: Chains, half: int, n_simple: int, starts: Any, ends: Any, star: Any, place: Any, bounds: Any
) -> int:  # fmt: skip
    """Return the boundary half-chain that goes on around the region to the left of ``half``."""
    twin = half ^ 1
    at = place[twin]
    while True:  # bound: once around the star; the twin itself is on the boundary
        at = place_before(chains, n_simple, starts, ends, at, twin)
        if bounds[star[at] >> 1]:
            return star[at]


@inline
def _emit(
    edges: Edges, chains: Chains, nodes: Any, fan: Any, marks: Any, path: Any, first: int, last: int, region: int,
    rings: Rings, n_rings: int, n_points: int, cycle: Any, regions: Any, sources: RingLabels, stop: Any,
) -> int:  # fmt: skip
    """Write the ring of the half-chains ``path[first:last]``, straight points left out; return the number of points."""
    before, beyond = path[last - 1], 0
    start, doubt = n_points, 0  # doubt: about what the ring begins with, which goes on from its last point
    for k in range(first, last):
        if k & POLL == 0 and stop[0]:
            return n_points
        half = path[k]
        chain = half >> 1
        node = origin(chains, half)
        edge = leaving_edge(chains, half)
        if fan[node] > 2 or turn_of_edges(edges, leaving_edge(chains, before ^ 1), edge) != 0:
            rings.point[n_points] = nodes[node]
            rings.meets[n_points] = MEETS * (fan[node] > 2) | marks[edge] & DOUBTFUL
            n_points += 1
        elif n_points > start:
            rings.meets[n_points - 1] |= marks[edge] & DOUBTFUL
        else:
            doubt |= marks[edge] & DOUBTFUL
        if chains.first[chain] != chains.last[chain]:
            if half & 1:
                v, end = chains.last[chain], chains.first[chain]
                while v != end:  # bound: the vertices of the chain
                    if v & POLL == 0 and stop[0]:
                        return n_points
                    edge = edges.before[v]
                    if marks[v] & BENT or orient(edges, edge, v, edges.after[v]) != 0:
                        rings.point[n_points], rings.meets[n_points] = v, marks[edge] & (RUN | DOUBTFUL)
                        n_points += 1
                    elif n_points > start:
                        rings.meets[n_points - 1] |= marks[edge] & DOUBTFUL
                    else:
                        doubt |= marks[edge] & DOUBTFUL
                    v = edge
            else:
                v, end = chains.first[chain], chains.last[chain]
                while v != end:  # bound: the vertices of the chain
                    v = edges.after[v]
                    if v & POLL == 0 and stop[0]:
                        return n_points
                    if marks[v] & BENT or orient(edges, edges.before[v], v, edges.after[v]) != 0:
                        rings.point[n_points], rings.meets[n_points] = v, marks[v] & (RUN | DOUBTFUL)
                        n_points += 1
                    elif n_points > start:
                        rings.meets[n_points - 1] |= marks[v] & DOUBTFUL
                    else:
                        doubt |= marks[v] & DOUBTFUL
        if sources.shells.shape[0] > 0:
            beyond |= sources.gathered[root_of(regions, cycle[half ^ 1])]
        before = half
    rings.meets[n_points - 1] |= doubt
    if sources.shells.shape[0] > 0:
        sources.beyond[n_rings] = beyond
    rings.region[n_rings] = region
    rings.offset[n_rings + 1] = n_points
    return n_points


@inline
def walk_rings(
    edges: Edges, chains: Chains, n_chains: int, nodes: Any, n_nodes: int, n_simple: int, cycle: Any, inside: Any,
    regions: Any, starts: Any, ends: Any, star: Any, place: Any, bounds: Any, fan: Any, marks: Any, seen: Any,
    path: Any, path_place: Any, rings: Rings, sources: RingLabels, stop: Any,
) -> tuple[int, int]:  # fmt: skip
    """Write all boundary rings; return how many rings and points.

    marks: of the edges, BENT where the boundary surely turns at the first vertex, RUN where one stands for many,
    DOUBTFUL as clearance.py says.
    seen: (2 n_chains,) uint8; path: (2 n_chains,) and path_place: (n_nodes,) int64, scratch.
    """
    seen[: 2 * n_chains] = 0
    path_place[:n_nodes] = -1
    rings.offset[0] = 0
    n_rings = n_points = 0
    for chain in range(n_chains):
        if not bounds[chain]:
            continue
        start = 2 * chain if inside[cycle[2 * chain]] else 2 * chain + 1
        if seen[start]:
            continue
        if stop[0]:
            return n_rings, n_points
        region = root_of(regions, cycle[start])
        half, depth = start, 0
        # invariant: a node of more than two boundary chains where path[k] begins has place k, no other is on the path
        while not seen[half]:  # bound: each turn marks one half-chain
            if depth & POLL == 0 and stop[0]:
                return n_rings, n_points
            seen[half] = 1
            node = origin(chains, half)
            if fan[node] > 2:
                first = path_place[node]
                if first >= 0:
                    n_points = _emit(
                        edges, chains, nodes, fan, marks, path, first, depth, region, rings, n_rings, n_points, cycle,
                        regions, sources, stop,
                    )  # fmt: skip
                    n_rings += 1
                    for k in range(first, depth):
                        path_place[origin(chains, path[k])] = -1
                    depth = first
                path_place[node] = depth
            path[depth] = half
            depth += 1
            half = _following(chains, half, n_simple, starts, ends, star, place, bounds)
        n_points = _emit(
            edges, chains, nodes, fan, marks, path, 0, depth, region, rings, n_rings, n_points, cycle, regions, sources,
            stop,
        )  # fmt: skip
        n_rings += 1
        for k in range(depth):
            path_place[origin(chains, path[k])] = -1
    return n_rings, n_points
