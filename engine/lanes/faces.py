"""Tests eight triangles at once, one a lane: against eight triangles of another body, a segment, or a point.

**Pairs.** Which pairs of triangles of two blocks may meet.

A block (9, 8) float32 holds the corners of up to eight triangles, px py pz qx ... rz, in the coordinates of their tree
(`bvh.py`); lanes without one hold `NOWHERE`. Each block is taken to the tree of the other by `frames` (`boxes.py`),
and a pair is apart if one of eight directions separates it: the axes of either tree (`meet_boxes`), and the normals of
the two planes (`set_normals`, `unseparated_faces`). That saves most of the exact signs: surfaces near each other are
locally parallel, and the planes of their triangles separate them.

**margin.** A direction w, however it was rounded, separates two triangles where the numbers w . x of their corners do;
so only the corners and the products have errors. In the tree of w a corner is off on axis k by at most a quarter of its
margin m_k (placement.py: the sums there are those of `boxes.meeting`, with room to spare), a product w . x by 2^-22 sum
|w_k| |x_k|, which is below a quarter of sum |w_k| m_k; both bodies together: sum |w_k| m_k. What underflows is below
`_TINY`. Normals are taken from a tree's own coordinates, at most 2, so nothing overflows where the other tree is large.

**A segment.** Which of a block's triangles a segment may meet.

Seen along the segment, from its middle m, a triangle that the segment meets covers the origin. With k the longest axis
of the half e, i and j the others, and r = e_i / e_k, s = e_j / e_k,

    x = (v_i - m_i) - r (v_k - m_k)          y = (v_j - m_j) - s (v_k - m_k)          for each corner v.

The origin is outside where two edges a b, b c have x_a y_b - y_a x_b of different signs, and the segment ends before
the triangle where all v_k - m_k are beyond |e_k| to one side.

**The bound.** Let u = 2^-24 and S + 2 bound all coordinates (`local_segment`). Where a segment and a triangle meet,
the common point z lies within 2 u (S + 2) of m + t e on each axis, so its x within 4 u (S + 2), and 1 u more for the
rounding of r; a corner is rounded, which moves x by 2 u (S + 2), and x is computed within 10 u (S + 2). So a point
within 17 u (S + 2) of the origin lies in the triangle of the computed corners, and the sign of an edge is what it is
there where it exceeds 17 u (S + 2) times the edge's length in |x| + |y|, and 8.4 u (S + 2) times the corners' for its
own rounding. `slack` = 32 u (S + 2) times the sum of |x| + |y| of all corners is more than both. Products that
underflow are far below: no sign exceeds the bound unless that sum exceeds 2^-18.

What is no number separates nothing.

**Over a point**, seen from above, in single precision, with a band.
A block is (8, 8) float32, a triangle to a lane: x and y of its three corners less the block's centre, the band, and its
growth with the blur b of the point. Let R >= 2^-50 bound the corners and the point about the centre, u = 2^-24, and
S = 2 R + b: no difference of corner and point is larger. It is off by 2 u S at most (each rounded once, and their
difference), a product of two by 5 u S^2, and orient2d by 12 u S^2, below 108 u max(R, b)^2 < 2^-17 (R^2 + b^2); what
underflows is far below 2^-117. The blur itself moves it by 4 R b, so the growth is 8 R.

Source: T. Moller, B. Trumbore, Fast, minimum storage ray/triangle intersection, 1997; the shear is that of S. Woop,
C. Benthin, I. Wald, Watertight ray/triangle intersection, 2013. Changed: conservative, exact signs decide behind it.

**Distances.** Lower bounds of eight distances: of a node's children to a child of another tree, and of triangles.

The children are those of an inner node (`bvh.py`), boxes with flat cylinders (`boxes.py`), the triangles those of a
block (`faces.py`), against one of another body. `frames` (`boxes.py`) take either tree to the other.
Distances are counted in the units of a tree: that of the eight children, for triangles that of the first body.

**Directions.** Along any direction the gap between two bodies, over the direction's length, is below their distance.
Boxes: the axes of either tree, whose gaps are put together. Discs, which hold a patch of surface far closer: the line
of their middles and either normal; along d a disc reaches |g| t + sqrt(1 - g^2) r from its middle, g the product of d
and its normal. Triangles: the line of their middles.

**margin.** Triangles: as derived above, sum |w_k| m_k along a direction w. Boxes are enlarged by the margins where they
are taken to the other tree, as in `boxes.py`. Discs: both sides of a comparison along a normal are off by less than
twice the margin (`boxes.py`); along another direction g is off by no more for either of them; four of both margins are
left out. 2^-18 of each bound is left out for what the last operations round and for rotations that are not quite
orthogonal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from engine.compiling.jit import inline
from engine.lanes.boxes import (
    BOX_ROWS,
    DISC_ROWS,
    FRAME_ROWS,
    MARGIN_ROW,
    MARGINS_ROW,
    ROUND,
    SHIFT_ROW,
    Bounds,
    are_separated,
)
from engine.lanes.lanes import (
    any_above,
    bits_of,
    bytes_of,
    dot,
    filter_pairs,
    greater,
    lane_of,
    lesser,
    load,
    load_lane,
    root,
    store,
)
from engine.lanes.tracing import LANES, Lanes, Number, Rows, Triple, traced
from engine.types import Float32Array

CORNER_ROWS: Final = 9
"""Numbers of a triangle: ax ay az bx by bz cx cy cz."""
AXES_BEFORE: Final = (1, 2, 0, 1, 2)
"""The other two axes of axis k: AXES_BEFORE[k], AXES_BEFORE[k + 1]."""


@inline
def longest_axis(half: tuple[float, ...]) -> int:
    """Return the axis (0, 1, 2) of the largest component of a vector."""
    x, y, z = abs(half[0]), abs(half[1]), abs(half[2])
    if x >= y and x >= z:
        return 0
    return 1 if y >= z else 2


@traced
def near_triangles(
    corners: Rows, node: int, i: int, j: int, k: int, middle: Triple, r: Number, s: Number, reach: Number, slack: Number
) -> int:
    """Return the mask of a block's lanes (block number `node`) whose triangles a segment may meet. All numbers are
    float32. k: axis of the largest component of e, half the segment; i, j: the other two. middle: of the segment, on
    the axes i, j, k. r, s: e_i / e_k, e_j / e_k. reach: |e_k| + slack, slack as derived above."""

    def away(axis: int, place: int) -> Any:
        return [load(corners, CORNER_ROWS * node + axis + 3 * corner) - middle[place] for corner in range(3)]

    z = away(k, 2)
    x = [along - r * z[corner] for corner, along in enumerate(away(i, 0))]
    y = [along - s * z[corner] for corner, along in enumerate(away(j, 1))]
    sizes = [abs(x[corner]) + abs(y[corner]) for corner in range(3)]
    bound = slack * (sizes[0] + sizes[1] + sizes[2])
    edges = [x[a] * y[b] - y[a] * x[b] for a, b in ((0, 1), (1, 2), (2, 0))]
    is_left = (edges[0] > bound) | (edges[1] > bound) | (edges[2] > bound)
    is_right = (edges[0] < -bound) | (edges[1] < -bound) | (edges[2] < -bound)
    is_before = (z[0] < -reach) & (z[1] < -reach) & (z[2] < -reach)
    is_beyond = (z[0] > reach) & (z[1] > reach) & (z[2] > reach)
    return bits_of(~((is_left & is_right) | is_beyond | is_before))


OVERHEAD_ROWS: Final = 8
BAND: Final = 2.0**-17
GROWTH: Final = 8.0
LEAST_REACH: Final = 2.0**-50


@traced
def overhead(blocks: Rows, boxes: Rows, node: int, x: Number, y: Number, z: Number, blur: Number) -> tuple[int, int]:
    """Return two masks of a node's lanes: triangles that are certainly above a point, and triangles that certainly are
    not. x, y: of the point, relative to the block's centre; z: an upper bound, in the coordinates of boxes (`bvh.py`).
    blur: bound on the error of x and y."""
    rows = [load(blocks, OVERHEAD_ROWS * node + row) for row in range(OVERHEAD_ROWS)]
    u, v = [rows[k] - x for k in (0, 2, 4)], [rows[k] - y for k in (1, 3, 5)]
    turns = [u[i] * v[j] - v[i] * u[j] for i, j in ((0, 1), (1, 2), (2, 0))]
    least, most = lesser(lesser(turns[0], turns[1]), turns[2]), greater(greater(turns[0], turns[1]), turns[2])
    band = rows[6] + rows[7] * blur + blur * blur * BAND
    is_above = load(boxes, BOX_ROWS * node + 2) - load(boxes, BOX_ROWS * node + 5) > z
    is_within = (least - band > 0.0) | (most + band < 0.0)
    is_apart = (least + band < 0.0) & (most - band > 0.0)
    return bits_of(is_within & is_above), bits_of(is_apart)


NOWHERE: Final = 1e30
"""Coordinate of all corners of an unused lane: beyond every image and every margin."""

WORK_ROWS: Final = 28
_SECOND_IMAGE, _FIRST_IMAGE, _FIRST_NORMAL, _SECOND_NORMAL = 0, 9, 18, 23
"""First rows of the work space: corners of either block in coordinates of the other tree; normals of either block with
the least and largest product with its own corners."""
_TINY: Final = 2.0**-120
_BEYOND: Final = 2.0**98  # a float32 between all coordinates with their margins and `NOWHERE`


@inline
def faces_meeting(
    first: Float32Array, i: int, second: Float32Array, j: int, frames: Float32Array, work: Float32Array
) -> tuple[int, int]:
    """Return the pairs of triangles, lane a of block i of the first tree and lane b of block j of the second, that may
    meet, as two 32-bit masks (`boxes.meeting`). frames: maps between the trees (`boxes.py`). work (WORK_ROWS, 8)
    float32: scratch."""
    low, high = meet_boxes(first, i, second, j, frames, work)
    if low | high == 0:
        return low, high
    set_normals(first, i, second, j, frames, work)
    return filter_pairs(low, 0, unseparated_faces, (work,)), filter_pairs(high, LANES // 2, unseparated_faces, (work,))


def _block(rows: Rows, block: int) -> list[Lanes]:
    return [load(rows, CORNER_ROWS * block + row) for row in range(CORNER_ROWS)]


def _least(a: Lanes, b: Lanes, c: Lanes) -> Lanes:
    return lesser(c, lesser(b, a))


def _greatest(a: Lanes, b: Lanes, c: Lanes) -> Lanes:
    return greater(c, greater(b, a))


@traced
def meet_boxes(first: Rows, i: int, second: Rows, j: int, frames: Rows, work: Rows) -> tuple[int, int]:
    """Return the pairs of triangles of two blocks, as two masks, whose boxes no axis of either tree separates; write
    both blocks' corners in coordinates of the other tree to work."""
    own, image = _bounds(first, i, second, j, frames, 0, work, _SECOND_IMAGE)
    theirs, their_image = _bounds(second, j, first, i, frames, FRAME_ROWS, work, _FIRST_IMAGE)
    masks = []
    for lane in range(LANES):
        apart = lane_of(own[0][0], lane) > _BEYOND  # case: neither lane is used
        masks.append(~(apart | are_separated(lane, own, image, their_image, theirs)))
    return bytes_of(masks)


