"""Runs the kernels of convex regions, on which a segment has one piece at most: decide, then fill.

1. *decide* goes over the segments in chunks and lists those that are kept with the planes that bound them. What it
   leaves open is settled by rational arithmetic and put in its place, so that the number of pieces is known.
2. *fill* goes over the pieces in chunks and writes each where it belongs, nothing is copied. A coordinate that it
   cannot round for sure is settled by rational arithmetic too.

Kernels take numbers of sizes for which expansions are exact. Where more than a few items are left open, all is done
again on numbers times a power of two, if there is one that brings them into that range.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.parallel import Budget, Progress, check_options, run_chunks
from engine.predicates.scaling import exponent_of, scaled_back, shifted
from engine.segment_clipping.exact_segments import Piece
from engine.segment_clipping.pieces import Pieces
from engine.solids.checks import check_finite

Settle = Callable[[list[float], list[float]], Piece | None]
Clipped = tuple[Pieces, int, int]
"""Pieces, how many items needed more than the filter, and how many rational arithmetic."""

_FEW: Final = 32
"""Open items that rational arithmetic settles in the time in which a batch is looked through for its exponent."""


@dataclass(frozen=True, slots=True)
class Scaled:
    """A batch and its region times 2^-exponent, as the kernels take them."""

    points: FloatArray
    region: tuple[Any, ...]
    exponent: int


def scaled(points: FloatArray, *region: FloatArray) -> Scaled | None:
    """Return a batch and the arrays of its region scaled, None where they are well as they are or it is not exact."""
    exponent = exponent_of(points, *region)
    arrays = [shifted(array, -exponent) for array in (points, *region)]
    exact = [array for array in arrays if array is not None]
    if exponent == 0 or len(exact) < len(arrays):
        return None
    return Scaled(exact[0], tuple(exact[1:]), exponent)


@dataclass(frozen=True, slots=True)
class Method:
    """How segments are clipped on one region.

    decide, fill: kernels; see cohen_sutherland.py. region: their arguments. settle: rational arithmetic on one segment.
    scale: returns the batch scaled, None where it is well as it is or cannot be scaled exactly.
    """

    decide: Any
    fill: Any
    region: tuple[Any, ...]
    settle: Settle
    scale: Callable[[FloatArray], Scaled | None]


class Tally:
    """Counts each segment once, when it is dropped or its piece is filled, also where all is done a second time."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._done = self._told = 0

    def restart(self) -> None:
        """Count from the first segment on; nothing is told again."""
        self._done = 0

    def add(self, n_items: int) -> None:
        self._done += n_items
        if self._progress is not None and self._done > self._told:
            self._progress(self._done - self._told)
            self._told = self._done


