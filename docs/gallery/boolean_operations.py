"""The four Boolean operations of two polygons; every piece is valid, holes are holes."""

from drawing import BLUE, GREY, PALE_BLUE, Canvas

import exact_geometry as eg

frame = [[(0, 0), (6, 0), (6, 6), (0, 6)], [(2, 2), (2, 4), (4, 4), (4, 2)]]
cross = [[(3, -1), (5, 3), (3, 7), (1, 3)]]

canvas = Canvas((-0.5, -1.5), (31, 7.5), 880)
for place, operation in enumerate(("intersection", "union", "difference", "symmetric_difference")):
    answer = eg.overlay(eg.Polygon(frame), eg.Polygon(cross), operation)

    def moved(ring, shift=8.0 * place):
        return [(x + shift, y) for x, y in ring]

    for ring in (*frame, *cross):
        canvas.rings([moved(ring)], "none", GREY, 0.8)
    for piece in answer.pieces:
        canvas.rings([moved(ring) for ring in (piece.shell, *piece.holes)], PALE_BLUE, BLUE, 2)
    canvas.text((8.0 * place, -1.3), f"{operation} {answer.area:.4g}")
canvas.save("boolean_operations")
