"""What overlays of some pairs found, as flat arrays: one pair after another, and the parts of that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np

from engine.arrays import FloatArray, Int8Array, Int32Array, IntArray
from engine.polygon_overlay.compiled.kernel import DONE
from engine.solids.ragged import summed

NO_EVIDENCE: Final = np.zeros((0, 2), np.int64)


class Found(NamedTuple):
    """What the kernel found for some pairs, one after another.

    status: (pairs,) int8, DONE, OPEN or MAY_CROSS; counts: (pairs, 4) int64, pieces, rings, vertices and pairs of edges
    beyond the filter; displacement: (pairs,) float64. vertices, sources: of all pairs that are not OPEN; ring_offsets
    into them; piece_offsets: into the rings. evidence: (m, 2) int64, of pairs whose rings are sources of their own: a
    ring, and one that it comes from.
    """

    status: Int8Array
    counts: IntArray
    displacement: FloatArray
    vertices: FloatArray
    sources: Int32Array
    ring_offsets: IntArray
    piece_offsets: IntArray
    evidence: IntArray


NO_PAIRS: Final = Found(
    np.zeros(0, np.int8), np.zeros((0, 4), np.int64), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2), np.int32),
    np.zeros(1, np.int64), np.zeros(1, np.int64), NO_EVIDENCE,
)  # fmt: skip


def one_pair(
    vertices: FloatArray, ring_offsets: IntArray, piece_offsets: IntArray, displacement: float, n_exact: int,
    sources: Int32Array | None = None, status: int = DONE,
) -> Found:  # fmt: skip
    """Return what was found for one pair; sources left out: vertices that may be any."""
    counts = np.array([[len(piece_offsets) - 1, len(ring_offsets) - 1, len(vertices), n_exact]])
    sources = np.zeros((len(vertices), 2), np.int32) if sources is None else sources
    outcome = np.array([status], np.int8), counts, np.array([displacement])
    return Found(*outcome, vertices, sources, ring_offsets, piece_offsets, NO_EVIDENCE)


def taken(found: Found, items: IntArray) -> Found:
    """Return some of the pairs found, in the order of ``items``; no evidence."""
    of_pieces, of_rings, of_vertices = (places_of(summed(found.counts[:, k]), items) for k in range(3))
    return Found(
        found.status[items], found.counts[items], found.displacement[items], found.vertices[of_vertices],
        found.sources[of_vertices], summed(np.diff(found.ring_offsets)[of_rings]),
        summed(np.diff(found.piece_offsets)[of_pieces]), NO_EVIDENCE,
    )  # fmt: skip


def places_of(offsets: IntArray, items: IntArray) -> IntArray:
    """Return the places that belong to ``items``, one item after another, those of item k from offsets[k] on."""
    sizes = offsets[items + 1] - offsets[items]
    ends = np.cumsum(sizes)
    return np.arange(ends[-1] if len(ends) else 0) + np.repeat(offsets[items] - (ends - sizes), sizes)


def joined(parts: list[Found]) -> Found:
    """Return the pairs of all parts, at least one, one part after another; no evidence."""
    if len(parts) == 1:
        return parts[0]._replace(evidence=NO_EVIDENCE)
    outcomes = (np.concatenate(arrays) for arrays in list(zip(*parts, strict=True))[:3])
    return Found(*outcomes, *put_together([(*part[3:7], NO_EVIDENCE) for part in parts]))


def put_together(parts: Sequence[Sequence[Any]]) -> list[Any]:
    """Return vertices, sources, ring offsets, piece offsets and evidence of some parts as those of one."""
    vertices, sources, ring_offsets, piece_offsets, evidence = zip(*parts, strict=True)
    offsets = chained(ring_offsets), chained(piece_offsets)
    return [np.concatenate(vertices), np.concatenate(sources), *offsets, np.concatenate(evidence)]


def chained(offsets: Sequence[IntArray]) -> IntArray:
    """Return the offsets of several arrays put one after another."""
    return summed(np.concatenate([np.zeros(0, np.int64), *(each[1:] - each[:-1] for each in offsets)]))


def ring_numbers(offsets: IntArray) -> IntArray:
    """Return by vertex the number of its ring."""
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


def ring_sizes(rings: Found) -> FloatArray:
    """Return by ring the sum of both sides of its box."""
    starts = rings.ring_offsets[:-1]
    if not len(starts):
        return np.zeros(0)
    low, high = np.minimum.reduceat(rings.vertices, starts), np.maximum.reduceat(rings.vertices, starts)
    return cast("FloatArray", (high / 2 - low / 2).sum(axis=1))
