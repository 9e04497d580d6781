"""The parts of polylines outside a region, from the pieces within it: what lies between these, ends included.

An end of a part is an end of a piece, or of the line; no coordinate is computed. The region is closed, so a part is an
open stretch of its line with both ends added: where a line touches the region in a point, two parts end there.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from engine.running.budget import polled
from engine.types import FloatArray, IntArray


class Mark(NamedTuple):
    """A place on a line: segment, parameter, position, and the face crossed there, -1 for a vertex of the line."""

    segment: int
    t: float
    at: FloatArray
    face: int


class PartColumns(NamedTuple):
    """PartColumns of `LinePieces`."""

    source: IntArray
    vertices: FloatArray
    offsets: IntArray
    segments: IntArray
    t: FloatArray
    faces: IntArray


def parts_outside(pieces: PartColumns, vertices: FloatArray, offsets: IntArray) -> PartColumns:
    """Return the parts of lines that pieces, of `clip_lines`, leave; vertices, offsets: of the lines.

    A line that ends where it begins closes there: the part through that vertex is one, the line's last.
    """
    made: list[tuple[int, Mark, Mark, list[FloatArray]]] = []
    bounds = np.searchsorted(pieces.source, np.arange(len(offsets)))
    for line in polled(range(len(offsets) - 1)):
        own = vertices[offsets[line] : offsets[line + 1]]
        if len(own):
            ends = [_ends_of(pieces, k) for k in range(bounds[line], bounds[line + 1])]
            made += [(line, *part) for part in _parts_of(own, ends)]
    chains = [[first.at, *between, last.at] for _, first, last, between in made]
    empty = np.zeros((0, vertices.shape[1]))
    return PartColumns(
        np.array([line for line, *_ in made], np.int64),
        np.array([at for chain in chains for at in chain], np.float64).reshape(-1, empty.shape[1]),
        np.cumsum([0, *map(len, chains)]),
        np.array([(first.segment, last.segment) for _, first, last, _ in made], np.int64).reshape(-1, 2),
        np.array([(first.t, last.t) for _, first, last, _ in made]).reshape(-1, 2),
        np.array([(first.face, last.face) for _, first, last, _ in made], np.int64).reshape(-1, 2),
    )


def _ends_of(pieces: PartColumns, piece: int) -> tuple[Mark, Mark]:
    places = pieces.offsets[piece], pieces.offsets[piece + 1] - 1
    first, last = (
        Mark(int(segment), float(t), pieces.vertices[place], int(face))
        for segment, t, place, face in zip(pieces.segments[piece], pieces.t[piece], places, pieces.faces[piece])
    )
    return first, last


def _parts_of(own: FloatArray, ends: list[tuple[Mark, Mark]]) -> list[tuple[Mark, Mark, list[FloatArray]]]:
    """Return both ends of each part of a line, and the line's vertices between; ends: of its pieces."""
    begin, end = Mark(0, 0.0, own[0], -1), Mark(len(own) - 2, 1.0, own[-1], -1)
    gaps = [(before[1], after[0]) for before, after in pairwise(ends)]
    if not ends:
        gaps = [(begin, end)]
    elif ends[-1][0][:2] > ends[-1][1][:2]:  # the last piece leads through the vertex where the line closes
        gaps = [(ends[-1][1], ends[0][0]), *gaps]
    else:
        has_head, has_tail = not _is_same(ends[0][0], begin), not _is_same(ends[-1][1], end)
        if has_head and has_tail and (own[0] == own[-1]).all():
            gaps.append((ends[-1][1], ends[0][0]))
        else:
            gaps = [(begin, ends[0][0])] * has_head + gaps + [(ends[-1][1], end)] * has_tail
    return [(first, last, _between(own, first, last)) for first, last in gaps]


def _is_same(mark: Mark, vertex: Mark) -> bool:
    """Return whether a mark is an end of its line: a rounded parameter may be 0 or 1 elsewhere, where a face is."""
    return mark.face < 0 and mark[:2] == vertex[:2]


def _between(own: FloatArray, first: Mark, last: Mark) -> list[FloatArray]:
    """Return the vertices of a line strictly between two marks, around its closing vertex where the last is before the
    first."""
    start = first.segment + 1 + (first.face < 0 and first.t == 1.0)
    stop = last.segment + 1 - (last.face < 0 and last.t == 0.0)
    if first.face < 0 and first.t == 0.0 and first.segment > 0:  # a vertex by the segment that begins there
        start = first.segment + 1
    if last[:2] > first[:2]:
        return list(own[start:stop])
    return [*own[start:], *own[1:stop]]
