"""From exact rings to doubles, still valid: rounded and arranged again until nothing moves.

Rounding vertices to doubles may make edges cross, rings touch along edges, slivers vanish. So rounded rings that are
not proven valid become input again: each ring is a source of its own, a face is inside where it lies in a shell and in
no hole of that shell, and new crossings are rounded in turn. If all vertices are doubles, nothing is left to round and
the rings, traced from an exact arrangement, are valid.

That almost always ends after one to three rounds; after `MAX_ROUNDS`, the exact rings are snapped to the lattice whose
spacing is the unit in the last place of the largest coordinate (`snap_rings`), after which it ends by construction. A
round moves an edge by at most as much as its ends, so the displacements add up to a bound.

The provenance of parts is composed over the rounds, so that lost, joined and parted ones are counted. A round is
computed by the kernel (run.py) or in integers (in_integers.py).
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
from engine.polygon_overlay.pair_arrays import NO_PAIRS, PairResults, concatenate_pairs, one_pair, places_of, take_pairs
from engine.polygon_overlay.result import Exact, Lost, Overlay, build_overlay
from engine.running.budget import Budget
from engine.types import OPEN, BoolArray, FloatArray, IntArray, read_only

MAX_ROUNDS: Final = 12
"""Rounds before snapping: of 4,296 results of public test pairs all but 14 ended earlier."""


Arranger = Callable[[PairResults, Budget], PairResults]


def make_valid_after_rounding(
    first: PairResults, exact: Exact, rearrange: Arranger, may_snap: bool, budget: Budget, snap: Arranger | None = None
) -> Overlay | None:
    """Arrange the rounded rings of a pair until they are valid; return None if ``rearrange`` leaves it OPEN, or
    snapping is needed and not possible.

    first: the rings rounded once; exact: the rings that they are rounded from; rearrange: arranges rounded rings, with
    evidence; may_snap: coordinates of ``first`` are those of ``exact``, not scaled; snap: moves valid rings to integer
    points (grid.py), for results on a grid.
    """
    rings, displacement = first, float(first.displacement[0])
    rounds = int(displacement > 0.0)
    edges = own_edges = edges_along(first.sources)
    own = np.repeat(np.arange(first.counts[0, 1]), 2).reshape(-1, 2)
    origins = own  # rows of a ring and one of ``first`` that it comes from, sorted
    has_crossings = snapped = False
    while rings.status[0] != PairStatus.DONE:  # bound: MAX_ROUNDS + 1
        rings = rearrange(rings, budget)
        if rings.status[0] == OPEN:
            return None
        origins, edges = _compose_origins(rings.evidence, origins), edges[edges_along(rings.sources)]
        has_crossings = has_crossings or bool((rings.sources[:, 1] >= 0).any())
        moved = float(rings.displacement[0])
        if moved:
            if snapped or (rounds == MAX_ROUNDS and not may_snap):
                return None
            if rounds < MAX_ROUNDS:
                rounds, displacement = rounds + 1, nextafter(displacement + moved, inf)
            else:
                rings, displacement = _snap_exact_rings(first, exact, budget)
                edges = own_edges[edges_along(rings.sources)]
                origins, snapped, has_crossings = own, True, True
    if snap is not None:
        rings = snap(rings, budget)
        edges, moved = edges[edges_along(rings.sources)], float(rings.displacement[0])
        if moved:
            rounds, displacement, snapped, has_crossings = rounds + 1, nextafter(displacement + moved, inf), True, True
        if rings.status[0] != PairStatus.DONE:
            rings = rearrange(rings, budget)
            if rings.status[0] != PairStatus.DONE:
                return None
            origins, edges = _compose_origins(rings.evidence, origins), edges[edges_along(rings.sources)]
    return build_valid_overlay(
        rings, first, exact, _edges=read_only(edges), rounds=rounds, largest_displacement=displacement, snapped=snapped,
        vertices_moved=n_moved(first.vertices, rings.vertices, snap is not None) if has_crossings else 0,
        **({} if origins is own else _changes(first, rings, origins, exact)),
    )  # fmt: skip


def _changes(first: PairResults, rings: PairResults, origins: IntArray, exact: Exact) -> dict[str, Any]:
    """Return, as fields of `Overlay`, how many pieces and holes of a pair rounding joined and parted, and which it
    removed. first: the rings before, rounded once; rings: the valid ones; origins: rows (ring of `rings`, ring of
    `first` that it comes from)."""
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


def _shells(pair: PairResults) -> BoolArray:
    """Return, by ring of a pair, whether it is the shell of a piece."""
    is_shell = np.zeros(pair.counts[0, 1], np.bool_)
    is_shell[pair.piece_offsets[:-1]] = True
    return is_shell


def _compose_origins(evidence: IntArray, origins: IntArray) -> IntArray:
    """Return rows (ring, original ring), sorted and unique: evidence (ring, ring of the round before) composed with
    origins (ring of the round before, original ring)."""
    offsets = np.searchsorted(origins[:, 0], np.arange(evidence[:, 1].max(initial=-1) + 2))
    sizes = np.diff(offsets)[evidence[:, 1]]
    through = origins[places_of(offsets, evidence[:, 1]), 1]
    return np.unique(np.column_stack([np.repeat(evidence[:, 0], sizes), through]), axis=0)


def build_valid_overlay(rings: PairResults, first: PairResults, exact: Exact, **fields: Any) -> Overlay:
    """Make the `Overlay` of valid rings. first: the rings rounded once, as many as the exact ones; exact: those;
    fields: counts of the parts that changed, and others of its fields."""
    n_pieces, n_rings = first.counts[0, :2].tolist()
    arrays = read_only(rings.vertices), read_only(rings.ring_offsets), read_only(rings.piece_offsets)
    return build_overlay(*arrays, exact, n_pieces_exact=n_pieces, n_holes_exact=n_rings - n_pieces, **fields)


def _snap_exact_rings(first: PairResults, exact: Exact, budget: Budget) -> tuple[PairResults, float]:
    """Return the exact rings snapped to the lattice whose spacing is the ulp of the largest coordinate, as a result
    with status MAY_CROSS, and half a pixel's diagonal, the bound on their displacement. first: the same rings, rounded.
    """
    spacing = ulp(float(np.abs(first.vertices).max()))
    snapped, along = snap_rings(exact.some(range(first.counts[0, 1])).places(), frexp(spacing)[1] - 1, budget)
    vertices = np.array([vertex for ring in snapped for vertex in ring])
    ring_offsets = np.cumsum([0, *map(len, snapped)])
    sources = np.column_stack([along, along]).astype(np.int32)
    rings = one_pair(vertices, ring_offsets, first.piece_offsets, 0.0, 0, sources, PairStatus.MAY_CROSS)
    return rings, nextafter(hypot(spacing, spacing) / 2, inf)


def n_moved(images: FloatArray, vertices: FloatArray, are_whole: bool = False) -> int:
    """Return how many of `vertices` (n, 2) are not among ``images`` (m, 2), the correctly rounded exact vertices.
    are_whole: all vertices are integers, which saves time."""
    if are_whole:  # order: few images are, and a search among all takes longer than an overlay
        images = images[(images == np.rint(images)).all(axis=1)]
    known, places = (np.ascontiguousarray(each).view(np.complex128).ravel() for each in (images, vertices))
    return int((~np.isin(places, known)).sum())


def count_changes(is_exact: BoolArray, origins: IntArray, n_parts: int) -> tuple[list[int], int, int]:
    """Return which exact parts are lost, the number of joins, and the number of partings.

    is_exact: by ring of the exact result, whether it is a part of the kind in question (shell or hole). origins: rows
    (output part, exact part it comes from). n_parts: number of output parts. Linked by origins, a group of e exact and
    o output parts counts e - 1 joins and o - 1 partings; an output part without origin counts as parted.
    """
    survivors = np.unique(origins[:, 1])
    is_lost = is_exact.copy()
    is_lost[survivors] = False
    alone = (np.bincount(origins[:, 0])[origins[:, 0]] == 1) & (np.bincount(origins[:, 1])[origins[:, 1]] == 1)
    n_groups = len(survivors)
    if not alone.all():
        firsts: dict[int, int] = {}
        linked = UnionFind(len(is_exact))
        for output, part in origins[~alone].tolist():
            other = firsts.setdefault(output, part)
            n_groups -= linked.find(part) != linked.find(other)
            linked.unite(part, other)
    return np.flatnonzero(is_lost).tolist(), len(survivors) - n_groups, n_parts - n_groups


class ValidPairs(NamedTuple):
    """Pairs that are valid after rounding. pairs: their numbers (n,) int64; rings: their results, pair after pair;
    ulps: the largest displacement of a vertex, in units in the last place of the pair's largest coordinate."""

    pairs: IntArray
    rings: PairResults
    ulps: float


