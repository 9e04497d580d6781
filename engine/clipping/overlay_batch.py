"""Overlays of many pairs: flat arrays in, flat arrays out, objects only for who asks for one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, cast

import numpy as np
import numpy.typing as npt

from engine.clipping.implicit_rings import ImplicitRings, RingArrays
from engine.clipping.overlay import accuracy_of, check_words, overlay_rings, rings_of
from engine.clipping.overlay_compiled import (
    Found,
    Operation,
    Output,
    Polygons,
    as_overlay,
    chained,
    gathered,
    only_done,
    run_kernel,
    summed,
)
from engine.clipping.overlay_result import Overlay
from engine.errors import InvalidArrayError, NotRepresentableError
from engine.parallel import Budget, Cancel, Progress, run_chunks
from engine.solids.base import Solid
from engine.solids.polygon import Polygon
from engine.types import Accuracy

DONE: Final = 0
NOT_REPRESENTABLE: Final = 1

_FIRST_CHUNK: Final = 8


@dataclass(frozen=True, slots=True)
class OverlayBatch:
    """Results of many overlays, as flat arrays; `overlays` and indexing make objects from them.

    status: (n_pairs,) int8; 0 done; 1 a coordinate of the result is beyond the largest double (the pair has no pieces
        here, and None as its overlay).
    vertices: (n_vertices, 2) float64, all rings one after another. ring_offsets: (n_rings + 1,) int64 into them.
    piece_offsets: (n_pieces + 1,) int64 into the rings, a shell before its holes. pair_offsets: (n_pairs + 1,) int64
        into the pieces.
    displacement: (n_pairs,) float64, how far an edge may lie from the exact one, as `Overlay.largest_displacement`.
    _sources: (n_vertices, 2), as those of `ImplicitRings`, but counted as _bases says. _bases: (n_pairs, 3), what is
        added to the numbers of the subject's vertices, to those of the clip's, and from where on they are the clip's.
    """

    status: npt.NDArray[np.int8]
    vertices: npt.NDArray[np.float64]
    ring_offsets: npt.NDArray[np.int64]
    piece_offsets: npt.NDArray[np.int64]
    pair_offsets: npt.NDArray[np.int64]
    displacement: npt.NDArray[np.float64]
    _subjects: Sequence[Solid] = field(repr=False)
    _clips: Sequence[Solid] = field(repr=False)
    _output: Output = field(repr=False)
    _sources: npt.NDArray[np.int32] = field(repr=False)
    _bases: npt.NDArray[np.int32] = field(repr=False)
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
        first, last = self.pair_offsets[pair], self.pair_offsets[pair + 1]
        rings = self.piece_offsets[first : last + 1]
        stops = self.ring_offsets[rings[0] : rings[-1] + 1]
        sources = self._sources[stops[0] : stops[-1]].copy()
        subject, clip = _arrays(self._subjects[pair]), _arrays(self._clips[pair])
        in_subjects, in_clips, n_subjects = self._bases[pair].tolist()
        is_clip = sources >= n_subjects
        sources[is_clip] += len(subject.vertices) - n_subjects - in_clips
        sources[~is_clip & (sources >= 0)] -= in_subjects
        exact = ImplicitRings(subject, clip, sources, stops - stops[0])
        vertices = self.vertices[stops[0] : stops[-1]].copy()
        return as_overlay(vertices, rings - rings[0], float(self.displacement[pair]), exact, self._output)

    @property
    def overlays(self) -> tuple[Overlay | None, ...]:
        """One `Overlay` for each pair, made now; None where its status is not 0."""
        return tuple(self)


def _arrays(solid: Solid) -> RingArrays:
    assert isinstance(solid, Polygon)
    return RingArrays(solid.vertices, solid.ring_offsets)


def _gathered(solids: Sequence[Solid]) -> Polygons:
    polygons = cast("Sequence[Polygon]", solids)
    return gathered([each.vertices for each in polygons], [each.ring_offsets for each in polygons])


def _bases(subjects: Polygons, clips: Polygons) -> npt.NDArray[np.int32]:
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
    Cost: some microseconds for a pair of a few vertices, on all workers; no object per pair.
    Raises: as `overlay`, and InvalidArrayError where the lengths differ. Every solid is checked before the first is
    overlaid.
    """
    check_words(operation, output)
    for solids, name in ((subjects, "subjects"), (clips, "clips")):
        if not isinstance(solids, (list, tuple)):
            raise InvalidArrayError(f"{name} must be a list of polygons, got {type(solids).__name__}", (name,))
    if len(subjects) != len(clips):
        raise InvalidArrayError(
            f"subjects and clips must be of equal length, got {len(subjects)} and {len(clips)}", ("clips",)
        )
    for solids, name in ((subjects, "subjects"), (clips, "clips")):
        if set(map(type, solids)) - {Polygon}:
            for i_pair, solid in enumerate(solids):
                rings_of(solid, name, i_pair)
    parts: dict[int, tuple[Found, npt.NDArray[np.int32]]] = {}
    apart: dict[int, Overlay] = {}
    n_exact: dict[int, int] = {}
    status = np.zeros(len(subjects), np.int8)
    with Budget(deadline, cancel) as budget:

        def task(start: int, stop: int) -> None:
            # Gathered here, chunk by chunk: one thread does while another's kernel runs, and what it wrote is near.
            first, second = _gathered(subjects[start:stop]), _gathered(clips[start:stop])
            found = run_kernel(first, second, operation, budget)
            left = np.flatnonzero(found.status)
            parts[start] = only_done(found) if len(left) else found, _bases(first, second)
            for place in left:
                pair = start + int(place)
                budget.check()
                try:
                    apart[pair], n_exact[pair], _ = overlay_rings(
                        _arrays(subjects[pair]), _arrays(clips[pair]), operation, output, budget
                    )
                except NotRepresentableError:
                    status[pair] = NOT_REPRESENTABLE

        run_chunks(task, len(subjects), budget=budget, first_chunk=_FIRST_CHUNK, workers=workers, progress=progress)
    chunks = [parts[start] for start in sorted(parts)]
    batch = _joined(status, chunks, apart, subjects, clips, output)
    if not report:
        return batch
    n_edges = sum(len(_arrays(each).vertices) for solids in (subjects, clips) for each in solids)
    n_beyond = sum(int(found.counts[:, 3].sum()) for found, _ in chunks) + sum(n_exact.values())
    return batch, accuracy_of(list(apart.values()), n_edges, n_beyond, sum(n_exact.values()))


