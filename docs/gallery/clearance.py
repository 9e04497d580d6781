"""How far apart: the nearest points of two bodies, and what they lie on."""

from drawing import DARK, ORANGE, PALE_BLUE, PALE_GREY, Canvas

import exact_geometry as eg

house = [(0, 0), (4, 0), (4, 3), (2, 5), (0, 3)]
lake = [(6, 1), (9, 0), (11, 3), (9, 6), (7, 5), (8, 3)]
answer = eg.clearance(eg.Polygon([house]), eg.Polygon([lake]))

canvas = Canvas((-0.5, -0.7), (11.5, 6.5), 560)
canvas.rings([house], PALE_GREY)
canvas.rings([lake], PALE_BLUE)
canvas.line([*answer.points], ORANGE, 3)
canvas.dots([*answer.points], DARK, 4)
canvas.text((4.2, 0.6), f"{float(answer.distance)!r}")
canvas.save("clearance")
