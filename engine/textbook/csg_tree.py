"""Point in a CSG tree: the Boolean operation of the nodes is applied to the answers of the leaves.

Source: exercise 22.4-2 of the chapter on computer graphics in Algorithms of Informatics. A leaf is a function from
points (n, dim) to bools (n,); a node is (operation, first, second).
What goes wrong: two values cannot tell "on the surface", so the difference of a closed set keeps or loses its wall.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from engine.arrays import BoolArray, FloatArray

Leaf = Callable[[FloatArray], BoolArray]


def contains(points: FloatArray, tree: Leaf | tuple[str, Any, Any]) -> BoolArray:
    """Tell of each point whether the tree holds it; recursive, as deep as the tree."""
    if not isinstance(tree, tuple):
        return tree(points)
    operation, first, second = tree
    a, b = contains(points, first), contains(points, second)
    if operation == "union":
        return a | b
    if operation == "intersection":
        return a & b
    if operation == "difference":
        return a & ~b
    raise ValueError(f"operation must be union, intersection or difference, got {operation!r}")
