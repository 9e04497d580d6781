"""Polygons split by lines: the faces of the exact arrangement of rings and lines that lie in the polygon.

Faces on the two sides of an edge that no line runs along are one piece. So a line that ends within the polygon, or
outside of it, splits nothing by that end. Each piece is rounded and made valid alone; pieces share rounded vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from engine.arrangement.arrange import Arrangement, arrange
from engine.arrangement.nodes import NodeTable, float_nodes
from engine.arrangement.rings import Piece, trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide
from engine.arrangement.union_find import UnionFind
from engine.errors import EngineError, InvalidArrayError, UnsupportedSolidError
from engine.polygon_overlay.in_integers import valid_overlay
from engine.polygon_overlay.result import Overlay
from engine.running.budget import Budget, Cancel, polled, reading
from engine.solids.accepted import SolidLike
from engine.solids.checks import as_points, shown
from engine.solids.geometries import lines_in
from engine.solids.polygon import Polygon
from engine.solids.shapes import as_solid
from engine.types import FloatArray


def split(
    polygon: SolidLike, lines: Any, *, deadline: float | None = None, cancel: Cancel | None = None
) -> tuple[Polygon, ...]:
    """Split a polygon by lines, exactly.

    Parameters
    ----------
    polygon : Polygon
        Or what stands for one.
    lines : list of array_like, shape (n, 2)
        Polylines; or GeoJSON or shapely lines. They may cross, and end anywhere.
    deadline, cancel
        As for `engine.locate`.

    Returns
    -------
    tuple of Polygon
        The pieces, in lexicographic order of their first vertices; one where no line splits.

    Raises
    ------
    EngineError
        The polygon or a line breaks a rule; the call was ended.

    Notes
    -----
    Boundary: what a line runs along, or ends in, is not split by it. Degenerate input: no lines, or lines of one point:
    the polygon as it is. Accuracy: which pieces there are is exact; coordinates are rounded once; a piece that rounding
    leaves nothing of is left out. Cost: some 50 us an edge and crossing.

    References
    ----------
    D. E. Muller, F. P. Preparata, Finding the intersection of two convex polyhedra, 1978; shapely.ops.split.

    Examples
    --------
    >>> import engine
    >>> left, right = engine.split(engine.Polygon([[[0, 0], [2, 0], [2, 2], [0, 2]]]), [[[1, -1], [1, 3]]])
    >>> right.vertices.tolist()
    [[1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0]]
    """
    with reading(deadline, cancel) as budget:
        body = as_solid(polygon, "polygon")
        if not isinstance(body, Polygon):
            raise UnsupportedSolidError(f"split takes polygons, got {body!r:.100}", ("polygon",))
        segments = [np.stack([line[:-1], line[1:]], axis=1) for line in _lines_in(lines)]
        made = split_rings(rings_of(body), np.concatenate([np.zeros((0, 2, 2)), *segments]), budget)
        return tuple(Polygon(each.rings) for each in made)


def rings_of(polygon: Polygon) -> list[FloatArray]:
    """Return the rings of a polygon as arrays."""
    return np.split(polygon.vertices, polygon.ring_offsets[1:-1]) if polygon.n_rings else []


def _lines_in(lines: Any) -> list[FloatArray]:
    try:
        given = lines_in(lines)
    except EngineError as error:
        raise error.at("lines") from None
    given = lines if given is None else given
    if not isinstance(given, (list, tuple)) and not (isinstance(given, np.ndarray) and given.ndim):
        raise InvalidArrayError(f"lines must be a list of arrays of shape (n, 2), got {shown(lines)}", ("lines",))
    return [as_points(line, 2, ("lines", number)) for number, line in enumerate(polled(given))]


def split_rings(rings: Sequence[FloatArray], segments: FloatArray, budget: Budget) -> list[Overlay]:
    """Return the pieces of an even-odd polygon between segments (n, 2, 2), an overlay of one piece each; empty ones are
    left out."""
    if not len(rings):
        return []
    flat = np.concatenate(rings)
    low, high = flat.min(axis=0), flat.max(axis=0)
    near = ((segments.min(axis=1) <= high) & (segments.max(axis=1) >= low)).all(axis=1)
    nodes, numbers = float_nodes(np.concatenate([flat, segments[near].reshape(-1, 2)]), budget)
    ends = np.cumsum([0, *map(len, rings)]).tolist()
    cuts = list(zip(numbers[ends[-1] :: 2], numbers[ends[-1] + 1 :: 2]))
    arrangement, pieces = pieces_between(nodes, [numbers[i:j] for i, j in pairwise(ends)], cuts, budget)
    made = [valid_overlay(arrangement, [piece], budget) for piece in polled(pieces)]
    return [each for each in made if each.n_pieces]


def pieces_between(
    nodes: NodeTable, rings: Sequence[list[int]], cuts: Sequence[tuple[int, int]], budget: Budget
) -> tuple[Arrangement, list[Piece]]:
    """Return the arrangement of closed rings and of segments, by numbers of nodes, and the pieces inside of an odd
    number of rings that segments separate."""
    segments = [pair for ring in rings for pair in zip(ring, ring[1:] + ring[:1])]
    n = len(segments)
    arrangement = arrange(nodes, [*segments, *cuts], [frozenset((k,)) for k in range(n + len(cuts))], budget)
    subdivision, cover = subdivide(arrangement), arrangement.cover
    inside = label_faces(subdivision, [sum(k < n for k in each) & 1 for each in polled(cover)])
    joined, faces = UnionFind(subdivision.n_faces), subdivision.faces
    for edge, each in enumerate(polled(cover)):
        left, right = faces[2 * edge : 2 * edge + 2]
        if inside[left] and inside[right] and max(each) < n:
            joined.unite(left, right)
    marks = [joined.find(face) + 1 if inside[face] else 0 for face in polled(range(subdivision.n_faces))]
    return arrangement, trace_pieces(subdivision, marks, [frozenset()] * subdivision.n_faces)
