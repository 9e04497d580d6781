"""Boxes of points: the smallest ``low <= p <= high``; comparisons of floats only, so exact. And boxes of float64 that
hold the exact images of boxes and balls under poses; infinite on overflow.

With u = 2^-53, centre c and half widths h of a box, and m its largest coordinate, the image is R c + t, plus or minus
|R| h, and no farther out than the body's points are from c: d + 2 roundings of terms below 2 m + |t|. The margin
2^-49 (3 m + |t|) + 2^-1060 covers them, the rounding of c and h, and its own. Distances grow by 2^-38: a rotation may
stretch lengths by up to 1.5e-12 (`engine.solids.pose.TOLERANCE`), and a ball under the pose of another body counts as
unposed.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.compiling.jit import kernel


def box_of_points(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return low and high ``(dimension,)`` of points ``(n, dimension)``, n at least 1.

    >>> low, high = box_of_points(np.array([[0.0, 5.0], [3.0, 1.0]]))
    >>> low.tolist(), high.tolist()
    ([0.0, 1.0], [3.0, 5.0])
    """
    return points.min(axis=0), points.max(axis=0)


def corners_of_box(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the ``(2 ** dimension, dimension)`` corners of a box; bit k of the row says low or high on axis k."""
    dimension = len(low)
    is_high = np.arange(2**dimension)[:, None] >> np.arange(dimension) & 1
    return np.where(is_high == 1, high, low)


@kernel
def place_boxes(
    boxes: FloatArray, reaches: FloatArray, radii: FloatArray, kinds: IntArray, rows: IntArray, rotations: FloatArray,
    translations: FloatArray, low: FloatArray, high: FloatArray,
) -> None:  # fmt: skip
    """Fill low and high (n, d), rounded outward.

    boxes (n_kinds, 2, d), of a ball its centre twice; reaches (n_kinds,): how far the body's points are at most from
    the middle of the box (of a ball: its centre from there); radii (n_kinds,), 0.0 for others; kinds (n,) int64: which
    of these each body is; rows (n,) int64: of each body's pose in rotations (n_poses, d, d) and translations (n_poses,
    d), -1 for none.
    """
    dimension = low.shape[1]
    for body in range(low.shape[0]):
        kind, pose = kinds[body], rows[body]
        radius = radii[kind]
        for axis in range(dimension):
            low[body, axis], high[body, axis] = boxes[kind, 0, axis], boxes[kind, 1, axis]
        if pose >= 0:
            largest = shift = 0.0
            for axis in range(dimension):
                largest = max(largest, abs(low[body, axis]), abs(high[body, axis]))
                shift = max(shift, abs(translations[pose, axis]))
            margin = 2.0**-49 * (3.0 * largest + shift) + 2.0**-1060
            radius *= 1.0 + 2.0**-38
            for axis in range(dimension):
                middle, reach = translations[pose, axis], margin
                for k in range(dimension):
                    turn = rotations[pose, axis, k]
                    middle += turn * (0.5 * boxes[kind, 0, k] + 0.5 * boxes[kind, 1, k])
                    reach += abs(turn) * (0.5 * boxes[kind, 1, k] - 0.5 * boxes[kind, 0, k])
                reach = min(reach, margin + reaches[kind] * (1.0 + 2.0**-38))
                below, above = middle - reach, middle + reach
                low[body, axis] = below if below == below else -np.inf
                high[body, axis] = above if above == above else np.inf
        if radius > 0.0:
            for axis in range(dimension):
                low[body, axis] = np.nextafter(low[body, axis] - radius, -np.inf)
                high[body, axis] = np.nextafter(high[body, axis] + radius, np.inf)
