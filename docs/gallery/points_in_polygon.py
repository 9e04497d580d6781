"""Lattice points in a star with a hole: many lie exactly on an edge, and none of them is guessed."""

import numpy as np
from drawing import BLUE, GREY, ORANGE, PALE_BLUE, Canvas

import exact_geometry as eg

star = [(0, 8), (2, 2), (8, 2), (3, -2), (5, -8), (0, -4), (-5, -8), (-3, -2), (-8, 2), (-2, 2)]
hole = [(-1, -1), (-1, 1), (1, 1), (1, -1)]
polygon = eg.Polygon([star, hole])
points = np.stack(np.meshgrid(np.arange(-9, 10), np.arange(-9, 10)), axis=-1).reshape(-1, 2).astype(float)
places = eg.locate(points, polygon)  # OUTSIDE -1, BOUNDARY 0, INSIDE 1

canvas = Canvas((-9.5, -9.5), (9.5, 9.5), 480)
canvas.rings([star, hole], PALE_BLUE)
for place, colour in ((-1, GREY), (0, ORANGE), (1, BLUE)):
    canvas.dots(points[places == place], colour, 4 if place == 0 else 2.5)
canvas.save("points_in_polygon")
