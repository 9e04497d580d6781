"""An open or closed soup of faces: nothing is inside; for collision only."""

from __future__ import annotations

from typing import ClassVar

from engine.solids.mesh import Mesh


class Surface(Mesh):
    """The faces themselves, open or closed, in any orientation; nothing is inside. For collision and bounds; 3D.

    Parameters: as for `Polyhedron`, whose checks it shares but for closedness.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError, RingTooShortError,
    IndexOutOfRangeError, RepeatedIndexError, FaceNotSimpleError, DeadlineExceededError,
    CancelledError.

    >>> Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]).triangles.tolist()
    [[3, 0, 1], [3, 1, 2]]
    """

    __slots__ = ()

    type: ClassVar[str] = "surface"
