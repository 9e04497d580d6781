"""Two triangles in the plane collide if an edge of one crosses an edge of the other, or one holds a vertex of it.

Source: exercise 22.4-5 of the chapter on computer graphics in Algorithms of Informatics, solved with the section's own
side test.
What goes wrong: triangles that touch in a point or along an edge get either answer where coordinates are not exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import inline, kernel


@inline
def side(a: Any, b: Any, p: Any) -> float:
    """Return > 0 where p is on the left of the line from a to b."""
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


@inline
def holds(triangle: Any, p: Any) -> bool:
    """Tell whether a triangle of either orientation holds p, its edges included."""
    s0, s1, s2 = (
        side(triangle[0], triangle[1], p),
        side(triangle[1], triangle[2], p),
        side(triangle[2], triangle[0], p),
    )
    return (s0 >= 0.0 and s1 >= 0.0 and s2 >= 0.0) or (s0 <= 0.0 and s1 <= 0.0 and s2 <= 0.0)


@inline
def edges_cross(a: Any, b: Any, c: Any, d: Any) -> bool:
    """Tell whether each of ab and cd has its ends on opposite sides of the other."""
    return side(a, b, c) * side(a, b, d) <= 0.0 and side(c, d, a) * side(c, d, b) <= 0.0


@inline
def pair_collides(first: Any, second: Any) -> bool:
    """Tell whether two triangles (3, 2) have a common point."""
    if holds(first, second[0]) or holds(second, first[0]):
        return True
    for i in range(3):
        for j in range(3):
            if edges_cross(first[i - 1], first[i], second[j - 1], second[j]):
                return True
    return False


@kernel
def collide(first: FloatArray, second: FloatArray) -> BoolArray:
    """Tell of each pair first[i], second[i], both (n, 3, 2), whether the closed triangles have a common point."""
    found = np.zeros(len(first), np.bool_)
    for i in range(len(first)):
        found[i] = pair_collides(first[i], second[i])
    return found
