"""Lower bounds on distances, eight at once: of eight children of a node and a child of another tree, of triangles.

The children are those of an inner node (`bvh.py`), boxes with flat cylinders (`discs.py`), the triangles those of a
block (`faces.py`); what they are held against is of another body. `frames` (`boxes.py`) take either tree to the other.
Distances are counted in the units of a tree: that of the eight children, for triangles that of the first body.

**Directions.** Along any direction the gap between two bodies, over the direction's length, is below their distance.
Boxes: the axes of either tree, whose gaps are put together. Discs, which hold a patch of surface far closer: the line
of their middles and either normal; along d a disc reaches |g| t + sqrt(1 - g^2) r from its middle, g the product of d
and its normal. Triangles: the line of their middles.

**margin.** Triangles: as derived in `faces.py`, margin |w|_1 along a direction w. Boxes are enlarged by the margin
where they are taken to the other tree, as in `boxes.py`. Discs: both sides of a comparison along a normal are off by
less than twice the margin (`discs.py`); along another direction g is off by no more for either of them. Four of both
margins are left out of each bound, and 2^-18 of it for what the last operations round and for rotations that are not
quite orthogonal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from engine.lanes.boxes import BOX_ROWS, MARGIN_ROW, SHIFT_ROW
from engine.lanes.discs import DISC_ROWS, ROUND
from engine.lanes.lanes import bits_of, dot, greater, lesser, load, load_lane, root, store
from engine.lanes.tracing import Lanes, Number, Rows, traced
from engine.lanes.triangles import CORNER_ROWS

FIXED_ROWS: Final = BOX_ROWS + DISC_ROWS
GAP_ROWS: Final = 12
"""Of work space: the corners of eight triangles, and three times their middles."""
_MIDDLES: Final = 9
_TINY: Final = 2.0**-120
_BELOW_ONE: Final = 1.0 - 2.0**-18
_MOST: Final = 2.0**60
"""A bound beyond, in the units of either tree, is told as this: squares of more overflow."""


def _sizes(v: Sequence[Lanes]) -> list[Lanes]:
    return [abs(x) for x in v]


def _gaps(v: Sequence[Lanes], reach: Sequence[Lanes]) -> Lanes:
    """Return the square of the vector of gaps between two boxes along three axes."""
    gaps = [greater(abs(x) - r, 0.0) for x, r in zip(v, reach)]
    return dot(gaps, gaps)


def _width(disc: Sequence[Lanes], cosine: Lanes) -> Lanes:
    """Return how far a disc, its radius and half thickness, reaches from its middle along a direction not longer than 1
    whose product with its normal is given."""
    radius, half = disc
    return abs(cosine) * half + root(greater((1.0 + ROUND) - cosine * cosine, ROUND)) * radius


@traced
def child_bounds(
    boxes: Rows, discs: Rows, node: int, fixed: Rows, frames: Rows, own: int, theirs: int, ratio: Number,
    inverse: Number, work: Rows,
) -> None:  # fmt: skip
    """Write lower bounds on the distances of the eight children of a node and what is fixed to the first row of work.

    fixed (FIXED_ROWS, 8): in its first column a box and a disc, in the tree of the other body. own, theirs: the rows of
    frames where the maps begin to the tree of the node and from it; ratio: the other tree's scale over this one's, and
    its inverse.
    """
    box, disc = (
        [load(rows, n * node + row) for row in range(n)] for rows, n in ((boxes, BOX_ROWS), (discs, DISC_ROWS))
    )
    other = [load_lane(fixed, row, 0) for row in range(FIXED_ROWS)]
    their_box, their_disc = other[:BOX_ROWS], other[BOX_ROWS:]
    margin, their_margin = load(frames, own + MARGIN_ROW), load(frames, theirs + MARGIN_ROW)
    v, w, reach, their_reach, d, normal = [], [], [], [], [], []
    for k in range(3):
        turn = [load(frames, own + 3 * k + column) for column in range(3)]
        back = [load(frames, theirs + 3 * k + column) for column in range(3)]
        shift = load(frames, own + SHIFT_ROW + k)
        v.append(dot(turn, their_box[:3]) + shift - box[k])
        reach.append(dot(_sizes(turn), their_box[3:]) + margin + box[3 + k])
        w.append(dot(back, box[:3]) + load(frames, theirs + SHIFT_ROW + k) - their_box[k])
        their_reach.append(dot(_sizes(back), box[3:]) + their_margin + their_box[3 + k])
        d.append(dot(turn, their_disc[:3]) + shift - disc[k])
        normal.append(dot(turn, their_disc[3:6]) * inverse)
    flat, their_flat = disc[6:], [number * ratio for number in their_disc[6:]]
    size, g = root(dot(d, d)), dot(disc[3:6], normal)
    on_own, on_their = dot(disc[3:6], d), dot(normal, d)
    bound = greater(root(_gaps(v, reach)), ratio * lesser(root(_gaps(w, their_reach)), _MOST))
    for level, cosine, their_cosine in (
        (size, on_own / greater(size, _TINY), on_their / greater(size, _TINY)),
        (abs(on_own) - flat[1], None, g),
        (abs(on_their) - their_flat[1], g, None),
    ):
        level = level if cosine is None else level - _width(flat, cosine)
        bound = greater(level if their_cosine is None else level - _width(their_flat, their_cosine), bound)
    bound = greater(bound * _BELOW_ONE - (margin + ratio * their_margin) * 4.0, 0.0)  # what is no number is 0
    store(work, 0, lesser(bound, _MOST))


def _ends(way: Sequence[Lanes], corners: Sequence[Lanes]) -> tuple[Lanes, Lanes]:
    """Return the least and the greatest product of a direction with three corners."""
    p, q, r = (dot(way, corners[3 * k : 3 * k + 3]) for k in range(3))
    return lesser(p, lesser(q, r)), greater(p, greater(q, r))


@traced
def place_triangles(blocks: Rows, node: int, frames: Rows, work: Rows) -> None:
    """Write the triangles of a block of the second body, in the tree of the first, to work."""
    own, corners = [load(blocks, CORNER_ROWS * node + row) for row in range(CORNER_ROWS)], []
    for corner in range(3):
        for k in range(3):
            turn = [load(frames, 3 * k + column) for column in range(3)]
            corners.append(dot(turn, own[3 * corner : 3 * corner + 3]) + load(frames, SHIFT_ROW + k))
            store(work, 3 * corner + k, corners[-1])
    for k in range(3):
        store(work, _MIDDLES + k, corners[k] + corners[3 + k] + corners[6 + k])


@traced
def near_triangle(blocks: Rows, node: int, lane: int, frames: Rows, most: Number, work: Rows) -> int:
    """Return the triangles in work, a bit each, that may be as near as `most` to one in a lane of a block; lanes that
    are not used count as near."""
    own = [load_lane(blocks, CORNER_ROWS * node + row, lane) for row in range(CORNER_ROWS)]
    theirs, margin = [load(work, row) for row in range(CORNER_ROWS)], load(frames, MARGIN_ROW)
    d = [load(work, _MIDDLES + k) - (own[k] + own[3 + k] + own[6 + k]) for k in range(3)]
    x, y, z = _sizes(d)
    gap = _ends(d, theirs)[0] - _ends(d, own)[1] - margin * (x + y + z)
    return bits_of(~(gap * _BELOW_ONE > most * root(dot(d, d)) + _TINY))
