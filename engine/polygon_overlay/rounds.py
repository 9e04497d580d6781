"""From exact rings to doubles, still valid: rounded and arranged again until nothing moves.

Rounding every vertex to the nearest double may make edges cross, rings touch along edges, slivers vanish. So rounded
rings that nothing vouches for are taken as input again: each ring is a source of its own, a face is inside where it
lies in a shell and in no hole of that shell, and new crossings are rounded in turn. If all vertices are doubles,
nothing is left to round and the rings, being traced from an exact arrangement, are valid.

That almost always ends after one to three rounds; where it has not after `MAX_ROUNDS`, the exact rings are snapped to
the lattice whose spacing is the unit in the last place of the largest coordinate (`snap_rings`), after which it
ends by construction. Each round moves an edge by no more than its ends, so the displacements add up to a bound.

Which exact parts a part comes from is carried along, so that lost, joined and parted ones are counted. The work of a
round is the kernel's (run.py), or that of integers (in_integers.py).
"""

from __future__ import annotations

from collections.abc import Callable
from math import frexp, hypot, inf, nextafter, ulp
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrangement.arrange import snap_rings
from engine.arrangement.union_find import UnionFind
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.implicit_rings import edges_along
from engine.polygon_overlay.pair_arrays import NO_PAIRS, Found, joined, one_pair, places_of, taken
from engine.polygon_overlay.result import Exact, Lost, Overlay, made_overlay
from engine.running.budget import Budget
from engine.types import OPEN, BoolArray, FloatArray, IntArray, read_only

MAX_ROUNDS: Final = 12
"""Rounds before snapping: on 4,296 results of public test pairs all but 14 had ended by then."""


Again = Callable[[Found, Budget], Found]


def settle_rings(
    first: Found, exact: Exact, again: Again, may_snap: bool, budget: Budget, snap: Again | None = None
) -> Overlay | None:
    """Arrange a pair until it is valid; None where ``again`` cannot, or snapping is needed and not possible.

    exact: the exact rings that ``first`` is rounded from. again: arranges rounded rings, and gives evidence. may_snap:
    the rings are those of ``exact``, not scaled. snap: what puts them on whole numbers once they are valid (grid.py).
    """
    rings, displacement = first, float(first.displacement[0])
    rounds = int(displacement > 0.0)
    edges = own_edges = edges_along(first.sources)
    own = np.repeat(np.arange(first.counts[0, 1]), 2).reshape(-1, 2)
    origins = own  # rows of a ring and one of ``first`` that it comes from, sorted
    has_crossings = snapped = False
    while rings.status[0] != PairStatus.DONE:  # bound: MAX_ROUNDS + 1
        rings = again(rings, budget)
        if rings.status[0] == OPEN:
            return None
        origins, edges = _composed(rings.evidence, origins), edges[edges_along(rings.sources)]
        has_crossings = has_crossings or bool((rings.sources[:, 1] >= 0).any())
        moved = float(rings.displacement[0])
        if moved:
            if snapped or (rounds == MAX_ROUNDS and not may_snap):
                return None
            if rounds < MAX_ROUNDS:
                rounds, displacement = rounds + 1, nextafter(displacement + moved, inf)
            else:
                rings, displacement = _snapped(first, exact, budget)
                edges = own_edges[edges_along(rings.sources)]
                origins, snapped, has_crossings = own, True, True
    if snap is not None:
        rings = snap(rings, budget)
        edges, moved = edges[edges_along(rings.sources)], float(rings.displacement[0])
        if moved:
            rounds, displacement, snapped, has_crossings = rounds + 1, nextafter(displacement + moved, inf), True, True
        if rings.status[0] != PairStatus.DONE:
            rings = again(rings, budget)
            if rings.status[0] != PairStatus.DONE:
                return None
            origins, edges = _composed(rings.evidence, origins), edges[edges_along(rings.sources)]
    return overlay_of(
        rings, first, exact, _edges=read_only(edges), rounds=rounds, largest_displacement=displacement, snapped=snapped,
        vertices_moved=n_moved(first.vertices, rings.vertices, snap is not None) if has_crossings else 0,
        **({} if origins is own else _changes(first, rings, origins, exact)),
    )  # fmt: skip


