"""Overlays of many pairs: flat arrays in, flat arrays out, objects only for who asks for one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, NamedTuple, cast

import numpy as np

from engine.arrays import BoolArray, FloatArray, Int8Array, Int32Array, IntArray, read_only
from engine.errors import InvalidArrayError, NotRepresentableError
from engine.parallel import Budget, Cancel, Progress, check_options, run_chunks
from engine.polygon_overlay.compiled.kernel import DONE, MAY_CROSS
from engine.polygon_overlay.compiled.loading import LEFT_OUT, RingArrays
from engine.polygon_overlay.found import NO_PAIRS, Found, chained, joined, one_pair, summed, taken
from engine.polygon_overlay.implicit_rings import ImplicitRings
from engine.polygon_overlay.overlay import accuracy_of, check_words, overlay_rings, rings_of, ulps_moved
from engine.polygon_overlay.polygon_arrays import Chosen
from engine.polygon_overlay.result import Output, Overlay
from engine.polygon_overlay.rounds_of_many_pairs import SettledPairs, nearest_pairs, settle_pairs
from engine.polygon_overlay.run import Operation, Polygons, as_overlay, gathered, run_kernel
from engine.solids.base import Solid
from engine.solids.polygon import Polygon
from engine.solids.ragged import closed_rings
from engine.types import OPEN, Accuracy

NOT_REPRESENTABLE: Final = 1
_FIRST_CHUNK: Final = 8
_DOUBTFUL: Final = 256
"""Pairs whose rings are arranged again together, whatever their time: a call costs as much as some hundred of them."""


@dataclass(frozen=True, slots=True)
class OverlayBatch:
    """Results of many overlays, as flat arrays; `overlays` and indexing make objects from them.

    status: (n_pairs,) int8; 0 done; 1 a coordinate of the result is beyond the largest double (the pair has no pieces
        here, and None as its overlay).
    vertices: (n_vertices, 2) float64, all rings one after another. ring_offsets: (n_rings + 1,) int64 into them.
    piece_offsets: (n_pieces + 1,) int64 into the rings, a shell before its holes. pair_offsets: (n_pairs + 1,) int64
        into the pieces.
    displacement: (n_pairs,) float64, how far an edge may lie from the exact one, as `Overlay.largest_displacement`.
    _exact: what the first call of the kernel found; sources as those of `ImplicitRings`, but counted as _bases says.
    _bases: (n_pairs, 3), what is added to the numbers of the subject's vertices, to those of the clip's, and from where
        on they are the clip's. _is_rounded_again: (n_pairs,) bool, whose rings were not valid once rounded, or without
        area: such a pair is overlaid again for its object, which tells what became of all parts. _apart: objects made
        already, by pair.
    """

    status: Int8Array
    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    pair_offsets: IntArray
    displacement: FloatArray
    _subjects: Sequence[Solid] = field(repr=False)
    _clips: Sequence[Solid] = field(repr=False)
    _operation: Operation = field(repr=False)
    _output: Output = field(repr=False)
    _exact: Found = field(repr=False)
    _bases: Int32Array = field(repr=False)
    _is_rounded_again: BoolArray = field(repr=False)
    _apart: dict[int, Overlay] = field(repr=False)

    def __len__(self) -> int:
        return len(self.status)

    def __iter__(self) -> Iterator[Overlay | None]:
        return (self[pair] for pair in range(len(self)))

    def __getitem__(self, pair: int) -> Overlay | None:
        """Return the overlay of one pair, None where its status is not 0."""
        if not -len(self) <= pair < len(self):
            raise IndexError(f"pair {pair} of {len(self)}")
        pair %= len(self)
        if self.status[pair] != DONE:
            return None
        if pair in self._apart:
            return self._apart[pair]
        if self._is_rounded_again[pair]:
            both = _arrays(self._subjects[pair]), _arrays(self._clips[pair])
            return overlay_rings(*both, self._operation, self._output, Budget())[0]
        first, last = self.pair_offsets[pair], self.pair_offsets[pair + 1]
        rings = self.piece_offsets[first : last + 1]
        stops = self.ring_offsets[rings[0] : rings[-1] + 1]
        sources = taken(self._exact, np.array([pair])).sources
        subject, clip = _arrays(self._subjects[pair]), _arrays(self._clips[pair])
        in_subjects, in_clips, n_subjects = self._bases[pair].tolist()
        is_edge = sources < LEFT_OUT  # as `overlay_pairs` tells it
        sources[is_edge] = LEFT_OUT - 1 - sources[is_edge]
        is_clip = sources >= n_subjects
        sources[is_clip] += len(subject.vertices) - n_subjects - in_clips
        sources[~is_clip & (sources >= 0)] -= in_subjects
        sources[is_edge] = LEFT_OUT - 1 - sources[is_edge]
        vertices = self.vertices[stops[0] : stops[-1]].copy()
        arrays = vertices, rings - rings[0], sources, stops - stops[0]
        for array in arrays:
            array.setflags(write=False)
        exact = ImplicitRings(subject, clip, *arrays[2:])
        return as_overlay(vertices, arrays[1], float(self.displacement[pair]), exact, self._output)

    @property
    def areas(self) -> FloatArray:
        """The doubles nearest to the exact areas of all pairs, (n_pairs,), computed now.

        NaN where status is not 0, infinity for what is beyond the largest double.
        """
        exact = self._exact
        areas = np.full(len(self), np.nan)
        groups = exact.piece_offsets[summed(exact.counts[:, 0])]
        starts = np.flatnonzero((self._bases[:, :2] == 0).all(axis=1)).tolist()
        for start, stop in pairwise([*starts, len(self)]):  # as they were gathered
            both = [RingArrays(*_gathered(side[start:stop])[:2]) for side in (self._subjects, self._clips)]
            rings = groups[start : stop + 1]
            stops = exact.ring_offsets[rings[0] : rings[-1] + 1]
            part = ImplicitRings(both[0], both[1], exact.sources[stops[0] : stops[-1]], read_only(stops - stops[0]))
            areas[start:stop], _ = part.sure_areas(rings - rings[0])
        unsure = np.isnan(areas) | (exact.status == OPEN)
        areas[self.status != DONE] = np.nan
        for pair in np.flatnonzero(unsure & (self.status == DONE)).tolist():
            try:
                areas[pair] = cast("Overlay", self[pair]).area
            except NotRepresentableError:
                areas[pair] = np.inf
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
        """Coordinates, and offsets of rings, polygons and pairs, rings closed: for `shapely.from_ragged_array`."""
        positions, offsets = closed_rings(self.vertices, self.ring_offsets)
        return positions, (offsets, self.piece_offsets, self.pair_offsets)

    @property
    def overlays(self) -> tuple[Overlay | None, ...]:
        """One `Overlay` for each pair, made now; None where its status is not 0."""
        return tuple(self)


def _arrays(solid: Solid) -> RingArrays:
    assert isinstance(solid, Polygon)
    return RingArrays(solid.vertices, solid.ring_offsets)


def _n_vertices(solids: Sequence[Solid]) -> int:
    return solids.n_vertices if isinstance(solids, Chosen) else sum(len(_arrays(each).vertices) for each in solids)


def _gathered(solids: Sequence[Solid]) -> Polygons:
    if isinstance(solids, Chosen):
        arrays = solids.together()
        most = (int(sizes.max()) for sizes in (arrays.sizes(), np.diff(arrays.polygon_offsets)))
        return Polygons(*arrays, *most)
    polygons = cast("Sequence[Polygon]", solids)
    return gathered([each.vertices for each in polygons], [each.ring_offsets for each in polygons])


def _bases(subjects: Polygons, clips: Polygons) -> Int32Array:
    """Return `OverlayBatch._bases` of pairs that were overlaid together."""
    bases = np.empty((len(subjects.polygon_offsets) - 1, 3), np.int32)
    bases[:, 0] = subjects.ring_offsets[subjects.polygon_offsets[:-1]]
    bases[:, 1] = clips.ring_offsets[clips.polygon_offsets[:-1]]
    bases[:, 2] = len(subjects.vertices)
    return bases


def overlay_batch(
    subjects: Sequence[Solid],
    clips: Sequence[Solid],
    operation: Operation = "intersection",
    *,
    output: Output = "valid",
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> OverlayBatch | tuple[OverlayBatch, Accuracy]:
    """Combine pairs of polygons, subjects[i] with clips[i]; the options are those of `overlay`.

    Returns: `OverlayBatch`, in the order of the pairs; with report=True also one `Accuracy` for all.
    Cost: some microseconds for a pair of a few vertices, on all workers, several times that where rounding comes near
    other edges; no object per pair. The object of a pair whose rings were rounded more than once takes an overlay.
    Raises: as `overlay`, and InvalidArrayError where the lengths differ. Every solid is checked before the first is
    overlaid.
    """
    check_words(operation, output)
    check_options(workers, progress, report=report)
    for solids, name in ((subjects, "subjects"), (clips, "clips")):
        if not isinstance(solids, (list, tuple, Chosen)):
            raise InvalidArrayError(f"{name} must be a list of polygons, got {type(solids).__name__}", (name,))
    if len(subjects) != len(clips):
        raise InvalidArrayError(
            f"subjects and clips must be of equal length, got {len(subjects)} and {len(clips)}", ("clips",)
        )
    for solids, name in ((subjects, "subjects"), (clips, "clips")):
        if not isinstance(solids, Chosen) and set(map(type, solids)) - {Polygon}:
            for i_pair, solid in enumerate(solids):
                rings_of(solid, name, i_pair)
    parts: dict[int, tuple[Found, Int32Array]] = {}
    with Budget(deadline, cancel) as budget:

        def task(start: int, stop: int) -> None:
            # Gathered here, chunk by chunk: one thread does while another's kernel runs, and what it wrote is near.
            first, second = _gathered(subjects[start:stop]), _gathered(clips[start:stop])
            parts[start] = run_kernel(first, second, operation, budget), _bases(first, second)

        run_chunks(task, len(subjects), budget=budget, first_chunk=_FIRST_CHUNK, workers=workers, progress=progress)
        chunks = [parts[start] for start in sorted(parts)]
        found = first_found = joined([NO_PAIRS, *(found for found, _ in chunks)])
        rest = _Rest(np.zeros(len(subjects), np.int8), np.zeros(len(subjects), np.bool_), {})
        ulps, n_rational = 0.5, 0
        if found.status.any():
            found, ulps, n_rational = _settled(found, rest, subjects, clips, operation, output, workers, budget)
    for array in (rest.status, *found, *first_found):
        array.setflags(write=False)
    batch = OverlayBatch(
        status=rest.status,
        vertices=found.vertices,
        ring_offsets=found.ring_offsets,
        piece_offsets=found.piece_offsets,
        pair_offsets=summed(found.counts[:, 0]),
        displacement=found.displacement,
        _subjects=subjects if isinstance(subjects, Chosen) else tuple(subjects),
        _clips=clips if isinstance(clips, Chosen) else tuple(clips),
        _operation=operation,
        _output=output,
        _exact=first_found,
        _bases=np.concatenate([np.zeros((0, 3), np.int32), *(bases for _, bases in chunks)]),
        _is_rounded_again=rest.is_rounded_again,
        _apart=rest.apart,
    )
    if not report:
        return batch
    n_edges = _n_vertices(subjects) + _n_vertices(clips)
    return batch, accuracy_of(ulps, n_edges, int(found.counts[:, 3].sum()), n_rational)


class _Rest(NamedTuple):
    """What becomes of pairs that the first call of the kernel does not settle; the names are those of `OverlayBatch`,
    without underscores."""

    status: Int8Array
    is_rounded_again: BoolArray
    apart: dict[int, Overlay]


def _settled(
    found: Found,
    rest: _Rest,
    subjects: Sequence[Solid],
    clips: Sequence[Solid],
    operation: Operation,
    output: Output,
    workers: int | None,
    budget: Budget,
) -> tuple[Found, float, int]:
    """Fill ``rest``; return all pairs settled, `Accuracy.coordinates_ulp`, and how many decisions took rationals."""
    settled: dict[int, SettledPairs] = {}
    alone: dict[int, tuple[Overlay, int, int]] = {}
    doubtful = np.flatnonzero(found.status == MAY_CROSS)

    def settle(start: int, stop: int) -> None:
        some = doubtful[start * _DOUBTFUL : stop * _DOUBTFUL]
        pairs = taken(found, some)
        more = settle_pairs(pairs, budget) if output == "valid" else nearest_pairs(pairs, budget)
        settled[start] = more._replace(pairs=some[more.pairs])

    def overlay_alone(start: int, stop: int) -> None:
        for pair in left[start:stop].tolist():
            budget.check()
            both = _arrays(subjects[pair]), _arrays(clips[pair])
            try:
                alone[pair] = overlay_rings(*both, operation, output, budget)
            except NotRepresentableError:
                rest.status[pair] = NOT_REPRESENTABLE

    run_chunks(settle, -(-len(doubtful) // _DOUBTFUL), budget=budget, first_chunk=1, workers=workers)
    together = [settled[start] for start in sorted(settled)]
    for each in together:
        rest.is_rounded_again[each.pairs] = True
    left = np.flatnonzero((found.status != DONE) & ~rest.is_rounded_again)
    run_chunks(overlay_alone, len(left), budget=budget, first_chunk=1, workers=workers)
    rest.apart.update((pair, result) for pair, (result, _, _) in alone.items())
    more = [*(each.found for each in together), *(_found_of(*each) for each in alone.values())]
    pairs = np.concatenate([*(each.pairs for each in together), np.array([*alone], np.int64)])
    rows = np.arange(len(found.status))
    rows[pairs] = len(rows) + np.arange(len(pairs))
    ulps = [0.5, *(each.ulps for each in together), *(ulps_moved(result) for result, _, _ in alone.values())]
    return taken(joined([found, *more]), rows), max(ulps), sum(n for _, _, n in alone.values())


def _found_of(result: Overlay, n_exact: int, _: int) -> Found:
    """Return what was found for one pair from its object; n_exact: pairs of edges beyond the filter."""
    rings = result.vertices, result.ring_offsets, result.piece_offsets
    return one_pair(*rings, result.largest_displacement, n_exact)


def join_batches(batches: Sequence[OverlayBatch]) -> OverlayBatch:
    """Return the pairs of some batches, at least one, as one batch."""
    apart: dict[int, Overlay] = {}
    n_pairs = 0
    for part in batches:
        apart.update((n_pairs + pair, result) for pair, result in part._apart.items())
        n_pairs += len(part)
    batch = OverlayBatch(
        status=np.concatenate([part.status for part in batches]),
        vertices=np.concatenate([part.vertices for part in batches]),
        ring_offsets=chained([part.ring_offsets for part in batches]),
        piece_offsets=chained([part.piece_offsets for part in batches]),
        pair_offsets=chained([part.pair_offsets for part in batches]),
        displacement=np.concatenate([part.displacement for part in batches]),
        _subjects=tuple(solid for part in batches for solid in part._subjects),
        _clips=tuple(solid for part in batches for solid in part._clips),
        _operation=batches[0]._operation,
        _output=batches[0]._output,
        _exact=joined([part._exact for part in batches]),
        _bases=np.concatenate([part._bases for part in batches]),
        _is_rounded_again=np.concatenate([part._is_rounded_again for part in batches]),
        _apart=apart,
    )
    for name in ("status", "vertices", "ring_offsets", "piece_offsets", "pair_offsets", "displacement"):
        getattr(batch, name).setflags(write=False)
    return batch
