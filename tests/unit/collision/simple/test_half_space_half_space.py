"""Half-spaces against half-spaces."""

from __future__ import annotations

import pytest

from tests.unit.collision.lattices import COUNTS, Maker, check_pairs, half_space


@pytest.mark.parametrize(("d", "first", "second"), [(2, half_space, half_space), (3, half_space, half_space)])
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)
