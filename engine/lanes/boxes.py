"""Tests eight boxes against eight boxes of another body at once, one box a lane.

Two nodes of two trees (`bvh.py`), each in the coordinates of its own tree, and the two maps between those (`frames`)
give 64 answers in some 200 vector instructions: the images of eight boxes are boxes around turned ones, and a pair is
apart where an axis of either tree separates it (six of the fifteen axes of two turned boxes; the others cost more than
they spare). Boxes and margins hold whatever float32 rounds.

    frames (2, 25, 8) float32, every number in all lanes: [0] takes the second tree to the first, [1] the first to the
    second. Rows: matrix by rows (9), magnitudes of its entries (9), shift (3), margin (1), margins by axis (3).

While a tree is built a box is one row (low x, y, z, 0, -high x, -y, -z, 0): the least of two rows is the box around
both, one comparison of eight lanes.

**Discs.** Eight flat cylinders against eight of another body: which children of two nodes a plane does not separate.

The boxes of a tree stand along its axes, so two patches of surface that face each other askew have boxes that overlap
long before they meet. Around each child stands therefore also a flat cylinder ("disc"): about a centre c, along a unit
vector n, the mean normal of its faces, with radius r and half thickness t. Two discs are apart where n of either
separates them; with g = n_a . n_b that is

    |n . (c_b - c_a)|  >  t_a + |g| t_b + sqrt(1 - g^2) r_b          and the same with a and b exchanged.

    discs (n_nodes, 8, 8) float32: rows cx cy cz nx ny nz r t, one child to a lane, in the coordinates of the tree

Near contact this leaves a fraction of what boxes leave, and the more so the finer a surface is.

**margin.** Numbers are below 5 in the own tree. In units of 2^-24, with the other scale `ratio` times the own and the
shift T of `frames`: n . (c_b - c_a) is off by less than 80 ratio + 16 |T| + 30 (corners, products and sums), the right
side by less than 70 ratio + 40 (g is off by 13, either n by 10); twice the margin of a frame is 128 + 224 ratio + 64
|T| (placement.py). Under the root g^2 is off by less than 30: `ROUND` is 64. `fill_discs` enlarges by 16, which is more
than what its own rounding and that of the corners come to. What is no number separates nothing.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.compiling.jit import inline
from engine.lanes.lanes import (
    across,
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
    select,
    store,
)
from engine.lanes.tracing import LANES, Lanes, Mask, Number, Rows, Triple, traced
from engine.types import Float32Array

FRAME_ROWS: Final = 25
SHIFT_ROW: Final = 18
MARGIN_ROW: Final = 21
MARGINS_ROW: Final = 22
BOX_ROWS: Final = 6
EMPTY: Final = -(2**31)
"""Child number of an unused lane of a node (`bvh.py`)."""

Bounds = tuple[list[Lanes], list[Lanes]]


@traced
def meeting(first: Rows, i: int, second: Rows, j: int, frames: Rows) -> tuple[int, int]:
    """Return the pairs of children, lane a of node i of the first tree and lane b of node j of the second, whose boxes
    may meet, as two 32-bit masks: bit 8 a + b of the first for a < 4, bit 8 (a - 4) + b of the second for the others.
    """
    a = [load(first, BOX_ROWS * i + row) for row in range(BOX_ROWS)]
    b = [load(second, BOX_ROWS * j + row) for row in range(BOX_ROWS)]
    image, own, their_image, theirs = _image(b, frames, 0), _ends(a), _image(a, frames, FRAME_ROWS), _ends(b)
    return bytes_of([~are_separated(lane, own, image, their_image, theirs) for lane in range(LANES)])


def are_separated(lane: int, own: Bounds, image: Bounds, their_image: Bounds, theirs: Bounds) -> Mask:
    """Return a mask of eight boxes of the second tree: true where an axis of either tree separates a box from the box
    in `lane` of the first tree. Each pair (low, high) bounds eight boxes: own and theirs in their own tree, image those
    of the second tree in the first, their_image those of the first in the second."""
    pairs = []
    for (low, high), (their_low, their_high) in ((own, image), (their_image, theirs)):
        for k in range(3):
            pairs.append((their_low[k], lane_of(high[k], lane)))
            pairs.append((lane_of(low[k], lane), their_high[k]))
    return any_above(pairs)


def _ends(box: list[Lanes]) -> Bounds:
    """Return the low and the high corners of eight boxes given as six rows: centre and half widths."""
    return [box[k] - box[3 + k] for k in range(3)], [box[k] + box[3 + k] for k in range(3)]


def _image(box: list[Lanes], frames: Rows, first: int) -> Bounds:
    """Return the low and the high corners of the boxes around the images of eight boxes under a map: rows of `frames`
    from `first` on."""
    frame = [load(frames, first + row) for row in range(FRAME_ROWS)]
    centre = [dot(frame[3 * k : 3 * k + 3], box[:3]) + frame[SHIFT_ROW + k] for k in range(3)]
    half = [dot(frame[9 + 3 * k : 12 + 3 * k], box[3:]) + frame[MARGINS_ROW + k] for k in range(3)]
    return _ends([*centre, *half])


@traced
def inside_box(boxes: Rows, node: int, low: Triple, high: Triple) -> int:
    """Return the mask of a node's lanes whose boxes intersect the box from low to high, two float32 triples in tree
    coordinates."""
    own_low, own_high = _ends([load(boxes, BOX_ROWS * node + row) for row in range(BOX_ROWS)])
    pairs = [(own_low[k], high[k]) for k in range(3)] + [(low[k], own_high[k]) for k in range(3)]
    return bits_of(~any_above(pairs))


@traced
def enter_boxes(
    boxes: Rows, node: int, middle: Triple, inverse: Triple, slack: Number, last: Number, entered: Rows
) -> int:
    """Slab test: return the mask of a node's lanes (`bvh.py`) whose boxes the segment middle + t half may meet for some
    t in [-1, last], the intervals of t between the two planes of each axis being intersected.

    Sets entered (1, 8) to lower bounds of the parameters t of entry. All numbers are float32; inverse: 1 / half; slack:
    margin of a box. Source: T. Kay, J. Kajiya, Ray tracing complex scenes, 1986. With u = 2^-24 and S + 2 above all
    coordinates (`local_segment`), at a point of the box

        |w - t e| <= h + 3 u (S + 2),    w = c - m as computed here, e the half in float32,
        t >= w / e - (h + 3 u (S + 2)) / |e|
        errors: 3.1 u of each quotient, 1 u of their difference, parts below (S + 4.1) / |e|
        together: 11 u (S + 2) / |e| < slack / |e|,    slack = 16 u (S + 2)
    """
    first, end = -1.0, last
    for k in range(3):
        centre = (load(boxes, BOX_ROWS * node + k) - middle[k]) * inverse[k]
        reach = (load(boxes, BOX_ROWS * node + 3 + k) + slack) * abs(inverse[k])
        near, far = centre - reach, centre + reach
        first = select(near > first, near, first)
        end = select(far < end, far, end)
    store(entered, 0, first)
    return bits_of(~(first > end))


@traced
def fill(rows: Rows, row: int, value: Number) -> None:
    """Set all eight numbers of a row to `value`."""
    store(rows, row, value)


@traced
def join(boxes: Rows, box: int, others: Rows, other: int) -> None:
    """Set row `box` to the elementwise minimum of itself and row `other` of another array: the box around both."""
    store(boxes, box, lesser(load(boxes, box), load(others, other)))


@traced
def join_centre(centres: Rows, box: int, others: Rows, other: int) -> None:
    """Set row `box` to the box around it and the centre of row `other`, both low x, y, z, 0, then minus high."""
    row = load(others, other)
    store(centres, box, lesser(load(centres, box), (row - across(row, LANES // 2)) * 0.5))


@traced
def copy_row(rows: Rows, i: int, others: Rows, j: int) -> None:
    """Set row i to row j of another array."""
    store(rows, i, load(others, j))


@traced
def exchange(rows: Rows, i: int, j: int) -> None:
    """Swap rows i and j."""
    first, second = load(rows, i), load(rows, j)
    store(rows, i, second)
    store(rows, j, first)


DISC_ROWS: Final = 8
ROUND: Final = 2.0**-18


@inline
def discs_meeting(
    low: int, high: int, first: Float32Array, i: int, second: Float32Array, j: int, frames: Float32Array,
    scales: tuple[float, float], work: Float32Array,
) -> tuple[int, int]:  # fmt: skip
    """Return those pairs of two masks (low, high), as `meeting` returns them for nodes i and j, whose discs may meet.
    first, second: discs of either tree; scales: of the two trees. work (DISC_ROWS + 1 or more, 8) float32: scratch."""
    if low | high == 0:
        return low, high
    place_discs(second, j, frames, np.float32(scales[1] / scales[0]), inverse_ratio(scales[1], scales[0]), work)
    return filter_pairs(low, 0, unseparated_discs, (first, i, work)), filter_pairs(
        high, LANES // 2, unseparated_discs, (first, i, work)
    )


@inline
def inverse_ratio(their: float, own: float) -> Any:
    """Return own / their, two scales, as float32: the factor that turns normals carried over from the other tree into
    unit vectors again; infinity, which separates nothing, where float32 would lose bits of them."""
    return np.float32(own / their if own / their <= 2.0**60 else np.inf)


@traced
def place_discs(second: Rows, j: int, frames: Rows, ratio: Number, inverse: Number, work: Rows) -> None:
    """Write the discs of node j of the second tree, in coordinates of the first, to rows 0 .. 7 of work; row 8: twice
    the margin. ratio: scale of the second tree over that of the first; inverse: 1 / ratio (`inverse_ratio`)."""
    b = [load(second, DISC_ROWS * j + row) for row in range(DISC_ROWS)]
    for k in range(3):
        turn = [load(frames, 3 * k + column) for column in range(3)]
        store(work, k, dot(turn, b[:3]) + load(frames, SHIFT_ROW + k))
        store(work, 3 + k, dot(turn, b[3:6]) * inverse)
    store(work, 6, b[6] * ratio)
    store(work, 7, b[7] * ratio)
    margin = load(frames, MARGIN_ROW)
    store(work, 8, margin + margin)


@traced
def unseparated_discs(lane: int, first: Rows, i: int, work: Rows) -> int:
    """Return the mask of the eight discs in work that neither normal separates from the disc in `lane` of node i of the
    first tree."""
    a = [load_lane(first, DISC_ROWS * i + row, lane) for row in range(DISC_ROWS)]
    b = [load(work, row) for row in range(DISC_ROWS + 1)]
    gap = [b[k] - a[k] for k in range(3)]
    g = dot(a[3:6], b[3:6])
    along_a, along_b = abs(dot(a[3:6], gap)), abs(dot(b[3:6], gap))
    s, g = root(greater((1.0 + ROUND) - g * g, ROUND)), abs(g)

    def reach(theirs: list[Lanes], ours: list[Lanes]) -> Lanes:
        return (g * theirs[7] + s * theirs[6]) + (b[8] + ours[7])

    return bits_of(~any_above([(along_a, reach(b, a)), (along_b, reach(a, b))]))
