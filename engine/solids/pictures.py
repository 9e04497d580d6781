"""Pictures of shapes for notebooks, as SVG: of the plane as they are, of meshes three views; and shapely's objects."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from engine.solids.geometries import geometries_in
from engine.types import FloatArray

_INNER: Final = 224
_EDGE: Final = 8
_SIZE: Final = _INNER + 2 * _EDGE
"""Pixels of a view's longer side, and of its edge."""
_MOST: Final = 20_000
"""Positions, or edges of a mesh, that are drawn; of more only some, evenly."""
_LINE: Final = 'fill="none" stroke="#2f4b6e" vector-effect="non-scaling-stroke"'
_AREA: Final = _LINE.replace('"none"', '"#4c78a8" fill-opacity="0.3" fill-rule="evenodd"')


class Pictured:
    """Base of what has a `__geo_interface__`: a picture in notebooks, and shapely's object."""

    __slots__ = ()

    def to_shapely(self) -> Any:
        """Return the geometry of shapely, which must be installed.

        Returns
        -------
        shapely.Geometry
            Of `__geo_interface__`.
        """
        import shapely

        return shapely.geometry.shape(self)

    def _repr_svg_(self) -> str:
        """Return the picture that notebooks show."""
        given: Any = self
        return svg_of(given.__geo_interface__)


def svg_of(geometry: Any) -> str:
    """Return a GeoJSON geometry as SVG, y upward."""
    paths = [(np.asarray(line, np.float64)[:, :2], is_area) for line, is_area in _lines_in(geometry) if len(line)]
    paths = paths[:: 1 + len(paths) // _MOST]
    n_positions = sum(len(line) for line, _ in paths)
    every = 1 + n_positions // _MOST
    view = _view_of([line for line, _ in paths])
    drawn = [(view.path(line[::every] if len(line) > 8 * every else line), is_area) for line, is_area in paths]
    areas = " ".join(line + "Z" for line, is_area in drawn if is_area)
    lines = " ".join(line for line, is_area in drawn if not is_area)
    marks = f'<path d="{areas}" {_AREA}/>' * bool(areas) + f'<path d="{lines}" {_LINE}/>' * bool(lines)
    return _svg([(marks, view)])


def svg_of_mesh(vertices: FloatArray, triangles: Any) -> str:
    """Return three views of the edges of a mesh: along z, y and x."""
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    some = edges[:: 1 + len(edges) // _MOST]
    views = []
    for x, y in ((0, 1), (0, 2), (1, 2)):
        ends = vertices[some][:, :, [x, y]]
        view = _view_of([*ends])
        views.append((f'<path d="{"".join(map(view.path, ends))}" {_LINE}/>', view))
    return _svg(views)


def _lines_in(geometry: Any) -> Iterator[tuple[Any, bool]]:
    """Yield the rings, lines and points of a geometry, and whether each bounds an area."""
    for _, each in geometries_in(geometry):
        kind, at = each["type"], each["coordinates"]
        if kind in ("Polygon", "MultiPolygon"):
            yield from ((ring, True) for part in ([at] if kind == "Polygon" else at) for ring in part)
        elif kind.endswith("LineString"):
            yield from ((line, False) for line in ([at] if kind == "LineString" else at))
        else:
            yield from (([point, point], False) for point in ([at] if kind == "Point" else at))


class _View(NamedTuple):
    """The part of the plane that is drawn: a position becomes the pixel (position - low) * scale, computed from halves,
    which do not overflow."""

    low: FloatArray
    scale: float
    size: FloatArray
    """Pixels, without the edge."""

    def path(self, line: FloatArray) -> str:
        across = (line / 2 - self.low / 2) * self.scale
        return "M" + "L".join(f"{x:.6g},{self.size[1] - y:.6g}" for x, y in across.tolist())


def _view_of(lines: list[FloatArray]) -> _View:
    """Return the view of lines that shows all."""
    points = np.concatenate(lines or [np.zeros((1, 2))])
    low, high = points.min(axis=0), points.max(axis=0)
    half = high / 2 - low / 2
    extent = max(float(half.max()), 1e-300)
    scale = _INNER / extent
    return _View(low, scale, half * scale)


def _svg(views: list[tuple[str, _View]]) -> str:
    """Return views side by side, each its marks and what of the plane it shows."""
    parts, x = [], 0.0
    for marks, view in views:
        wide, tall = (view.size + 2 * _EDGE).tolist()
        box = f"{-_EDGE} {-_EDGE} {wide:.6g} {tall:.6g}"
        parts.append(f'<svg x="{x:.6g}" width="{wide:.6g}" height="{tall:.6g}" viewBox="{box}">{marks}</svg>')
        x += wide + 8
    return f'<svg xmlns="http://www.w3.org/2000/svg" width="{x:.6g}" height="{_SIZE}">{"".join(parts)}</svg>'