def _bounds(
    own_rows: Rows, own_block: int, rows: Rows, block: int, frames: Rows, frame_row: int, work: Rows, image_row: int
) -> tuple[Bounds, Bounds]:
    """Return the boxes (low, high) of the triangles of one block, widened by the margin, and those of another block's
    triangles in coordinates of the first tree. Their corners there are written to work from row image_row on;
    frame_row: first row in frames of the map."""
    own, other = _block(own_rows, own_block), _block(rows, block)
    frame = [load(frames, frame_row + row) for row in range(FRAME_ROWS)]
    margins, image = frame[MARGINS_ROW:], []
    for corner in range(3):
        for k in range(3):
            turned = dot(frame[3 * k : 3 * k + 3], other[3 * corner : 3 * corner + 3])
            image.append(turned + frame[SHIFT_ROW + k])
            store(work, image_row + 3 * corner + k, image[-1])
    low = [_least(*own[k::3]) - margins[k] for k in range(3)]
    high = [_greatest(*own[k::3]) + margins[k] for k in range(3)]
    return (low, high), ([_least(*image[k::3]) for k in range(3)], [_greatest(*image[k::3]) for k in range(3)])


@traced
def set_normals(first: Rows, i: int, second: Rows, j: int, frames: Rows, work: Rows) -> None:
    """Write the normals w of the triangles of block i and of block j to work, each with the least and largest product w
    . x of its own corners x, widened by the margin."""
    for rows, block, frame_row, row in ((first, i, 0, _FIRST_NORMAL), (second, j, FRAME_ROWS, _SECOND_NORMAL)):
        own = _block(rows, block)
        p, q, r = own[0:3], own[3:6], own[6:9]
        u, v = [q[k] - p[k] for k in range(3)], [r[k] - p[k] for k in range(3)]
        w = [u[x] * v[y] - u[y] * v[x] for x, y in ((1, 2), (2, 0), (0, 1))]
        products = dot(w, p), dot(w, q), dot(w, r)
        bound = dot(_sizes(w), [load(frames, frame_row + MARGINS_ROW + k) for k in range(3)]) + _TINY
        for place, value in enumerate([*w, _least(*products) - bound, _greatest(*products) + bound]):
            store(work, row + place, value)


