"""Eight flat cylinders against eight of another body: which children of two nodes are beside each other.

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
|T| (frames.py). Under the root g^2 is off by less than 30: `ROUND` is 64. `fill_discs` enlarges by 16, which is more
than what its own rounding and that of the corners come to. What is no number separates nothing.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import Float32Array
from engine.compiling.jit import inline
from engine.lanes.boxes import MARGIN_ROW, SHIFT_ROW
from engine.lanes.lanes import any_above, bits_of, dot, greater, load, load_lane, root, sift, store
from engine.lanes.tracing import LANES, Lanes, Number, Rows, traced

DISC_ROWS: Final = 8
ROUND: Final = 2.0**-18


@inline
def discs_meeting(
    low: int, high: int, first: Float32Array, i: int, second: Float32Array, j: int, frames: Float32Array,
    scales: tuple[float, float], work: Float32Array,
) -> tuple[int, int]:  # fmt: skip
    """Return those of the pairs of children (`boxes.meeting`) whose discs may meet.

    scales: of the two trees. work (DISC_ROWS or more, 8) float32.
    """
    if low | high == 0:
        return low, high
    place_discs(second, j, frames, np.float32(scales[1] / scales[0]), inverse_ratio(scales[1], scales[0]), work)
    return sift(low, 0, beside_disc, (first, i, work)), sift(high, LANES // 2, beside_disc, (first, i, work))


@inline
def inverse_ratio(their: float, own: float) -> Any:
    """Return what makes normals in the units of another tree unit vectors; infinity, which separates nothing, where
    those are so small that float32 has lost bits of them."""
    return np.float32(own / their if own / their <= 2.0**60 else np.inf)


@traced
def place_discs(second: Rows, j: int, frames: Rows, ratio: Number, inverse: Number, work: Rows) -> None:
    """Write the discs of node j, in the tree of the first body, to `work`; to their radii, twice the margin."""
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
def beside_disc(lane: int, first: Rows, i: int, work: Rows) -> int:
    """Return the discs in `work`, a bit each, that are not apart from one child of node i."""
    a = [load_lane(first, DISC_ROWS * i + row, lane) for row in range(DISC_ROWS)]
    b = [load(work, row) for row in range(DISC_ROWS + 1)]
    gap = [b[k] - a[k] for k in range(3)]
    g = dot(a[3:6], b[3:6])
    along_a, along_b = abs(dot(a[3:6], gap)), abs(dot(b[3:6], gap))
    s, g = root(greater((1.0 + ROUND) - g * g, ROUND)), abs(g)

    def reach(theirs: list[Lanes], ours: list[Lanes]) -> Lanes:
        return (g * theirs[7] + s * theirs[6]) + (b[8] + ours[7])

    return bits_of(~any_above([(along_a, reach(b, a)), (along_b, reach(a, b))]))
