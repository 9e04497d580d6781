"""Bounds on the distances of one point from eight boxes of a tree, and from eight triangles of a block.

The point is given in tree coordinates (`bvh.py`); S >= 2 bounds its coordinates and those of the tree, u = 2^-24.

**Boxes.** The point is rounded (u S), subtracted from a centre (2 u S) and compared with a half width plus `margin`
(u S more): `margin` = 2^-21 S is greater. What is left out of the sum of squares exceeds its rounding.

**Triangles.** A corner is rounded (u S), so is the point (u S), so is their difference (2 u S): 4 u S a coordinate, 7 u
S in length. A point of an edge or of the triangle is a combination of the rounded corners with weights in [0, 1] that
sum up to at most 1, whose three products and sums round by less than 9 u S a coordinate, 16 u S in length; its length
takes 6 u S more. So the triangle has a point within `slack` = 32 u S of that length. For every direction p, however it
was found, all corners c have c . p / |p| >= their least, computed within 7 u S + 8 u S: the slab bounds the distance of
the triangle from below, and from a point that is nearly the nearest the two bounds nearly meet. What is no number,
where p is too short to have a direction, bounds by 0. What underflows is far below u.

**A distant point** at D > 1000 from the origin in the direction e: with a = e . x, a point x of the tree, |x|^2 <= 12,
is D - a + (|x|^2 - a^2) / 2 (D - a) + ... away, between D - a and D - a + `spread`, 6.1 / (D - 4). The linear a is
greatest at a corner, computed with the rounded direction within 40 u.

Source: C. Ericson, Real-Time Collision Detection, 2005, 5.1.5 (the closest point of a triangle).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.lanes.boxes import BOX_ROWS
from engine.lanes.faces import CORNER_ROWS
from engine.lanes.lanes import bits_of, dot, greater, least_of, lesser, load, mask_of, root, select, store
from engine.lanes.tracing import Lanes, Number, Rows, traced

MARGIN: Final = 2.0**-21
SLACK: Final = 2.0**-19
"""Over S: `margin` of boxes and `slack` of triangles."""
_UNUSED: Final = 1e20
"""Above all bounds but those of unused lanes (`bvh.py`)."""
_BELOW_ONE: Final = 1.0 - 2.0**-20


@traced
def boxes_within(
    boxes: Rows, node: int, x: Number, y: Number, z: Number, margin: Number, bounds: Rows, row: int
) -> int:
    """Write to row `row` of bounds lower bounds on the squared distances of the point (x, y, z) from the boxes of a
    node's children, enlarged by margin; return the children with the least one, as bits."""
    box = [load(boxes, BOX_ROWS * node + k) for k in range(BOX_ROWS)]
    gaps = [greater(abs(box[k] - at) - (box[3 + k] + margin), 0.0) for k, at in enumerate((x, y, z))]
    low = dot(gaps, gaps) * _BELOW_ONE
    store(bounds, row, low)
    return _least_lanes(low)


@traced
def boxes_toward(
    boxes: Rows, node: int, x: Number, y: Number, z: Number, margin: Number, bounds: Rows, row: int
) -> int:
    """Do the same as `boxes_within` for a point infinitely far away in the direction (x, y, z): the bounds are on each
    distance minus that from the origin."""
    box = [load(boxes, BOX_ROWS * node + k) for k in range(BOX_ROWS)]
    along, reach = dot((x, y, z), box[:3]), dot((abs(x), abs(y), abs(z)), box[3:])
    low = -(along + reach) - margin
    low = select(low <= np.inf, low, -np.inf)  # no number: 0 along an axis times an infinite width
    store(bounds, row, low)
    return _least_lanes(low)


@traced
def nearest_of(bounds: Rows, row: int, bits: int) -> int:
    """Return, as bits, those of the lanes `bits` of a row of bounds that have the least."""
    return _least_lanes(select(mask_of(bits), load(bounds, row), np.inf))


def _least_lanes(low: Lanes) -> int:
    return bits_of((low <= least_of(low)) & (low < _UNUSED))


@traced
def triangles_toward(
    blocks: Rows, node: int, x: Number, y: Number, z: Number, slack: Number, more: Number, most: Number, work: Rows
) -> int:
    """Bound the distances of the triangles of a block from a point infinitely far away in the direction (x, y, z), each
    minus its distance from the origin; result, most and work as in `triangle_bounds`. slack: error of a bound; more: by
    how much the upper bounds are larger."""
    corners = [[load(blocks, CORNER_ROWS * node + 3 * corner + k) for k in range(3)] for corner in range(3)]
    a, b, c = (dot((x, y, z), corner) for corner in corners)
    level = -greater(a, greater(b, c))
    return _write(level - slack, select(corners[0][0] < _UNUSED, level + slack + more, np.inf), most, work)


def _write(low: Lanes, high: Lanes, most: Number, work: Rows) -> int:
    """Write bounds on eight distances to work: the least of `high`, the upper ones, to row 0, `low`, the lower ones, to
    row 1; return the mask of the lanes that may have the least distance, and one of at most `most`."""
    least = least_of(high)
    store(work, 0, least)
    store(work, 1, low)
    return bits_of(~(low > lesser(least, most)))


def _nearest_of_edge(a: Sequence[Lanes], b: Sequence[Lanes]) -> list[Lanes]:
    """Return the point of the edge a b that is nearest to the origin."""
    u = [b[k] - a[k] for k in range(3)]
    t = lesser(greater(-dot(a, u) / dot(u, u), 0.0), 1.0)  # of an edge without length: 0
    return [a[k] + t * u[k] for k in range(3)]


@traced
def triangle_bounds(
    blocks: Rows, node: int, x: Number, y: Number, z: Number, slack: Number, most: Number, work: Rows
) -> int:
    """Return the mask of the triangles of a block that may be the nearest to a point and within `most`, unused lanes
    maybe among them; write an upper bound on the least distance to row 0 of work, and lower bounds to row 1."""
    a, b, c = (
        [load(blocks, CORNER_ROWS * node + 3 * corner + k) - at for k, at in enumerate((x, y, z))]
        for corner in range(3)
    )
    nearest = _nearest_of_edge(a, b)
    square = dot(nearest, nearest)
    for start, end in ((b, c), (c, a)):
        other = _nearest_of_edge(start, end)
        other_square = dot(other, other)
        is_nearer = other_square < square
        nearest = [select(is_nearer, other[k], nearest[k]) for k in range(3)]
        square = select(is_nearer, other_square, square)
    u, v = [b[k] - a[k] for k in range(3)], [c[k] - a[k] for k in range(3)]
    uu, uv, vv, au, av = dot(u, u), dot(u, v), dot(v, v), dot(a, u), dot(a, v)
    size = uu * vv - uv * uv
    s, t = (uv * av - vv * au) / size, (uv * au - uu * av) / size
    foot = [a[k] + s * u[k] + t * v[k] for k in range(3)]
    foot_square = dot(foot, foot)
    is_nearer = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (foot_square < square)
    p = [select(is_nearer, foot[k], nearest[k]) for k in range(3)]
    length = root(select(is_nearer, foot_square, square))
    least = lesser(dot(p, a), lesser(dot(p, b), dot(p, c))) / length
    return _write(greater(least - slack, 0.0), length + slack, most, work)
