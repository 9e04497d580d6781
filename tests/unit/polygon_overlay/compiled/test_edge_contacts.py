"""Contacts of edges, kind by kind: every one against the integers, in all four operations."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import agree

SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
KINDS = {
    "proper crossing": [(1, 1), (6, 2), (1, 3)],
    "vertex in an edge": [(4, 2), (7, 1), (7, 3)],
    "vertex on vertex": [(4, 4), (7, 4), (7, 7)],
    "edge through a vertex": [(3, 5), (5, 3), (6, 6)],
    "overlap, one within the other": [(4, 1), (4, 3), (6, 2)],
    "overlap, end in each": [(4, 2), (4, 6), (6, 4)],
    "overlap, one end in common": [(4, 0), (4, 2), (6, 1)],
    "equal edges": [(4, 0), (4, 4), (6, 2)],
    "fold": [(1, 1), (3, 1), (2, 1), (2, 3)],
    "fold across": [(2, 2), (9, 2), (3, 2), (3, 3)],
    "three lines through one point": [(2, -1), (4, 4), (6, 9), (1, 4)],
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turn", range(4))
def test_contact(kind: str, turn: int) -> None:
    subject, clip = np.array(SQUARE, float), np.array(KINDS[kind], float)
    if turn & 1:
        clip = clip[::-1]
    if turn & 2:
        subject, clip = np.roll(subject, 1, axis=0) / 3.0, clip / 3.0
    for operation in OPERATIONS:
        assert agree([subject], [clip], operation)
        assert agree([clip], [subject], operation)
