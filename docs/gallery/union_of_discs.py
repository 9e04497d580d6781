"""The union of 60 discs in one arrangement: pieces, holes and the area, whatever overlaps what."""

import numpy as np
from drawing import BLUE, GREY, PALE_BLUE, Canvas

import exact_geometry as eg

rng = np.random.default_rng(22)
turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
discs = [center + radius * circle for center, radius in zip(rng.uniform(0, 12, (60, 2)), rng.uniform(0.4, 1.1, 60))]
answer = eg.union_all([eg.Polygon([disc]) for disc in discs])

canvas = Canvas((-1.3, -1.3), (13.3, 13.3), 520)
for piece in answer.pieces:
    canvas.rings([piece.shell, *piece.holes], PALE_BLUE, BLUE, 2)
for disc in discs:
    canvas.rings([disc], "none", GREY, 0.6)
canvas.text((-1.1, -1.1), f"{len(answer.pieces)} pieces, area {answer.area:.6f}")
canvas.save("union_of_discs")
