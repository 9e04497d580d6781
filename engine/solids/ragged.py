"""Ragged arrays: items of different lengths in one array, with the offsets of each, as in Arrow and shapely."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from itertools import chain, pairwise
from typing import Any, ClassVar, cast

import numpy as np

from engine.errors import EngineError, InvalidArrayError
from engine.solids.checks import Where, as_nested_offsets, as_offsets, as_point_groups, as_points, frozen, shown, spell
from engine.solids.columns import Columns
from engine.solids.polygon import Polygon
from engine.types import BoolArray, FloatArray, IntArray, read_only


class Ragged(Columns):
    """Base of results that are ragged arrays; a pickle is checked when read, since kernels trust offsets."""

    __slots__ = ()

    _levels: ClassVar[tuple[str, ...]]
    """Name of the field of items, then those of the fields of offsets, each into the one before."""

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self)._restored, tuple(getattr(self, each.name) for each in fields(cast(Any, self)))

    @classmethod
    def _restored(cls, *values: Any) -> Any:
        made = cls(*values)
        items, *levels = cls._levels
        as_nested_offsets(len(getattr(made, items)), **{name: getattr(made, name) for name in levels})
        return made


def as_lines(lines: object, dimension: int) -> tuple[FloatArray, IntArray]:
    """Return the vertices (n, dimension) of polylines and their offsets (n_lines + 1,); lines: as `clip_lines` takes
    them."""
    where: Where = ("lines",)
    if isinstance(lines, tuple) and len(lines) == 2 and isinstance(lines[1], np.ndarray) and lines[1].ndim == 1:
        vertices = as_points(lines[0], dimension, (*where, 0))
        offsets = as_offsets(lines[1], len(vertices), (*where, 1))
        vertices, offsets = vertices[offsets[0] : offsets[-1]], offsets - offsets[0]
    elif isinstance(lines, np.ndarray):
        groups = as_point_groups(lines, None, dimension, where)
        vertices = groups.reshape(-1, dimension)
        offsets = np.arange(len(groups) + 1) * groups.shape[1]
    elif isinstance(lines, (list, tuple)):
        vertices, offsets = _joined(lines, dimension, where)
    else:
        raise InvalidArrayError(f"lines must be a list of lists of positions, got {shown(lines)}", where)
    short = np.flatnonzero(np.diff(offsets) == 1)
    if len(short):
        place = (*where, int(short[0]))
        raise InvalidArrayError(f"{spell(place)} has 1 position; a line needs at least 2, or none", place)
    return vertices, offsets


def _joined(lines: list[Any] | tuple[Any, ...], dimension: int, where: Where) -> tuple[FloatArray, IntArray]:
    """Return the positions of a list of lines as one array, and the offsets of the lines."""
    try:
        offsets = np.cumsum([0, *map(len, lines)])
        if all(isinstance(line, np.ndarray) for line in lines):
            flat: Any = np.concatenate([np.zeros((0, dimension)), *lines])
        else:
            flat = list(chain.from_iterable(lines))
        return as_points(flat, dimension, where), offsets
    except (EngineError, TypeError, ValueError, NotImplementedError):
        parts = [as_points(line, dimension, (*where, i_line)) for i_line, line in enumerate(lines)]
    return np.concatenate([np.zeros((0, dimension)), *parts]), np.cumsum([0, *map(len, parts)])


def summed(sizes: Sequence[int] | IntArray | BoolArray) -> IntArray:
    """Return read-only offsets (n + 1,) of parts of these sizes, from 0."""
    offsets = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=offsets[1:])
    return read_only(offsets)


def run_offsets(keys: IntArray) -> IntArray:
    """Return offsets (n_runs + 1,) of the runs of equal numbers of an array (n,)."""
    return np.append(np.flatnonzero(np.append(True, keys[1:] != keys[:-1])[: len(keys)]), len(keys))


def parts_of_runs(keys: IntArray, most: int) -> list[tuple[int, int]]:
    """Return (first, last) of parts of at most so many equal numbers of an array."""
    runs = pairwise(run_offsets(keys).tolist())
    return [(first, min(first + most, last)) for begin, last in runs for first in range(begin, last, most)]


def ascending(numbers: IntArray) -> IntArray:
    """Return each integer of an array once, in order; np.unique, by a hash table from numpy 2.3 on, takes up to 70
    times as long for millions."""
    flat = np.sort(numbers, axis=None)
    distinct: IntArray = flat[run_offsets(flat)[:-1]]
    return distinct


def are_among(numbers: IntArray, known: IntArray) -> BoolArray:
    """Return, for each integer (n,), whether it is among known (m,), which ascend."""
    if not len(known):
        return np.zeros(len(numbers), np.bool_)
    result: BoolArray = known[np.minimum(np.searchsorted(known, numbers), len(known) - 1)] == numbers
    return result


def within(offsets: IntArray, items: IntArray) -> IntArray:
    """Return, by item number, the group that contains it: group g has the items offsets[g] .. offsets[g + 1] - 1."""
    return np.searchsorted(offsets, items, "right") - 1


def next_in_rings(ring_offsets: IntArray) -> IntArray:
    """Return (n,) int64: the index of the vertex that follows each vertex in its ring."""
    following = np.arange(1, ring_offsets[-1] + 1, dtype=np.int64)
    following[ring_offsets[1:] - 1] = ring_offsets[:-1]
    return following


def polygons(coordinates: object, ring_offsets: object, polygon_offsets: object) -> list[Polygon]:
    """Return polygons from ragged arrays, as shapely.to_ragged_array, GeoArrow and `OverlayBatch` have them.

    Parameters
    ----------
    coordinates : array_like, shape (n, 2)
        All rings one after another, each with its first position repeated at its end or not.
    ring_offsets : array_like of int, shape (n_rings + 1,)
        Ring r has the coordinates ``ring_offsets[r]`` up to ``ring_offsets[r + 1]``.
    polygon_offsets : array_like of int, shape (n_polygons + 1,)
        Polygon k has the rings ``polygon_offsets[k]`` up to ``polygon_offsets[k + 1]``, even-odd.

    Returns
    -------
    list of Polygon
        Views of the caller's coordinates where these are float64 and contiguous, which must not be changed afterwards;
        a polygon of several rings with repeated ends, or with -0.0 anywhere, is a copy.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError
        For arrays that break a rule.
    RingTooShortError
        As `Polygon`.

    Notes
    -----
    Cost: linear; no object a ring.

    References
    ----------
    The GeoArrow specification, layout of polygons.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 0]], float)
    >>> polygons(square, [0, 4], [0, 1])
    [Polygon(1 rings, 3 vertices)]
    """
    vertices, starts, ends, groups = parted(coordinates, ring_offsets, polygon_offsets)
    has_short = np.logical_or.reduceat(np.append(ends - starts < 3, False), groups)[:-1].tolist()
    first_vertices, last_vertices = starts.tolist(), ends.tolist()
    sizes: dict[int, IntArray] = {}
    result = []
    for k, (first, last) in enumerate(pairwise(groups.tolist())):
        if last - first == 1 and not has_short[k]:
            start, end = first_vertices[first], last_vertices[first]
            offsets = sizes.get(end - start)
            if offsets is None:
                offsets = sizes[end - start] = read_only(np.array([0, end - start]))
            result.append(Polygon.of_arrays(vertices[start:end], offsets))
        elif not has_short[k] and last_vertices[first : last - 1] == first_vertices[first + 1 : last] != []:
            start, end = first_vertices[first], last_vertices[last - 1]
            result.append(Polygon.of_arrays(vertices[start:end], read_only(np.append(starts[first:last], end) - start)))
        else:
            result.append(_of_rings(vertices, first_vertices[first:last], last_vertices[first:last], ring=first))
    return result


def parted(
    coordinates: object, ring_offsets: object, polygon_offsets: object
) -> tuple[FloatArray, IntArray, IntArray, IntArray]:
    """Check the arguments of `polygons`; return vertices, start and end of each ring (without a repeated last vertex),
    and the offsets of polygons into the rings."""
    vertices = as_points(coordinates, 2, ("coordinates",))
    zeros = vertices == 0.0
    if np.signbit(vertices[zeros]).any():
        vertices = frozen(vertices)
    rings = as_offsets(ring_offsets, len(vertices), ("ring_offsets",))
    groups = as_offsets(polygon_offsets, len(rings) - 1, ("polygon_offsets",))
    starts, ends = rings[:-1], rings[1:].copy()
    long = np.flatnonzero(ends - starts > 2)
    ends[long] -= (vertices[starts[long]] == vertices[ends[long] - 1]).all(axis=1)
    return vertices, starts, ends, groups


def _of_rings(vertices: FloatArray, starts: list[int], ends: list[int], ring: int) -> Polygon:
    """Return the polygon of the rings vertices[starts[k] : ends[k]]. ring: number of the first of them among the
    caller's rings, for messages."""
    try:
        return Polygon([vertices[start:end] for start, end in zip(starts, ends)])
    except EngineError as error:
        place = ring + int(error.where[1]) if len(error.where) > 1 else ring
        error.message = f"ring {place} of ring_offsets: {error.message}"
        error.where = ("ring_offsets", place)
        raise


