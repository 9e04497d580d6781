"""Rings of several lengths: how long each is, told by the brackets and commas of their text alone.

A point of two numbers is ``[,]`` there. With a dot for each, rings read ``[[.,.,.],[.,.,.,.]]``, and polygons are lists
of such. Nothing is looked at point by point: two rings of one length have one text.
"""

from __future__ import annotations

from typing import Any, Final

COST: Final = 300
"""Bytes that the arrays of a ring take beside its numbers."""


class Unfit(Exception):
    """The text, or an array in it, is none that is taken here."""


def lengths_of(tokens: bytes, depth: int) -> tuple[int, list[list[int]]]:
    """Return the dimension of the points, and the lengths of the rings by polygon.

    tokens: brackets and commas of a list of rings (depth 3: one polygon) or of polygons (depth 4).
    Raises: Unfit for anything else.

    >>> lengths_of(b"[[[,],[,]],[[,],[,],[,]]]", 3)
    (2, [[2, 3]])
    >>> lengths_of(b"[[[[,,]],[[,,]]],[[[,,],[,,]]]]", 4)
    (3, [[1, 1], [2]])
    """
    dimension = tokens.find(b"]") - depth + 1
    if dimension not in (2, 3):
        raise Unfit
    dotted = tokens.replace(b"[%b]" % (b"," * (dimension - 1)), b".")
    level = depth - 1
    if not dotted.startswith(b"[" * level + b".") or not dotted.endswith(b"." + b"]" * level):
        raise Unfit
    polygons = dotted[level:-level].split(b"]],[[") if depth == 4 else [dotted[level:-level]]
    rings = [polygon.split(b"],[") for polygon in polygons]
    if not all(ring == b",".join([b"."] * len(ring[::2])) for ring in set().union(*rings)):
        raise Unfit
    return dimension, [[len(ring[::2]) for ring in polygon] for polygon in rings]


def cut(rows: Any, groups: list[list[int]], depth: int) -> list[Any]:
    """Return the rings, views of `rows`; at depth 4 a list of them for each polygon."""
    found, start = [], 0
    for lengths in groups:
        rings = []
        for length in lengths:
            rings.append(rows[start : start + length])
            start += length
        found.append(rings)
    return found if depth == 4 else [ring for rings in found for ring in rings]
