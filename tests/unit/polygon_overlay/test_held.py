"""Polygons read from memory are those that their attributes tell; where memory is not as expected none is read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine.polygon_overlay import held
from engine.polygon_overlay.polygon_arrays import gathered
from engine.solids.aabb import Aabb
from engine.solids.polygon import Polygon

FEW = (
    Polygon([[(0, 0), (4, 0), (4, 4)]]),
    Polygon([]),
    Polygon([[(0, 0), (9, 0), (9, 9)], [(1, 1), (2, 1), (1, 2), (0.5, 0.25)]]),
    Polygon([[(-1, 0), (1, 0)]]),
)


class Named(Polygon):
    __slots__ = ()


def test_arrays_are_those_that_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    draw = np.random.default_rng(7)
    many = FEW + tuple(Polygon([draw.normal(size=(n, 2)) for n in draw.integers(3, 40, 3)]) for _ in range(50))
    found = gathered(many)
    assert held.arrays_held(many) is not None
    monkeypatch.setattr(held, "_layout", lambda: None)
    assert held.arrays_held(many) is None
    for array, expected in zip(found, gathered(many), strict=True):
        assert (array.dtype, array.shape, array.tolist()) == (expected.dtype, expected.shape, expected.tolist())
        assert not array.flags.writeable


def test_where_one_is_no_polygon_none_is_read() -> None:
    others: Any = Aabb(min=[0, 0], max=[1, 1]), "text", None, 1, FEW, Named([[(0, 0), (1, 0), (0, 1)]])
    for other in others:
        assert held.arrays_held((*FEW, other)) is None


def test_a_word_that_is_not_there_or_twice_has_no_place() -> None:
    both = FEW[0], FEW[0]
    with pytest.raises(ValueError, match="unpack"):
        held._place_in(both, id(FEW[0]))
    with pytest.raises(ValueError, match="unpack"):
        held._place_in(both, id(FEW[1]))