@traced
def unseparated_faces(lane: int, work: Rows) -> int:
    """Return the mask of the second block's triangles that neither normal separates from the first block's triangle in
    `lane`. work: what `meet_boxes` and `set_normals` wrote."""

    def rows(first: int, n_rows: int) -> list[Lanes]:
        return [load(work, first + row) for row in range(n_rows)]

    def numbers(first: int, n_rows: int) -> list[Lanes]:
        return [load_lane(work, first + row, lane) for row in range(n_rows)]

    pairs = []
    for w, image in (
        (numbers(_FIRST_NORMAL, 5), rows(_SECOND_IMAGE, 9)),
        (rows(_SECOND_NORMAL, 5), numbers(_FIRST_IMAGE, 9)),
    ):
        products = dot(w, image[0:3]), dot(w, image[3:6]), dot(w, image[6:9])
        pairs += [(_least(*products), w[4]), (w[3], _greatest(*products))]
    return bits_of(~any_above(pairs))


FIXED_ROWS: Final = BOX_ROWS + DISC_ROWS
GAP_ROWS: Final = 12
"""Rows of the work space: the corners of eight triangles (9), and three times their centroids (3)."""
_MIDDLES: Final = 9
_LEAST_SIZE: Final = 2.0**-120
_BELOW_ONE: Final = 1.0 - 2.0**-18
_MOST: Final = 2.0**60
"""Largest bound in the units of either tree, since squares of larger numbers overflow."""