def _joined(
    status: npt.NDArray[np.int8],
    chunks: Sequence[tuple[Found, npt.NDArray[np.int32]]],
    apart: dict[int, Overlay],
    subjects: Sequence[Solid],
    clips: Sequence[Solid],
    output: Output,
) -> OverlayBatch:
    """Put the flat results of all chunks, and the overlays made apart from them, into one set of arrays."""
    parts = [found for found, _ in chunks]
    n_pieces = np.concatenate([np.zeros(0, np.int64), *(part.counts[:, 0] for part in parts)])
    displacement = np.concatenate([np.zeros(0), *(part.displacement for part in parts)])
    vertices = np.concatenate([np.zeros((0, 2)), *(part.vertices for part in parts)])
    sources = np.concatenate([np.zeros((0, 2), np.int32), *(part.sources for part in parts)])
    ring_offsets = chained([part.ring_offsets for part in parts])
    piece_offsets = chained([part.piece_offsets for part in parts])
    if apart:
        pairs = np.array(sorted(apart), np.int64)
        results = [apart[pair] for pair in pairs.tolist()]
        n_rings, n_vertices = (np.concatenate([part.counts[:, k] for part in parts]) for k in (1, 2))
        n_pieces[pairs] = [result.n_pieces for result in results]
        n_rings[pairs] = [len(result.ring_offsets) - 1 for result in results]
        n_vertices[pairs] = [len(result.vertices) for result in results]
        displacement[pairs] = [result.largest_displacement for result in results]
        is_apart = np.zeros(len(status), np.bool_)
        is_apart[pairs] = True
        by_piece, by_ring, by_vertex = (np.repeat(is_apart, each) for each in (n_pieces, n_rings, n_vertices))
        added = np.concatenate([result.vertices for result in results])
        vertices = _woven(by_vertex, vertices, added)
        sources = _woven(by_vertex, sources, np.full((len(added), 2), -1))
        sizes = np.concatenate([np.diff(result.ring_offsets) for result in results])
        ring_offsets = summed(_woven(by_ring, np.diff(ring_offsets), sizes))
        sizes = np.concatenate([np.diff(result.piece_offsets) for result in results])
        piece_offsets = summed(_woven(by_piece, np.diff(piece_offsets), sizes))
    pair_offsets = summed(n_pieces)
    for array in (status, vertices, displacement, ring_offsets, piece_offsets, pair_offsets):
        array.setflags(write=False)
    return OverlayBatch(
        status=status,
        vertices=vertices,
        ring_offsets=ring_offsets,
        piece_offsets=piece_offsets,
        pair_offsets=pair_offsets,
        displacement=displacement,
        _subjects=tuple(subjects),
        _clips=tuple(clips),
        _output=output,
        _sources=sources,
        _bases=np.concatenate([np.zeros((0, 3), np.int32), *(bases for _, bases in chunks)]),
        _apart=apart,
    )


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
        _output=batches[0]._output,
        _sources=np.concatenate([part._sources for part in batches]),
        _bases=np.concatenate([part._bases for part in batches]),
        _apart=apart,
    )
    for name in ("status", "vertices", "ring_offsets", "piece_offsets", "pair_offsets", "displacement"):
        getattr(batch, name).setflags(write=False)
    return batch


def _woven(
    is_apart: npt.NDArray[np.bool_], rest: npt.NDArray[np.generic], apart: npt.NDArray[np.generic]
) -> np.ndarray:
    """Return the rows of two arrays in one, those of ``apart`` where the mask says."""
    result = np.empty((len(is_apart), *rest.shape[1:]), rest.dtype)
    result[~is_apart], result[is_apart] = rest, apart
    return result
