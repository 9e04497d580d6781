"""The solid bounded by closed, consistently oriented faces, under the even-odd rule."""

from __future__ import annotations

from typing import ClassVar, Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.errors import InconsistentOrientationError, NotClosedError
from engine.solids.checks import digits
from engine.solids.mesh import Mesh

_N_NAMED: Final = 3  # broken edges that a message names


class Polyhedron(Mesh):
    """All points from which a ray crosses the faces an odd number of times, and the faces themselves; 3D.

    Parameters: vertices, ``(n, 3)`` numbers; faces, an integer array ``(m, k)`` or a list of index lists, three or more
    each, counter-clockwise seen from outside. Vertices at equal coordinates count as one; vertices that no face names
    are kept and mean nothing. Faces of more than three vertices are cut into triangles by the rule of
    `engine.solids.ear_cutting`; the solid is the one bounded by those triangles.
    Closed: each undirected edge is used equally often in both directions. Non-manifold, self-intersecting and globally
    inverted shells are accepted, and so are triangles of zero area with three different indices (also where two of them
    stand at one position). A face of four or more vertices must be simple in its projection, so no two at one position.
    Boundary: the points on any face, even on one that another face cancels under even-odd.
    deadline: seconds, None for no limit; cancel: a switch.
    Cost: sorts vertices and edges once, a face of n vertices is cut in n log n.
    1.4 million triangles take about a second and 36 bytes each, vertices included.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError, RingTooShortError,
    IndexOutOfRangeError, RepeatedIndexError, NotClosedError, InconsistentOrientationError, FaceNotSimpleError,
    DeadlineExceededError, CancelledError.

    >>> Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    Polyhedron(4 vertices, 4 faces)
    """

    __slots__ = ()

    type: ClassVar[str] = "polyhedron"
    _must_close: ClassVar[bool] = True

    def _check_faces(self, vertices: FloatArray, offsets: IntArray | None, indices: IntArray, merged: IntArray) -> None:
        check_closed(vertices, offsets, indices, merged)


def check_closed(vertices: FloatArray, offsets: IntArray | None, indices: IntArray, merged: IntArray) -> None:
    """Raise unless each undirected edge is used equally often in both directions.

    indices, merged: the corners of all faces, as given and with equal positions made one index. An edge between two
    corners at one position has no length and both directions at once: it is left out.
    """
    ends = _next_corners(offsets, merged)
    low, high = np.minimum(merged, ends), np.maximum(merged, ends)
    edges = (low * len(vertices) + high) * 2 + (merged > ends)  # key of the edge, then its direction
    ordered = np.sort(edges[low != high])
    if not len(ordered):
        return
    keys, signs = ordered >> 1, 1 - 2 * (ordered & 1)
    starts = np.flatnonzero(np.append(True, keys[1:] != keys[:-1]))
    balance = np.add.reduceat(signs, starts)
    if not balance.any():
        return
    is_open = balance % 2 != 0
    kind = NotClosedError if is_open.any() else InconsistentOrientationError
    broken = keys[starts[is_open if is_open.any() else balance != 0]]
    corners = np.flatnonzero(np.isin(edges >> 1, broken))
    _, firsts = np.unique((edges >> 1)[corners], return_index=True)
    named = corners[np.sort(firsts)[:_N_NAMED]]
    faces = np.searchsorted(_offsets(offsets, indices), named, side="right") - 1
    ends_as_given = _next_corners(offsets, indices)
    counts = [_uses(edges, int(corner)) for corner in named]
    lines = "; ".join(
        f"edge {indices[corner]}-{ends_as_given[corner]} of face {face}, "
        f"from {digits(vertices[indices[corner]])} to {digits(vertices[ends_as_given[corner]])}, "
        f"used {forth} times in this direction and {back} in the other"
        for corner, face, (forth, back) in zip(named, faces, counts)
    )
    if kind is NotClosedError:
        claim, advice = "are open", "close the mesh, or use a surface for collision only"
    else:
        claim, advice = "are not used equally often in both directions", "turn the faces that run the wrong way"
    raise kind(
        f"{len(broken)} edges {claim}: {lines}{'; ...' if len(broken) > len(named) else ''}; {advice}",
        ("faces", int(faces[0])),
    )


def _uses(edges: IntArray, corner: int) -> tuple[int, int]:
    """Return how often the directed edge that starts at `corner` is used, and how often its reverse."""
    key = edges[corner]
    return int((edges == key).sum()), int((edges == (key ^ 1)).sum())


def _offsets(offsets: IntArray | None, indices: IntArray) -> IntArray:
    return np.arange(0, len(indices) + 1, 3) if offsets is None else offsets


def _next_corners(offsets: IntArray | None, indices: IntArray) -> IntArray:
    """Return for each corner the index at the next corner of its face."""
    if offsets is None:
        ends: IntArray = indices.reshape(-1, 3)[:, [1, 2, 0]].ravel()
        return ends
    ends = np.roll(indices, -1)
    ends[offsets[1:] - 1] = indices[offsets[:-1]]
    return ends