def _changes(first: Found, rings: Found, origins: IntArray, exact: Exact) -> dict[str, Any]:
    """Return what became of the parts of a pair, as fields of `Overlay`."""
    is_shell, was_shell = _shells(rings), _shells(first)
    of_shells = is_shell[origins[:, 0]]
    pieces, pieces_joined, pieces_parted = count_changes(was_shell, origins[of_shells], int(is_shell.sum()))
    holes, holes_joined, holes_parted = count_changes(~was_shell, origins[~of_shells], int((~is_shell).sum()))
    return {
        "_lost": Lost(exact, first.piece_offsets, pieces, holes),
        "pieces_joined": pieces_joined,
        "pieces_parted": pieces_parted,
        "holes_joined": holes_joined,
        "holes_parted": holes_parted,
    }


def _shells(found: Found) -> BoolArray:
    """Tell of each ring whether it is a shell."""
    is_shell = np.zeros(found.counts[0, 1], np.bool_)
    is_shell[found.piece_offsets[:-1]] = True
    return is_shell


def _composed(evidence: IntArray, origins: IntArray) -> IntArray:
    """Return where rings come from by way of those of the round before."""
    offsets = np.searchsorted(origins[:, 0], np.arange(evidence[:, 1].max(initial=-1) + 2))
    sizes = np.diff(offsets)[evidence[:, 1]]
    through = origins[places_of(offsets, evidence[:, 1]), 1]
    return np.unique(np.column_stack([np.repeat(evidence[:, 0], sizes), through]), axis=0)


def overlay_of(rings: Found, first: Found, exact: Exact, **told: Any) -> Overlay:
    """Return the `Overlay` of rings that are settled, ``first`` before that; told: what became of its parts."""
    n_pieces, n_rings = first.counts[0, :2].tolist()
    arrays = read_only(rings.vertices), read_only(rings.ring_offsets), read_only(rings.piece_offsets)
    return made_overlay(*arrays, exact, n_pieces_exact=n_pieces, n_holes_exact=n_rings - n_pieces, **told)


def _snapped(first: Found, exact: Exact, budget: Budget) -> tuple[Found, float]:
    """Return the exact rings snapped to the lattice of their largest coordinate, and half a pixel's diagonal."""
    spacing = ulp(float(np.abs(first.vertices).max()))
    snapped, along = snap_rings(exact.some(range(first.counts[0, 1])).places(), frexp(spacing)[1] - 1, budget)
    vertices = np.array([vertex for ring in snapped for vertex in ring])
    ring_offsets = np.cumsum([0, *map(len, snapped)])
    sources = np.column_stack([along, along]).astype(np.int32)
    rings = one_pair(vertices, ring_offsets, first.piece_offsets, 0.0, 0, sources, PairStatus.MAY_CROSS)
    return rings, nextafter(hypot(spacing, spacing) / 2, inf)


def n_moved(images: FloatArray, vertices: FloatArray, are_whole: bool = False) -> int:
    """Return how many vertices, all of them whole numbers or not, are none of ``images``."""
    if are_whole:  # order: few images are, and a search among all takes longer than an overlay
        images = images[(images == np.rint(images)).all(axis=1)]
    known, places = (np.ascontiguousarray(each).view(np.complex128).ravel() for each in (images, vertices))
    return int((~np.isin(places, known)).sum())


