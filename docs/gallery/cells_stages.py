"""The cells over a mesh: a slice of the lattice as built, and the triangles that one mixed cell lists."""

import numpy as np
from drawing import BLUE, GREY, ORANGE, PALE_BLUE, PALE_GREY, PALE_ORANGE, Canvas

import exact_geometry as eg
from engine.containment.cells.build import cells_of
from engine.running.budget import Budget

# A torus: 40 x 20 corners.
u, v = np.meshgrid(np.arange(40) * np.pi / 20, np.arange(20) * np.pi / 10, indexing="ij")
ring = 3 + np.cos(v)
vertices = np.stack([ring * np.cos(u), ring * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)
i, j = np.meshgrid(np.arange(40), np.arange(20), indexing="ij")
a, b = i * 20 + j, (i + 1) % 40 * 20 + j
c, d = (i + 1) % 40 * 20 + (j + 1) % 20, i * 20 + (j + 1) % 20
torus = eg.Polyhedron(vertices, np.stack([a, b, c, d], axis=-1).reshape(-1, 4))

cells = cells_of(torus, Budget())
low, size, n = np.array(cells.lattice.low), np.array(cells.lattice.size), cells.lattice.n
level = int((0.02 - low[2]) / size[2])  # the layer of cells that holds the plane z = 0.02
layer = cells.statuses[:-1].reshape(n[2], n[1], n[0])[level]
fills = {-1: PALE_GREY, 1: PALE_BLUE}  # whole cell outside, inside; what is left is mixed

canvas = Canvas((-4.4, -4.9), (22.8, 4.4), 1100)
SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
STAGES = (
    "1. the lattice over the mesh",
    "2. cells: outside, inside, mixed",
    "3. points: orange ones ask a list of triangles",
)
points = np.random.default_rng(7).uniform(-4.1, 4.1, (900, 2))
turn = np.arange(40) * np.pi / 20
for stage, words in enumerate(STAGES):
    shift = (9.2 * stage, 0.0)
    if stage == 1:
        squares: dict[str, list] = {}
        for y, x in np.ndindex(layer.shape):
            square = low[:2] + (x, y) * size[:2] + shift + size[:2] * SQUARE
            squares.setdefault(fills.get(int(layer[y, x]), PALE_ORANGE), []).append(square)
        for fill, rings in squares.items():
            canvas.rings(rings, fill, GREY, 0.4)
    else:
        ends = low[:2] + shift, low[:2] + shift + size[:2] * n[:2]
        for x in np.linspace(ends[0][0], ends[1][0], n[0] + 1):
            canvas.line([(x, ends[0][1]), (x, ends[1][1])], GREY, 0.4)
        for y in np.linspace(ends[0][1], ends[1][1], n[1] + 1):
            canvas.line([(ends[0][0], y), (ends[1][0], y)], GREY, 0.4)
    for radius in (2.0, 4.0):
        canvas.rings([np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1) + shift], "none", BLUE, 1.2)
    canvas.text((shift[0] - 4.2, -4.8), words)
places = ((points - low[:2]) / size[:2]).astype(int)
states = layer[places[:, 1], places[:, 0]]
for state, colour in ((-1, GREY), (1, BLUE)):
    canvas.dots(points[states == state] + shift, colour, 1.5)
canvas.dots(points[(states != -1) & (states != 1)] + shift, ORANGE, 2.5)
canvas.save("cells_stages")
