"""Axis-aligned boxes without poses: comparisons of their bounds, exact as they stand."""

from __future__ import annotations

from typing import Any

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING
from engine.jit import inline, kernel


def relate_boxes(low: Any, high: Any, i: int, j: int) -> int:
    """Return the relation of box i to box j, closed boxes (n, d) of any dimension, flat ones too."""
    meet = solid = i_within = j_within = interiors = True
    for axis in range(low.shape[1]):
        a0, a1, b0, b1 = low[i, axis], high[i, axis], low[j, axis], high[j, axis]
        meet &= a0 <= b1 and b0 <= a1
        i_within &= b0 < a0 and a1 < b1
        j_within &= a0 < b0 and b1 < a1
        solid &= a0 < a1 and b0 < b1
        interiors &= a0 < b1 and b0 < a1
    if not meet:
        return DISJOINT
    if i_within:
        return FIRST_INSIDE_SECOND
    if j_within:
        return SECOND_INSIDE_FIRST
    return OVERLAPPING if solid and interiors else TOUCHING


_relate = inline(relate_boxes)


@kernel
def relate_box_pairs(low: Any, high: Any, is_box: Any, pairs: Any, relations: Any) -> None:
    """Fill relations (n,) int8 for the pairs (n, 2) of which both are boxes without pose."""
    for item in range(pairs.shape[0]):
        i, j = pairs[item, 0], pairs[item, 1]
        if is_box[i] and is_box[j]:
            relations[item] = _relate(low, high, i, j)
