"""Which side of a line? Each cell is one double further than its neighbour; left in float64, right exact."""

from itertools import pairwise

import numpy as np
from drawing import BLUE, GREY, PALE_ORANGE, Canvas

import exact_geometry as eg

N, STEP = 48, 2.0**-53
a, b = (12.0, 12.0), (24.0, 24.0)
steps = np.arange(N) * STEP
points = np.stack(np.meshgrid(0.5 + steps, 0.5 + steps), axis=-1).reshape(-1, 2)
# The half-plane right of the line through a and b, x >= y: its boundary holds the diagonal of the picture.
exact = eg.locate(points, eg.HalfSpace(normal=(1.0, -1.0), offset=0.0)).reshape(N, N)
x, y = points.T
rounded = np.sign((b[0] - x) * (a[1] - y) - (b[1] - y) * (a[0] - x)).reshape(N, N)  # orient2d, as textbooks write it

canvas = Canvas((0, 0), (2 * N + 4, N), 800)
for shift, signs in ((0, rounded), (N + 4, exact)):
    for row in range(N):
        starts = [0, *(np.flatnonzero(np.diff(signs[row])) + 1).tolist(), N]
        for start, stop in pairwise(starts):
            ring = [(shift + start, row), (shift + stop, row), (shift + stop, row + 1), (shift + start, row + 1)]
            fill = {-1.0: GREY, 0.0: PALE_ORANGE, 1.0: BLUE}[float(signs[row, start])]
            canvas.rings([ring], fill, fill, 0.3)
canvas.save("one_ulp_apart")
