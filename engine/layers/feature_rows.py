"""Rows of an answer as GeoJSON features, made on request."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np

from engine.layers.altitudes import heights_at
from engine.layers.json_text import text_of
from engine.layers.rows import LayerRows
from engine.polygon_overlay.touching import Touching
from engine.solids.ragged import summed
from engine.types import FloatArray, IntArray, read_only

_BATCH: Final = 1000
"""Number of features made at a time."""
ROW: Final = 55
"""Lower bound on the bytes of a row in JSON, without copied members and positions."""
_POSITION: Final = 10
"""Lower bound on the bytes of a position in JSON."""


@dataclass(frozen=True, slots=True, eq=False)
class FeatureRows:
    """Features of an answer, made on request.

    Attributes
    ----------
    offsets : ndarray of int64, shape (n + 1,)
        How many vertices stand before each feature.
    collapsed : int
        Rows that rounding left nothing of.
    slivers : tuple or None
        With `min_width`: feature, piece of it, and width of each piece that is narrower.
    crs_text : str
        The collection's `crs` as JSON.
    n_bytes : ndarray of int64, shape (n + 1,)
        Bytes of JSON before each feature, at least.
    areas : tuple or None
        Positions, and offsets of rings, of polygons and of rows, where the geometries are made.
    members, geometry : callable
        ``members(row)``: the members beside type and geometry, as JSON; ``geometry(row)``: that as JSON, None for one
        of `areas`.
    """

    members: Callable[[int], bytes]
    offsets: IntArray
    n_bytes: IntArray
    crs_text: bytes | None
    areas: tuple[FloatArray, tuple[IntArray, IntArray, IntArray]] | None = None
    geometry: Callable[[int], bytes | None] = lambda row: None
    collapsed: int = 0
    slivers: tuple[tuple[int, int, float], ...] | None = None

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __iter__(self) -> Iterator[dict[str, Any]]:
        for start in range(0, len(self), _BATCH):
            yield from self.make(start, min(len(self), start + _BATCH))

    @property
    def crs(self) -> Any:
        """The member `crs` of the input."""
        return None if self.crs_text is None else json.loads(self.crs_text)

    def make(self, start: int, stop: int) -> list[dict[str, Any]]:
        """Return features as dicts.

        Parameters
        ----------
        start, stop : int
            The first, and one past the last.

        Returns
        -------
        list of dict
            GeoJSON features.
        """
        return [
            {"type": "Feature", **json.loads(b"{%b}" % self.members(row)), "geometry": self._geometry(row)}
            for row in range(start, stop)
        ]

    def _geometry(self, row: int) -> Any:
        given = self.geometry(row)
        if given is not None or self.areas is None:
            return json.loads(given or b"null")
        positions, (rings, pieces, ends) = self.areas
        parts = [
            [positions[i:j] for i, j in pairwise(rings[first : last + 1].tolist())]
            for first, last in pairwise(pieces[ends[row] : ends[row + 1] + 1].tolist())
        ]
        if not parts:
            return None
        kind, coordinates = ("Polygon", parts[0]) if len(parts) == 1 else ("MultiPolygon", parts)
        return {"type": kind, "coordinates": coordinates}


def with_geometries(
    rows: LayerRows, members: Callable[[int], bytes], n_bytes: IntArray, crs: bytes | None,
    sources: list[tuple[FloatArray, IntArray]],
) -> FeatureRows:  # fmt: skip
    """Return the features of rows. members(row): JSON bytes of a row's members besides type and geometry; n_bytes:
    lower bound on the bytes of JSON of each row but for the geometry; crs: the common member of the layers as JSON;
    sources: altitudes, as `heights_at` has them."""
    positions, (rings, pieces, ends) = rows.ragged
    offsets, areas = rings[pieces[ends]], (positions, (rings, pieces, ends))
    none = Touching(offsets[:0], positions[:0], offsets[:1] * 0, offsets[:0], positions[:0])
    touching = none if rows.touching is None else rows.touching
    of_lines = np.repeat(touching.lines, np.diff(touching.offsets))
    owners = np.concatenate([np.repeat(np.arange(len(rows)), np.diff(offsets)), of_lines, touching.points])
    heights = heights_at(np.concatenate([positions, touching.vertices, touching.places]), owners, sources)
    offsets = read_only(summed(np.bincount(owners, minlength=len(rows))))
    n_bytes = summed(ROW + n_bytes) + _POSITION * offsets
    if heights is None and not len(touching.lines) + len(touching.points):
        return FeatureRows(members, offsets, n_bytes, crs, areas, collapsed=rows.n_collapsed)
    firsts = np.cumsum([len(positions), len(touching.vertices)]).tolist()

    def listed(places: FloatArray, start: int, stop: int, first: int = 0) -> list[Any]:
        flat = places[start:stop].tolist()
        if heights is None:
            return flat
        own = heights[first + start : first + stop].tolist()
        return [[*place, z] if z == z else place for place, z in zip(flat, own)]

    lines, points = ({row: list[Any]() for row in numbers.tolist()} for numbers in (touching.lines, touching.points))
    for row, start, stop in zip(touching.lines.tolist(), touching.offsets.tolist(), touching.offsets[1:].tolist()):
        lines[row].append((start, stop))
    for place, row in enumerate(touching.points.tolist()):
        points[row].append(place)

    def geometry(row: int) -> bytes | None:
        made: dict[str, list[Any]] = {"Polygon": [], "LineString": [], "Point": []}
        if heights is not None:
            made["Polygon"] = [
                [listed(positions, i, j) for i, j in pairwise(rings[first : last + 1].tolist())]
                for first, last in pairwise(pieces[ends[row] : ends[row + 1] + 1].tolist())
            ]
        made["LineString"] = [listed(touching.vertices, i, j, firsts[0]) for i, j in lines.get(row, ())]
        made["Point"] = [listed(touching.places, k, k + 1, firsts[1])[0] for k in points.get(row, ())]
        parts = [
            {"type": f"Multi{kind}" if len(given) > 1 else kind, "coordinates": given if len(given) > 1 else given[0]}
            for kind, given in made.items()
            if given
        ]
        if not parts:
            return None
        return text_of(parts[0] if len(parts) == 1 else {"type": "GeometryCollection", "geometries": parts})

    return FeatureRows(members, offsets, n_bytes, crs, areas, geometry, rows.n_collapsed)