def _sizes(v: Sequence[Lanes]) -> list[Lanes]:
    return [abs(x) for x in v]


def _gaps(v: Sequence[Lanes], reach: Sequence[Lanes]) -> Lanes:
    """Return the squared length of max(|v_k| - reach_k, 0) over three axes: the squared distance of two boxes with
    centres v apart and half widths that add up to reach."""
    gaps = [greater(abs(x) - r, 0.0) for x, r in zip(v, reach)]
    return dot(gaps, gaps)


def _width(disc: Sequence[Lanes], cosine: Lanes) -> Lanes:
    """Return how far a disc (radius, half thickness) reaches from its centre along a direction; cosine: of the angle
    between the direction and the disc's normal."""
    radius, half = disc
    return abs(cosine) * half + root(greater((1.0 + ROUND) - cosine * cosine, ROUND)) * radius


@traced
def child_bounds(
    boxes: Rows, discs: Rows, node: int, fixed: Rows, frames: Rows, own: int, theirs: int, ratio: Number,
    inverse: Number, work: Rows,
) -> None:  # fmt: skip
    """Write lower bounds on the distances of a node's eight children from one box with its disc to row 0 of work, in
    units of the node's tree.

    boxes, discs: of that tree. fixed (FIXED_ROWS, 8): in lane 0 the box and the disc, in coordinates of the other tree.
    own, theirs: first rows in frames of the maps to and from the node's tree. ratio: scale of the other tree over that
    of the node's tree; inverse: 1 / ratio (`inverse_ratio`)."""
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
        reach.append(dot(_sizes(turn), their_box[3:]) + load(frames, own + MARGINS_ROW + k) + box[3 + k])
        w.append(dot(back, box[:3]) + load(frames, theirs + SHIFT_ROW + k) - their_box[k])
        their_reach.append(dot(_sizes(back), box[3:]) + load(frames, theirs + MARGINS_ROW + k) + their_box[3 + k])
        d.append(dot(turn, their_disc[:3]) + shift - disc[k])
        normal.append(dot(turn, their_disc[3:6]) * inverse)
    flat, their_flat = disc[6:], [number * ratio for number in their_disc[6:]]
    size, g = root(dot(d, d)), dot(disc[3:6], normal)
    on_own, on_their = dot(disc[3:6], d), dot(normal, d)
    bound = greater(root(_gaps(v, reach)), ratio * lesser(root(_gaps(w, their_reach)), _MOST))
    for level, cosine, their_cosine in (
        (size, on_own / greater(size, _LEAST_SIZE), on_their / greater(size, _LEAST_SIZE)),
        (abs(on_own) - flat[1], None, g),
        (abs(on_their) - their_flat[1], g, None),
    ):
        level = level if cosine is None else level - _width(flat, cosine)
        level = level if their_cosine is None else level - _width(their_flat, their_cosine)
        bound = greater(level - (margin + ratio * their_margin) * 4.001, bound)
    store(work, 0, lesser(greater(bound * _BELOW_ONE, 0.0), _MOST))  # what is no number is 0


