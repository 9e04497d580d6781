"""numba_celltree: its Cohen-Sutherland, compiled, called for each segment of the plane from a compiled loop."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba_celltree.algorithms.cohen_sutherland import cohen_sutherland_line_box_clip
from numba_celltree.constants import Box, Point

import engine
from benchmarks.contenders import NotApplicable, Prepared, pieces_of, rows_of

PACKAGE = "numba-celltree"
NAMES = {"": "numba_celltree"}


@numba.njit(nogil=True)
def _clip(segments: Any, low: Any, high: Any) -> tuple[Any, Any]:
    box = Box(low[0], high[0], low[1], high[1])
    clipped, remaining = np.empty_like(segments), np.zeros(len(segments), np.bool_)
    for i in range(len(segments)):
        p, q = Point(segments[i, 0, 0], segments[i, 0, 1]), Point(segments[i, 1, 0], segments[i, 1, 1])
        remaining[i], p, q = cohen_sutherland_line_box_clip(p, q, box)
        clipped[i, 0, 0], clipped[i, 0, 1], clipped[i, 1, 0], clipped[i, 1, 1] = p.x, p.y, q.x, q.y
    return clipped, remaining


def _segments(region: engine.Solid, threads: int) -> Prepared:
    if not isinstance(region, engine.Aabb):
        raise NotApplicable("boxes only")
    return Prepared(
        lambda segments: _clip(np.ascontiguousarray(segments, float), region.min, region.max),
        answer=lambda result: rows_of(*result),
    )


MAKERS = {"segments": _segments, "pieces": pieces_of(_segments)}
