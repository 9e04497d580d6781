"""What remains of segments in a concave polygon: pieces, in order, with the edges where each enters and leaves."""

import numpy as np
from drawing import BLUE, DARK, GREY, PALE_BLUE, Canvas

import exact_geometry as eg

comb = [(0, 0), (10, 0), (10, 6), (8, 6), (8, 2), (6, 2), (6, 6), (4, 6), (4, 2), (2, 2), (2, 6), (0, 6)]
segments = np.array([[(-1, y), (11, y + 1.5)] for y in np.arange(-1.0, 6.0)])
pieces = eg.clip_segments(segments, eg.Polygon([comb]))

canvas = Canvas((-1.2, -1.2), (11.2, 7.7), 560)
canvas.rings([comb], PALE_BLUE)
for segment in segments:
    canvas.line(segment, GREY, 1, "4 3")
for start, end in zip(pieces.start, pieces.end):
    canvas.line([start, end], BLUE, 3)
    canvas.dots([start, end], DARK, 3)
canvas.save("segments_in_polygon")
