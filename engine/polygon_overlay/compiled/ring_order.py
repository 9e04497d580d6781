"""Rings of doubles in their order: pieces by their shells, holes after their shell, each ring from its first vertex.

The first vertex of a ring is its leftmost, then lowest; rings are compared vertex by vertex from there on. Many are
first put where its coordinates say, as if these were evenly spread, the last digit first: that leaves little to merge.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.jit import inline
from engine.polygon_overlay.compiled.boundary.chain_rings import Rings
from engine.polygon_overlay.compiled.edge_tree import OFTEN, POLL, box_holds
from engine.polygon_overlay.compiled.rounded_crossings import Rounded
from engine.predicates.orientation import orient2d
from engine.types import Point2

_FEW: Final = 64
"""Rings that are merged only."""
_MOST_PARTS: Final = 1 << 14
"""Parts of a range, whose counts the cache still holds."""

Ranking = namedtuple("Ranking", "start x y is_hole piece order spare counts")
"""By ring: index of its first vertex, its place, whether it is a hole, rank of its piece; order: the rings in order."""


@inline
def _is_before(rings: Rings, ranking: Ranking, rounded: Rounded, i: int, j: int) -> bool:
    """Tell whether ring i stands before ring j."""
    x, y = rounded.x, rounded.y
    if ranking.piece[i] != ranking.piece[j]:
        return ranking.piece[i] < ranking.piece[j]
    if ranking.is_hole[i] != ranking.is_hole[j]:
        return ranking.is_hole[i] < ranking.is_hole[j]
    if ranking.x[i] != ranking.x[j]:
        return ranking.x[i] < ranking.x[j]
    if ranking.y[i] != ranking.y[j]:
        return ranking.y[i] < ranking.y[j]
    p, q = ranking.start[i], ranking.start[j]
    n, m = rings.offset[i + 1] - rings.offset[i], rings.offset[j + 1] - rings.offset[j]
    for _ in range(min(n, m)):
        if x[p] != x[q]:
            return x[p] < x[q]
        if y[p] != y[q]:
            return y[p] < y[q]
        p = p + 1 if p + 1 < rings.offset[i + 1] else rings.offset[i]
        q = q + 1 if q + 1 < rings.offset[j + 1] else rings.offset[j]
    return n < m


@inline
def _spread(ranking: Ranking, keys: Any, n: int) -> None:
    """Put the first n entries of ``ranking.order`` in the order of the parts of equal width that their keys are in.

    Entries of one part stay as they are.
    """
    order, spare, counts = ranking.order, ranking.spare, ranking.counts
    least = most = keys[order[0]]
    for k in range(n):
        spare[k] = order[k]
        least, most = min(least, keys[order[k]]), max(most, keys[order[k]])
    n_parts = min(n, _MOST_PARTS)
    scale = (n_parts - 1) / (most - least) if most > least else 0.0
    counts[:n_parts] = 0
    for k in range(n):
        counts[int((keys[spare[k]] - least) * scale)] += 1
    at = 0
    for part in range(n_parts):
        size = counts[part]
        counts[part], at = at, at + size
    for k in range(n):
        part = int((keys[spare[k]] - least) * scale)
        order[counts[part]] = spare[k]
        counts[part] += 1


@inline
def _sort(rings: Rings, ranking: Ranking, rounded: Rounded, n: int, is_by_piece: bool, stop: Any) -> None:
    """Sort the first n entries of ``ranking.order``: merging runs of doubling length that are not in order.

    is_by_piece: pieces differ.
    """
    order, spare, first_x = ranking.order, ranking.spare, ranking.x
    if n > _FEW:
        _spread(ranking, ranking.y, n)
        _spread(ranking, first_x, n)
        if is_by_piece:
            _spread(ranking, ranking.piece, n)
    width = 1
    while width < n:  # bound: log n turns
        for low in range(0, n - width, 2 * width):
            middle, high = low + width, min(low + 2 * width, n)
            if low & POLL == 0 and stop[0]:
                return
            if not _is_before(rings, ranking, rounded, order[middle], order[middle - 1]):
                continue
            i, j = low, middle
            for k in range(low, high):
                if k & POLL == 0 and stop[0]:
                    return
                p, q = order[i if i < middle else low], order[j if j < high else low]
                if i >= middle or j >= high:
                    takes_second = i >= middle
                elif is_by_piece or first_x[p] == first_x[q]:
                    takes_second = _is_before(rings, ranking, rounded, q, p)
                else:
                    takes_second = first_x[q] < first_x[p]
                spare[k] = q if takes_second else p
                i += not takes_second
                j += takes_second
            for k in range(low, high):
                order[k] = spare[k]
        width *= 2


@inline
def find_shells(rings: Rings, n_rings: int, rounded: Rounded, ranking: Ranking, widest: Any, boxes: Any) -> bool:
    """Fill ``ranking.is_hole`` of rings whose rounded points may turn either way; tell whether it is sure.

    Rounding keeps order, so the rounded box of a shell holds those of its holes: the one ring of a region whose box
    holds all others, and is no other's, is its shell. widest: scratch by region; boxes: by ring.
    """
    x, y = rounded.x, rounded.y
    for ring in range(n_rings):
        x_min = y_min = np.inf
        x_max = y_max = -np.inf
        for k in range(rings.offset[ring], rings.offset[ring + 1]):
            x_min, x_max = min(x_min, x[k]), max(x_max, x[k])
            y_min, y_max = min(y_min, y[k]), max(y_max, y[k])
        boxes[ring, 0], boxes[ring, 1], boxes[ring, 2], boxes[ring, 3] = x_min, x_max, y_min, y_max
        widest[rings.region[ring]] = ring
    for ring in range(n_rings):
        if box_holds(boxes, ring, boxes, widest[rings.region[ring]]):
            widest[rings.region[ring]] = ring
    for ring in range(n_rings):
        shell = widest[rings.region[ring]]
        if ring != shell and (not box_holds(boxes, shell, boxes, ring) or box_holds(boxes, ring, boxes, shell)):
            return False
        ranking.is_hole[ring] = ring != shell
    return True


@inline
def rank_rings(
    rings: Rings, n_rings: int, rounded: Rounded, ranking: Ranking, is_valid: bool, piece_of: Any, boxes: Any, stop: Any
) -> int:
    """Fill ``ranking``; return the number of pieces, -1 if a region has not exactly one shell, or none that is sure.

    is_valid: whether rounding left the rings what they were. piece_of: scratch by region; boxes: by ring.
    """
    if not is_valid and not find_shells(rings, n_rings, rounded, ranking, piece_of, boxes):
        return -1
    n_pieces = 0
    for ring in range(n_rings):
        if ring & OFTEN == 0 and stop[0]:
            return -1
        turn = _turn_at_first(rings, ring, rounded, ranking, stop)
        if is_valid:
            ranking.is_hole[ring] = turn < 0
        ranking.piece[ring] = 0
        piece_of[rings.region[ring]] = -1
        if turn > 0 if is_valid else not ranking.is_hole[ring]:
            ranking.order[n_pieces] = ring
            n_pieces += 1
    if n_rings == 1:
        return n_pieces if n_pieces == 1 else -1
    _sort(rings, ranking, rounded, n_pieces, False, stop)
    if stop[0]:
        return -1
    for k in range(n_pieces):
        region = rings.region[ranking.order[k]]
        if piece_of[region] >= 0:
            return -1
        piece_of[region] = k
    for ring in range(n_rings):
        ranking.piece[ring] = piece_of[rings.region[ring]]
        if ranking.piece[ring] < 0:
            return -1
    if n_pieces < n_rings:
        for ring in range(n_rings):
            ranking.order[ring] = ring
        _sort(rings, ranking, rounded, n_rings, True, stop)
    return n_pieces


@inline
def _turn_at_first(rings: Rings, ring: int, rounded: Rounded, ranking: Ranking, stop: Any) -> int:
    """Find the first vertex of a ring, and return the sign of the turn there, 0 where the call is to end."""
    x, y = rounded.x, rounded.y
    first, last = rings.offset[ring], rings.offset[ring + 1]
    low = first
    for k in range(first + 1, last):
        if k & POLL == 0 and stop[0]:
            return 0
        if x[k] < x[low] or (x[k] == x[low] and y[k] < y[low]):
            low = k
    ranking.start[ring], ranking.x[ring], ranking.y[ring] = low, x[low], y[low]
    before, after = (low if low > first else last) - 1, low + 1 if low + 1 < last else first
    return orient2d(Point2(x[before], y[before]), Point2(x[low], y[low]), Point2(x[after], y[after]))
