"""Runs the kernels of convex regions, on which a segment has at most one piece: decide a chunk, then fill its pieces.

1. *decide* lists the accepted segments of a chunk with the planes that bound them; OPEN ones go to the exact fallback.
2. *fill* computes the pieces and writes each to its final row; a piece with a coordinate that is not certainly rounded
goes to the exact fallback.

Kernels need numbers of sizes for which expansions are exact. If more than a few items stay OPEN, the batch is run again
on numbers scaled by a power of two, if one brings them into that range.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import entry_of
from engine.predicates.rational import exponent_of, scaled_back, shifted
from engine.running.budget import UNLIMITED, Budget
from engine.running.parallel import FEW_THREADS, Progress, default_workers, run_chunks
from engine.segment_clipping.pieces import Pieces, allocate_pieces, first_of, in_order_of_source
from engine.segment_clipping.profiles import clip_exactly
from engine.solids.base import Solid
from engine.solids.checks import check_finite
from engine.types import FloatArray, Int32Array, IntArray

Clipped = tuple[Pieces, int, int]
"""Pieces, number of segments beyond the filter, and number decided in rationals."""

FEW: Final = 32
"""Most segments of a small batch, run as one chunk; and most OPEN items for which the exact fallback costs no more than
a search for a scale."""


_spare: list[tuple[Int32Array, Int32Array, Int32Array, IntArray]] = []
"""Scratch of the small batch path, for one call at a time."""
_NO_FLAG: Final = UNLIMITED.flag
_PER_BLOCK: Final = 1 << 12
_PER_SHARED_BLOCK: Final = 1 << 14
"""Segments that are decided before their pieces are filled: few are still in the cache then; many keep the interpreter
lock free where more than a few threads need it."""


@dataclass(frozen=True, slots=True)
class Scaled:
    """A batch of segments and the arrays of its region, as arguments of kernels, all times 2^-exponent."""

    points: FloatArray
    region: tuple[Any, ...]
    exponent: int


def scaled(points: FloatArray, *region: FloatArray) -> Scaled | None:
    """Return a batch and the arrays of its region scaled by a power of two into the range of expansions; None if no
    scale is needed, or not all numbers are exact after it."""
    exponent = exponent_of(points, *region)
    arrays = [shifted(array, -exponent) for array in (points, *region)]
    exact = [array for array in arrays if array is not None]
    if exponent == 0 or len(exact) < len(arrays):
        return None
    return Scaled(exact[0], tuple(exact[1:]), exponent)


class Method(NamedTuple):
    """How to clip segments to one convex region. decide, fill: kernels (cohen_sutherland.py, planes_cut.py); region:
    their arguments after the segments; scale: returns a batch `Scaled`, or None."""

    decide: Any
    fill: Any
    region: tuple[Any, ...]
    scale: Callable[[FloatArray], Scaled | None]


class Plan(NamedTuple):
    """How to clip segments to one solid, by its type (`Row.clip`); cached with the solid."""

    name: str
    """Name of the method in `Accuracy.method`."""
    cut: Callable[[FloatArray, Any, Plan, Budget, int | None, Progress | None], Clipped]
    """(segments, solid, plan, budget, workers, progress); segments: (n, 2, dim) float64, not yet tested for NaN. Raises
    NotFiniteError."""
    few: int = FEW
    """Largest batch that runs as one chunk if the call has no limits: `budget` is UNLIMITED then."""
    method: Method | None = None
    """Kernels, for a convex region; None for others."""


def clip_on_convex(
    segments: FloatArray, region: Solid, plan: Plan, budget: Budget, workers: int | None, progress: Progress | None
) -> Clipped:
    """Return the pieces of segments (n, 2, dim) in a convex region, at most one each; the number of segments beyond the
    filter; and of those decided in rationals."""
    method = plan.method
    assert method is not None
    if len(segments) <= FEW and (few := _clip_few(segments, method)) is not None:
        if budget is not UNLIMITED:
            budget.check()
        if progress is not None and len(segments):
            progress(len(segments))
        return few
    scene = Scaled(segments, method.region, 0)
    clipped = _clip(segments, region, method, scene, FEW + len(segments) // 256, budget, workers, progress)
    if clipped is None:
        scene = method.scale(segments) or scene
        clipped = _clip(segments, region, method, scene, len(segments), budget, workers, None)  # already reported
    assert clipped is not None
    return clipped


def _clip_few(segments: FloatArray, method: Method) -> Clipped | None:
    """Return the pieces of at most `FEW` segments (n, 2, dim) float64, maybe with NaN, and counts; None if one stays
    OPEN."""
    n, _, dimension = segments.shape
    decide, fill, region, _ = method
    try:
        scratch = _spare.pop()
    except IndexError:
        scratch = np.empty(FEW, np.int32), np.empty((FEW, 2), np.int32), np.empty(FEW, np.int32), np.zeros(3, np.int64)
    items, planes, still, counts = scratch
    entry_of(decide)(segments, *region, 0, n, _NO_FLAG, items, planes, still, counts)
    m, n_open, n_beyond = counts.tolist()
    pieces = allocate_pieces(m, dimension)
    if not n_open:
        entry_of(fill)(segments, *region, items, planes, 0, m, _NO_FLAG, pieces, still, counts)
        n_open, n_more, _ = counts.tolist()
        n_beyond = min(n, n_beyond + n_more)
    _spare.append(scratch)
    return None if n_open else (pieces, n_beyond, 0)


def _clip(
    segments: FloatArray, region: Solid, method: Method, scene: Scaled, most_open: int, budget: Budget,
    workers: int | None, progress: Progress | None,
) -> Clipped | None:  # fmt: skip
    """Return the pieces of a batch and counts; None if more than `most_open` segments need the exact fallback. scene:
    the batch as kernels take it."""
    n_threads = default_workers() if workers is None else workers
    batch = _Batch(method, scene, budget, _PER_BLOCK if n_threads <= FEW_THREADS else _PER_SHARED_BLOCK)
    run_chunks(batch.clip, len(segments), budget=budget, workers=workers, progress=progress, in_order=True)
    if batch.waiting:
        run_chunks(batch.fill_rest, len(batch.waiting), budget=budget, workers=workers, first_chunk=1)
    n_open = sum(map(len, batch.open_items))
    if n_open:
        check_finite(segments, ("segments",))  # kernels leave open what is not
    n_rational = n_open + sum(map(len, batch.unsure_rows))
    if n_rational > most_open:
        return None
    m = batch.n_rows
    filled = first_of(batch.pieces, m) if m < len(segments) else batch.pieces
    if n_rational:
        filled = _settle(filled, batch, segments, region, budget)
    return filled, min(len(segments), batch.n_beyond + n_open), n_rational


class _Batch:
    """Clips chunks of a batch and writes each piece to its final row, behind those of all earlier chunks.

    Rows are assigned in the order of the blocks: a block that is decided early waits until those before it are, and is
    filled by whichever thread decides a block next, or by `fill_rest` at the end. Rows are allocated for a piece of
    every segment; unused ones cost address space only.
    """

    def __init__(self, method: Method, scene: Scaled, budget: Budget, per_block: int) -> None:
        n, _, dimension = scene.points.shape
        self.pieces = allocate_pieces(n, dimension)
        self.open_items: list[IntArray] = []
        self.unsure_rows: list[IntArray] = []
        self.n_rows = self.n_beyond = 0
        self._method, self._scene, self._flag, self._per_block = method, scene, budget.flag, per_block
        self.waiting: dict[int, tuple[int, Int32Array, Int32Array, int]] = {}
        """Decided blocks that are not filled, by first segment: last segment, items, planes, number of items."""
        self._lock, self._next = Lock(), 0

    def clip(self, first: int, last: int) -> None:
        """Clip segments first .. last - 1 in blocks, which are still in the cache when their pieces are filled."""
        for begin in range(first, last, self._per_block):
            self._decide(begin, min(begin + self._per_block, last))
            for _ in range(2):  # its own, and one that waits: the last to decide must not fill all others' alone
                if (block := self._next_to_fill()) is not None:
                    self._fill(*block)

    def fill_rest(self, first: int, last: int) -> None:
        """Fill the next last - first of the waiting blocks, in order, as a task of `run_chunks`, of whose ranges only
        the lengths count. Called once all blocks are decided."""
        for _ in range(first, last):
            if (block := self._next_to_fill()) is not None:
                self._fill(*block)

    def _decide(self, first: int, last: int) -> None:
        """Decide segments first .. last - 1, and add the chunk to those waiting to be filled."""
        size, scene = last - first, self._scene
        items, planes, still = np.empty(size, np.int32), np.empty((size, 2), np.int32), np.empty(size, np.int32)
        counts = np.zeros(3, np.int64)
        entry_of(self._method.decide)(
            scene.points, *scene.region, first, last, self._flag, items, planes, still, counts
        )
        n_accepted, n_open, n_beyond = counts.tolist()
        with self._lock:
            self.n_beyond += n_beyond
            if n_open:
                self.open_items.append(still[:n_open].astype(np.int64))
            self.waiting[first] = last, items, planes, n_accepted

    def _next_to_fill(self) -> tuple[int, Int32Array, Int32Array, int] | None:
        """Return the first row of the next chunk in order, its segments, their planes, and its number of rows; None if
        that chunk is still undecided."""
        with self._lock:
            if self._next not in self.waiting:
                return None
            row = self.n_rows
            self._next, items, planes, n_accepted = self.waiting.pop(self._next)
            self.n_rows += n_accepted
            return row, items, planes, n_accepted

    def _fill(self, row: int, items: Int32Array, planes: Int32Array, n_accepted: int) -> None:
        """Fill `n_accepted` rows from `row` on with the pieces of segments `items` between their planes; note the rows
        that are not certainly rounded."""
        scene, pieces, counts, still = self._scene, self.pieces, np.zeros(2, np.int64), np.empty(n_accepted, np.int32)
        entry_of(self._method.fill)(
            scene.points, *scene.region, items, planes, row, n_accepted, self._flag, pieces, still, counts
        )
        n_unsure, n_beyond = counts.tolist()
        unsure = still[:n_unsure].astype(np.int64)
        rows = slice(row, row + n_accepted)
        if scene.exponent:
            is_cut = pieces.faces[rows] >= 0
            for side in range(2):
                pieces.ends[side, rows], doubtful = scaled_back(pieces.ends[side, rows], scene.exponent)
                unsure = np.union1d(unsure, row + np.flatnonzero(doubtful & is_cut[:, side]))
        with self._lock:
            self.n_beyond += n_beyond
            if len(unsure):
                self.unsure_rows.append(unsure)


def _settle(filled: Pieces, batch: _Batch, segments: FloatArray, region: Solid, budget: Budget) -> Pieces:
    """Return the pieces in order of source, after the exact fallback recomputed the uncertain rows of `filled` and
    clipped the OPEN segments of `batch`."""
    rows = np.concatenate([np.zeros(0, np.int64), *batch.unsure_rows])
    again = clip_exactly(segments, filled.source[rows], region, None, budget)
    filled.t[rows], filled.ends[:, rows], filled.faces[rows] = again.t, again.ends, again.faces
    open_items = np.concatenate([np.zeros(0, np.int64), *batch.open_items])
    return in_order_of_source([filled, clip_exactly(segments, open_items, region, None, budget)])
