"""Whether segments are further apart than a margin, in floating point: the margins of clearance.py hold its errors."""

from __future__ import annotations

from typing import Any

from engine.jit import called, merged


@merged
def is_far(px: float, py: float, ax: float, ay: float, bx: float, by: float, square: float) -> bool:
    """Tell whether p is further from the segment ab than the root of ``square``."""
    dx, dy, ex, ey = bx - ax, by - ay, px - ax, py - ay
    along, length = ex * dx + ey * dy, dx * dx + dy * dy
    if along <= 0.0:
        return ex * ex + ey * ey > square
    if along >= length:
        ex, ey = px - bx, py - by
        return ex * ex + ey * ey > square
    across = dx * ey - dy * ex
    return across * across > square * length


@merged
def _is_beside(x: Any, y: Any, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Tell whether c and d are on one side of the line ab, further from it than the root of ``square``."""
    dx, dy = x[b] - x[a], y[b] - y[a]
    side_c, side_d = dx * (y[c] - y[a]) - dy * (x[c] - x[a]), dx * (y[d] - y[a]) - dy * (x[d] - x[a])
    nearest = min(abs(side_c), abs(side_d))
    return ((side_c > 0.0) == (side_d > 0.0)) & (nearest * nearest > square * (dx * dx + dy * dy))


@merged
def _crosses(x: Any, y: Any, a: int, b: int, c: int, d: int) -> bool:
    """Tell whether c and d are on two sides of ab, and a and b on two sides of cd, in floating point."""
    dx, dy = x[b] - x[a], y[b] - y[a]
    side_c, side_d = dx * (y[c] - y[a]) - dy * (x[c] - x[a]), dx * (y[d] - y[a]) - dy * (x[d] - x[a])
    if (side_c > 0.0) == (side_d > 0.0):
        return False
    dx, dy = x[d] - x[c], y[d] - y[c]
    side_a, side_b = dx * (y[a] - y[c]) - dy * (x[a] - x[c]), dx * (y[b] - y[c]) - dy * (x[b] - x[c])
    return (side_a > 0.0) != (side_b > 0.0)


@called
def segments_are_far(x: Any, y: Any, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Tell whether the segments ab and cd are further apart than the root of ``square``."""
    if _is_beside(x, y, a, b, c, d, square) or _is_beside(x, y, c, d, a, b, square):
        return True
    return (
        is_far(x[b], y[b], x[c], y[c], x[d], y[d], square)
        and is_far(x[d], y[d], x[a], y[a], x[b], y[b], square)
        and is_far(x[a], y[a], x[c], y[c], x[d], y[d], square)
        and is_far(x[c], y[c], x[a], y[a], x[b], y[b], square)
        and not _crosses(x, y, a, b, c, d)
    )
