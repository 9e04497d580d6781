"""The region between rings under the even-odd rule: multiply connected, with holes, rings in any orientation."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate, pairwise
from typing import Any, ClassVar, Final, cast

import numpy as np

from engine.errors import EngineError, InvalidArrayError, RingTooShortError
from engine.running.budget import Budget, Cancel
from engine.solids.base import Solid, T
from engine.solids.checks import as_nested_offsets, as_points, check_finite, check_not_empty, frozen, is_ready
from engine.solids.geometries import geometry_of, lines_in
from engine.solids.pictures import Pictured, svg_of
from engine.types import FloatArray, IntArray

_NO_VERTICES = np.zeros((0, 2))
_LEAST: Final = 3
"""Least number of vertices of a ring in `Polygon.vertices`, for kernels."""


class Polygon(Pictured, Solid):
    """All points from which a ray crosses the rings an odd number of times, and the rings themselves; 2D.

    Parameters
    ----------
    rings : list of array_like of shape (n, 2), GeoJSON as a dict, or object with `__geo_interface__`
        A repeated last vertex is dropped. Rings may cross, touch, overlap and repeat themselves. Of GeoJSON (Polygon,
        MultiPolygon, Feature, a collection of these; an object of shapely has it) all parts are united.
    deadline, cancel
        As for `Polyhedron`: to unite parts takes time.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, RingTooShortError
        For rings that break a rule.

    Notes
    -----
    Boundary: the points on any edge, even on one that another edge cancels under even-odd.

    Degenerate input: a ring of two positions is the edge between them, there and back, without area; one that is left
    with fewer is refused. Without rings a polygon is empty, as results of overlays may be: overlays take it, other
    operations refuse it (EmptyGeometryError).

    Examples
    --------
    >>> Polygon([[[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [2, 1], [1, 2]]])
    Polygon(2 rings, 7 vertices)
    """

    __slots__ = ("ring_offsets", "vertices")

    type: ClassVar[str] = "polygon"
    _pickled: ClassVar[tuple[str, ...]] = ("vertices", "ring_offsets")
    vertices: FloatArray
    """``(n, 2)``: the vertices of all rings, one ring after another; in a ring of two positions the last is repeated.
    """
    ring_offsets: IntArray
    """``(n_rings + 1,)``: ring i holds the vertices ``ring_offsets[i]`` up to ``ring_offsets[i + 1]``."""

    geojson: ClassVar[tuple[Callable[..., Polygon], Callable[[Polygon], dict[str, Any]]]]
    """Functions that convert a geometry to a polygon and back; set by `engine.layers`, since they need overlays."""
    _from_geojson: ClassVar[Callable[[Any, Budget], Polygon | None]]
    """The function from any GeoJSON to a polygon, None for what is none; set by `engine.solids.shapes`."""

    def __init__(self, rings: object, *, deadline: float | None = None, cancel: Cancel | None = None) -> None:
        if not isinstance(rings, (list, tuple, np.ndarray)) and geometry_of(rings) is not None:
            with Budget(deadline, cancel) as budget:
                budget.check()
                read = Polygon._from_geojson(rings, budget)
            if read is not None:
                self._set(dimension=2, vertices=read.vertices, ring_offsets=read.ring_offsets)
                return
        if isinstance(rings, np.ndarray) and rings.ndim == 3:
            rings = list(rings)
        if not isinstance(rings, (list, tuple)):
            raise InvalidArrayError(
                f"rings must be a list of rings, each a list of positions, got {type(rings).__name__}; "
                "put a single ring into a list",
                ("rings",),
            )
        arrays = [_as_ring(ring, ("rings", i_ring)) for i_ring, ring in enumerate(rings)]
        vertices = frozen(arrays[0]) if len(arrays) == 1 else frozen(np.concatenate([_NO_VERTICES, *arrays]))
        offsets = np.array([0, *accumulate(map(len, arrays))], np.int64)
        offsets.setflags(write=False)
        self._set(dimension=2, vertices=vertices, ring_offsets=offsets)

    @classmethod
    def of_arrays(cls, vertices: FloatArray, ring_offsets: IntArray) -> Polygon:
        """Return a polygon of these arrays without a copy or checks. ring_offsets: of rings into vertices. Caller
        guarantees that they are read-only, have no -0.0 and no repeated last vertex."""
        polygon = object.__new__(cls)
        polygon._set(dimension=2, vertices=vertices, ring_offsets=ring_offsets)
        return polygon

    @classmethod
    def restored(cls, *values: Any) -> Polygon:
        vertices = frozen(as_points(values[0], 2, ("vertices",)))
        (offsets,) = as_nested_offsets(len(vertices), ring_offsets=values[1])
        if len(short := np.flatnonzero(np.diff(offsets) < _LEAST)):
            where = ("rings", int(short[0]))
            raise RingTooShortError(f"rings[{where[1]}] has fewer than {_LEAST} vertices", where)
        return cls.of_arrays(vertices, offsets)

    @property
    def n_rings(self) -> int:
        """Number of rings."""
        return len(self.ring_offsets) - 1

    @classmethod
    def from_lines(cls, lines: object) -> Polygon:
        """Return the polygon that is lines themselves, without area: a body, for its distance to others.

        Parameters
        ----------
        lines : list of array_like of shape (n, 2), GeoJSON of lines, or object with `__geo_interface__`
            Two positions or more each; a ring repeats its first position at its end.

        Returns
        -------
        Polygon
            A ring of two positions for each segment.

        Examples
        --------
        >>> from engine import Sphere, clearance
        >>> clearance(Polygon.from_lines([[(0, 0), (4, 0), (4, 4)]]), Sphere((1, 3), 1)).distance
        2.0
        """
        try:
            listed = lines_in(lines)
        except EngineError as error:
            raise error.at("lines") from None
        given: Any = lines if listed is None else listed
        if not isinstance(given, (list, tuple)) and not (isinstance(given, np.ndarray) and given.ndim):
            raise InvalidArrayError(f"lines must be a list of lines, got {type(lines).__name__}", ("lines",))
        chains = [as_points(line, 2, ("lines", k)) for k, line in enumerate(given)]
        for k, chain in enumerate(chains):
            if len(chain) == 1:
                raise RingTooShortError(f"lines[{k}] has 1 position; a line needs at least 2", ("lines", k))
        return cls([np.stack(pair) for chain in chains for pair in pairwise(chain)])

    @property
    def boundary(self) -> Polygon:
        """The rings themselves, without what they enclose: the distance from inside to it is above 0."""
        rings = np.split(self.vertices, self.ring_offsets[1:-1]) if self.n_rings else []
        return Polygon.from_lines([np.concatenate([ring, ring[:1]]) for ring in rings])

    def prepared(self, key: str, build: Callable[[], T], check: Callable[[], object] | None = None) -> T:
        """Return the structure cached under `key`, as `Preparing.prepared`; raise for an empty polygon, which only
        overlays accept."""
        self.check_not_empty()
        return super().prepared(key, build, check)

    def check_not_empty(self) -> None:
        """Raise if the polygon has no rings."""
        check_not_empty(len(self.vertices), "ring", ("rings",))

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The polygon as GeoJSON: valid shells with their holes; crossing rings are resolved."""
        return Polygon.geojson[1](self)

    def _repr_svg_(self) -> str:
        """Return the picture that notebooks show: the rings as given, even-odd."""
        rings = np.split(self.vertices, self.ring_offsets[1:-1]) if self.n_rings else []
        return svg_of({"type": "Polygon", "coordinates": rings})

    def __repr__(self) -> str:
        return f"Polygon({self.n_rings} rings, {len(self.vertices)} vertices)"


def _as_ring(ring: object, where: tuple[str | int, ...]) -> FloatArray:
    """Return the vertices of one ring, without a repeated last vertex."""
    if is_ready(ring, 2):
        points = cast("FloatArray", ring)
        check_finite(points, where)
    else:
        points = as_points(ring, 2, where)
    if len(points) < 2:
        raise RingTooShortError(f"rings[{where[-1]}] has {len(points)} vertices; a ring needs at least 2", where)
    if len(points) > 2 and points[0].tolist() == points[-1].tolist():
        points = points[:-1]
    return points if len(points) >= _LEAST else points[[0, 1, 1]]
