"""The solid bounded by closed, consistently oriented faces, under the even-odd rule."""

from __future__ import annotations

from typing import ClassVar

from engine.solids.mesh import Mesh


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
    Cost: linear in vertices and edges, a face of n vertices is cut in n^2 at most: 1,000 in some milliseconds.
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
