"""A small SVG canvas: what the pictures of these pages are drawn with. Coordinates are the scene's, y upward."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

PICTURES = Path(__file__).resolve().parents[1] / "pictures"
BLUE, ORANGE, GREY, RED, DARK = "#3b6ea8", "#d9822b", "#9aa3ad", "#c23030", "#1d2733"
PALE_BLUE, PALE_ORANGE, PALE_GREY = "#c9daee", "#f6dcbd", "#eceff2"
Point = Sequence[float]


class Canvas:
    """Shapes within ``[x_min, x_max] x [y_min, y_max]`` of the scene, `width` pixels wide.

    Parameters
    ----------
    low, high : sequence of two floats
        The corners of the visible part of the scene.
    width : int
        In pixels; the height follows.
    """

    def __init__(self, low: Point, high: Point, width: int = 640) -> None:
        self._low, self._high = low, high
        self._scale = width / (high[0] - low[0])
        self._size = width, round((high[1] - low[1]) * self._scale)
        self._shapes: list[str] = []

    def _at(self, point: Point) -> str:
        x, y = (point[0] - self._low[0]) * self._scale, (self._high[1] - point[1]) * self._scale
        return f"{x:.2f},{y:.2f}"

    def rings(self, rings: Iterable[Iterable[Point]], fill: str = "none", edge: str = DARK, width: float = 1.5) -> None:
        """Draw rings under the even-odd rule."""
        path = " ".join("M" + " L".join(map(self._at, ring)) + "Z" for ring in rings)
        self._shapes.append(
            f'<path d="{path}" fill="{fill}" fill-rule="evenodd" stroke="{edge}" stroke-width="{width}"/>'
        )

    def line(self, points: Iterable[Point], edge: str = DARK, width: float = 1.5, dash: str = "") -> None:
        """Draw a polyline, dashed if `dash` is given (SVG's own notation)."""
        pattern = f' stroke-dasharray="{dash}"' if dash else ""
        places = " ".join(map(self._at, points))
        self._shapes.append(
            f'<polyline points="{places}" fill="none" stroke="{edge}" stroke-width="{width}"{pattern}/>'
        )

    def dots(self, points: Iterable[Point], fill: str = DARK, radius: float = 3.0) -> None:
        """Draw filled circles of `radius` pixels."""
        for point in points:
            x, y = self._at(point).split(",")
            self._shapes.append(f'<circle cx="{x}" cy="{y}" r="{radius}" fill="{fill}"/>')

    def text(self, point: Point, words: object, fill: str = DARK, size: int = 13) -> None:
        """Write one line that starts at `point`."""
        x, y = self._at(point).split(",")
        self._shapes.append(f'<text x="{x}" y="{y}" fill="{fill}" font-size="{size}">{words}</text>')

    def save(self, name: str) -> None:
        """Write ``docs/pictures/<name>.svg``."""
        width, height = self._size
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
            'font-family="sans-serif"><rect width="100%" height="100%" fill="white"/>'
        )
        (PICTURES / f"{name}.svg").write_text("\n".join([head, *self._shapes, "</svg>", ""]), "utf-8")
