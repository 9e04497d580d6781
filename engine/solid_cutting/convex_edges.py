"""Compiled: what two convex bodies have in common, from the parts of their edges, where no corner is on a plane.

The boundary of the common part has three kinds of edges: parts of the edges of either body that are in the other
(Cyrus-Beck), and segments in which a face of one crosses a face of the other. These end where an edge of either passes
through the face. With p and q the ends of a part on a face f, counter-clockwise about f, and k the axis on which its
normal is largest,

    S = sum over all parts on f of (p x q)_k        twice the area of what is left of f, seen along k

so parts are added as they come, in no order. An edge that leaves the other body through face g, in the direction of
face f, is where the segment of f and g begins on f; that of g and f ends there on g.

**Bounds.** Parameters t along an edge are v / (v - w), v and w being values at its ends: in doubles off by their error
over |v - w| and 2^-50, by which the first and the last plane must be told apart; in double-doubles by e / |v - w| and
32 u^2. A crossing is off by the length of the edge times that, eta, and 16 u^2 D; p x q by 2 D of both errors and
16 u^2 D^2, and sums of n parts by 8 n u^2 D^2 each.

Source: M. Cyrus, J. Beck, Generalized two- and three-dimensional clipping, 1978; C. F. Gauss's theorem.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.compiling.jit import called, inline
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_sub
from engine.solid_cutting.convex_bodies import ROUGH, SLACK, STEEPEST, Body, add_cone, difference, value_at
from engine.types import FloatArray

SPOT: Final = 7
"""Numbers of a corner or crossing: as placed, then the bound on its error."""
OPEN, FOUND, APART = 0, 1, 2

Parts = namedtuple("Parts", "spots segments areas")
"""Scratch of a pair.

