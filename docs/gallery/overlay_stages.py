"""The seven stages of an overlay, drawn from the exact arrangement that defines its answer."""

from itertools import pairwise

import numpy as np
from drawing import BLUE, DARK, GREY, ORANGE, PALE_BLUE, PALE_GREY, PALE_ORANGE, RED, Canvas

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.rings import trace_pieces
from engine.arrangement.subdivision import cycles_of, label_faces, next_half_edges, subdivide

subject = np.array([(0, 0), (8, 0), (8, 6), (5, 3), (0, 6)], float)
clip = np.array([(3, -1), (10, 2), (7, 7), (1, 4)], float)
corners = np.concatenate([subject, clip])
STEP, NAMES = 13.0, ("edges", "noding", "chains", "stars", "faces", "labels", "rings")

arrangement = arrange_rings(corners, [0, len(subject), len(corners)], [1, 2])
subdivision = subdivide(arrangement)
labels = label_faces(subdivision)  # bit 0: inside the subject, bit 1: inside the clip polygon
pieces = trace_pieces(subdivision, [int(label == 3) for label in labels], [frozenset()] * len(labels))
nodes = np.stack([arrangement.nodes.xs, arrangement.nodes.ys], axis=1)
ends = list(zip(arrangement.tails, arrangement.heads))
around = subdivision.around
following = next_half_edges(around, 2 * len(ends))
cycles, n_cycles = cycles_of(following)


def face_ring(face: int) -> list[list[np.ndarray]]:
    """The boundary of a face: the cycles of half-edges that have it to their left."""
    rings = []
    for cycle in range(n_cycles):
        start = cycles.index(cycle)
        if subdivision.faces[start] == face:
            walk, half_edge = [start], following[start]
            while half_edge != start:
                walk.append(half_edge)
                half_edge = following[half_edge]
            rings.append([nodes[arrangement.origin(half_edge)] for half_edge in walk])
    return rings


canvas = Canvas((-1, -3), (4 * STEP - 1, 19.5), 900)
for place, name in enumerate(NAMES):
    shift = np.array([STEP * (place % 4), 11.0 * (1 - place // 4)])
    canvas.text((shift[0], shift[1] - 2.2), f"{place + 1}. {name}", size=15)
    if name in ("faces", "labels"):
        for face in range(1, subdivision.n_faces):
            palette = (PALE_GREY, PALE_BLUE, PALE_ORANGE, "#d8ecd2")
            fill = palette[labels[face] if name == "labels" else face % 4]
            rings = face_ring(face)
            canvas.rings([np.array(ring) + shift for ring in rings], fill, GREY, 1)
            middle = np.mean(max(rings, key=len), axis=0) + shift
            words = {0: "-", 1: "S", 2: "C", 3: "SC"}[labels[face]] if name == "labels" else face
            canvas.text(middle - (0.4, 0.2), words, size=12)
        continue
    for ring, colour in ((subject, BLUE), (clip, ORANGE)):
        canvas.rings([ring + shift], "none", colour, 0.8 if name == "rings" else 2)
    if name == "edges":
        canvas.dots(corners + shift, DARK, 3)
    elif name == "noding":
        used = sorted({node for pair in ends for node in pair})
        crossings = [node for node in used if not (corners == nodes[node]).all(axis=1).any()]
        canvas.dots(nodes[crossings] + shift, RED, 4.5)
    elif name == "chains":
        canvas.dots([nodes[node] + shift for node, fan in enumerate(around) if len(fan) > 2], RED, 4.5)
        canvas.dots([nodes[node] + shift for node, fan in enumerate(around) if len(fan) == 2], GREY, 2.5)
    elif name == "stars":
        for node, fan in enumerate(around):
            for half_edge in fan:
                far = nodes[arrangement.origin(half_edge ^ 1)]
                reach = min(0.7 / np.hypot(*(far - nodes[node])), 0.4)
                canvas.line([nodes[node] + shift, nodes[node] + reach * (far - nodes[node]) + shift], DARK, 2.5)
    else:
        for piece in pieces:
            ring = [nodes[arrangement.origin(half_edge)] + shift for half_edge in piece.shell]
            canvas.rings([ring], PALE_BLUE, DARK, 2.5)
            for start, end in pairwise([*ring, ring[0]]):
                canvas.dots([start + 0.6 * (end - start)], DARK, 2.5)
canvas.save("overlay_stages")
