"""Views of a result: rings, pieces, counts and areas, piece by piece."""

from __future__ import annotations

from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon


def square(x: float, y: float, size: float) -> list[tuple[float, float]]:
    return [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]


def test_pieces_with_holes() -> None:
    frame = Polygon([square(0, 0, 9), square(1, 1, 2), square(4, 4, 3), square(20, 0, 5)])
    result = overlay(frame, Polygon([square(21, 1, 1), square(100, 0, 1)]), "difference")
    assert (result.n_pieces, result.n_holes) == (2, 3)
    assert [len(piece.holes) for piece in result.pieces] == [2, 1]
    assert result.rings[0].tolist() == [list(map(float, vertex)) for vertex in square(0, 0, 9)]
    assert result.piece_areas.tolist() == [68.0, 24.0]
    assert (result.area, result.area_exact) == (92.0, 92)
    empty = overlay(frame, frame, "difference")
    assert (empty.n_pieces, empty.area, len(empty.piece_areas)) == (0, 0.0, 0)
