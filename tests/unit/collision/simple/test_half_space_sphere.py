"""Half-spaces against balls."""

from __future__ import annotations

import pytest

from tests.unit.collision.lattices import COUNTS, Maker, check_pairs, half_space, sphere


@pytest.mark.parametrize(("d", "first", "second"), [(2, half_space, sphere), (3, half_space, sphere)])
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)