def make_pairs_valid(first: PairResults, rearrange: Arranger, budget: Budget) -> ValidPairs:
    """Arrange the rounded rings of the MAY_CROSS pairs of ``first`` until they are valid, all in one call of
    ``rearrange`` a round. Pairs that become OPEN, or are not valid after the last round, are omitted. Only rings are
    returned: lost and joined parts are computed for single pairs, on request. Raises as `Budget.check`."""
    pairs = np.flatnonzero(first.status == PairStatus.MAY_CROSS)
    rings = take_pairs(first, pairs)
    displacement = rings.displacement
    has_crossings = np.zeros(len(pairs), np.bool_)
    done_pairs = [ValidPairs(pairs[:0], NO_PAIRS, 0.5)]
    rounds = 1  # invariant: those of all pairs that are left, since each moved in every round
    while len(pairs):  # bound: MAX_ROUNDS, in whose last no moved pair continues
        rings = rearrange(rings, budget)
        moved = rings.displacement
        displacement = np.where(moved > 0.0, np.nextafter(displacement + moved, np.inf), displacement)
        crossings = np.repeat(np.arange(len(pairs)), rings.counts[:, 2])[rings.sources[:, 1] >= 0]
        has_crossings[crossings] = True
        goes_on = (rings.status != OPEN) & ((moved == 0.0) | (rounds < MAX_ROUNDS))
        done = np.flatnonzero(goes_on & (rings.status == PairStatus.DONE))
        valid = take_pairs(rings, done)._replace(displacement=displacement[done])
        valid.counts[:, 3] = first.counts[pairs[done], 3]
        ulps = _ulps_moved(first, pairs[done], valid, np.flatnonzero(has_crossings[done]))
        done_pairs.append(ValidPairs(pairs[done], valid, ulps))
        left = np.flatnonzero(goes_on & (rings.status == PairStatus.MAY_CROSS))
        pairs, rings, displacement, has_crossings = (
            pairs[left],
            take_pairs(rings, left),
            displacement[left],
            has_crossings[left],
        )
        rounds += 1
    return ValidPairs(
        np.concatenate([each.pairs for each in done_pairs]),
        concatenate_pairs([each.rings for each in done_pairs]),
        max(each.ulps for each in done_pairs),
    )


def _ulps_moved(first: PairResults, pairs: IntArray, valid: PairResults, doubtful: IntArray) -> float:
    """Return `ValidPairs.ulps` of ``valid``, the results of ``pairs`` of ``first`` after further rounds. doubtful:
    indices into ``pairs`` of those that may have new vertices; the others have 0.5."""
    ulps = 0.5
    for k in range(len(doubtful)):
        before, now = take_pairs(first, pairs[doubtful[k : k + 1]]), take_pairs(valid, doubtful[k : k + 1])
        if n_moved(before.vertices, now.vertices):
            ulps = max(ulps, float(now.displacement[0] / np.spacing(np.abs(now.vertices).max())))
    return ulps
