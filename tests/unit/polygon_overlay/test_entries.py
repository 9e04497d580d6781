"""A kernel is entered without its dispatcher once it is compiled for one kind of arguments only."""

from __future__ import annotations

from engine.polygon_overlay.compiled.ring_area import sum_areas
from engine.polygon_overlay.entries import entry_of
from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon


def test_entry_of() -> None:
    square = Polygon([[(0, 0), (1, 0), (1, 1)]])
    assert overlay(square, square).area == 0.5
    if hasattr(sum_areas, "signatures"):
        assert len(sum_areas.signatures) == 1
        assert entry_of(sum_areas) is not sum_areas
        assert entry_of(sum_areas) is entry_of(sum_areas)

    def plain() -> None: ...

    assert entry_of(plain) is plain
