"""Kinds numbered in the order in which they first appear."""

from __future__ import annotations

import numpy as np
import pytest

from engine.collision.scenes.bodies import numbered


@pytest.mark.parametrize("n", [0, 1, 1000])
def test_as_a_dictionary_numbers_them(n: int) -> None:
    keys = np.random.default_rng(n).integers(0, 50, n) * 16 + 140_000_000_000
    kinds, firsts = numbered(keys)
    places: dict[int, int] = {}
    assert kinds.tolist() == [places.setdefault(key, len(places)) for key in keys.tolist()]
    assert firsts.tolist() == [keys.tolist().index(key) for key in places]
