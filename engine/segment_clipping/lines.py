"""Public: what remains of polylines on a region, with what is connected there left connected.

Each segment of each line is clipped as `clip_segments` does; a piece that reaches the end of its segment and one that
begins at the start of the next are one. Whether a piece reaches an end is decided exactly there (its face is -1), so
nothing here compares rounded numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Unpack, overload

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.parallel import Cancel, Options, Progress, check_options
from engine.segment_clipping.clip_segments import SegmentPieces, clip_segments
from engine.solids.base import Solid
from engine.solids.ragged import as_lines, within
from engine.types import Accuracy


@dataclass(frozen=True, slots=True, eq=False)
class LinePieces:
    """The pieces of a batch of polylines within a region, by source and then along the line.

    source: (m,) int64, the line each piece is a part of.
    vertices: (n, dim) float64, of all pieces one after another: the two ends, each coordinate the double nearest to
        the exact one, and between them the line's own vertices. offsets: (m + 1,) int64 into them.
    segments: (m, 2) int64, on which segment of the line either end lies: segment k goes from vertex k to k + 1.
    t: (m, 2) float64, the parameters of both ends on those segments, each the nearest double.
    faces: (m, 2) int64, the plane or face crossed at either end, -1 where the end is the line's own.
    """

    source: IntArray
    vertices: FloatArray
    offsets: IntArray
    segments: IntArray
    t: FloatArray
    faces: IntArray

    def __len__(self) -> int:
        return len(self.source)

    def __getitem__(self, piece: int) -> FloatArray:
        """Return the positions of one piece, (k, dim) with k of at least 2, a view of `vertices`."""
        if not -len(self) <= piece < len(self):
            raise IndexError(f"piece {piece} of {len(self)}")
        piece %= len(self)
        return self.vertices[self.offsets[piece] : self.offsets[piece + 1]]


@overload
def clip_lines(
    lines: object, region: Solid, *, report: Literal[False] = False, **options: Unpack[Options]
) -> LinePieces: ...


@overload
def clip_lines(
    lines: object, region: Solid, *, report: Literal[True], **options: Unpack[Options]
) -> tuple[LinePieces, Accuracy]: ...


def clip_lines(
    lines: object,
    region: Solid,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> LinePieces | tuple[LinePieces, Accuracy]:
    """Return the pieces of polylines (open paths) that lie in a region, a closed set.

    A piece is a maximal stretch of a line within the region or on its boundary. For lines of one segment each, and
    their pieces in flat columns, there is `clip_segments`.

    Parameters
        lines: a list of lines, each (n, dim) numbers; or an array (n_lines, n, dim); or a pair of arrays
            ``(vertices, offsets)``, (n, dim) and (n_lines + 1,), which is not copied. A line has 2 positions or more;
            one of none has no pieces.
        region, workers, deadline, cancel, report: as `clip_segments`; progress: told of segments.
    Returns
        `LinePieces`; with report=True also the `Accuracy`, whose items are segments.
    Boundary
        Counts as in, so a line that runs along it is kept there, and one that touches in a single point gives that
        point, as a piece of two equal positions.
    Degenerate input
        Repeated vertices are kept as they are. A line whose last vertex is its first closes there: where the region
        holds that vertex and cuts the line elsewhere, the stretch through it is one piece, the line's last, whose first
        end lies on a later segment than its second. Points that a line passes twice otherwise join nothing.
    Accuracy
        As `clip_segments`. A vertex of the line beside a constructed end that rounds to it is left out.
    Cost
        That of `clip_segments` on all segments, and some passes over the pieces.
    Raises
        As `clip_segments`.

    >>> from engine import Aabb, clip_lines
    >>> pieces = clip_lines([[[-1.0, 1.0], [1.0, 1.0], [1.0, 3.0]]], Aabb(min=[0.0, 0.0], max=[2.0, 2.0]))
    >>> pieces[0].tolist(), pieces.segments.tolist(), pieces.t.tolist(), pieces.faces.tolist()
    ([[0.0, 1.0], [1.0, 1.0], [1.0, 2.0]], [[0, 1]], [[0.5, 0.5]], [[0, 3]])
    """
    check_options(workers, progress, report=report)
    dimension = getattr(region, "dimension", 2)  # what has none is refused below
    vertices, offsets = as_lines(lines, dimension)
    ends = offsets[1:][np.diff(offsets) > 0] - 1
    firsts = np.delete(np.arange(len(vertices)), ends)
    segments = np.empty((len(firsts), 2, dimension))
    segments[:, 0], segments[:, 1] = vertices[firsts], vertices[firsts + 1]
    pieces, accuracy = clip_segments(
        segments, region, workers=workers, deadline=deadline, cancel=cancel, progress=progress, report=True
    )
    found = _joined(pieces, firsts[pieces.source], vertices, offsets)
    return (found, accuracy) if report else found


def _joined(pieces: SegmentPieces, at: IntArray, vertices: FloatArray, offsets: IntArray) -> LinePieces:
    """Join the pieces of segments; at: the vertex that the segment of each begins with."""
    line = within(offsets, at)
    reaches = pieces.faces == -1
    goes_on = np.zeros(len(at), np.bool_)
    goes_on[1:] = reaches[:-1, 1] & reaches[1:, 0] & (at[1:] == at[:-1] + 1)
    order = _closed(line, at, reaches, goes_on, vertices, offsets)
    if order is not None:
        pieces = SegmentPieces(*(getattr(pieces, name)[order] for name in SegmentPieces.__slots__))
        line, at, reaches, goes_on = line[order], at[order], reaches[order], goes_on[order]
        goes_on[1:] |= (line[1:] == line[:-1]) & (at[1:] < at[:-1])
    heads = np.flatnonzero(~goes_on)
    tails = np.append(heads[1:], len(at))[: len(heads)] - 1
    # the vertices of a piece are the starts of its parts and the end of its last
    place = np.arange(len(at)) + np.cumsum(~goes_on) - 1
    made = np.empty((len(at) + len(heads), vertices.shape[1]))
    made[place], made[place[tails] + 1] = pieces.start, pieces.end[tails]
    kept = np.ones(len(made), np.bool_)
    long = heads < tails
    is_cut = long & ~reaches[heads, 0]
    after = place[heads[is_cut]] + 1
    kept[after] = (made[after] != made[after - 1]).any(axis=1)
    is_cut = long & ~reaches[tails, 1]
    before = place[tails[is_cut]]
    kept[before] &= (made[before] != made[before + 1]).any(axis=1)
    begins = np.append(0, np.cumsum(kept))
    ends = np.append(place[heads], len(made))
    sides = np.stack([heads, tails], axis=1)
    number = at - offsets[line]
    t, faces = (np.stack([each[heads, 0], each[tails, 1]], axis=1) for each in (pieces.t, pieces.faces))
    return LinePieces(line[heads], made[kept], begins[ends], number[sides], t, faces)


def _closed(
    line: IntArray, at: IntArray, reaches: BoolArray, goes_on: BoolArray, vertices: FloatArray, offsets: IntArray
) -> Any:
    """Return the parts in an order in which those from the start of a closed line follow those up to its end.

    None where there are none to be moved: lines whose two ends differ, or not both within, or in one piece.
    """
    sizes = np.diff(offsets)
    lines = np.flatnonzero(sizes > 0)
    first, last = offsets[lines], offsets[lines + 1] - 1
    closes = np.zeros(len(sizes), np.bool_)
    closes[lines] = (vertices[first] == vertices[last]).all(axis=1)
    opens = reaches[:, 0] & (at == offsets[line])  # parts that begin where their line does
    ends = reaches[:, 1] & (at == offsets[line + 1] - 2)
    for side in (opens, ends):
        reached = np.zeros(len(sizes), np.bool_)
        reached[line[side]] = True
        closes &= reached
    if not len(line) or not closes.any():
        return None
    run = np.cumsum(~goes_on)
    head = np.searchsorted(line, np.arange(len(sizes)))  # the first part of each line
    head, tail = head[line], np.searchsorted(line, np.arange(len(sizes)), "right")[line] - 1
    is_moved = closes[line] & (run == run[head]) & (run[head] != run[tail])
    return np.argsort(2 * line + is_moved, kind="stable") if is_moved.any() else None
