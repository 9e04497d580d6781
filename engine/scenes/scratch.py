"""Room for the work on one segment at a time in a scene, kept by each thread: one array, whose parts have names."""

from __future__ import annotations

import threading
from collections import namedtuple
from typing import Final

import numpy as np

from engine.arrays import IntArray
from engine.bounding.bvh import STACK, WIDTH
from engine.compiling.jit import merged
from engine.lanes.addresses import array_at
from engine.segment_clipping.on_boundary.boundary_cut import Crossings
from engine.segment_clipping.pieces import Pieces

MOST_MET: Final = 512
"""Triangles that a segment crosses; with more it is UNDECIDED."""

_here: Final = threading.local()
_MOST_KEPT: Final = 1 << 14
"""Bodies of a scene whose room is kept: some 800 kB a thread."""

Scratch = namedtuple("Scratch", "stack cuts room waiting keys entered best found depths near")
"""Room for the work on one segment. stack: of one body, cuts: its `Crossings`, room: its pieces, the
last row for the first of them all. waiting, keys: nodes and bodies to be asked, and where they are entered; entered
(1, 8), of one node. best: where the first piece begins; found: the body it lies in, and whether another may begin there
too. depths: how many nodes and bodies of a tree wait, and how many of those without a place in it. near: bodies."""
_SIZES: Final = (
    STACK // 2, MOST_MET, MOST_MET, 3 * MOST_MET, MOST_MET, MOST_MET, MOST_MET + 1, 6 * MOST_MET + 6, 2 * MOST_MET + 2,
    2 * MOST_MET + 2, STACK // 2, STACK // 2, WIDTH // 2, 1, 2, 2, MOST_MET,
)  # fmt: skip
"""Words of the arrays of a `Scratch`, in order, but for `near`."""
_AT: Final = tuple(8 * (2 + sum(_SIZES[:k])) for k in range(len(_SIZES) + 1))
"""Where these begin, in bytes."""


def scratch_for(n_bodies: int) -> IntArray:
    """Return room for the work on one segment at a time (`scratch_at`); each thread keeps its own."""
    found: IntArray | None = getattr(_here, "scratch", None)
    if found is None or found[1] <= n_bodies:
        found = np.empty(_AT[-1] // 8 + n_bodies + 1, np.int64)
        found[:2] = found.ctypes.data, n_bodies + 1
        if n_bodies <= _MOST_KEPT:
            _here.scratch = found
    return found


@merged
def scratch_at(words: IntArray) -> Scratch:
    """Return the arrays that `scratch_for` has room for."""
    at, m = words[0], MOST_MET
    cuts = Crossings(
        array_at(at + _AT[2], (m,), np.float64), array_at(at + _AT[3], (m, 3), np.float64),
        array_at(at + _AT[4], (m,), np.int64), array_at(at + _AT[5], (m,), np.int64),
        array_at(at + _AT[16], (m,), np.int64), array_at(at + _AT[1], (m,), np.int64),
    )  # fmt: skip
    room = Pieces(
        array_at(at + _AT[6], (m + 1,), np.int64), array_at(at + _AT[7], (2, m + 1, 3), np.float64),
        array_at(at + _AT[8], (m + 1, 2), np.float64), array_at(at + _AT[9], (m + 1, 2), np.int64),
    )  # fmt: skip
    return Scratch(
        array_at(at + _AT[0], (STACK,), np.int32), cuts, room,
        array_at(at + _AT[10], (STACK,), np.int32), array_at(at + _AT[11], (STACK,), np.float32),
        array_at(at + _AT[12], (1, WIDTH), np.float32), array_at(at + _AT[13], (1,), np.float64),
        array_at(at + _AT[14], (2,), np.int64), array_at(at + _AT[15], (2,), np.int64),
        array_at(at + _AT[17], (words[1],), np.int64),
    )  # fmt: skip