def count_changes(is_exact: BoolArray, origins: IntArray, n_found: int) -> tuple[list[int], int, int]:
    """Return which exact parts are lost, by how many the rest fell by joining, and by how many it rose by parting.

    is_exact: of the rings of the exact result those that are such parts. origins: rows of an output part and an exact
    one that it comes from. n_found: output parts. Parts are linked where one comes from the other. Of each linked group
    of e exact and o output parts, e - 1 were joined and o - 1 parted; an output part without origin counts as parted.
    """
    survivors = np.unique(origins[:, 1])
    is_lost = is_exact.copy()
    is_lost[survivors] = False
    alone = (np.bincount(origins[:, 0])[origins[:, 0]] == 1) & (np.bincount(origins[:, 1])[origins[:, 1]] == 1)
    n_groups = len(survivors)
    if not alone.all():
        firsts: dict[int, int] = {}
        linked = UnionFind(len(is_exact))
        for found, part in origins[~alone].tolist():
            other = firsts.setdefault(found, part)
            n_groups -= linked.find(part) != linked.find(other)
            linked.unite(part, other)
    return np.flatnonzero(is_lost).tolist(), len(survivors) - n_groups, n_found - n_groups


class SettledPairs(NamedTuple):
    """pairs: (n,) int64, their numbers; found: their rings, one pair after another; ulps: by how many units in the last
    place of the largest coordinate a vertex of one of them may be off."""

    pairs: IntArray
    found: Found
    ulps: float


def settle_pairs(first: Found, again: Again, budget: Budget) -> SettledPairs:
    """Arrange the pairs of ``first`` that are MAY_CROSS until they are valid, all in one call of ``again`` a round.

    A pair leaves when it is valid, with no more than its rings: what became of the parts of the exact result is found
    for a single pair, when asked for. Left out are those that the kernel leaves open, or that are not valid after the
    last round. Raises as `Budget.check` when the call must end.
    """
    pairs = np.flatnonzero(first.status == PairStatus.MAY_CROSS)
    rings = taken(first, pairs)
    displacement = rings.displacement
    has_crossings = np.zeros(len(pairs), np.bool_)
    settled = [SettledPairs(pairs[:0], NO_PAIRS, 0.5)]
    rounds = 1  # invariant: those of all pairs that are left, since each moved in every round
    while len(pairs):  # bound: MAX_ROUNDS, in whose last no pair goes on that moved
        rings = again(rings, budget)
        moved = rings.displacement
        displacement = np.where(moved > 0.0, np.nextafter(displacement + moved, np.inf), displacement)
        crossings = np.repeat(np.arange(len(pairs)), rings.counts[:, 2])[rings.sources[:, 1] >= 0]
        has_crossings[crossings] = True
        goes_on = (rings.status != OPEN) & ((moved == 0.0) | (rounds < MAX_ROUNDS))
        done = np.flatnonzero(goes_on & (rings.status == PairStatus.DONE))
        valid = taken(rings, done)._replace(displacement=displacement[done])
        valid.counts[:, 3] = first.counts[pairs[done], 3]
        ulps = _ulps_moved(first, pairs[done], valid, np.flatnonzero(has_crossings[done]))
        settled.append(SettledPairs(pairs[done], valid, ulps))
        left = np.flatnonzero(goes_on & (rings.status == PairStatus.MAY_CROSS))
        pairs, rings, displacement, has_crossings = (
            pairs[left],
            taken(rings, left),
            displacement[left],
            has_crossings[left],
        )
        rounds += 1
    return SettledPairs(
        np.concatenate([each.pairs for each in settled]),
        joined([each.found for each in settled]),
        max(each.ulps for each in settled),
    )


def _ulps_moved(first: Found, pairs: IntArray, valid: Found, doubtful: IntArray) -> float:
    """Return `SettledPairs.ulps` of ``valid``, the ``pairs`` of ``first``, some of which may have other vertices."""
    ulps = 0.5
    for k in range(len(doubtful)):
        before, now = taken(first, pairs[doubtful[k : k + 1]]), taken(valid, doubtful[k : k + 1])
        if n_moved(before.vertices, now.vertices):
            ulps = max(ulps, float(now.displacement[0] / np.spacing(np.abs(now.vertices).max())))
    return ulps
