"""From exact rings to doubles that are still valid: round, arrange again, until nothing moves.

Rounding every vertex to the nearest double may make edges cross, rings touch along edges, slivers vanish. So the
rounded rings are taken as input again: each ring is a source of its own in an exact arrangement, a face is inside where
it lies in a shell and in no hole of that shell, and the pieces are traced anew. New crossings are rounded in turn. If
all vertices are doubles, nothing is left to round and the rings, being traced from an exact arrangement, are valid.

That almost always ends after one to three rounds; where it has not after `MAX_ROUNDS`, the exact rings are snapped to
the lattice whose spacing is the unit in the last place of the largest coordinate (snap_rounding.py), after which it
ends by construction. Each round moves an edge by no more than its ends, so the displacements add up to a bound.

Which exact part an output part comes from is carried along as bits, so that lost, joined and parted ones are counted.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import frexp, hypot, inf, nextafter, ulp
from typing import Final

import numpy as np

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.nodes import NodeTable, float_nodes
from engine.arrangement.rings import Piece, trace_pieces
from engine.arrangement.snap_rounding import snap_rings
from engine.arrangement.subdivision import label_faces, subdivide
from engine.arrangement.union_find import UnionFind
from engine.errors import TooComplexError
from engine.parallel import Budget

MAX_ROUNDS: Final = 12
"""Rounds before snapping: on 4,296 results of public test pairs all but 14 had ended by then."""

Vertex = tuple[float, float]
Ring = list[Vertex]


@dataclass(slots=True)
class Rounded:
    """Pieces as rings of doubles, shell first, and where they come from.

    piece_origins, hole_origins: for each piece, and for each hole in the same order, the numbers of the exact ones.
    """

    pieces: list[list[Ring]]
    piece_origins: list[set[int]]
    hole_origins: list[set[int]]
    rounds: int = 0
    displacement: float = 0.0
    snapped: bool = False


def rounded_ring(nodes: NodeTable, ring: Iterable[int]) -> Ring:
    """Return the nearest doubles of the nodes of `ring`, none repeated in succession."""
    return without_repeats((nodes.xs[node], nodes.ys[node]) for node in ring)


def without_repeats(vertices: Iterable[Vertex]) -> Ring:
    """Return a ring, none of its vertices repeated in succession."""
    result: Ring = []
    for vertex in vertices:
        if not result or result[-1] != vertex:
            result.append(vertex)
    while len(result) > 1 and result[0] == result[-1]:
        result.pop()
    return result


def _displacement(nodes: NodeTable, pieces: Sequence[Piece]) -> float:
    """Return a bound on how far rounding moves a vertex of `pieces`; 0 where all are doubles."""
    used = {node for piece in pieces for ring in (piece.shell, *piece.holes) for node in ring}
    return max(map(nodes.displacement, used), default=0.0)


def round_to_nearest(nodes: NodeTable, pieces: Sequence[Piece]) -> Rounded:
    """Return every vertex rounded to the nearest double; rings without area are left out. May be invalid."""
    result = Rounded([], [], [], displacement=_displacement(nodes, pieces))
    result.rounds = 1 if result.displacement else 0
    n_holes = 0
    for number, piece in enumerate(pieces):
        rings = [rounded_ring(nodes, ring) for ring in (piece.shell, *piece.holes)]
        if has_area(rings[0]):
            kept = [k for k, ring in enumerate(rings) if k == 0 or has_area(ring)]
            result.pieces.append([rings[k] for k in kept])
            result.piece_origins.append({number})
            result.hole_origins += [{n_holes + k - 1} for k in kept[1:]]
        n_holes += len(piece.holes)
    result.pieces = in_order(result.pieces)  # each part has one origin: their order tells nothing
    return result


def in_order(pieces: Iterable[list[Ring]]) -> list[list[Ring]]:
    """Return pieces and their holes in lexicographic order, each ring from its leftmost, then lowest vertex.

    A ring that passes that vertex more than once, as rounding may leave it, begins so that it comes first in the order.
    """
    turned = [[_from_first(ring) for ring in piece] for piece in pieces]
    return sorted([shell, *sorted(holes)] for shell, *holes in turned)


def _from_first(ring: Ring) -> Ring:
    first = min(ring)
    if ring.count(first) == 1:
        start = ring.index(first)
    else:
        start = min((k for k, vertex in enumerate(ring) if vertex == first), key=lambda k: ring[k:] + ring[:k])
    return ring[start:] + ring[:start]


def has_area(ring: Ring) -> bool:
    """Tell whether the signed area of `ring` is not zero, exactly."""
    if len(ring) < 3:
        return False
    nodes, numbers = float_nodes(np.array(ring))
    points = [nodes.points[number] for number in numbers]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, points[1:] + points[:1])) != 0


def round_to_valid(nodes: NodeTable, pieces: Sequence[Piece], budget: Budget) -> Rounded:
    """Return rings of doubles that form valid pieces, each edge within `displacement` of its exact one."""
    exact_nodes, exact_pieces = nodes, pieces
    piece_origins = [{number} for number in range(len(pieces))]
    hole_origins = [{number} for number in range(sum(len(piece.holes) for piece in pieces))]
    rounds, displacement, snapped = 0, 0.0, False
    while moved := _displacement(nodes, pieces):  # bound: MAX_ROUNDS + 1
        budget.check()
        if snapped:
            raise TooComplexError("snap rounding left a vertex off its lattice; please report this input")
        if rounds < MAX_ROUNDS:
            rings = [[rounded_ring(nodes, ring) for ring in (piece.shell, *piece.holes)] for piece in pieces]
            rounds, displacement = rounds + 1, nextafter(displacement + moved, inf)
        else:
            nodes, pieces, snapped = exact_nodes, exact_pieces, True
            piece_origins = [{number} for number in range(len(pieces))]
            hole_origins = [{number} for number in range(sum(len(piece.holes) for piece in pieces))]
            rings, displacement = _snapped(nodes, pieces, budget)
        nodes, pieces = _arranged_again(rings, budget)
        piece_origins, hole_origins = _origins(rings, pieces, piece_origins, hole_origins)
    return Rounded(
        pieces=[[rounded_ring(nodes, ring) for ring in (piece.shell, *piece.holes)] for piece in pieces],
        piece_origins=piece_origins,
        hole_origins=hole_origins,
        rounds=rounds,
        displacement=displacement,
        snapped=snapped,
    )


def _snapped(nodes: NodeTable, pieces: Sequence[Piece], budget: Budget) -> tuple[list[list[Ring]], float]:
    """Return the pieces snapped to the lattice of their largest coordinate, and half a pixel's diagonal, rounded up."""
    used = [node for piece in pieces for ring in (piece.shell, *piece.holes) for node in ring]
    largest = max(max(abs(nodes.xs[node]), abs(nodes.ys[node])) for node in used)
    spacing = ulp(largest)
    exact = [[nodes.exact(node) for node in ring] for piece in pieces for ring in (piece.shell, *piece.holes)]
    snapped = iter(snap_rings(exact, frexp(spacing)[1] - 1, budget))
    rings = [[next(snapped) for _ in (piece.shell, *piece.holes)] for piece in pieces]
    return rings, nextafter(hypot(spacing, spacing) / 2, inf)


