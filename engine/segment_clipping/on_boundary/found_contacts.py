"""The contacts of segments with a boundary, for arithmetic in Python."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import FlagArray, FloatArray, IntArray
from engine.budget import Budget
from engine.direct import entry_of
from engine.segment_clipping.on_boundary.contacts import NO_ROOM, find_contacts_2d
from engine.segment_clipping.on_boundary.mesh_streams import find_mesh_contacts
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline

_LEAST_ROOM: Final = 1 << 8
"""Contacts looked for at once, beside a few for each segment; doubled where there are more."""
_EACH: Final = 8


def contacts_with(
    segments: FloatArray, boundary: Outline | Mesh, budget: Budget
) -> tuple[IntArray, FlagArray, IntArray]:
    """Return the elements that segments (n, 2, dim) may meet, GROUP at most, and how; offsets (n + 1,) of each."""
    kernel: Any = find_mesh_contacts if isinstance(boundary, Mesh) else find_contacts_2d
    room, found = _LEAST_ROOM + _EACH * len(segments), NO_ROOM
    met, kinds, offsets = np.zeros(0, np.int64), np.zeros(0, np.uint8), np.zeros(0, np.int64)
    while found == NO_ROOM:  # bound: room is doubled, and a segment meets an element once
        found, met, kinds, offsets = entry_of(kernel)(segments, boundary, budget.flag, room)
        budget.check()
        room *= 2
    return met[:found], kinds[:found], offsets[: len(segments) + 1]
