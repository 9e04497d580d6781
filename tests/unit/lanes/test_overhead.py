"""Triangles over a point: what eight lanes tell holds in rational arithmetic, also at the edge of the band."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from engine import Polyhedron
from engine.containment.prepared import tree_of
from engine.jit import kernel
from engine.lanes.overhead import overhead


@kernel
def _ask(blocks: Any, boxes: Any, points: Any, blur: float, found: Any) -> None:
    for item in range(len(points)):
        u, v = points[item, 0] - float(boxes[0, 0, 0]), points[item, 1] - float(boxes[0, 1, 0])
        found[item, 0], found[item, 1] = overhead(blocks, boxes, 0, u, v, points[item, 2], blur)


def _turns(corners: list[list[float]], point: list[float]) -> list[Fraction]:
    a, b, c = ([Fraction(x) for x in corner] for corner in corners)
    x, y = Fraction(point[0]), Fraction(point[1])
    pairs = ((a, b), (b, c), (c, a))
    return [(p[0] - x) * (r[1] - y) - (p[1] - y) * (r[0] - x) for p, r in pairs]


def test_what_lanes_tell_is_true() -> None:
    random = np.random.default_rng(5)
    vertices = random.uniform(-1, 1, (4, 3)) * [1.0, 1.0, 0.1] + [0, 0, 0.5]
    solid = Polyhedron(vertices, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    tree = tree_of(solid)
    local = (solid.vertices[tree.triangles] - np.array(tree.origin)) / tree.scale
    weights = random.dirichlet([0.3, 0.3, 0.3], (200, 4))
    on_triangles = (weights[..., None] * local).sum(axis=2).reshape(-1, 3)
    for blur in (0.0, 2.0**-12):
        points = on_triangles - [0, 0, 1.0]
        found = np.empty((len(points), 2), np.int64)
        _ask(tree.blocks, tree.boxes, points, blur, found)
        n_told = 0
        for point, (over, beside) in zip(points.tolist(), found.tolist()):
            for shift in ((0, 0), (blur, -blur), (-blur, -blur)):
                moved = [point[0] + shift[0], point[1] + shift[1]]
                for lane, corners in enumerate(local.tolist()):
                    turns = _turns(corners, moved)
                    if over >> lane & 1:
                        assert min(turns) > 0 or max(turns) < 0
                    if beside >> lane & 1:
                        assert min(turns) < 0 < max(turns)
            n_told += ((over | beside) & 15).bit_count()
        assert n_told > 2 * len(points)
        _ask(tree.blocks, tree.boxes, points + np.array([0, 0, 4.0]), blur, found)
        assert (found[:, 0] & 15 == 0).all()  # above them all
