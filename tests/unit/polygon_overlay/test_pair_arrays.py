"""Polygons as flat arrays: compiled code reads what Python reads."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polygon
from engine.polygon_overlay import pair_arrays
from engine.polygon_overlay.compiled import polygon_fields
from engine.polygon_overlay.pair_arrays import polygon_arrays_of
from engine.types import read_only


def _polygons() -> list[Polygon]:
    rng = np.random.default_rng(3)
    apart = [Polygon([rng.random((rng.integers(3, 9), 2)) for _ in range(k % 4)]) for k in range(40)]
    flat = read_only(rng.random((30, 2)))
    return [*apart, *(Polygon.of_arrays(flat[k : k + 6], read_only(np.array([0, 3, 6]))) for k in range(20))]


@pytest.mark.parametrize("layout", [polygon_fields.LAYOUT, None], ids=["compiled", "in Python"])
def test_arrays_of_polygons_are_their_fields(
    layout: polygon_fields.Layout | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert polygon_fields.LAYOUT is not None
    monkeypatch.setattr(pair_arrays, "LAYOUT", layout)
    polygons = _polygons()
    for first, last in ((0, None), (0, 1), (7, 9), (38, 60), (39, 100)):
        made, some = polygon_arrays_of(polygons, first, last), polygons[first:last]
        assert len(made.polygon_offsets) == len(some) + 1
        assert not any(array.flags.writeable for array in made)
        for k, each in enumerate(some):
            assert made.polygon(k) == each
        assert made.ring_offsets[-1] == len(made.vertices) == sum(len(each.vertices) for each in some)


def test_another_memory_layout_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    words = polygon_fields._words
    for place in (2, 3):  # the data, the number of axes of an array
        with monkeypatch.context() as other:
            other.setattr(
                polygon_fields,
                "_words",
                lambda thing, place=place: [word + (k == place) for k, word in enumerate(words(thing))],
            )
            assert polygon_fields._layout() is None
    monkeypatch.setattr(polygon_fields.sys, "implementation", type("Other", (), {"name": "pypy"}))
    assert polygon_fields._layout() is None
