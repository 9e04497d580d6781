"""Faces of an arrangement (DCEL): half-edges in exact angular order, boundary cycles, components located in faces.

Edge e has two half-edges: 2 e runs from tail to head (to the right, or straight up), 2 e + 1 back; ``h ^ 1`` is the
twin. The face of a half-edge lies to its left. Around a node the outgoing half-edges are in counter-clockwise order;
the cycle of a face continues with the outgoing one next clockwise from the twin of the one that arrived.

A face has one cycle for each connected component of its boundary. Cycles of one face are united by one exact vertical
ray (stab) per component: from its first node (leftmost, then lowest) straight down to the next edge below.

Source: D. E. Muller, F. P. Preparata, Finding the intersection of two convex polyhedra, 1978 (half-edges, DCEL);
winding numbers as fill rules: K. Hormann, A. Agathos, The point in polygon problem for arbitrary polygons, 2001.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cmp_to_key
from typing import Any

import numpy as np

from engine.arrangement.arrange import Arrangement, Line, side
from engine.arrangement.nodes import Homogeneous
from engine.arrangement.union_find import UnionFind
from engine.running.budget import poll, polled


@dataclass(frozen=True, slots=True)
class Subdivision:
    """The faces of an arrangement. around: by node its outgoing half-edges, counter-clockwise, beginning straight down.
    faces: by half-edge the face to its left; face 0 is the unbounded one. n_faces: number of faces."""

    arrangement: Arrangement
    around: list[list[int]]
    faces: list[int]
    n_faces: int


def turn_of(first: Line, second: Line) -> int:
    """Return the sign of the turn from the direction of `first` to that of `second`: 1 left, -1 right, 0 for parallel
    lines."""
    # The direction of (a, b, .) is (b, -a); the cross product of two of them is a q - b p with its sign.
    value = second[1] * first[0] - first[1] * second[0]
    return (value > 0) - (value < 0)


def half_edges_around(arrangement: Arrangement) -> list[list[int]]:
    """Return, by node, its outgoing half-edges counter-clockwise, beginning straight down."""
    lines = arrangement.lines

    # Lines run right or straight up, so all outgoing half-edges of even number lie within one half turn, the odd ones
    # (which run against their line) within the other: inside each the turn between the lines gives the order.
    def order(first: int, second: int) -> int:
        return -turn_of(lines[first >> 1], lines[second >> 1])

    by_angle = cmp_to_key(order)
    rightward: list[list[int]] = [[] for _ in arrangement.nodes.points]
    leftward: list[list[int]] = [[] for _ in arrangement.nodes.points]
    for edge, (tail, head) in enumerate(polled(zip(arrangement.tails, arrangement.heads))):
        rightward[tail].append(2 * edge)
        leftward[head].append(2 * edge + 1)
    for fans in (rightward, leftward):
        for fan in polled(fans):
            if len(fan) > 1:
                fan.sort(key=by_angle)
    return [right + left for right, left in zip(rightward, leftward)]


def next_half_edges(around: Sequence[Sequence[int]], n_half_edges: int) -> list[int]:
    """Return, by half-edge, the next half-edge around the face to its left; -1 for half-edges not in `around`. around:
    by node its outgoing half-edges, counter-clockwise."""
    following = [-1] * n_half_edges
    for fan in polled(around):
        before = fan[-1] if fan else -1
        for half_edge in fan:
            following[half_edge ^ 1] = before
            before = half_edge
    return following


def cycles_of(following: Sequence[int]) -> tuple[list[int], int]:
    """Return, by half-edge, the number of its cycle under the permutation `following` (by half-edge the next one), and
    the number of cycles."""
    cycle = [-1] * len(following)
    n_cycles = 0
    for start in polled(range(len(following))):
        if cycle[start] < 0:
            half_edge = start
            while cycle[half_edge] < 0:  # bound: each turn numbers one half-edge
                cycle[half_edge] = n_cycles
                half_edge = following[half_edge]
            n_cycles += 1
    return cycle, n_cycles


def subdivide(arrangement: Arrangement) -> Subdivision:
    """Return the faces of `arrangement` (DCEL). Cost: linear, plus a vertical ray for each component of its edges."""
    around = half_edges_around(arrangement)
    cycle, n_cycles = cycles_of(next_half_edges(around, 2 * len(arrangement.tails)))
    # Cycle n_cycles stands for the boundary at infinity; joined to it, a cycle bounds the unbounded face.
    joined = UnionFind(n_cycles + 1)
    below = EdgesBelow(arrangement)
    for first in _first_nodes(arrangement):
        poll()
        edge = below.find(first)
        # The lowest half-edge that leaves the first node has the outer side of its component to its right.
        joined.unite(cycle[around[first][0] ^ 1], n_cycles if edge < 0 else cycle[2 * edge])
    unbounded = joined.find(n_cycles)
    numbers = {unbounded: 0}
    faces = [numbers.setdefault(joined.find(number), len(numbers)) for number in polled(cycle)]
    return Subdivision(arrangement, around, faces, len(numbers))


def _first_nodes(arrangement: Arrangement) -> list[int]:
    """Return the lexicographically first node (x, then y) of each connected component of the edges."""
    compare = arrangement.nodes.compare
    joined = UnionFind(len(arrangement.nodes.points))
    for tail, head in polled(zip(arrangement.tails, arrangement.heads)):
        joined.unite(tail, head)
    first: dict[int, int] = {}
    for node in polled(arrangement.tails):  # the first node of a component is the tail of its edges
        root = joined.find(node)
        known = first.setdefault(root, node)
        if known != node and compare(node, known) < 0:
            first[root] = node
    return list(first.values())


def label_faces(subdivision: Subdivision, masks: Sequence[Any] | None = None, winds: bool = False) -> list[Any]:
    """Return the label of each face by a flood fill from the unbounded face: the exclusive or of the masks of the edges
    crossed on the way.

    masks: by edge; None: those of the arrangement. Bit k of a label: the face lies in source k (even-odd), if each
    source is a set of closed rings. winds: masks are numbers, rings along an edge minus rings against it, and labels
    are winding numbers.
    """
    masks = subdivision.arrangement.masks if masks is None else masks
    faces = subdivision.faces
    neighbours: list[list[tuple[int, Any]]] = [[] for _ in range(subdivision.n_faces)]
    for edge, mask in enumerate(polled(masks)):
        left, right = faces[2 * edge], faces[2 * edge + 1]
        if left != right:
            neighbours[left].append((right, -mask if winds else mask))
            neighbours[right].append((left, mask))
    labels: list[Any] = [masks[0] ^ masks[0] if len(masks) else 0] * subdivision.n_faces
    reached = [False] * subdivision.n_faces
    reached[0], waiting = True, [0]
    for face in polled(waiting):  # it grows: each face is entered once, since no face is enclosed by nothing
        for other, mask in neighbours[face]:
            if not reached[other]:
                reached[other] = True
                labels[other] = labels[face] + mask if winds else labels[face] ^ mask
                waiting.append(other)
    return labels


class EdgesBelow:
    """The edges of an arrangement, for vertical rays from a node down, moved right by an infinitesimal step. Arrays of
    rounded coordinates exclude most edges (rounding is monotone), integers decide the others. A ray at x can meet the
    edges with tail.x <= x < head.x, so no vertical edge."""

    __slots__ = ("_arrangement", "_high", "_low", "_x_max", "_x_min")

    def __init__(self, arrangement: Arrangement) -> None:
        xs, ys = np.array(arrangement.nodes.xs), np.array(arrangement.nodes.ys)
        tails, heads = np.array(arrangement.tails, np.int64), np.array(arrangement.heads, np.int64)
        self._arrangement = arrangement
        self._x_min, self._x_max = xs[tails], xs[heads]
        self._low, self._high = np.minimum(ys[tails], ys[heads]), np.maximum(ys[tails], ys[heads])

    def find(self, node: int) -> int:
        """Return the first edge below node number `node`, -1 if there is none. The node must not lie in the interior of
        an edge."""
        nodes, lines = self._arrangement.nodes, self._arrangement.lines
        tails, heads = self._arrangement.tails, self._arrangement.heads
        x, y, point = nodes.xs[node], nodes.ys[node], nodes.points[node]
        near = np.flatnonzero((self._x_min <= x) & (self._x_max >= x) & (self._low <= y))
        # An edge that certainly spans x and lies below bounds the answer from below.
        certain = near[(self._x_min[near] < x) & (self._x_max[near] > x) & (self._high[near] < y)]
        if len(certain):
            near = near[self._high[near] >= self._low[certain].max()]
        best = -1
        for edge in near.tolist():
            tail, head = nodes.points[tails[edge]], nodes.points[heads[edge]]
            # spans: tail.x <= x < head.x; then the node lies above where it lies to the left.
            if tail[0] * point[2] <= point[0] * tail[2] and point[0] * head[2] < head[0] * point[2]:
                if side(lines[edge], point) > 0 and (best < 0 or _is_above(lines[edge], lines[best], point)):
                    best = edge
        return best


def _is_above(first: Line, second: Line, point: Homogeneous) -> bool:
    """Return whether line `first` is above line `second` just right of `point`; both are directed to the right."""
    # On a x + b y + c w = 0 with b > 0 and w = 1: y = -(a x + c) / b, and the slope is -a / b.
    height = (first[0] * point[0] + first[2] * point[2]) * second[1]
    other = (second[0] * point[0] + second[2] * point[2]) * first[1]
    if height != other:
        return height < other
    return first[0] * second[1] < second[0] * first[1]
