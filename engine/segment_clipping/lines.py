"""Public: clip polylines to a region; connected parts stay connected.

Each segment of each line is clipped as `clip_segments` does; a piece that reaches the end of its segment is joined to
the one that begins at the start of the next. Both are exact (face -1), so no rounded numbers are compared.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal, Unpack, overload

import numpy as np

from engine.compiling.jit import entry_of, inline, kernel
from engine.errors import EngineError, InvalidInputError
from engine.running.budget import UNLIMITED, Budget, Cancel, polled, reading
from engine.running.parallel import Options, Progress, check_options, is_unlimited
from engine.segment_clipping.clip_segments import plan_for
from engine.segment_clipping.on_boundary.contacts import are_same
from engine.segment_clipping.outside import PartColumns, parts_outside
from engine.segment_clipping.pieces import Pieces
from engine.solids.accepted import LinesLike, SolidLike
from engine.solids.checks import as_points, shown
from engine.solids.geometries import lines_in, note_altitude
from engine.solids.mesh import is_large
from engine.solids.pictures import Pictured
from engine.solids.poses import axes_of
from engine.solids.ragged import Ragged, as_lines
from engine.solids.shapes import as_solid
from engine.types import Accuracy, FlagArray, FloatArray, IntArray, read_only

Joined = namedtuple("Joined", "vertices offsets source heads tails")
"""Output of `join_parts`: vertices (2 m, dim), offsets (m + 1,) into them, and by joined piece its line and its first
and last piece of a segment (m,)."""
_PER_BLOCK: Final = 1 << 20
"""Pieces whose columns are gathered between two polls of the flag."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LinePieces(Pictured, Ragged):
    """The pieces of a batch of polylines within a region, by source and then along the line.

    Attributes
    ----------
    source : ndarray of int64, shape (m,)
        The line each piece is a part of.
    vertices : ndarray of float64, shape (n, dim)
        Of all pieces one after another: the two ends, each coordinate the double nearest to the exact one, and between
        them the line's own vertices.
    offsets : ndarray of int64, shape (m + 1,)
        Into `vertices`.
    segments : ndarray of int64, shape (m, 2)
        On which segment of the line either end lies: segment k goes from vertex k to k + 1.
    t : ndarray of float64, shape (m, 2)
        The parameters of both ends on those segments, each the nearest double.
    faces : ndarray of int64, shape (m, 2)
        The plane or face crossed at either end, -1 where the end is the line's own.
    """

    _rows: ClassVar[str] = "pieces"
    _levels: ClassVar[tuple[str, ...]] = ("vertices", "offsets")
    source: IntArray
    vertices: FloatArray
    offsets: IntArray
    segments: IntArray
    t: FloatArray
    faces: IntArray

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The pieces as a GeoJSON MultiLineString."""
        return {"type": "MultiLineString", "coordinates": [self[piece].tolist() for piece in range(len(self))]}

    def __iter__(self) -> Iterator[FloatArray]:
        """Yield the positions of each piece."""
        return (self[piece] for piece in range(len(self)))

    def __getitem__(self, piece: int) -> FloatArray:
        """Return the positions of one piece, (k, dim) with k of at least 2, a view of `vertices`."""
        if not -len(self) <= piece < len(self):
            raise IndexError(f"piece {piece} of {len(self)}")
        piece %= len(self)
        return self.vertices[self.offsets[piece] : self.offsets[piece + 1]]


class LineOptions(Options, total=False):
    """Keyword arguments of `clip_lines`, except `report`, which changes the return type."""

    keep: Literal["inside", "outside"]


@overload
def clip_lines(
    lines: LinesLike, region: SolidLike, *, report: Literal[False] = False, **options: Unpack[LineOptions]
) -> LinePieces: ...


@overload
def clip_lines(
    lines: LinesLike, region: SolidLike, *, report: Literal[True], **options: Unpack[LineOptions]
) -> tuple[LinePieces, Accuracy]: ...


def clip_lines(
    lines: LinesLike,
    region: SolidLike,
    *,
    keep: Literal["inside", "outside"] = "inside",
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> LinePieces | tuple[LinePieces, Accuracy]:
    """Return the pieces of polylines (open paths) that lie in a region, a closed set.

    Parameters
    ----------
    lines : array_like or pair of array_like
        A list of lines, each (n, dim) numbers; or an array (n_lines, n, dim); or a pair of arrays ``(vertices,
        offsets)``, (n, dim) and (n_lines + 1,), which is not copied. A line has two positions or more; one of none has
        no pieces.
    region : Solid
        As for `clip_segments`.
    keep : {"inside", "outside"}, default "inside"
        Which parts of the lines: those in the region, or those between, before and after these, ends included.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts segments.

    Returns
    -------
    LinePieces
        With ``report=True`` a pair of it and an `Accuracy`, whose items are segments.

    Raises
    ------
    EngineError
        As `clip_segments`.

    Notes
    -----
    A piece is a maximal stretch of a line within the region or on its boundary.

    Boundary: counts as inside. A line that runs along it is kept there, one that touches in a single point gives that
    point, as a piece of two equal positions.

    Degenerate input: repeated vertices are kept as they are. A line whose last vertex is its first closes there: where
    the region contains that vertex and cuts the line elsewhere, the stretch through it is one piece, the line's last,
    whose first end lies on a later segment than its second. Points that a line passes twice otherwise join nothing.

    Accuracy: as `clip_segments`. A vertex of the line beside a constructed end that rounds to it is left out.

    Cost: that of `clip_segments` on all segments, and some passes over the pieces.

    References
    ----------
    As `clip_segments`.

    Examples
    --------
    >>> from engine import Aabb, clip_lines
    >>> pieces = clip_lines([[[-1.0, 1.0], [1.0, 1.0], [1.0, 3.0]]], Aabb(min=[0.0, 0.0], max=[2.0, 2.0]))
    >>> pieces[0].tolist(), pieces.segments.tolist(), pieces.t.tolist(), pieces.faces.tolist()
    ([[0.0, 1.0], [1.0, 1.0], [1.0, 2.0]], [[0, 1]], [[0.5, 0.5]], [[0, 3]])
    """
    check_options(workers, progress, report=report)
    if not isinstance(keep, str) or keep not in ("inside", "outside"):
        raise InvalidInputError(f"keep must be inside or outside, got {shown(keep)}", ("keep",))
    with reading(deadline, cancel) as reader:
        region = as_solid(region, "region")
        plan = plan_for(region)
        try:
            listed = lines_in(lines)
        except EngineError as error:
            raise error.at("lines") from None
        if listed and region.dimension == 2 and axes_of(listed) == 3 and len(listed[0]) and len(listed[0][0]) == 3:
            note_altitude("lines")  # positions of other lengths beside it are refused
            listed = [as_points(line, 3, ("lines", k))[:, :2] for k, line in enumerate(polled(listed))]
        vertices, offsets = as_lines(lines if listed is None else listed, region.dimension)
    deadline = reader.left()
    firsts = np.arange(len(vertices) - 1) if len(offsets) == 2 else _firsts_of(offsets, len(vertices))
    segments = np.empty((len(firsts), 2, region.dimension))
    segments[:, 0], segments[:, 1] = vertices[firsts], vertices[firsts + 1]
    is_free = len(firsts) <= plan.few and is_unlimited(workers, deadline, cancel, progress)
    is_free &= workers is None or not is_large(region)
    with UNLIMITED if is_free else Budget(deadline, cancel, workers) as budget:
        pieces, n_beyond, n_rational = plan.cut(read_only(segments), region, plan, budget, workers, progress)
        made = _joined(pieces, firsts, vertices, offsets, budget)
        if keep == "outside":
            columns = PartColumns(made.source, made.vertices, made.offsets, made.segments, made.t, made.faces)
            made = LinePieces(*parts_outside(columns, vertices, offsets))
    return (made, Accuracy("exact", 0.5, len(firsts), n_beyond, n_rational, plan.name)) if report else made


def _firsts_of(offsets: IntArray, n_vertices: int) -> IntArray:
    """Return the first vertex of each segment of lines: all vertices but the last of each line. offsets: of lines into
    the n_vertices vertices."""
    return np.delete(np.arange(n_vertices), offsets[1:][np.diff(offsets) > 0] - 1)


def _joined(pieces: Pieces, firsts: IntArray, vertices: FloatArray, offsets: IntArray, budget: Budget) -> LinePieces:
    """Join the pieces of segments to pieces of lines. firsts: number of the first vertex of each segment; offsets: of
    the lines into vertices."""
    m, at = len(pieces.source), firsts[pieces.source]
    starts, ends = map(np.ascontiguousarray, pieces.ends)
    made = Joined(np.empty((2 * m, vertices.shape[1])), np.empty(m + 1, np.int64), *np.empty((3, m), np.int64))
    budget.check()
    n = entry_of(join_parts)(starts, ends, pieces.faces, at, vertices, offsets, made, budget.flag)
    source, heads, tails = made.source[:n], made.heads[:n], made.tails[:n]
    sides, t, faces = np.empty((n, 2), np.int64), np.empty((n, 2)), np.empty((n, 2), np.int64)
    for some in (slice(first, first + _PER_BLOCK) for first in range(0, n, _PER_BLOCK)):
        budget.check()
        for side, parts in enumerate((heads[some], tails[some])):
            sides[some, side] = at[parts] - offsets[source[some]]
            t[some, side], faces[some, side] = pieces.t[parts, side], pieces.faces[parts, side]
    budget.check()
    return LinePieces(source, made.vertices[: made.offsets[n]], made.offsets[: n + 1], sides, t, faces)


@kernel
def join_parts(
    starts: FloatArray, ends: FloatArray, faces: IntArray, at: IntArray, vertices: FloatArray, offsets: IntArray,
    out: Joined, flag: FlagArray,
) -> int:  # fmt: skip
    """Join consecutive pieces of segments, from starts (m, dim) to ends (m, dim), where they meet in a vertex of their
    line; fill `out` and return the number of joined pieces. faces (m, 2): -1 for an end of the segment itself; at (m,):
    first vertex of the segment of each piece; offsets: of the lines into vertices. Polls `flag`."""
    n, n_made, begin, line = 0, 0, 0, 0
    out.offsets[0] = 0
    while begin < at.size and not flag[0]:  # bound: each turn ends a line
        while at[begin] >= offsets[line + 1]:
            line += 1
        end = begin + 1
        while end < at.size and at[end] < offsets[line + 1]:
            end += 1
        size, moved = end - begin, _n_moved(faces, at, begin, end, vertices, offsets[line], offsets[line + 1] - 1)
        head, before, is_written = -1, -1, False
        for place in range(moved, moved + size):
            if flag[0]:
                break
            part, after = begin + place % size, begin + (place + 1) % size
            if head < 0:
                head, out.source[n], out.heads[n] = part, line, part
                n_made = _append_vertex(out.vertices, n_made, starts, part)
            else:
                is_written = before != head or faces[head, 0] < 0 or not are_same(starts, head, starts, part)
                n_made = _append_vertex(out.vertices, n_made, starts, part) if is_written else n_made
            before = part
            if place + 1 < moved + size and (after == begin or _continues(faces, at, part, after)):
                continue
            if part != head and is_written and faces[part, 1] >= 0 and are_same(starts, part, ends, part):
                n_made -= 1
            n_made, head, out.tails[n] = _append_vertex(out.vertices, n_made, ends, part), -1, part
            n += 1
            out.offsets[n] = n_made
        begin = end
    return n


@inline
def _continues(faces: IntArray, at: IntArray, part: int, after: int) -> bool:
    """Return whether piece `part` reaches the end of its segment, and piece `after` begins at the start of the next
    segment. faces, at: as in `join_parts`."""
    return (faces[part, 1] < 0) & (faces[after, 0] < 0) & (at[after] == at[part] + 1)


@inline
def _n_moved(faces: IntArray, at: IntArray, begin: int, end: int, vertices: FloatArray, first: int, last: int) -> int:
    """Return how many pieces at the start of a closed line continue its last piece, and so move behind it. begin .. end
    - 1: the pieces of the line; first, last: its first and last vertex. 0 unless these are equal and inside, and some
    piece of the line is not connected to the next."""
    if at[begin] != first or at[end - 1] != last - 1 or faces[begin, 0] >= 0 or faces[end - 1, 1] >= 0:
        return 0
    if not are_same(vertices, first, vertices, last):
        return 0
    for part in range(begin + 1, end):
        if not _continues(faces, at, part - 1, part):
            return part - begin
    return 0


@inline
def _append_vertex(rows: FloatArray, row: int, points: FloatArray, point: int) -> int:
    """Copy row ``point`` of points to row ``row`` of rows; return row + 1."""
    for k in range(points.shape[1]):
        rows[row, k] = points[point, k]
    return row + 1
