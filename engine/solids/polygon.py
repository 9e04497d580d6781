"""The region between rings under the even-odd rule: multiply connected, with holes, rings in any orientation."""

from __future__ import annotations

from itertools import accumulate
from typing import ClassVar

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.errors import InvalidArrayError, RingTooShortError
from engine.solids.base import Solid
from engine.solids.checks import as_points, check_not_empty, frozen


class Polygon(Solid):
    """All points from which a ray crosses the rings an odd number of times, and the rings themselves; 2D.

    Parameters: rings, a list of rings, each a list of at least 3 positions of 2 numbers; a repeated last vertex is
    dropped. Rings may cross, touch, overlap and repeat themselves.
    Boundary: the points on any edge, even on one that another edge cancels under even-odd.
    Raises: InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError, RingTooShortError.

    >>> Polygon([[[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [2, 1], [1, 2]]])
    Polygon(2 rings, 7 vertices)
    """

    __slots__ = ("ring_offsets", "vertices")

    type: ClassVar[str] = "polygon"
    vertices: FloatArray
    """``(n, 2)``: the vertices of all rings, one ring after another."""
    ring_offsets: IntArray
    """``(n_rings + 1,)``: ring i holds the vertices ``ring_offsets[i]`` up to ``ring_offsets[i + 1]``."""

    def __init__(self, rings: object) -> None:
        if isinstance(rings, np.ndarray) and rings.ndim == 3:
            rings = list(rings)
        if not isinstance(rings, (list, tuple)):
            raise InvalidArrayError(
                f"rings must be a list of rings, each a list of positions, got {type(rings).__name__}; "
                "put a single ring into a list",
                ("rings",),
            )
        check_not_empty(len(rings), "ring", ("rings",))
        arrays = [_as_ring(ring, ("rings", i_ring)) for i_ring, ring in enumerate(rings)]
        vertices = frozen(arrays[0]) if len(arrays) == 1 else frozen(np.concatenate(arrays))
        offsets = np.array([0, *accumulate(map(len, arrays))], np.int64)
        offsets.setflags(write=False)
        self._set(dimension=2, vertices=vertices, ring_offsets=offsets)

    @property
    def n_rings(self) -> int:
        """Number of rings."""
        return len(self.ring_offsets) - 1

    def __repr__(self) -> str:
        return f"Polygon({self.n_rings} rings, {len(self.vertices)} vertices)"


def _as_ring(ring: object, where: tuple[str | int, ...]) -> FloatArray:
    """Return the vertices of one ring without a repeated last one."""
    points = as_points(ring, 2, where)
    repeats = len(points) > 1 and points[0].tolist() == points[-1].tolist()
    points = points[:-1] if repeats else points
    if len(points) < 3:
        told = " after its repeated last vertex was dropped" if repeats else ""
        raise RingTooShortError(f"rings[{where[-1]}] has {len(points)} vertices{told}; a ring needs at least 3", where)
    return points