def _ends(way: Sequence[Lanes], corners: Sequence[Lanes]) -> tuple[Lanes, Lanes]:
    """Return the least and the largest product of the direction `way` with the three corners (9 rows) of a triangle."""
    p, q, r = (dot(way, corners[3 * k : 3 * k + 3]) for k in range(3))
    return lesser(p, lesser(q, r)), greater(p, greater(q, r))


@traced
def place_triangles(blocks: Rows, node: int, frames: Rows, work: Rows) -> None:
    """Write the triangles of block `node` of the second tree, in coordinates of the first, to rows 0 .. 8 of work, and
    three times their centroids to rows 9 .. 11."""
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
    """Return the mask of the eight triangles in work (`place_triangles`) that may be within distance `most`, in units
    of the first tree, of the triangle in `lane` of block `node` of that tree. Unused lanes count as near."""
    own = [load_lane(blocks, CORNER_ROWS * node + row, lane) for row in range(CORNER_ROWS)]
    theirs, margins = [load(work, row) for row in range(CORNER_ROWS)], [load(frames, MARGINS_ROW + k) for k in range(3)]
    d = [load(work, _MIDDLES + k) - (own[k] + own[3 + k] + own[6 + k]) for k in range(3)]
    gap = _ends(d, theirs)[0] - _ends(d, own)[1] - dot(margins, _sizes(d))
    return bits_of(~(gap * _BELOW_ONE > most * root(dot(d, d)) + _LEAST_SIZE))
