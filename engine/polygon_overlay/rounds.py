"""Rounds of the compiled overlay: rounded rings that nothing vouches for are arranged again, until they are valid.

The rule, and what is told of its outcome, are those of exact/rounding.py; the kernel does the work of a round, also
of the last one after snap rounding, where `MAX_ROUNDS` do not end it. Which exact parts a part comes from is carried
along: its evidence names rings of the round before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import frexp, hypot, inf, nextafter, ulp
from typing import Literal

import numpy as np

from engine.arrangement.exact_area import ExactRings
from engine.arrangement.nodes import nearest_quotient
from engine.arrangement.snap_rounding import snap_rings
from engine.arrays import FloatArray, IntArray
from engine.parallel import Budget
from engine.polygon_overlay.exact.rounding import MAX_ROUNDS, count_changes
from engine.polygon_overlay.implicit_rings import ImplicitRings
from engine.polygon_overlay.result import Collapse
from engine.polygon_overlay.ring_bits import Corners, RingBits, assign_bits, boxes_of, rings_meant


@dataclass(frozen=True, slots=True)
class RoundedRings:
    """What one arrangement left, rounded.

    vertices: (n, 2) float64 of all rings, ring_offsets into them, piece_offsets into the rings, shells first; both
    int64. evidence: by ring, bits of rings of the round before; empty in the first. displacement: how far rounding
    moved a vertex at most. is_valid: whether the rings are surely those of the arrangement still. has_crossings: some
    vertex is none of the round before.
    """

    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    evidence: IntArray
    displacement: float
    is_valid: bool
    has_crossings: bool

    @property
    def n_rings(self) -> int:
        return len(self.ring_offsets) - 1

    @property
    def n_pieces(self) -> int:
        return len(self.piece_offsets) - 1


@dataclass(frozen=True, slots=True)
class Settled:
    """Valid rings, and what became of the parts of the exact result; the names are those of `Overlay`."""

    rings: RoundedRings
    rounds: int
    displacement: float
    snapped: bool
    vertices_moved: int
    collapsed: tuple[Collapse, ...]
    pieces_joined: int
    pieces_parted: int
    holes_joined: int
    holes_parted: int


Again = Callable[[RoundedRings, RingBits], RoundedRings | None]


def settle_rings(
    first: RoundedRings, exact: ImplicitRings, again: Again, may_snap: bool, budget: Budget
) -> Settled | None:
    """Arrange ``first`` until it is valid; None where that takes integers: rings deep in each other, or no snapping.

    exact: the exact rings that ``first`` is rounded from. again: arranges rings, given their bits.
    may_snap: the rings are those of ``exact``, not scaled.
    """
    n_holes = first.n_rings - first.n_pieces
    own = [{piece} for piece in range(first.n_pieces)], [{hole} for hole in range(n_holes)]
    piece_origins, hole_origins = own
    rings, rounds, displacement, has_crossings, snapped = first, 1, first.displacement, False, False
    while not rings.is_valid:  # bound: MAX_ROUNDS + 1
        boxes = boxes_of(rings.vertices, rings.ring_offsets)
        labels = assign_bits(boxes, rings.piece_offsets, budget)
        found = None if labels is None else again(rings, labels)
        if labels is None or found is None:
            return None
        meant = _meant(rings, found, boxes, labels, again, budget)
        if meant is None:
            return None
        piece_origins, hole_origins = _origins(rings, found, meant, piece_origins, hole_origins)
        rings, has_crossings = found, has_crossings or found.has_crossings
        if rings.displacement:
            if snapped or (rounds == MAX_ROUNDS and not may_snap):
                return None
            if rounds < MAX_ROUNDS:
                rounds, displacement = rounds + 1, nextafter(displacement + rings.displacement, inf)
            else:
                rings, displacement = _snapped(first, exact, budget)
                piece_origins, hole_origins = own
                snapped = has_crossings = True
    lost_pieces, pieces_joined, pieces_parted = count_changes(first.n_pieces, piece_origins)
    lost_holes, holes_joined, holes_parted = count_changes(n_holes, hole_origins)
    return Settled(
        rings=rings,
        rounds=rounds,
        displacement=displacement,
        snapped=snapped,
        vertices_moved=n_moved(first.vertices, rings.vertices) if has_crossings else 0,
        collapsed=collapses(first, exact, lost_pieces, lost_holes, budget),
        pieces_joined=pieces_joined,
        pieces_parted=pieces_parted,
        holes_joined=holes_joined,
        holes_parted=holes_parted,
    )


def _meant(
    before: RoundedRings, found: RoundedRings, boxes: Corners, labels: RingBits, again: Again, budget: Budget
) -> list[list[int]] | None:
    """Return for each ring found those of the round before that it comes from; None where that is not sure."""

    def evidence(other: RingBits) -> IntArray | None:
        same = again(before, other)  # bits decide nothing: these are the same rings
        return None if same is None else same.evidence

    boxes_found = boxes_of(found.vertices, found.ring_offsets)
    return rings_meant(labels, found.evidence, boxes, before.piece_offsets, boxes_found, evidence, budget)


def _snapped(first: RoundedRings, exact: ImplicitRings, budget: Budget) -> tuple[RoundedRings, float]:
    """Return the exact rings snapped to the lattice of their largest coordinate, and half a pixel's diagonal."""
    spacing = ulp(float(np.abs(first.vertices).max()))
    snapped = snap_rings(exact.exact_rings().places(), frexp(spacing)[1] - 1, budget)
    rings = RoundedRings(
        vertices=np.array([vertex for ring in snapped for vertex in ring]),
        ring_offsets=np.cumsum([0, *map(len, snapped)]),
        piece_offsets=first.piece_offsets,
        evidence=first.evidence,
        displacement=0.0,
        is_valid=False,
        has_crossings=True,
    )
    return rings, nextafter(hypot(spacing, spacing) / 2, inf)