def closed_rings(vertices: FloatArray, ring_offsets: IntArray) -> tuple[FloatArray, IntArray]:
    """Return rings closed by a repeated first vertex, as GeoJSON and Arrow need them: positions (m, 2) and their
    offsets."""
    firsts = ring_offsets[:-1]
    return np.insert(vertices, ring_offsets[1:], vertices[firsts], axis=0), ring_offsets + np.arange(len(firsts) + 1)


def as_geojson(vertices: FloatArray, ring_offsets: IntArray, piece_offsets: IntArray) -> dict[str, Any]:
    """Return pieces (each a shell and its holes) as a GeoJSON MultiPolygon; a single piece as a Polygon. ring_offsets:
    of rings into vertices; piece_offsets: of pieces into rings."""
    positions, offsets = closed_rings(vertices, ring_offsets)
    rings = [positions[start:stop].tolist() for start, stop in pairwise(offsets.tolist())]
    pieces = [rings[start:stop] for start, stop in pairwise(piece_offsets.tolist())]
    if len(pieces) == 1:
        return {"type": "Polygon", "coordinates": pieces[0]}
    return {"type": "MultiPolygon", "coordinates": pieces}


def rings_as_geojson(polygons: Iterable[list[FloatArray]]) -> dict[str, Any]:
    """Return polygons, lists of rings that are not closed, as a GeoJSON MultiPolygon; those without rings left out."""
    parts = [[[*ring.tolist(), ring[0].tolist()] for ring in rings] for rings in polygons if rings]
    return {"type": "MultiPolygon", "coordinates": parts}