def _arranged_again(pieces: Sequence[Sequence[Ring]], budget: Budget) -> tuple[NodeTable, list[Piece]]:
    """Trace the pieces anew from the exact arrangement of rounded rings; bit k of all masks belongs to ring k."""
    rings = [ring for piece in pieces for ring in piece]
    holes_of: dict[int, int] = {}  # for each shell's bit the bits of its holes
    first = 0
    for piece in pieces:
        holes_of[first] = (1 << (first + len(piece))) - (1 << (first + 1))
        first += len(piece)
    all_shells = sum(1 << bit for bit in holes_of)
    offsets = np.cumsum([0, *map(len, rings)]).tolist()
    coordinates = np.array([vertex for ring in rings for vertex in ring], np.float64).reshape(-1, 2)
    arrangement = arrange_rings(coordinates, offsets, [1 << bit for bit in range(len(rings))], budget)
    subdivision = subdivide(arrangement, budget)
    budget.check()

    def verdict(label: int) -> tuple[bool, int]:
        """Tell whether a face is inside, and name the shells it lies in, or else the holes."""
        shells, inside = label & all_shells, 0
        while shells:
            shell = shells & -shells
            if not label & holes_of[shell.bit_length() - 1]:
                inside |= shell
            shells ^= shell
        return inside != 0, inside or label & ~all_shells

    known: dict[int, tuple[bool, int]] = {}
    verdicts = []
    for label in label_faces(subdivision):
        if label not in known:
            known[label] = verdict(label)
        verdicts.append(known[label])
    traced = trace_pieces(subdivision, [inside for inside, _ in verdicts], [bits for _, bits in verdicts], budget)
    return arrangement.nodes, traced


def _origins(
    rings: Sequence[Sequence[Ring]],
    pieces: Sequence[Piece],
    piece_origins: list[set[int]],
    hole_origins: list[set[int]],
) -> tuple[list[set[int]], list[set[int]]]:
    """Return the origins of `pieces`, whose evidence names rings of the round before, in terms of the exact parts."""
    of_ring: list[set[int]] = []
    holes = iter(hole_origins)
    for number, piece in enumerate(rings):
        of_ring += [piece_origins[number], *(next(holes) for _ in piece[1:])]

    def collected(bits: int) -> set[int]:
        found: set[int] = set()
        while bits:
            bit = bits & -bits
            found |= of_ring[bit.bit_length() - 1]
            bits ^= bit
        return found

    return (
        [collected(piece.evidence) for piece in pieces],
        [collected(bits) for piece in pieces for bits in piece.hole_evidence],
    )


def count_changes(n_exact: int, origins: Sequence[set[int]]) -> tuple[list[int], int, int]:
    """Return which exact parts are lost, by how many the rest fell by joining, and by how many it rose by parting.

    Parts are linked where an output part comes from an exact one. Of each linked group of e exact and o output parts,
    e - 1 were joined and o - 1 parted; an output part without origin counts as parted.
    """
    survivors = set().union(*origins)
    linked = UnionFind(n_exact + len(origins))
    for number, origin in enumerate(origins):
        for part in origin:
            linked.unite(part, n_exact + number)
    n_groups = len({linked.find(part) for part in survivors})
    lost = [part for part in range(n_exact) if part not in survivors]
    return lost, len(survivors) - n_groups, len(origins) - n_groups