def _origins(
    before: RoundedRings,
    found: RoundedRings,
    meant: Sequence[Sequence[int]],
    piece_origins: list[set[int]],
    hole_origins: list[set[int]],
) -> tuple[list[set[int]], list[set[int]]]:
    """Return the exact parts that pieces and holes come from.

    meant: for each ring found those of the round before that it comes from.
    """
    of_ring: list[set[int]] = []
    holes = iter(hole_origins)
    for origin, size in zip(piece_origins, np.diff(before.piece_offsets).tolist(), strict=True):
        of_ring.append(origin)
        of_ring += [next(holes) for _ in range(size - 1)]
    collected: list[set[int]] = [set().union(*(of_ring[ring] for ring in rings)) for rings in meant]
    shells = found.piece_offsets[:-1].tolist()
    is_shell = set(shells)
    pieces = [collected[ring] for ring in shells]
    return pieces, [origin for ring, origin in enumerate(collected) if ring not in is_shell]


def n_moved(images: FloatArray, vertices: FloatArray) -> int:
    """Return how many vertices are none of ``images``."""
    known = {(x, y) for x, y in images.tolist()}
    return sum((x, y) not in known for x, y in vertices.tolist())


def collapses(
    first: RoundedRings, exact: ImplicitRings, lost_pieces: Sequence[int], lost_holes: Sequence[int], budget: Budget
) -> tuple[Collapse, ...]:
    """Return lost pieces, then lost holes, each by the vertices of its exact ring from the first one on."""
    if not lost_pieces and not lost_holes:
        return ()
    shells = first.piece_offsets.tolist()
    shell_of = np.repeat(first.piece_offsets[:-1], np.diff(first.piece_offsets)).tolist()
    holes = [ring for ring, shell in enumerate(shell_of) if ring != shell]
    holes = [holes[hole] for hole in lost_holes]
    around = {shell_of[ring] for ring in holes}
    if len(around) == 1:  # order: of one shell, which may be large, holes need no more than their own vertices
        around.clear()
    rings = {ring for piece in lost_pieces for ring in range(shells[piece], shells[piece + 1])}
    made = _made(exact, sorted(rings.union(holes, around)))

    def entry(kind: Literal["piece", "hole"], rings: Sequence[int]) -> tuple[list[_Place], Collapse]:
        budget.check()
        whole = [made[ring] for ring in rings]
        place, near = _first_vertex(whole[0])
        area = abs(ExactRings(tuple(ring for each in whole for ring in each.rings), whole[0].exponent).area())
        return place, Collapse(kind, area, near)

    of_shell = {ring: _first_vertex(made[ring])[0] for ring in around}
    pieces = [entry("piece", range(shells[piece], shells[piece + 1])) for piece in lost_pieces]
    lost = [(of_shell.get(shell_of[ring], []), *entry("hole", [ring])) for ring in holes]
    pieces.sort(key=lambda each: each[0])
    lost.sort(key=lambda each: each[:2])
    return (*(each[-1] for each in pieces), *(each[-1] for each in lost))


def _made(exact: ImplicitRings, rings: Sequence[int]) -> dict[int, ExactRings]:
    """Return some of the exact rings as integers, by their numbers."""
    sources = [exact.sources[exact.offsets[ring] : exact.offsets[ring + 1]] for ring in rings]
    offsets = np.cumsum([0, *map(len, sources)])
    some = exact._replace(sources=np.concatenate(sources), offsets=offsets).exact_rings()
    return {ring: ExactRings((points,), some.exponent) for ring, points in zip(rings, some.rings, strict=True)}


_Place = tuple[Fraction, Fraction]


def _first_vertex(ring: ExactRings) -> tuple[list[_Place], tuple[float, float]]:
    """Return a ring from its first vertex on, and the doubles nearest to that vertex."""
    (places,) = ring.places()
    k = places.index(min(places))
    x, y = (nearest_quotient(*value.as_integer_ratio()) for value in places[k])
    return places[k:] + places[:k], (x, y)
