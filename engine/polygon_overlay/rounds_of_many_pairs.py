"""Rounds of many pairs at once: rings that nothing vouches for are arranged again, all pairs in one call of the kernel.

The rule is that of rounds.py, round by round; a pair leaves when it is valid. Only the rings are kept: what
became of the parts of the exact result is found for a single pair, when asked for.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.parallel import Budget
from engine.polygon_overlay.compiled.kernel import DONE, MAY_CROSS
from engine.polygon_overlay.compiled.ring_labels import MOST_BITS, RingBits
from engine.polygon_overlay.nearest import nearest_rings
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.rounds import MAX_ROUNDS, n_moved
from engine.polygon_overlay.run import Found, Polygons, put_together, run_kernel, summed
from engine.types import OPEN

_NONE: Final = np.zeros(0, np.int64)


class SettledPairs(NamedTuple):
    """pairs: (n,) int64, their numbers; found: their rings, one pair after another; ulps: by how many units in the last
    place of the largest coordinate a vertex of one of them may be off."""

    pairs: IntArray
    found: Found
    ulps: float


def settle_pairs(first: Found, budget: Budget) -> SettledPairs:
    """Arrange the pairs of ``first`` that are MAY_CROSS until they are valid.

    Left out are those that the kernel leaves open, that have more rings than a label has bits, or that are not valid
    after the last round. Raises as `Budget.check` when the call must end.
    """
    pairs = np.flatnonzero(first.status == MAY_CROSS)
    rings = taken(first, pairs)
    displacement = rings.displacement
    has_crossings = np.zeros(len(pairs), np.bool_)
    settled = [SettledPairs(_NONE, taken(first, _NONE), 0.5)]
    rounds = 1  # invariant: those of all pairs that are left, since each moved in every round
    while len(pairs):  # bound: MAX_ROUNDS, in whose last no pair goes on that moved
        few = np.flatnonzero(rings.counts[:, 1] <= MOST_BITS)
        if len(few) < len(pairs):
            pairs, displacement, has_crossings = pairs[few], displacement[few], has_crossings[few]
            rings = taken(rings, few)
            if not len(few):
                break
        rings = _arranged_again(rings, budget)
        moved = rings.displacement
        displacement = np.where(moved > 0.0, np.nextafter(displacement + moved, np.inf), displacement)
        crossings = np.repeat(np.arange(len(pairs)), rings.counts[:, 2])[rings.sources[:, 1] >= 0]
        has_crossings[crossings] = True
        goes_on = (rings.status != OPEN) & ((moved == 0.0) | (rounds < MAX_ROUNDS))
        done = np.flatnonzero(goes_on & (rings.status == DONE))
        valid = taken(rings, done)._replace(displacement=displacement[done])
        valid.counts[:, 3] = first.counts[pairs[done], 3]
        ulps = _ulps_moved(first, pairs[done], valid, np.flatnonzero(has_crossings[done]))
        settled.append(SettledPairs(pairs[done], valid, ulps))
        left = np.flatnonzero(goes_on & (rings.status == MAY_CROSS))
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


def _arranged_again(rings: Found, budget: Budget) -> Found:
    """Arrange the rings of each pair, each a source of its own."""
    n_rings = rings.counts[:, 1]
    items = summed(n_rings)
    shells = np.repeat(rings.piece_offsets[:-1], np.diff(rings.piece_offsets))
    before = np.repeat(items[:-1], n_rings)
    labels = RingBits(np.arange(len(shells)) - before, shells - before)
    largest = (int(rings.counts[:, k].max(initial=0)) for k in (2, 1))
    subjects = Polygons(read_only(rings.vertices), read_only(rings.ring_offsets), items, *largest)
    clips = Polygons(
        read_only(np.zeros((0, 2))), read_only(np.zeros(1, np.int64)), read_only(np.zeros_like(items)), 0, 0
    )
    return run_kernel(subjects, clips, "union", budget, labels)


def nearest_pairs(first: Found, budget: Budget) -> SettledPairs:
    """Leave the rings of the pairs of ``first`` that are MAY_CROSS as they are, but those without area."""
    pairs = np.flatnonzero(first.status == MAY_CROSS)
    found = [taken(first, _NONE)]
    for pair in range(len(pairs)):
        one = taken(first, pairs[pair : pair + 1])
        rings = nearest_rings(one.vertices, one.ring_offsets, one.piece_offsets, budget).arrays()
        found.append(_one(*rings, float(one.displacement[0]), int(one.counts[0, 3])))
    return SettledPairs(pairs, joined(found), 0.5)


def found_of(result: Overlay, n_exact: int) -> Found:
    """Return what was found for one pair from its object; n_exact: pairs of edges beyond the filter."""
    rings = result.vertices, result.ring_offsets, result.piece_offsets
    return _one(*rings, result.largest_displacement, n_exact)


def _one(
    vertices: FloatArray,
    ring_offsets: IntArray,
    piece_offsets: IntArray,
    displacement: float,
    n_exact: int,
) -> Found:
    counts = np.array([[len(piece_offsets) - 1, len(ring_offsets) - 1, len(vertices), n_exact]])
    sources = np.full((len(vertices), 2), -1, np.int32)
    status, moved = np.array([DONE], np.int8), np.array([displacement])
    return Found(status, counts, moved, vertices, sources, ring_offsets, piece_offsets, _NONE)


def taken(found: Found, items: IntArray) -> Found:
    """Return some of the pairs found, in the order of ``items``; no evidence."""
    of_pieces, of_rings, of_vertices = (_places(summed(found.counts[:, k]), items) for k in range(3))
    return Found(
        found.status[items],
        found.counts[items],
        found.displacement[items],
        found.vertices[of_vertices],
        found.sources[of_vertices],
        summed(np.diff(found.ring_offsets)[of_rings]),
        summed(np.diff(found.piece_offsets)[of_pieces]),
        _NONE,
    )


def _places(offsets: IntArray, items: IntArray) -> IntArray:
    """Return the places that belong to ``items``, one item after another, those of item k from offsets[k] on."""
    sizes = offsets[items + 1] - offsets[items]
    ends = np.cumsum(sizes)
    return np.arange(ends[-1] if len(ends) else 0) + np.repeat(offsets[items] - (ends - sizes), sizes)


def joined(parts: list[Found]) -> Found:
    """Return the pairs of all parts, at least one, one part after another; no evidence."""
    outcomes = (np.concatenate(arrays) for arrays in list(zip(*parts, strict=True))[:3])
    return Found(*outcomes, *put_together([(*part[3:7], _NONE) for part in parts]))
