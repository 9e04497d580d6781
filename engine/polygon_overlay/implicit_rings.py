"""Rings of an overlay with implicit vertices: a vertex of the input, or the crossing of two of its edges.

The compiled overlay never computes a crossing as a fraction. The exact area needs fractions; they are computed then,
from the input polygons.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from engine.arrangement.arrange import crossing, line_through
from engine.arrangement.nodes import Homogeneous, float_nodes
from engine.arrangement.rings import ExactRings
from engine.compiling.jit import entry_of
from engine.errors import IndexOutOfRangeError, InvalidArrayError
from engine.polygon_overlay.compiled.loading import LEFT_OUT, RingArrays
from engine.polygon_overlay.compiled.ring_area import sum_areas
from engine.solids.checks import as_nested_offsets, as_points
from engine.types import BoolArray, FloatArray, IntArray, read_only

_NEVER: Final = np.zeros(1, np.uint8)
_NO_SUMS: Final = np.zeros((0, 3))


NO_RINGS: Final = RingArrays(read_only(np.zeros((0, 2))), read_only(np.zeros(1, np.int64)))


def edges_along(sources: npt.NDArray[np.signedinteger]) -> IntArray:
    """Return, by vertex of a ring, the input edge (number of its first vertex) along which the ring continues. sources:
    (n, 2), see `overlay_pairs`."""
    return np.where(sources[:, 1] < LEFT_OUT, LEFT_OUT - 1 - sources[:, 1], sources[:, 0]).astype(np.int64)


@functools.lru_cache(64)
def one_polygon(n_rings: int) -> IntArray:
    """Return the ring offsets of a single polygon of n_rings: [0, n_rings]; cached."""
    return read_only(np.array([0, n_rings]))


def areas_of(
    subjects: RingArrays, subject_items: IntArray, clips: RingArrays, clip_items: IntArray,
    sources: npt.NDArray[np.signedinteger], offsets: IntArray, groups: IntArray, sums: FloatArray = _NO_SUMS,
) -> tuple[FloatArray, int]:  # fmt: skip
    """Return (n,) the area of each group of rings, NaN where no nearest double is certified, and the number of NaN.
    Arguments as those of `sum_areas`."""
    areas = np.empty(len(groups) - 1)
    sum_them = entry_of(sum_areas)
    return areas, sum_them(subjects, subject_items, clips, clip_items, sources, offsets, groups, _NEVER, areas, sums)


def check_sources(sources: npt.NDArray[np.signedinteger], n_inputs: int | IntArray) -> None:
    """Raise unless sources, read from a pickle, name existing input vertices; kernels do not check that. n_inputs:
    number of input vertices, for all rows or by row.
    """
    if sources.shape != (np.size(n_inputs) if np.ndim(n_inputs) else len(sources), 2) or sources.dtype.kind != "i":
        raise InvalidArrayError(f"sources have dtype {sources.dtype} and shape {sources.shape}", ("sources",))
    firsts, seconds = sources.astype(np.int64).T
    seconds = np.where(seconds < LEFT_OUT, LEFT_OUT - 1 - seconds, seconds)
    if len(bad := np.flatnonzero((firsts < 0) | (firsts >= n_inputs) | (seconds >= n_inputs))):
        raise IndexOutOfRangeError(f"sources[{bad[0]}] names a vertex that is not there", ("sources", int(bad[0])))


class ImplicitRings(NamedTuple):
    """Exact rings whose vertices are input vertices or crossings of input edges, computed on request. sources: (n, 2)
    integers, by vertex (see `overlay_pairs`); vertices of `clip` are numbered after those of `subject`. offsets:
    (n_rings + 1,) int64 of rings into sources."""

    subject: RingArrays
    clip: RingArrays
    sources: npt.NDArray[np.signedinteger]
    offsets: IntArray

    @property
    def n_rings(self) -> int:
        return len(self.offsets) - 1

    def check(self) -> None:
        """Raise unless all indices are in range: for rings read from a pickle."""
        for side in (self.subject, self.clip):
            as_nested_offsets(len(as_points(side.vertices, 2)), offsets=side.offsets)
        as_nested_offsets(len(self.sources), offsets=self.offsets)
        check_sources(self.sources, len(self.subject.vertices) + len(self.clip.vertices))

    def certified_areas(self, groups: IntArray) -> tuple[FloatArray, int]:
        """Return, for each k, the double nearest to the total area of rings groups[k] .. groups[k + 1] - 1, (n,)
        float64, NaN where that is not certified; and the number of NaN."""
        items = one_polygon(len(self.subject.offsets) - 1), one_polygon(len(self.clip.offsets) - 1)
        return areas_of(self.subject, items[0], self.clip, items[1], self.sources, self.offsets, groups)

    def nearest_areas(self, groups: IntArray) -> FloatArray:
        """Return (n,) float64: for each k the double nearest to the area of rings groups[k] .. groups[k + 1] - 1. By
        exact sums where `certified_areas` does not prove one. Raises `NotRepresentableError` beyond the largest double.
        """
        areas, n_uncertified = self.certified_areas(groups)
        for k in np.flatnonzero(np.isnan(areas)).tolist() if n_uncertified else ():
            areas[k] = self.some(range(groups[k], groups[k + 1])).nearest_area()
        return areas

    def are_shells(self) -> BoolArray:
        """Return, by ring, whether its exact area is positive, even if that is too small or large for a double."""
        areas, n_uncertified = self.certified_areas(np.arange(self.n_rings + 1))
        is_shell = areas > 0.0
        if n_uncertified:
            uncertified = np.flatnonzero(np.isnan(areas)).tolist()
            is_shell[uncertified] = self.some(uncertified).are_shells()
        return is_shell

    def some(self, rings: Sequence[int]) -> ExactRings:
        """Return the rings with the given numbers, with exact vertices in integers."""
        sources = [self.sources[self.offsets[ring] : self.offsets[ring + 1]] for ring in rings]
        offsets = np.cumsum([0, *map(len, sources)])
        return self._replace(sources=np.concatenate(sources), offsets=offsets).exact_rings()

    def exact_rings(self) -> ExactRings:
        """Return all rings, with exact vertices in integers."""
        vertices = np.concatenate([self.subject.vertices, self.clip.vertices])
        offsets = np.concatenate([self.subject.offsets, self.clip.offsets[1:] + len(self.subject.vertices)])
        firsts = np.unique(np.append(self.sources[:, 0], self.sources[self.sources[:, 1] >= 0, 1])).astype(np.int64)
        ends = _ends_of_edges(vertices, offsets, firsts)
        nodes, numbers = float_nodes(vertices[np.concatenate([firsts, ends])])
        place = {first: k for k, first in enumerate(firsts.tolist())}
        points = [nodes.points[number] for number in numbers]
        made: list[Homogeneous] = []
        for first, second in self.sources.tolist():
            i, j = place[first], place.get(second, -1)
            if j < 0:
                made.append(points[i])
            else:
                lines = [line_through(points[k], points[len(firsts) + k]) for k in (i, j)]
                made.append(crossing(*lines))
        stops = self.offsets.tolist()
        return ExactRings(tuple(tuple(made[a:b]) for a, b in itertools.pairwise(stops)), nodes.exponent)


def as_implicit_rings(vertices: FloatArray, offsets: IntArray) -> ImplicitRings:
    """Return rings of doubles (vertices (n, 2), offsets of rings) as `ImplicitRings` that are their own input."""
    own = RingArrays(read_only(vertices), read_only(offsets))
    n, few = len(vertices), _FEW_IDENTITY_SOURCES
    sources = few[:n] if n <= len(few) else _identity_sources(n)
    return ImplicitRings(own, NO_RINGS, sources, own.offsets)


def _identity_sources(n: int) -> npt.NDArray[np.int32]:
    """Return the sources (n, 2) int32 of the input vertices 0 .. n - 1: rows (v, -1)."""
    sources = np.full((n, 2), -1, np.int32)
    sources[:, 0] = np.arange(n)
    return read_only(sources)


_FEW_IDENTITY_SOURCES: Final = _identity_sources(1024)
"""Sources of small rings, made once."""


def _ends_of_edges(vertices: FloatArray, offsets: IntArray, firsts: IntArray) -> IntArray:
    """Return, for each vertex of `firsts`, the next vertex of its ring that differs from it (else itself)."""
    rings = np.searchsorted(offsets, firsts, side="right") - 1
    starts, stops = offsets[rings], offsets[rings + 1]
    ends = firsts.copy()
    left = np.arange(len(firsts))
    while len(left):  # bound: the vertices of the largest ring
        after = ends[left] + 1
        ends[left] = np.where(after < stops[left], after, starts[left])
        is_there = (vertices[ends[left]] == vertices[firsts[left]]).all(axis=1) & (ends[left] != firsts[left])
        left = left[is_there]
    return ends
