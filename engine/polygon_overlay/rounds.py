"""From exact rings to doubles that are still valid: round, arrange again, until nothing moves.

Rounding every vertex to the nearest double may make edges cross, rings touch along edges, slivers vanish. So rounded
rings that nothing vouches for are taken as input again: each ring is a source of its own, a face is inside where it
lies in a shell and in no hole of that shell, and new crossings are rounded in turn. If all vertices are doubles,
nothing is left to round and the rings, being traced from an exact arrangement, are valid.

That almost always ends after one to three rounds; where it has not after `MAX_ROUNDS`, the exact rings are snapped to
the lattice whose spacing is the unit in the last place of the largest coordinate (snap_rounding.py), after which it
ends by construction. Each round moves an edge by no more than its ends, so the displacements add up to a bound.

Which exact parts a part comes from is carried along, so that lost, joined and parted ones are counted. The work of a
round is the kernel's (run.py), or that of integers (exact/rounding.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import frexp, hypot, inf, nextafter, ulp
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from engine.arrangement.exact_area import ExactRings
from engine.arrangement.nodes import nearest_quotient
from engine.arrangement.snap_rounding import snap_rings
from engine.arrangement.union_find import UnionFind
from engine.arrays import FloatArray, IntArray, read_only
from engine.parallel import Budget
from engine.polygon_overlay.implicit_rings import ImplicitRings
from engine.polygon_overlay.result import Collapse, Output, Overlay

MAX_ROUNDS: Final = 12
"""Rounds before snapping: on 4,296 results of public test pairs all but 14 had ended by then."""


@dataclass(frozen=True, slots=True)
class RoundedRings:
    """What one arrangement left, rounded.

    vertices: (n, 2) float64 of all rings, ring_offsets into them, piece_offsets into the rings, shells first; both
    int64. displacement: how far rounding moved a vertex at most. is_valid: whether the rings are surely those of the
    arrangement still. has_crossings: some vertex may be none of the round before.
    """

    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    displacement: float
    is_valid: bool
    has_crossings: bool

    @property
    def n_rings(self) -> int:
        return len(self.ring_offsets) - 1

    @property
    def n_pieces(self) -> int:
        return len(self.piece_offsets) - 1


class ArrangedAgain(NamedTuple):
    """What one round left; meant: for each ring those of the round before that it comes from."""

    rings: RoundedRings
    meant: Sequence[Sequence[int]]


Exact = ExactRings | ImplicitRings
Again = Callable[[RoundedRings], ArrangedAgain | None]


def settle_rings(first: RoundedRings, exact: Exact, again: Again, may_snap: bool, budget: Budget) -> Overlay | None:
    """Arrange ``first`` until it is valid; None where ``again`` cannot, or snapping is needed and not possible.

    exact: the exact rings that ``first`` is rounded from. again: arranges rounded rings. may_snap: the rings are those
    of ``exact``, not scaled.
    """
    n_holes = first.n_rings - first.n_pieces
    own = [{piece} for piece in range(first.n_pieces)], [{hole} for hole in range(n_holes)]
    piece_origins, hole_origins = own
    rings, rounds, displacement = first, int(first.displacement > 0.0), first.displacement
    has_crossings = snapped = False
    while not rings.is_valid:  # bound: MAX_ROUNDS + 1
        found = again(rings)
        if found is None:
            return None
        piece_origins, hole_origins = _origins(rings, found, piece_origins, hole_origins)
        rings, has_crossings = found.rings, has_crossings or found.rings.has_crossings
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
    return overlay_of(
        rings,
        first,
        exact,
        "valid",
        rounds=rounds,
        largest_displacement=displacement,
        snapped=snapped,
        vertices_moved=n_moved(first.vertices, rings.vertices) if has_crossings else 0,
        collapsed=collapses(first, exact, lost_pieces, lost_holes, budget),
        pieces_joined=pieces_joined,
        pieces_parted=pieces_parted,
        holes_joined=holes_joined,
        holes_parted=holes_parted,
    )


def overlay_of(rings: RoundedRings, first: RoundedRings, exact: Exact, output: Output, **told: Any) -> Overlay:
    """Return the `Overlay` of rings that are settled, ``first`` before that; told: what became of its parts."""
    return Overlay(
        vertices=read_only(rings.vertices),
        ring_offsets=read_only(rings.ring_offsets),
        piece_offsets=read_only(rings.piece_offsets),
        output=output,
        may_be_invalid=output == "nearest" and first.displacement > 0.0,
        n_pieces_exact=first.n_pieces,
        n_holes_exact=first.n_rings - first.n_pieces,
        exact=exact,
        **told,
    )


def _snapped(first: RoundedRings, exact: Exact, budget: Budget) -> tuple[RoundedRings, float]:
    """Return the exact rings snapped to the lattice of their largest coordinate, and half a pixel's diagonal."""
    spacing = ulp(float(np.abs(first.vertices).max()))
    snapped = snap_rings(exact.some(range(first.n_rings)).places(), frexp(spacing)[1] - 1, budget)
    rings = RoundedRings(
        vertices=np.array([vertex for ring in snapped for vertex in ring]),
        ring_offsets=np.cumsum([0, *map(len, snapped)]),
        piece_offsets=first.piece_offsets,
        displacement=0.0,
        is_valid=False,
        has_crossings=True,
    )
    return rings, nextafter(hypot(spacing, spacing) / 2, inf)


def _origins(
    before: RoundedRings, found: ArrangedAgain, piece_origins: list[set[int]], hole_origins: list[set[int]]
) -> tuple[list[set[int]], list[set[int]]]:
    """Return the exact parts that the pieces and holes of a round come from, given those of the round before."""
    of_ring: list[set[int]] = []
    holes = iter(hole_origins)
    for origin, size in zip(piece_origins, np.diff(before.piece_offsets).tolist(), strict=True):
        of_ring.append(origin)
        of_ring += [next(holes) for _ in range(size - 1)]
    collected: list[set[int]] = [set().union(*(of_ring[ring] for ring in rings)) for rings in found.meant]
    shells = found.rings.piece_offsets[:-1].tolist()
    is_shell = set(shells)
    pieces = [collected[ring] for ring in shells]
    return pieces, [origin for ring, origin in enumerate(collected) if ring not in is_shell]


def n_moved(images: FloatArray, vertices: FloatArray) -> int:
    """Return how many vertices are none of ``images``."""
    known = {(x, y) for x, y in images.tolist()}
    return sum((x, y) not in known for x, y in vertices.tolist())


def collapses(
    first: RoundedRings, exact: Exact, lost_pieces: Sequence[int], lost_holes: Sequence[int], budget: Budget
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
    numbers = sorted(rings.union(holes, around))
    some = exact.some(numbers)
    made = {ring: ExactRings((points,), some.exponent) for ring, points in zip(numbers, some.rings, strict=True)}

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


_Place = tuple[Fraction, Fraction]


def _first_vertex(ring: ExactRings) -> tuple[list[_Place], tuple[float, float]]:
    """Return a ring from its first vertex on, and the doubles nearest to that vertex."""
    (places,) = ring.places()
    k = places.index(min(places))
    x, y = (nearest_quotient(*value.as_integer_ratio()) for value in places[k])
    return places[k:] + places[:k], (x, y)


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
