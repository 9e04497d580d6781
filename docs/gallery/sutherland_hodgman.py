"""Sutherland-Hodgman keeps one ring together: where a concave polygon falls apart, bridges run along the region."""

import numpy as np
from drawing import BLUE, GREY, PALE_BLUE, Canvas

import exact_geometry as eg

comb = [(0, 0), (10, 0), (10, 6), (8, 6), (8, 2), (6, 2), (6, 6), (4, 6), (4, 2), (2, 2), (2, 6), (0, 6)]
clipped = eg.clip_polygons([eg.Polygon([comb])], eg.HalfSpace(normal=(0.0, 1.0), offset=-4.0))  # above y = 4

canvas = Canvas((-0.7, -0.7), (10.7, 6.7), 560)
canvas.rings([comb], "none", GREY, 1)
for ring in np.split(clipped.vertices, clipped.ring_offsets[1:-1]):
    canvas.rings([ring], PALE_BLUE, BLUE, 2.5)
canvas.save("sutherland_hodgman")
