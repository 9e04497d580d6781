"""Gaps of a coverage: holes of a union that no feature has as a hole of its own.

A lake that one feature leaves out is a hole of that feature. What several features enclose is a gap between them,
whatever its size: no tolerance tells a lake between parcels from a digitizing error, so gaps are reported with their
places, and refused on request.
"""

from __future__ import annotations

import numpy as np

from engine.errors import InvalidInputError
from engine.polygon_overlay.pair_arrays import PolygonArrays
from engine.polygon_overlay.result import Overlay
from engine.predicates.rational import orient2d_rational
from engine.running.budget import note, polled
from engine.solids.checks import shown

_MOST_SHOWN = 10

Place = tuple[float, float]


def check_gaps(gaps: object, coverage: bool, grid: float | None) -> None:
    """Raise unless `gaps` is keep, or refuse for a coverage without a grid."""
    if not isinstance(gaps, str) or gaps not in ("keep", "refuse"):
        raise InvalidInputError(f"gaps must be keep or refuse, got {shown(gaps)}", ("gaps",))
    if gaps == "refuse" and (not coverage or grid is not None):
        raise InvalidInputError(
            "gaps are refused of a coverage without a grid: set coverage, leave grid out", ("gaps",)
        )


def gaps_of(union: Overlay, polygons: PolygonArrays) -> list[Place]:
    """Return the lexicographically first vertex of each gap in the union of polygons that do not overlap."""
    is_hole = np.ones(len(union.ring_offsets) - 1, np.bool_)
    is_hole[union.piece_offsets[:-1]] = False
    holes = [_corners(union.rings[k].tolist()) for k in np.flatnonzero(is_hole).tolist()]
    if not holes:
        return []
    firsts = {hole[0] for hole in holes}
    starts = polygons.ring_offsets[:-1]
    filled = np.flatnonzero(np.diff(polygons.ring_offsets))
    least = np.minimum.reduceat(polygons.vertices[:, 0], starts[filled])
    known = set()
    lefts = {x for x, _ in firsts}
    for ring, x in zip(filled.tolist(), polled(least.tolist())):
        if x in lefts:
            known.add(_corners(polygons.vertices[slice(*polygons.ring_offsets[ring : ring + 2])].tolist()))
    return [hole[0] for hole in holes if hole not in known]


def _corners(ring: list[list[float]]) -> tuple[Place, ...]:
    """Return the corners of a simple ring (vertices where it turns), from the lexicographically first on, in the
    direction of the lower of its neighbours: equal for rings of one shape, however they are written."""
    places = [(x + 0.0, y + 0.0) for x, y in ring]
    n = len(places)
    turns = [p for k, p in enumerate(places) if orient2d_rational(places[k - 1], p, places[(k + 1) % n]) != 0]
    first = turns.index(min(turns)) if turns else 0
    turns = turns[first:] + turns[:first]
    return tuple(turns if turns[1:2] < turns[-1:] else turns[:1] + turns[:0:-1])


def report_gaps(places: list[Place], is_refused: bool) -> None:
    """Tell the places of gaps, or refuse them."""
    if not places:
        return
    some = ", ".join(f"({x!r}, {y!r})" for x, y in places[:_MOST_SHOWN]) + ", ..." * (len(places) > _MOST_SHOWN)
    if is_refused:
        raise InvalidInputError(f"coverage: features enclose a gap at {some}; close it, or keep gaps", ("coverage",))
    note(f"coverage: {len(places)} gaps, which several features enclose and none has as a hole: at {some}")