def clip_on_convex(
    segments: FloatArray, method: Method, budget: Budget, workers: int | None, progress: Progress | None
) -> Clipped:
    """Return the piece of each segment that has one. segments: (n, 2, dim) float64, not yet looked at for NaN.

    Raises: NotFiniteError.
    """
    check_options(workers, progress)
    scene, tally = Scaled(segments, method.region, 0), Tally(progress)
    found = _clip(segments, method, scene, _FEW + len(segments) // 256, budget, workers, tally)
    if found is None:
        better = method.scale(segments)
        tally.restart()
        found = _clip(segments, method, better or scene, len(segments), budget, workers, tally)
    assert found is not None
    return found


def _clip(
    segments: FloatArray,
    method: Method,
    scene: Scaled,
    most_open: int,
    budget: Budget,
    workers: int | None,
    tally: Tally,
) -> Clipped | None:
    """Return the pieces; None where more than `most_open` items are left to rational arithmetic."""
    n = len(segments)
    listed, still = np.empty((2, n), np.int32)  # together: a large block gets large pages
    planes = np.empty((n, 2), np.int32)
    decided: dict[int, IntArray] = {}
    dropped: deque[int] = deque()

    def decide(first: int, last: int) -> None:
        counts = np.zeros(3, np.int64)
        with np.errstate(all="ignore"):  # uncompiled kernels: overflow is looked at by their filters
            method.decide(scene.points, *scene.region, first, last, budget.flag, listed, planes, still, counts)
        decided[first] = counts
        dropped.append(last - first - int(counts[0] + counts[1]))

    def count(_: int) -> None:
        while dropped:
            tally.add(dropped.popleft())

    run_chunks(decide, n, budget=budget, workers=workers, progress=count)
    firsts = sorted(decided)
    n_open = sum(int(decided[first][1]) for first in firsts)
    if n_open:
        check_finite(segments, ("segments",))  # kernels leave open what is not
        if n_open > most_open:
            return None
    kept = [(first, int(decided[first][0])) for first in firsts]
    left = _joined(still, [(first, int(decided[first][1])) for first in firsts])
    pieces: dict[int, Piece] = {}
    for item in left.tolist():
        budget.check()
        piece = method.settle(segments[item, 0].tolist(), segments[item, 1].tolist())
        if piece is not None:
            pieces[item] = piece
    tally.add(len(left) - len(pieces))
    if pieces:
        items = np.append(_joined(listed, kept), np.array(list(pieces), np.int32))
        bounding = np.append(_joined(planes, kept), np.full((len(pieces), 2), -1, np.int32), axis=0)
        order = np.argsort(items, kind="stable")
        listed, planes, kept = items[order], bounding[order], [(0, len(items))]
    filled, unsure, n_beyond = _fill(scene, method, listed, planes, kept, budget, workers, tally)
    if len(unsure) + n_open > most_open:
        return None
    for row in unsure:
        budget.check()
        item = int(filled.source[row])
        piece = method.settle(segments[item, 0].tolist(), segments[item, 1].tolist())
        assert piece is not None
        pieces[item] = piece
    if pieces:
        _put(filled, pieces)
    beyond = sum(int(decided[first][2]) for first in firsts)
    return filled, min(n, beyond + n_beyond + n_open), n_open + len(unsure)


def _fill(
    scene: Scaled,
    method: Method,
    items: Int32Array,
    planes: Int32Array,
    kept: list[tuple[int, int]],
    budget: Budget,
    workers: int | None,
    tally: Tally,
) -> tuple[Pieces, IntArray, int]:
    """Return the pieces, which of them are not surely rounded, and how many needed more than one try.

    items, planes: as decided, of the ranges `kept` (first, how many).
    """
    ends_of_ranges = np.cumsum([0, *(size for _, size in kept)]).tolist()
    m, dimension = ends_of_ranges[-1], scene.points.shape[2]
    floats, integers, still = np.empty(m * (2 * dimension + 2)), np.empty(3 * m, np.int64), np.empty(m, np.int32)
    ends, t = floats[: 2 * m * dimension].reshape(2, m, dimension), floats[2 * m * dimension :].reshape(m, 2)
    pieces = Pieces(integers[:m], ends, t, integers[m:].reshape(m, 2))
    counts: dict[int, IntArray] = {}
    unsure: list[IntArray] = []

    def fill(first: int, last: int) -> None:
        i_range = bisect_right(ends_of_ranges, first) - 1
        while first < last:  # bound: every turn goes on to the next range
            stop = min(last, ends_of_ranges[i_range + 1])
            if first < stop:
                fill_from(kept[i_range][0] - ends_of_ranges[i_range], first, stop)
            first, i_range = stop, i_range + 1

    def fill_from(shift: int, first: int, last: int) -> None:
        """Fill rows from the items `shift` places further on."""
        found = counts[first] = np.zeros(2, np.int64)
        with np.errstate(all="ignore"):
            method.fill(
                scene.points,
                *scene.region,
                items[shift:],
                planes[shift:],
                first,
                last,
                budget.flag,
                pieces,
                still,
                found,
            )
        if scene.exponent:
            is_cut = pieces.faces[first:last] >= 0
            for side in range(2):
                points, doubtful = scaled_back(ends[side, first:last], scene.exponent)
                ends[side, first:last] = points
                unsure.append(first + np.flatnonzero(doubtful & is_cut[:, side]))

    run_chunks(fill, m, budget=budget, workers=workers, progress=tally.add)
    unsure += [still[first : first + found[0]].astype(np.int64) for first, found in counts.items()]
    return pieces, np.unique(np.concatenate([np.zeros(0, np.int64), *unsure])), sum(int(c[1]) for c in counts.values())


def _joined(array: Int32Array, parts: list[tuple[int, int]]) -> Int32Array:
    """Return the parts (first, how many) of an array one after another."""
    if len(parts) == 1:
        return array[parts[0][0] : parts[0][0] + parts[0][1]]
    return np.concatenate([array[:0], *(array[first : first + n] for first, n in parts)])


def _put(filled: Pieces, pieces: dict[int, Piece]) -> None:
    """Write settled pieces to their rows."""
    rows = np.searchsorted(filled.source, np.array(list(pieces), np.int64))
    for row, piece in zip(rows, pieces.values()):
        filled.t[row], filled.ends[:, row], filled.faces[row] = piece.t, (piece.start, piece.end), piece.faces
