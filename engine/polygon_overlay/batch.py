"""Overlays of many pairs: flat arrays in, flat arrays out, objects on request."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, cast

import numpy as np

from engine.errors import InvalidArrayError, NotRepresentableError
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.implicit_rings import ImplicitRings, areas_of, check_sources
from engine.polygon_overlay.overlay import (
    accuracy_of,
    check_operation,
    overlay_rings,
    polygons_in,
    rings_of,
    ulps_moved,
)
from engine.polygon_overlay.pair_arrays import (
    NO_PAIRS,
    PairResults,
    PolygonArrays,
    PolygonSelection,
    concatenate_offsets,
    concatenate_pairs,
    one_pair,
    polygon_arrays_of,
    take_pairs,
)
from engine.polygon_overlay.result import Overlay
from engine.polygon_overlay.rounds import ValidPairs, make_pairs_valid
from engine.polygon_overlay.run import SELECTED_ARRAYS, Operation, as_overlay, rebuild_from_rounded_rings, run_kernel
from engine.running.budget import Budget, Cancel, reading
from engine.running.parallel import Progress, check_options, run_chunks
from engine.solids.accepted import SolidsLike
from engine.solids.base import Solid
from engine.solids.checks import as_nested_offsets
from engine.solids.polygon import Polygon
from engine.solids.ragged import Ragged, closed_rings, summed
from engine.types import OPEN, Accuracy, BoolArray, FloatArray, Int8Array, IntArray, read_only

NOT_REPRESENTABLE: Final = 1
_FIRST_CHUNK: Final = 8
_FIRST_VERTICES: Final = 16_384
"""Vertices of the first chunk of at most 64 times `_FIRST_CHUNK` pairs: the overhead of a chunk is 20 us."""
_DOUBTFUL: Final = 256
"""Pairs whose rounded rings are arranged in one call: the overhead of a call is that of some hundred pairs."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class OverlayBatch(Ragged):
    """Results of many overlays, as flat arrays; `overlays` and indexing make objects from them.

    Attributes
    ----------
    status : ndarray of int8, shape (n_pairs,)
        0 done; 1 a coordinate of the result is beyond the largest double (the pair has no pieces here, and None as its
        overlay).
    vertices : ndarray of float64, shape (n_vertices, 2)
        All rings one after another.
    ring_offsets : ndarray of int64, shape (n_rings + 1,)
        Into `vertices`.
    piece_offsets : ndarray of int64, shape (n_pieces + 1,)
        Into the rings, a shell before its holes.
    pair_offsets : ndarray of int64, shape (n_pairs + 1,)
        Into the pieces.
    displacement : ndarray of float64, shape (n_pairs,)
        How far an edge may lie from the exact one, as `Overlay.largest_displacement`.

    Notes
    -----
    Private fields:

    | field | contents |
    | --- | --- |
    | `_exact` | the result of the kernel's first call |
    | `_is_rounded_again` | (n_pairs,) bool: the rounded rings were not valid; its object takes an overlay of its own |
    | `_apart` | objects made already, by pair |
    """

    _rows: ClassVar[str] = "pairs"
    _levels: ClassVar[tuple[str, ...]] = ("vertices", "ring_offsets", "piece_offsets", "pair_offsets")
    status: Int8Array
    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    pair_offsets: IntArray
    displacement: FloatArray
    _subjects: Sequence[Solid] = field(repr=False)
    _clips: Sequence[Solid] = field(repr=False)
    _operation: Operation = field(repr=False)
    _exact: PairResults = field(repr=False)
    _is_rounded_again: BoolArray = field(repr=False)
    _apart: dict[int, Overlay] = field(repr=False)

    @classmethod
    def _restored(cls, *values: Any) -> OverlayBatch:
        made: OverlayBatch = super(OverlayBatch, cls)._restored(*values)
        exact = made._exact
        as_nested_offsets(len(exact.vertices), rings=exact.ring_offsets, pieces=exact.piece_offsets)
        for column, items in enumerate((exact.piece_offsets[1:], exact.ring_offsets[1:], exact.vertices)):
            as_nested_offsets(len(items), counts=summed(exact.counts[:, column]))
        n_inputs = _polygon_arrays(made._subjects).sizes() + _polygon_arrays(made._clips).sizes()
        check_sources(exact.sources, np.repeat(n_inputs, exact.counts[:, 2]))
        return made

    def __eq__(self, other: object) -> bool:
        is_same = Ragged.__eq__(self, other)  # of the arrays
        if is_same is not True or not isinstance(other, OverlayBatch):
            return is_same
        questions = [(each._operation, tuple(each._subjects), tuple(each._clips)) for each in (self, other)]
        return questions[0] == questions[1]  # what `batch[k]` may ask again

    __hash__ = Ragged.__hash__

    def __len__(self) -> int:
        return len(self.status)

    def __iter__(self) -> Iterator[Overlay | None]:
        return (self[pair] for pair in range(len(self)))

    def __getitem__(self, pair: int) -> Overlay | None:
        """Return the overlay of one pair, None where its status is not 0."""
        if not -len(self) <= pair < len(self):
            raise IndexError(f"pair {pair} of {len(self)}")
        pair %= len(self)
        if self.status[pair] != PairStatus.DONE:
            return None
        if pair in self._apart:
            return self._apart[pair]
        subject, clip = rings_of(self._subjects[pair]), rings_of(self._clips[pair])
        if self._is_rounded_again[pair]:
            return overlay_rings(subject, clip, self._operation, Budget())[0]
        one = take_pairs(self._exact, np.array([pair]))
        exact = ImplicitRings(subject, clip, read_only(one.sources), one.ring_offsets)
        return as_overlay(read_only(one.vertices), one.piece_offsets, float(one.displacement[0]), exact)

    @property
    def areas(self) -> FloatArray:
        """The doubles nearest to the exact areas of all pairs, (n_pairs,), computed now. NaN where status is not 0,
        infinity for what is beyond the largest double."""
        areas = self._sum_areas(np.empty((0, 3)))
        uncertified = np.isnan(areas) & (self.status == PairStatus.DONE)
        for pair in np.flatnonzero(uncertified).tolist():
            try:
                areas[pair] = cast("Overlay", self[pair]).area
            except NotRepresentableError:
                areas[pair] = np.inf
        return areas

    def _sum_areas(self, sums: FloatArray) -> FloatArray:
        """Return the areas that doubles prove, NaN for others; sums: (0, 3), or (n_pairs, 3) as for `sum_areas`, NaN
        where they do not hold."""
        exact = self._exact
        groups = exact.piece_offsets[summed(exact.counts[:, 0])]
        sides = [
            (RingArrays(*each[:2]), each[2]) for each in (_polygon_arrays(self._subjects), _polygon_arrays(self._clips))
        ]
        sources, offsets = read_only(exact.sources), read_only(exact.ring_offsets)
        areas, _ = areas_of(*sides[0], *sides[1], sources, offsets, groups, sums)
        is_open = (exact.status == OPEN) | (self.status != PairStatus.DONE)
        areas[is_open] = np.nan
        sums[is_open[: len(sums)]] = np.nan
        return areas

    @property
    def n_pieces_exact(self) -> IntArray:
        """How many pieces the exact result of each pair has, before rounding, (n_pairs,)."""
        counts = self._exact.counts[:, 0].copy()
        for pair, result in self._apart.items():
            counts[pair] = result.n_pieces_exact
        return counts

    @property
    def ragged(self) -> tuple[FloatArray, tuple[IntArray, IntArray, IntArray]]:
        """Coordinates (n, 2), and offsets of rings into them, of pieces into rings, of pairs into pieces; rings are
        closed by their first vertex, as `shapely.from_ragged_array` takes them."""
        positions, offsets = closed_rings(self.vertices, self.ring_offsets)
        return positions, (offsets, self.piece_offsets, self.pair_offsets)

    @property
    def overlays(self) -> tuple[Overlay | None, ...]:
        """One `Overlay` for each pair, made now; None where its status is not 0."""
        return tuple(self)


