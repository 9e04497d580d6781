"""The axis of a segment, and whether two elements that it touches are touched in one point (contacts.py)."""

from __future__ import annotations

from typing import Any

from engine.jit import inline, merged
from engine.segment_clipping.on_boundary.contacts import END, START, place_of


@merged
def axis_of(segments: Any, item: int) -> int:
    """Return the axis along which a segment is longest."""
    best = 0
    for k in range(1, segments.shape[2]):
        length = abs(segments[item, 1, k] - segments[item, 0, k])
        if length > abs(segments[item, 1, best] - segments[item, 0, best]):
            best = k
    return best


@inline
def are_one(elements: Any, first: int, code: int, second: int, other: int) -> bool:
    """Tell whether what two codes say of two elements is one point: an end, or a corner or one side of both."""
    n, m = place_of(code), place_of(other)
    if n >= START or m >= START:
        return n == m and n <= END
    if (n < 3) != (m < 3):
        return False
    if n < 3:
        return _are_equal(elements, first, n, second, m)
    a, b, c, d = n - 3, (n - 2) % 3, m - 3, (m - 2) % 3
    return (_are_equal(elements, first, a, second, c) and _are_equal(elements, first, b, second, d)) or (
        _are_equal(elements, first, a, second, d) and _are_equal(elements, first, b, second, c)
    )


@inline
def _are_equal(elements: Any, first: int, place: int, second: int, other: int) -> bool:
    """Tell whether a corner of one element is one of another."""
    are_equal = True
    for k in range(elements.shape[2]):
        are_equal &= elements[first, place, k] == elements[second, other, k]
    return are_equal
