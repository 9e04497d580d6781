"""Rounds of many pairs at once: rings that nothing vouches for are arranged again, all pairs in one call of the kernel.

The rule is that of rounds.py, round by round; a pair leaves when it is valid. Only the rings are kept: what
became of the parts of the exact result is found for a single pair, when asked for.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.arrays import IntArray
from engine.parallel import Budget
from engine.polygon_overlay.compiled.kernel import DONE, MAY_CROSS
from engine.polygon_overlay.found import Found, joined, one_pair, taken
from engine.polygon_overlay.nearest import nearest_rings
from engine.polygon_overlay.rounds import MAX_ROUNDS, n_moved
from engine.polygon_overlay.run import arranged_again
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

    Left out are those that the kernel leaves open, or that are not valid after the last round. Raises as `Budget.check`
    when the call must end.
    """
    pairs = np.flatnonzero(first.status == MAY_CROSS)
    rings = taken(first, pairs)
    displacement = rings.displacement
    has_crossings = np.zeros(len(pairs), np.bool_)
    settled = [SettledPairs(_NONE, taken(first, _NONE), 0.5)]
    rounds = 1  # invariant: those of all pairs that are left, since each moved in every round
    while len(pairs):  # bound: MAX_ROUNDS, in whose last no pair goes on that moved
        rings = arranged_again(rings, budget)
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


def nearest_pairs(first: Found, budget: Budget) -> SettledPairs:
    """Leave the rings of the pairs of ``first`` that are MAY_CROSS as they are, but those without area."""
    pairs = np.flatnonzero(first.status == MAY_CROSS)
    found = [taken(first, _NONE)]
    for pair in range(len(pairs)):
        one = taken(first, pairs[pair : pair + 1])
        rings = nearest_rings(one.vertices, one.ring_offsets, one.piece_offsets, budget).arrays()
        found.append(one_pair(*rings, float(one.displacement[0]), int(one.counts[0, 3])))
    return SettledPairs(pairs, joined(found), 0.5)