def twice_areas(made: OverlayBatch) -> FloatArray:
    """Return twice the exact areas of all pairs, (n_pairs, 3): high part, low part, error bound; NaN where floats prove
    nothing."""
    sums = np.empty((len(made), 3))
    made._sum_areas(sums)
    return sums


def _polygons_in(solids: Any, name: str) -> Sequence[Solid]:
    """Return polygons as a tuple, or unchanged if they are a selection of arrays; other shapes are read
    (`shapes.as_solid`). name: of the argument, for errors."""
    return solids if isinstance(solids, PolygonSelection) else polygons_in(solids, name)


def _n_vertices(solids: Sequence[Solid]) -> int:
    """Return the number of vertices of all polygons."""
    return (
        solids.n_vertices
        if isinstance(solids, PolygonSelection)
        else sum(len(rings_of(each).vertices) for each in solids)
    )


def _polygon_arrays(solids: Sequence[Solid], first: int = 0, last: int | None = None) -> PolygonArrays:
    """Return polygons first .. last - 1 as flat arrays."""
    if isinstance(solids, PolygonSelection):
        return solids[first:last].arrays()
    return polygon_arrays_of(cast("Sequence[Polygon]", solids), first, last)


def overlay_batch(
    subjects: SolidsLike,
    clips: SolidsLike,
    operation: Operation = "intersection",
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> OverlayBatch | tuple[OverlayBatch, Accuracy]:
    """Combine pairs of polygons, subjects[i] with clips[i].

    Parameters
    ----------
    subjects, clips : sequence of Polygon
        As many of one as of the other.
    operation : {"intersection", "union", "difference", "symmetric_difference"}
        The same for all pairs.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts pairs.

    Returns
    -------
    OverlayBatch
        In the order of the pairs. With ``report=True`` a pair of it and one `Accuracy` for all.

    Raises
    ------
    InvalidArrayError
        The lengths differ.
    EngineError
        As `overlay`. Every solid is checked before the first is overlaid.

    Notes
    -----
    Boundary, degenerate input and accuracy: as `overlay`.

    Cost: some microseconds for a pair of a few vertices, on all workers, several times that where rounding comes near
    other edges; no object per pair. The object of a pair whose rings were rounded more than once takes an overlay.

    References
    ----------
    As `overlay`; Shamos, Hoey, Geometric intersection problems, 1976 (convex pairs).

    Examples
    --------
    >>> from engine import Polygon, overlay_batch
    >>> squares = [Polygon([[(x, 0), (x + 2, 0), (x + 2, 2), (x, 2)]]) for x in range(3)]
    >>> overlay_batch(squares[:2], squares[1:], "intersection").areas.tolist()
    [2.0, 2.0]
    """
    check_operation(operation)
    check_options(workers, progress, report=report)
    with reading(deadline, cancel) as reader:
        subjects, clips = _polygons_in(subjects, "subjects"), _polygons_in(clips, "clips")
    deadline = reader.left()
    if len(subjects) != len(clips):
        raise InvalidArrayError(
            f"subjects and clips must be of equal length, got {len(subjects)} and {len(clips)}", ("clips",)
        )
    parts: dict[int, PairResults] = {}
    selected = SELECTED_ARRAYS[operation]
    with Budget(deadline, cancel, workers) as budget:

        def task(start: int, stop: int) -> None:
            # Gathered here, chunk by chunk: by all threads, and what was written is near.
            both = _polygon_arrays(subjects, start, stop), _polygon_arrays(clips, start, stop)
            parts[start] = run_kernel(*both, selected, budget)

        n_few = max(1, _n_vertices(subjects[:_FIRST_CHUNK]) + _n_vertices(clips[:_FIRST_CHUNK]))
        first_chunk = _FIRST_CHUNK * min(64, max(1, _FIRST_VERTICES // n_few))
        run_chunks(task, len(subjects), budget=budget, first_chunk=first_chunk, workers=workers, progress=progress)
        outcome = first_outcome = concatenate_pairs(
            [parts[start] for start in sorted(parts)] or [NO_PAIRS], budget, workers
        )
        rest = np.zeros(len(subjects), np.int8), np.zeros(len(subjects), np.bool_), dict[int, Overlay]()
        status, is_rounded_again, apart = rest
        ulps, n_rational = 0.5, 0
        if outcome.status.any():
            outcome, ulps, n_rational = _resolve(outcome, rest, subjects, clips, operation, workers, budget)
    for array in (status, *outcome, *(first_outcome if first_outcome is not outcome else ())):
        array.setflags(write=False)
    batch = OverlayBatch(
        status=status, vertices=outcome.vertices, ring_offsets=outcome.ring_offsets,
        piece_offsets=outcome.piece_offsets, pair_offsets=summed(outcome.counts[:, 0]),
        displacement=outcome.displacement, _subjects=subjects, _clips=clips, _operation=operation, _exact=first_outcome,
        _is_rounded_again=is_rounded_again, _apart=apart,
    )  # fmt: skip
    if not report:
        return batch
    n_edges = _n_vertices(subjects) + _n_vertices(clips)
    return batch, accuracy_of(ulps, n_edges, int(outcome.counts[:, 3].sum()), n_rational)


def _resolve(
    outcome: PairResults, rest: tuple[Int8Array, BoolArray, dict[int, Overlay]], subjects: Sequence[Solid],
    clips: Sequence[Solid], operation: Operation, workers: int | None, budget: Budget,
) -> tuple[PairResults, float, int]:  # fmt: skip
    """Return the results of all pairs, valid after rounding; the largest displacement as `Accuracy.coordinates_ulp`;
    and the number of edge pairs decided in rationals. outcome: of the kernel, with pairs that are OPEN or MAY_CROSS;
    rest: the fields status, `_is_rounded_again` and `_apart` of the `OverlayBatch`, filled here."""
    status, is_rounded_again, apart = rest
    valid: dict[int, ValidPairs] = {}
    alone: dict[int, tuple[Overlay, int, int]] = {}
    doubtful = np.flatnonzero(outcome.status == PairStatus.MAY_CROSS)

    def make_valid(start: int, stop: int) -> None:
        some = doubtful[start * _DOUBTFUL : stop * _DOUBTFUL]
        pairs = take_pairs(outcome, some)
        results = make_pairs_valid(pairs, rebuild_from_rounded_rings, budget)
        valid[start] = results._replace(pairs=some[results.pairs])

    def overlay_alone(start: int, stop: int) -> None:
        for pair in left[start:stop].tolist():
            budget.check()
            both = rings_of(subjects[pair]), rings_of(clips[pair])
            try:
                alone[pair] = overlay_rings(*both, operation, budget)
            except NotRepresentableError:
                status[pair] = NOT_REPRESENTABLE

    run_chunks(make_valid, -(-len(doubtful) // _DOUBTFUL), budget=budget, first_chunk=1, workers=workers)
    together = [valid[start] for start in sorted(valid)]
    for each in together:
        is_rounded_again[each.pairs] = True
    left = np.flatnonzero((outcome.status != PairStatus.DONE) & ~is_rounded_again)
    run_chunks(overlay_alone, len(left), budget=budget, first_chunk=1, workers=workers)
    apart.update((pair, result) for pair, (result, _, _) in alone.items())
    results = [each.rings for each in together]
    for result, n_exact, _ in alone.values():
        rings = result.vertices, result.ring_offsets, result.piece_offsets
        results.append(one_pair(*rings, result.largest_displacement, n_exact))
    pairs = np.concatenate([*(each.pairs for each in together), np.array([*alone], np.int64)])
    rows = np.arange(len(outcome.status))
    rows[pairs] = len(rows) + np.arange(len(pairs))
    ulps = [0.5, *(each.ulps for each in together), *(ulps_moved(result) for result, _, _ in alone.values())]
    return take_pairs(concatenate_pairs([outcome, *results]), rows), max(ulps), sum(n for _, _, n in alone.values())


def join_batches(batches: Sequence[OverlayBatch]) -> OverlayBatch:
    """Concatenate the pairs of at least one batch, all of one operation."""
    apart: dict[int, Overlay] = {}
    n_pairs = 0
    for part in batches:
        apart.update((n_pairs + pair, result) for pair, result in part._apart.items())
        n_pairs += len(part)
    return OverlayBatch(
        status=read_only(np.concatenate([part.status for part in batches])),
        vertices=read_only(np.concatenate([part.vertices for part in batches])),
        ring_offsets=concatenate_offsets([part.ring_offsets for part in batches]),
        piece_offsets=concatenate_offsets([part.piece_offsets for part in batches]),
        pair_offsets=concatenate_offsets([part.pair_offsets for part in batches]),
        displacement=read_only(np.concatenate([part.displacement for part in batches])),
        _subjects=tuple(solid for part in batches for solid in part._subjects),
        _clips=tuple(solid for part in batches for solid in part._clips), _operation=batches[0]._operation,
        _exact=concatenate_pairs([part._exact for part in batches]),
        _is_rounded_again=np.concatenate([part._is_rounded_again for part in batches]), _apart=apart,
    )  # fmt: skip
