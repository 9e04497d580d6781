"""For tests: arrangements of segments, and one exact point inside each face.

     ceiling           A bounded face has an edge below it, its floor. In the slab between the floor's left end and
 ___/-----\\__         the next node of the face to the right, the face is a trapezoid between the floor and the
|    |  .  |           lowest edge above: the point is halfway between them, halfway across the slab.
|____|_____|__
  floor
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from engine.arrangement.arrange import Arrangement, Line, arrange
from engine.arrangement.nodes import Rational, float_nodes, rational_nodes
from engine.arrangement.subdivision import Subdivision
from engine.running.budget import Budget


def arrange_segments(
    segments: Sequence[tuple[Sequence[Rational], Sequence[Rational]]],
    masks: Sequence[int] | None = None,
    budget: Budget | None = None,
) -> Arrangement:
    """Return the arrangement of segments given by their end points, ((x, y), (x, y)) of ints, floats or fractions.

    masks: as in `arrange`; left out, every segment belongs to source 0 (mask 1).
    """
    ends = [end for segment in segments for end in segment]
    if all(isinstance(value, float) for end in ends for value in end):
        nodes, numbers = float_nodes(np.array(ends, np.float64).reshape(-1, 2))
    else:
        nodes, numbers = rational_nodes(ends)
    pairs = list(zip(numbers[0::2], numbers[1::2]))
    return arrange(nodes, pairs, [1] * len(pairs) if masks is None else masks, budget)


def _height(line: Line, x: Fraction) -> Fraction:
    """Return y in a x + b y + c = 0, b not 0."""
    return -(line[0] * x + line[2]) / line[1]


def face_points(subdivision: Subdivision) -> list[tuple[Fraction, Fraction]]:
    """Return for each face a point of its open interior; for face 0 one to the right of everything.

    Cost: for each face linear in its edges, in rational arithmetic.
    """
    arrangement = subdivision.arrangement
    nodes = arrangement.nodes
    scale = Fraction(2) ** nodes.exponent
    xs: dict[int, Fraction] = {}  # in the units of the lines
    for node in {*arrangement.tails, *arrangement.heads}:
        xs[node] = Fraction(nodes.points[node][0], nodes.points[node][2])
    of_face: list[list[int]] = [[] for _ in range(subdivision.n_faces)]
    for half_edge, face in enumerate(subdivision.faces):
        of_face[face].append(half_edge)
    result = [((max(xs.values(), default=Fraction(0)) + 1) * scale, Fraction(0))]
    for half_edges in of_face[1:]:
        spans = [(xs[arrangement.tails[h >> 1]], xs[arrangement.heads[h >> 1]], h) for h in half_edges]
        start, _, floor = next(span for span in spans if not span[2] & 1 and span[0] < span[1])
        stop = min(x for tail_x, head_x, _ in spans for x in (tail_x, head_x) if x > start)
        x = (start + stop) / 2
        y = _height(arrangement.lines[floor >> 1], x)
        heights = (_height(arrangement.lines[h >> 1], x) for left, right, h in spans if h & 1 and left < x < right)
        ceiling = min(height for height in heights if height > y)
        result.append((x * scale, (y + ceiling) / 2 * scale))
    return result
