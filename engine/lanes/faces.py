"""Eight triangles against eight triangles of another body at once, one to a lane: which pairs may meet.

A block (9, 8) float32 holds the corners of up to eight triangles, px py pz qx ... rz, in the coordinates of their tree
(`bvh.py`); lanes without one hold `NOWHERE`. Each block is taken to the tree of the other by `frames` (`boxes.py`),
and a pair is apart where one of eight directions separates it: the axes of either tree (`meet_boxes`), and the
normals of the two planes (`set_normals`, `beside_planes`). That spares most of the exact signs: two surfaces that come
near each other are side by side there, and it is the planes of their triangles that part them.

**margin.** A direction w, however it was rounded, separates two triangles where the numbers w . x of their corners do;
so only the corners and the products have errors. In the tree of w a corner is off by at most a quarter of `margin`
(frames.py: the sums there are those of `boxes.meeting`, with room to spare), a product w . x by 2^-22 |w|_1 |x|,
which is below a quarter of margin |w|_1; both bodies together: `margin` |w|_1. What underflows is below `_TINY`.
Normals are taken from a tree's own coordinates, at most 2, so nothing overflows where the other tree is large.
"""

from __future__ import annotations

from typing import Final

from engine.arrays import Float32Array
from engine.compiling.jit import inline
from engine.lanes.boxes import FRAME_ROWS, MARGIN_ROW, SHIFT_ROW, Bounds, are_parted
from engine.lanes.lanes import any_above, bits_of, bytes_of, dot, greater, lane_of, lesser, load, load_lane, sift, store
from engine.lanes.tracing import LANES, Lanes, Rows, traced
from engine.lanes.triangles import CORNER_ROWS

NOWHERE: Final = 1e30
"""Coordinate of the corners of a lane that is not used: beyond every image and every margin."""

WORK_ROWS: Final = 28
_SECOND_IMAGE, _FIRST_IMAGE, _FIRST_NORMAL, _SECOND_NORMAL = 0, 9, 18, 23
"""Rows of the work space: corners of either block in the tree of the other; normal, and lowest and highest product of
it, of either block in its own tree."""
_TINY: Final = 2.0**-120
_BEYOND: Final = 2.0**98  # a float32 between all coordinates with their margins and `NOWHERE`


@inline
def faces_meeting(
    first: Float32Array, i: int, second: Float32Array, j: int, frames: Float32Array, work: Float32Array
) -> tuple[int, int]:
    """Return which triangles of block i and block j may meet: bit 8 a + b for the lanes a and b, lanes a < 4 and the
    others apart, each in 32 bits. work (WORK_ROWS, 8) float32: what it holds after the call is of no use."""
    low, high = meet_boxes(first, i, second, j, frames, work)
    if low | high == 0:
        return low, high
    set_normals(first, i, second, j, frames, work)
    return sift(low, 0, beside_planes, (work,)), sift(high, LANES // 2, beside_planes, (work,))


def _block(rows: Rows, block: int) -> list[Lanes]:
    return [load(rows, CORNER_ROWS * block + row) for row in range(CORNER_ROWS)]


def _least(a: Lanes, b: Lanes, c: Lanes) -> Lanes:
    return lesser(c, lesser(b, a))


def _greatest(a: Lanes, b: Lanes, c: Lanes) -> Lanes:
    return greater(c, greater(b, a))


@traced
def meet_boxes(first: Rows, i: int, second: Rows, j: int, frames: Rows, work: Rows) -> tuple[int, int]:
    """Return as `faces_meeting` does the pairs that the axes of the trees leave; write the images to `work`."""
    own, image = _bounds(first, i, second, j, frames, 0, work, _SECOND_IMAGE)
    theirs, their_image = _bounds(second, j, first, i, frames, FRAME_ROWS, work, _FIRST_IMAGE)
    masks = []
    for lane in range(LANES):
        apart = lane_of(own[0][0], lane) > _BEYOND  # case: neither lane is used
        masks.append(~(apart | are_parted(lane, own, image, their_image, theirs)))
    return bytes_of(masks)


def _bounds(
    own_rows: Rows, own_block: int, rows: Rows, block: int, frames: Rows, frame_row: int, work: Rows, image_row: int
) -> tuple[Bounds, Bounds]:
    """Return low and high of a block, by its margin, and of the image of another block; write that to `work`."""
    own, other = _block(own_rows, own_block), _block(rows, block)
    frame = [load(frames, frame_row + row) for row in range(FRAME_ROWS)]
    margin, image = frame[MARGIN_ROW], []
    for corner in range(3):
        for k in range(3):
            turned = dot(frame[3 * k : 3 * k + 3], other[3 * corner : 3 * corner + 3])
            image.append(turned + frame[SHIFT_ROW + k])
            store(work, image_row + 3 * corner + k, image[-1])
    low, high = [_least(*own[k::3]) - margin for k in range(3)], [_greatest(*own[k::3]) + margin for k in range(3)]
    return (low, high), ([_least(*image[k::3]) for k in range(3)], [_greatest(*image[k::3]) for k in range(3)])


@traced
def set_normals(first: Rows, i: int, second: Rows, j: int, frames: Rows, work: Rows) -> None:
    """Write the normals of two blocks to `work`, and what their own corners reach along them."""
    for rows, block, frame_row, row in ((first, i, 0, _FIRST_NORMAL), (second, j, FRAME_ROWS, _SECOND_NORMAL)):
        own = _block(rows, block)
        p, q, r = own[0:3], own[3:6], own[6:9]
        u, v = [q[k] - p[k] for k in range(3)], [r[k] - p[k] for k in range(3)]
        w = [u[x] * v[y] - u[y] * v[x] for x, y in ((1, 2), (2, 0), (0, 1))]
        products = dot(w, p), dot(w, q), dot(w, r)
        bound = (abs(w[0]) + abs(w[1]) + abs(w[2])) * load(frames, frame_row + MARGIN_ROW) + _TINY
        for place, value in enumerate([*w, _least(*products) - bound, _greatest(*products) + bound]):
            store(work, row + place, value)


@traced
def beside_planes(lane: int, work: Rows) -> int:
    """Return the triangles of the second block, a bit each, that no normal parts from one lane of the first."""

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
