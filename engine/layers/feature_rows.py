"""Rows of an answer as GeoJSON features, made on request."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, Literal, Protocol, cast, overload

import numpy as np

from engine.layers.json_text import text_of
from engine.layers.rows import LayerRows, heights_at
from engine.solids.ragged import summed
from engine.types import Accuracy, FloatArray, IntArray, read_only

_BATCH: Final = 1000
"""Number of features made at a time."""
ROW: Final = 55
"""Lower bound on the bytes of a row in JSON, without copied members and positions."""
_POSITION: Final = 10
"""Lower bound on the bytes of a position in JSON."""


Areas = tuple[FloatArray, tuple[IntArray, IntArray, IntArray]]
"""Positions, and offsets of rings, of polygons and of rows."""


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
    areas: Areas | None = None
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
        positions, _ = self.areas
        parts = _polygons(self.areas, row, lambda start, stop: positions[start:stop])
        return _joined("Polygon", parts) if parts else None


Answer = FeatureRows | tuple[FeatureRows, Accuracy]


class _Reporting(Protocol):
    """A function whose answer has an `Accuracy` with it on request."""

    @overload
    def __call__(self, *given: Any, report: Literal[False] = False, **options: Any) -> FeatureRows: ...
    @overload
    def __call__(self, *given: Any, report: Literal[True], **options: Any) -> tuple[FeatureRows, Accuracy]: ...


def reporting(function: Callable[..., Answer]) -> _Reporting:
    """Return the function as it is, for type checkers a `_Reporting`."""
    return cast(_Reporting, function)


def with_geometries(
    rows: LayerRows, members: Callable[[int], bytes], n_bytes: IntArray, crs: bytes | None,
    sources: list[tuple[FloatArray, IntArray]],
) -> FeatureRows:  # fmt: skip
    """Return the features of rows. members(row): JSON bytes of a row's members besides type and geometry; n_bytes:
    lower bound on the bytes of JSON of each row but for the geometry; crs: the common member of the layers as JSON;
    sources: altitudes, as `heights_at` has them."""
    positions, (rings, pieces, ends) = areas = rows.ragged
    touching, lines, points = rows.touching, rows.touching.lines, rows.touching.points
    places = np.concatenate([positions, touching.vertices, touching.places])
    owners = [
        np.repeat(np.arange(len(rows)), np.diff(rings[pieces[ends]])),
        np.repeat(lines, np.diff(touching.offsets)),
    ]
    owner = np.concatenate([*owners, points])
    heights = heights_at(places, owner, sources)
    offsets = read_only(summed(np.bincount(owner, minlength=len(rows))))
    n_bytes = summed(ROW + n_bytes) + _POSITION * offsets
    if heights is None and not len(lines) + len(points):
        return FeatureRows(members, offsets, n_bytes, crs, areas, collapsed=rows.n_collapsed)
    places = places if heights is None else np.column_stack([places, heights])
    first_line, first_point = len(positions), len(places) - len(points)
    parts_of = [(order := np.argsort(numbers, kind="stable"), numbers[order]) for numbers in (lines, points)]

    def listed(start: int, stop: int) -> list[Any]:
        flat = places[start:stop].tolist()
        return flat if heights is None else [place if place[2] == place[2] else place[:2] for place in flat]

    def geometry(row: int) -> bytes | None:
        of_lines, of_points = (order[slice(*np.searchsorted(of, [row, row + 1]))].tolist() for order, of in parts_of)
        made = {
            "Polygon": _polygons(areas, row, listed) if heights is not None or of_lines or of_points else [],
            "LineString": [listed(*(first_line + touching.offsets[k : k + 2]).tolist()) for k in of_lines],
            "Point": [listed(first_point + k, first_point + k + 1)[0] for k in of_points],
        }
        parts = [_joined(kind, some) for kind, some in made.items() if some]
        if not parts:
            return None
        return text_of(parts[0] if len(parts) == 1 else {"type": "GeometryCollection", "geometries": parts})

    return FeatureRows(members, offsets, n_bytes, crs, areas, geometry, rows.n_collapsed)


def _polygons(areas: Areas, row: int, listed: Callable[[int, int], Any]) -> list[list[Any]]:
    """Return the pieces of a row, each a list of rings, as nested lists. listed(start, stop): those positions as
    lists."""
    _, (rings, pieces, ends) = areas
    return [
        [listed(i, j) for i, j in pairwise(rings[first : last + 1].tolist())]
        for first, last in pairwise(pieces[ends[row] : ends[row + 1] + 1].tolist())
    ]


def _joined(kind: str, parts: list[Any]) -> dict[str, Any]:
    """Return a GeoJSON geometry of type `kind` for one part, of the Multi type for several. parts: coordinates of
    each."""
    return {"type": f"Multi{kind}", "coordinates": parts} if len(parts) > 1 else {"type": kind, "coordinates": parts[0]}
