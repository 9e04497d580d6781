r"""Boundary rings of the open regions that a choice of faces makes.

An edge bounds the result where the faces on its two sides differ. Faces that meet in an edge which does not are one
region: its open interior is connected. At a node of four boundary edges the walk keeps to its own region, so parts
that meet in one point stay apart:

      \  in /           The walk around a region may pass a node twice, where a hole touches its shell or another
   out \   / out        hole. It is cut there into simple rings. Of those of one region exactly one runs
        \ /             counter-clockwise, its shell: the region lies inside each such ring, and of two of them
   ------x------        each would lie inside the other. All others run clockwise: holes.
        / \
   out /   \ out        A ring lists the nodes where the boundary turns and those where rings meet. Whether the
      /  in \           input had a vertex on a straight stretch leaves no trace: equal point sets give equal rings.

Area of rings with exact vertices: as a fraction, and as the nearest double without making the fraction.

Twice the area of a ring is the sum of (x_i y_j - x_j y_i) / (w_i w_j) over its edges. As one fraction the denominators
of all crossings multiply, so its length grows with their number; the nearest double comes from sums in fixed point,
whose error is below one unit per term, and the fraction is made only where those cannot settle the rounding.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cmp_to_key
from itertools import pairwise

import numpy as np

from engine.arrangement.arrange import Arrangement
from engine.arrangement.nodes import Homogeneous, nearest_quotient
from engine.arrangement.subdivision import Subdivision, next_half_edges, turn_of
from engine.arrangement.union_find import UnionFind
from engine.errors import NotRepresentableError
from engine.running.budget import poll, polled
from engine.types import BoolArray, FloatArray, IntArray


@dataclass(slots=True)
class Piece:
    """One connected region: a shell and its holes. A ring is the list of the half-edges that leave its corners, the
    lexicographically smallest corner (x, then y) first. The evidence of a face is a set of source rings that the caller
    gives it; evidence: the union over the region's faces; hole_evidence: for each hole, the union over the region on
    the other side of its ring."""

    shell: list[int] = field(default_factory=list)
    holes: list[list[int]] = field(default_factory=list)
    evidence: frozenset[int] = frozenset()
    hole_evidence: list[frozenset[int]] = field(default_factory=list)


def trace_pieces(subdivision: Subdivision, inside: Sequence[int], evidence: Sequence[frozenset[int]]) -> list[Piece]:
    """Return the connected regions of the faces marked `inside`, in lexicographic order of their shells.

    inside, evidence: by face its mark and its evidence (`Piece`). Mark 0 is outside, as face 0 must be; faces of
    different marks belong to different regions. Shells run counter-clockwise, holes clockwise and in lexicographic
    order: the result does not depend on the order of the input.
    """
    arrangement, faces = subdivision.arrangement, subdivision.faces
    bounds = [inside[left] != inside[right] for left, right in polled(zip(faces[0::2], faces[1::2]))]
    regions = UnionFind(subdivision.n_faces)
    for edge, is_boundary in enumerate(polled(bounds)):
        if not is_boundary:
            regions.unite(faces[2 * edge], faces[2 * edge + 1])
    region_of = [regions.find(face) for face in polled(range(subdivision.n_faces))]
    gathered: list[frozenset[int]] = [frozenset()] * subdivision.n_faces
    for face, region in enumerate(polled(region_of)):
        gathered[region] |= evidence[face]
    fans = [[half_edge for half_edge in fan if bounds[half_edge >> 1]] for fan in polled(subdivision.around)]
    starts = [half_edge for half_edge, face in enumerate(polled(faces)) if bounds[half_edge >> 1] and inside[face]]
    rank = _ranks(arrangement, fans)
    pieces: dict[int, Piece] = {}
    for ring in _simple_rings(arrangement, next_half_edges(fans, len(faces)), starts):
        poll()
        region = region_of[faces[ring[0]]]
        piece = pieces.setdefault(region, Piece(evidence=gathered[region]))
        corners, is_shell = _corners(arrangement, fans, rank, ring)
        if is_shell:
            piece.shell = corners
        else:
            piece.holes.append(corners)
            beyond: frozenset[int] = frozenset()
            for other in {region_of[faces[half_edge ^ 1]] for half_edge in ring}:
                beyond |= gathered[other]
            piece.hole_evidence.append(beyond)

    def place(ring: list[int]) -> list[int]:
        return [rank[arrangement.origin(half_edge)] for half_edge in ring]

    for piece in pieces.values():
        if len(piece.holes) > 1:
            both = sorted(zip(piece.holes, piece.hole_evidence), key=lambda hole: place(hole[0]))
            piece.holes, piece.hole_evidence = [ring for ring, _ in both], [bits for _, bits in both]
    return sorted(pieces.values(), key=lambda piece: place(piece.shell))


def _ranks(arrangement: Arrangement, fans: Sequence[Sequence[int]]) -> dict[int, int]:
    """Return the lexicographic rank (x, then y) of each node with boundary edges. fans: by node its boundary
    half-edges."""
    nodes = arrangement.nodes
    used = sorted((node for node, fan in enumerate(polled(fans)) if fan), key=nodes.xs.__getitem__)
    in_order: list[int] = []
    run: list[int] = []
    for node in polled(used):  # only runs of equal rounded x need the exact comparison
        if run and nodes.xs[run[0]] != nodes.xs[node]:
            in_order += sorted(run, key=cmp_to_key(nodes.compare)) if len(run) > 1 else run
            run = []
        run.append(node)
    in_order += sorted(run, key=cmp_to_key(nodes.compare))
    return {node: place for place, node in enumerate(in_order)}


def _simple_rings(arrangement: Arrangement, following: Sequence[int], starts: Sequence[int]) -> list[list[int]]:
    """Return the cycles through the half-edges `starts`, each cut into simple rings where it visits a node twice; a
    ring is the list of its half-edges. following: by half-edge the next one of its cycle."""
    seen = [False] * len(following)
    rings: list[list[int]] = []
    for start in polled(starts):
        if seen[start]:
            continue
        path: list[int] = []
        place: dict[int, int] = {}  # invariant: the node where path[k] begins is at place k, and no other is there
        half_edge = start
        while not seen[half_edge]:  # bound: each turn marks one half-edge
            seen[half_edge] = True
            node = arrangement.origin(half_edge)
            first = place.get(node)
            if first is not None:
                loop = path[first:]
                del path[first:]
                for other in loop:
                    del place[arrangement.origin(other)]
                rings.append(loop)
            place[node] = len(path)
            path.append(half_edge)
            half_edge = following[half_edge]
        rings.append(path)
    return rings


def _corners(
    arrangement: Arrangement, fans: Sequence[Sequence[int]], rank: dict[int, int], ring: list[int]
) -> tuple[list[int], bool]:
    """Return the half-edges that leave the corners of a simple ring, from the lexicographically first corner on, and
    whether the ring is a shell (counter-clockwise). A corner is a node where the ring turns or more than two boundary
    edges meet. fans: by node its boundary half-edges; rank: of `_ranks`; ring: its half-edges."""
    lines = arrangement.lines
    corners: list[int] = []
    first, is_shell = -1, False
    before = ring[-1]
    for half_edge in polled(ring):
        node = arrangement.origin(half_edge)
        arriving, leaving = lines[before >> 1], lines[half_edge >> 1]
        if len(fans[node]) > 2 or turn_of(arriving, leaving) != 0:
            if first < 0 or rank[node] < rank[arrangement.origin(corners[first])]:
                # At the leftmost node the ring arrives against its line and leaves along it: the sign is reversed.
                first, is_shell = len(corners), turn_of(arriving, leaving) < 0
            corners.append(half_edge)
        before = half_edge
    return corners[first:] + corners[:first], is_shell


_PRECISIONS = (160, 640)  # bits of the largest term that are used; the second for sums that nearly cancel


@dataclass(frozen=True, slots=True)
class ExactRings:
    """Closed rings of exact vertices (x, y, w); a coordinate is ``x / w * 2**exponent``. Areas of clockwise rings are
    negative."""

    rings: tuple[tuple[Homogeneous, ...], ...]
    exponent: int

    @property
    def n_rings(self) -> int:
        return len(self.rings)

    def exact_rings(self) -> ExactRings:
        """Return self: `ImplicitRings`, used in the same places, has a method of this name that computes vertices."""
        return self

    def some(self, rings: Sequence[int]) -> ExactRings:
        """Return the rings of these indices."""
        return ExactRings(tuple(self.rings[ring] for ring in rings), self.exponent)

    def places(self) -> list[list[tuple[Fraction, Fraction]]]:
        """Return, by ring, the coordinates of its vertices as fractions."""
        up, down = max(self.exponent, 0), max(-self.exponent, 0)
        return [
            [(Fraction(x << up, w << down), Fraction(y << up, w << down)) for x, y, w in ring] for ring in self.rings
        ]

    def _terms(self) -> list[tuple[int, int]]:
        """Return fractions (numerator, denominator) whose sum is twice the area of all rings, in units of
        ``4**exponent``."""
        whole = 0
        rest: list[tuple[int, int]] = []
        for ring in self.rings:
            for (ax, ay, aw), (bx, by, bw) in zip(ring, ring[1:] + ring[:1]):
                numerator, denominator = ax * by - bx * ay, aw * bw
                if denominator == 1:
                    whole += numerator
                else:
                    rest.append((numerator, denominator))
        return [(whole, 1), *rest]

    def area(self) -> Fraction:
        """Return the exact area of all rings together; the length of the fraction grows with the crossings."""
        numerator, denominator = _sum(self._terms())
        return Fraction(numerator, 2 * denominator) * Fraction(4) ** self.exponent

    def nearest_areas(self, groups: IntArray) -> FloatArray:
        """Return (n,) float64: for each k the double nearest to the area of rings groups[k] .. groups[k + 1] - 1."""
        return np.array([self.some(range(a, b)).nearest_area() for a, b in pairwise(groups.tolist())], np.float64)

    def nearest_area(self) -> float:
        """Return the double nearest to the exact area of all rings together. Raises `NotRepresentableError` beyond the
        largest double."""
        terms = self._terms()
        for low, high, shift in _bounds(terms):
            with suppress(NotRepresentableError):  # case: a bound is beyond the doubles, and the area may be none
                ends = {_nearest(end, 1, 2 * self.exponent - 1 - shift) for end in (low, high)}
                if len(ends) == 1:
                    return ends.pop()
        return _nearest(*_sum(terms), 2 * self.exponent - 1)

    def are_shells(self) -> BoolArray:
        """Return for each ring whether its exact area is positive, even if that is too small or large for a double."""
        return np.array([_is_positive(self.some([ring])._terms()) for ring in range(self.n_rings)], np.bool_)


def _is_positive(terms: Sequence[tuple[int, int]]) -> bool:
    """Return whether a sum of fractions (numerator, denominator) is positive: by bounds, else exactly."""
    for low, high, _ in _bounds(terms):
        if low > 0 or high < 0:
            return low > 0
    return _sum(terms)[0] > 0


def _bounds(terms: Sequence[tuple[int, int]]) -> Iterator[tuple[int, int, int]]:
    """Yield bounds (low, high, shift) on a sum of fractions (numerator, denominator), low <= 2**shift * sum <= high, in
    integers: a coarse pair first, then finer ones."""
    longest = max(abs(numerator).bit_length() - denominator.bit_length() for numerator, denominator in terms)
    for precision in _PRECISIONS:
        low = sum(_floor(numerator, denominator, precision - longest) for numerator, denominator in terms)
        yield low, low + len(terms), precision - longest


def _floor(numerator: int, denominator: int, shift: int) -> int:
    """Return floor(numerator / denominator * 2**shift); shift may be negative."""
    return (numerator << shift) // denominator if shift >= 0 else numerator // (denominator << -shift)


def _nearest(numerator: int, denominator: int, exponent: int) -> float:
    """Return the double nearest to numerator / denominator * 2**exponent, integers of any length and sign of exponent.
    Raises `NotRepresentableError` beyond the largest double."""
    return nearest_quotient(numerator << max(exponent, 0), denominator << max(-exponent, 0))


def _sum(terms: Iterable[tuple[int, int]]) -> tuple[int, int]:
    """Return the sum of fractions (numerator, denominator) as one such fraction, not reduced. Terms are added in pairs,
    level by level, so that the numbers added are of similar length."""
    level: Sequence[tuple[int, int]] = list(terms)
    while len(level) > 1:  # bound: each turn halves the list
        odd = level[-1:] if len(level) % 2 else []
        level = [(a * d + c * b, b * d) for (a, b), (c, d) in zip(level[0::2], level[1::2])] + list(odd)
    return level[0]
