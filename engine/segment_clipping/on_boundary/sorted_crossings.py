"""The crossings of a segment with a boundary, and their order along it."""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from engine.jit import allocating, inline

Crossings = namedtuple("Crossings", "t points faces order codes met")
"""Crossings of one segment, as many as there is room for: t, points and faces of each; codes, met: how it meets which
element, see contacts.py; order: of t."""


@allocating
def crossings_for(n: int, dimension: int) -> Crossings:
    """Return room for n contacts."""
    return Crossings(
        np.empty(n), np.empty((n, dimension)), np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64),
        np.empty(n, np.int64),
    )  # fmt: skip


@inline
def sort_crossings(cuts: Crossings, n: int) -> bool:
    """Set the order of the first n crossings by t; False where two are equal."""
    t, order = cuts.t, cuts.order
    for i in range(n):
        order[i] = i
    gap = n // 2
    while gap > 0:  # bound: gap is halved; Shell's sort, n^1.5 steps
        for i in range(gap, n):
            moved, j = order[i], i
            while j >= gap and t[order[j - gap]] > t[moved]:
                order[j] = order[j - gap]
                j -= gap
            order[j] = moved
        gap //= 2
    differ = True
    for i in range(1, n):
        differ &= t[order[i - 1]] != t[order[i]]
    return differ
