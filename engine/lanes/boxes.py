"""Eight boxes against eight boxes of another body at once, one to a lane.

Two nodes of two trees (`bvh.py`), each in the coordinates of its own tree, and the two maps between those (`frames`)
give 64 answers in some 200 vector instructions: the images of eight boxes are boxes around turned ones, and a pair is
apart where an axis of either tree separates it (six of the fifteen axes of two turned boxes; the others cost more than
they spare). Boxes and margins hold whatever float32 rounds.

    frames (2, 22, 8) float32, every number in all lanes: [0] takes the second tree to the first, [1] the first to the
    second. Rows: matrix by rows (9), magnitudes of its entries (9), shift (3), margin (1).

While a tree is built a box is one row (low x, y, z, 0, -high x, -y, -z, 0): the least of two rows is the box around
both, one comparison of eight lanes.
"""

from __future__ import annotations

from typing import Final

from engine.lanes.lanes import any_above, bits_of, bytes_of, dot, lane_of, lesser, load, select, store
from engine.lanes.tracing import LANES, Lanes, Mask, Number, Rows, Triple, traced

FRAME_ROWS: Final = 22
SHIFT_ROW: Final = 18
MARGIN_ROW: Final = 21
BOX_ROWS: Final = 6
EMPTY: Final = -(2**31)
"""What a node of a tree names in a lane without a child (`bvh.py`)."""

Bounds = tuple[list[Lanes], list[Lanes]]


@traced
def meeting(first: Rows, i: int, second: Rows, j: int, frames: Rows) -> tuple[int, int]:
    """Return which children of node i and node j may meet: bit 8 a + b for the lanes a and b, lanes a < 4 and the
    others apart, each in 32 bits."""
    a = [load(first, BOX_ROWS * i + row) for row in range(BOX_ROWS)]
    b = [load(second, BOX_ROWS * j + row) for row in range(BOX_ROWS)]
    image, own, their_image, theirs = _image(b, frames, 0), _ends(a), _image(a, frames, FRAME_ROWS), _ends(b)
    return bytes_of([~are_parted(lane, own, image, their_image, theirs) for lane in range(LANES)])


def are_parted(lane: int, own: Bounds, image: Bounds, their_image: Bounds, theirs: Bounds) -> Mask:
    """Tell which boxes of the second body an axis of either tree parts from the one in a lane of the first."""
    pairs = []
    for (low, high), (their_low, their_high) in ((own, image), (their_image, theirs)):
        for k in range(3):
            pairs.append((their_low[k], lane_of(high[k], lane)))
            pairs.append((lane_of(low[k], lane), their_high[k]))
    return any_above(pairs)


def _ends(box: list[Lanes]) -> Bounds:
    """Return low and high of eight boxes."""
    return [box[k] - box[3 + k] for k in range(3)], [box[k] + box[3 + k] for k in range(3)]


def _image(box: list[Lanes], frames: Rows, first: int) -> Bounds:
    """Return low and high of the eight boxes around the images of eight boxes."""
    frame = [load(frames, first + row) for row in range(FRAME_ROWS)]
    centre = [dot(frame[3 * k : 3 * k + 3], box[:3]) + frame[SHIFT_ROW + k] for k in range(3)]
    half = [dot(frame[9 + 3 * k : 12 + 3 * k], box[3:]) + frame[MARGIN_ROW] for k in range(3)]
    return _ends([*centre, *half])


@traced
def inside_box(boxes: Rows, node: int, low: Triple, high: Triple) -> int:
    """Return the lanes of a node, a bit each, that meet the box of two triples of float32."""
    own_low, own_high = _ends([load(boxes, BOX_ROWS * node + row) for row in range(BOX_ROWS)])
    pairs = [(own_low[k], high[k]) for k in range(3)] + [(low[k], own_high[k]) for k in range(3)]
    return bits_of(~any_above(pairs))


@traced
def enter_boxes(
    boxes: Rows, node: int, middle: Triple, inverse: Triple, slack: Number, last: Number, entered: Rows
) -> int:
    """Return the lanes of a node (`bvh.py`), a bit each, in whose boxes the segment middle + t half may be at a t of
    -1 to `last`; set entered (1, 8) to parameters before which it is in none of them. All numbers are float32.

    inverse: 1 / half. With u = 2^-24 and S + 2 above all coordinates (`local_segment`), at a point of the box

        |w - t e| <= h + 3 u (S + 2),    w = c - m as it is computed here, e the half in float32,

    so t >= w / e - (h + 3 u (S + 2)) / |e|. Both quotients are off by 3.1 u of themselves, their difference by 1 u of
    its parts, all of which are below S + 4.1 over |e|: 11 u (S + 2) / |e| in all, and a slack is 16 u (S + 2).
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
    """Set all numbers of a row to one."""
    store(rows, row, value)


@traced
def join(boxes: Rows, box: int, others: Rows, other: int) -> None:
    """Set a row to the least of itself and a row of another array, number by number."""
    store(boxes, box, lesser(load(boxes, box), load(others, other)))


@traced
def exchange(rows: Rows, i: int, j: int) -> None:
    """Exchange two rows."""
    first, second = load(rows, i), load(rows, j)
    store(rows, i, second)
    store(rows, j, first)