| field | contents |
| --- | --- |
| spots (.., SPOT) | corners of the first body, of the second, crossings |
| segments (.., .., 2) | for a face of the first and one of the second body: where their segment begins, as the first
face runs, and ends; -1 for none |
| areas (2, .., 3) | for each face S, high and low, and its error |
"""


@inline
def _add_part(
    spots: FloatArray, p: int, q: int, plane: FloatArray, area: FloatArray, rounded: float, reach: float
) -> None:
    """Add (p x q)_k of spots p and q to the area of a face. rounded: bound on its rounding; reach: 2 D."""
    axis = int(plane[STEEPEST])
    i, j = (axis + 1) % 3, (axis + 2) % 3
    h, low = dd_mul(spots[p, i], spots[p, i + 3], spots[q, j], spots[q, j + 3])
    th, tl = dd_mul(spots[p, j], spots[p, j + 3], spots[q, i], spots[q, i + 3])
    h, low = dd_sub(h, low, th, tl)
    area[0], area[1] = dd_add(area[0], area[1], h, low)
    area[2] += rounded + reach * (spots[p, 6] + spots[q, 6])


@called
def _set_crossing(body: Body, plane: FloatArray, a: int, b: int, eta: float, span: float, spot: FloatArray) -> None:
    """Fill a spot with the point where the edge of corners a and b passes through a plane of the other body."""
    h, low = value_at(plane, body.placed, a)
    th, tl = value_at(plane, body.placed, b)
    th, tl = dd_sub(h, low, th, tl)
    off = 1.01 * plane[SLACK] / abs(th) + 32.0 * U2
    h, low = dd_div(h, low, th, tl)
    spot[6] = eta + 16.0 * U2 * span
    for axis in range(3):
        dh, dl = difference(body.placed, b, a, axis)
        spot[6] = max(spot[6], eta + 16.0 * U2 * span + abs(dh) * off)
        dh, dl = dd_mul(dh, dl, h, low)
        spot[axis], spot[axis + 3] = dd_add(body.placed[a, axis], body.placed[a, axis + 3], dh, dl)


@called
def _part_of_edge(own: Body, other: Body, a: int, b: int) -> tuple[int, int, int]:
    """Return APART if the edge from corner a to b is outside the other body, OPEN if that is not certain, else FOUND;
    and the planes through which it enters and leaves, -1 for none."""
    starts, ends = own.sides[a], own.sides[b]
    enters, leaves, enter, leave = 0.0, 1.0, -1, -1
    enter_off = leave_off = before = 0.0
    after, n_outside = 1.0, 0
    for item in range(other.planes.shape[0]):  # no branch: not to be predicted
        n_outside += int(starts[item] < 0.0) & int(ends[item] < 0.0)
    if n_outside > 0:
        return APART, -1, -1
    for item in range(other.planes.shape[0]):
        v, w = starts[item], ends[item]
        if v > 0.0 and w > 0.0:
            continue
        t, off = v / (v - w), 1.01 * other.planes[item, ROUGH] / abs(v - w) + 2.0**-50
        if v < 0.0:
            if t > enters or enter < 0:
                before = max(before, enters + enter_off) if enter >= 0 else before
                enters, enter_off, enter = t, off, item
            else:
                before = max(before, t + off)
        elif t < leaves or leave < 0:
            after = min(after, leaves - leave_off) if leave >= 0 else after
            leaves, leave_off, leave = t, off, item
        else:
            after = min(after, t - off)
    if enter >= 0 and leave >= 0 and enters - enter_off > leaves + leave_off:
        return APART, -1, -1
    is_sure = enter < 0 or leave < 0 or enters + enter_off < leaves - leave_off
    is_sure = is_sure and (enter < 0 or before == 0.0 or before < enters - enter_off)
    is_sure = is_sure and (leave < 0 or after == 1.0 or after > leaves + leave_off)
    return FOUND if is_sure else OPEN, enter, leave


@called
def _add_edges(
    own: Body, other: Body, is_first: bool, numbers: tuple[float, float, float], n_spots: int, parts: Parts
) -> int:
    """Add the parts of the edges of `own` that are in the other body to the areas of its faces, and their ends to spots
    and segments; return the number of spots, -1 if something is not certain. numbers: eta, D and the bound on the
    rounding of a part; n_spots: so many spots are filled."""
    (eta, span, rounded), spots, segments = numbers, parts.spots, parts.segments
    first, way = (0, 0) if is_first else (other.placed.shape[0], 1)
    for face in range(own.planes.shape[0]):
        for place in range(own.rings[face], own.rings[face + 1]):
            a, b = own.corners[place], own.corners[place + 1 if place + 1 < own.rings[face + 1] else own.rings[face]]
            if b < a:
                continue
            found, enter, leave = _part_of_edge(own, other, a, b)
            if found == OPEN:
                return -1
            if found == APART:
                continue
            start, end, twin = first + a, first + b, own.twins[place]
            for k in range(2):
                plane = leave if k == 1 else enter
                if plane < 0:
                    continue
                _set_crossing(own, other.planes[plane], a, b, eta, span, spots[n_spots])
                start, end = n_spots if k == 0 else start, n_spots if k == 1 else end
                # where it enters, the segment of `face` ends and that of its twin begins; the other body's run back
                for side in range(2):
                    one, place_in = face if side == 0 else twin, k if (side == 1) == is_first else 1 - k
                    slot = segments[one, plane] if is_first else segments[plane, one]
                    if slot[place_in] >= 0:
                        return -1
                    slot[place_in] = n_spots
                n_spots += 1
            _add_part(spots, start, end, own.planes[face], parts.areas[way, face], rounded, 2.02 * span)
            _add_part(spots, end, start, own.planes[twin], parts.areas[way, twin], rounded, 2.02 * span)
    return n_spots


@called
def add_common(own: Body, other: Body, eta: float, span: float, parts: Parts, sums: FloatArray) -> int:
    """Add six times the common volume of two bodies to sums[0:3], a double-double and a bound; return FOUND, APART if
    there is none, OPEN if something is not certain. Caller guarantees that no corner is on a plane. eta, span: as for
    `set_planes`."""
    n, m, n_faces, n_others = own.placed.shape[0], other.placed.shape[0], own.planes.shape[0], other.planes.shape[0]
    spots, segments, areas = parts.spots, parts.segments, parts.areas
    for k in range(n + m):
        for axis in range(6):
            spots[k, axis] = own.placed[k, axis] if k < n else other.placed[k - n, axis]
        spots[k, 6] = eta
    for face in range(n_faces):
        for item in range(n_others):
            segments[face, item, 0] = segments[face, item, 1] = -1
    for face in range(max(n_faces, n_others)):
        for k in range(3):
            areas[0, face, k] = areas[1, face, k] = 0.0
    n_sides = own.rings[n_faces] - own.rings[0] + other.rings[n_others] - other.rings[0]
    rounded = (16.0 + 8.0 * n_sides) * U2 * span * span
    n_spots = _add_edges(own, other, True, (eta, span, rounded), n + m, parts)
    n_spots = _add_edges(other, own, False, (eta, span, rounded), n_spots, parts) if n_spots >= 0 else -1
    if n_spots < 0:
        return OPEN
    for face in range(n_faces):
        for item in range(n_others):
            start, end = segments[face, item, 0], segments[face, item, 1]
            if (start < 0) != (end < 0):
                return OPEN
            if start >= 0:
                _add_part(spots, start, end, own.planes[face], areas[0, face], rounded, 2.02 * span)
                _add_part(spots, end, start, other.planes[item], areas[1, item], rounded, 2.02 * span)
    share, result = 32.0 * (n_faces + n_others) * U2, APART
    for k in range(2):
        body = own if k == 0 else other
        for face in range(body.planes.shape[0]):
            area = areas[k, face]
            if area[2] > 0.0:
                add_cone(body.planes[face], area[0], area[1], area[2], share, sums, 0)
                result = FOUND
    return result
