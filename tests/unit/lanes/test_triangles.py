"""Eight triangles against a segment: none that it meets is missed, and compiled code says what Python says."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import Polyhedron
from engine.compiling.jit import kernel
from engine.containment.prepared import tree_of
from engine.lanes.faces import near_triangles, overhead
from engine.segment_clipping.on_boundary.descent import local_segment, shear_of
from engine.segment_clipping.on_boundary.prepared_boundary import mesh_of
from engine.types import Point3


@kernel
def asked(corners, node, i, j, k, middle, r, s, reach, slack):  # type: ignore[no-untyped-def]
    return near_triangles(corners, node, i, j, k, middle, r, s, reach, slack)


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1.0, 1e9, 1e150])
def test_triangles_met_are_near(scale: float) -> None:
    """Triangles through points of a segment, of all sizes and shapes, far from the origin too."""
    rng = np.random.default_rng(int(np.log10(scale)) + 200)
    n_met = n_apart = 0
    for size in (1e-6, 1e-3, 1.0):
        for length in (1e-6, 1.0, 1e6):
            p, q = rng.uniform(-1, 1, (2, 3)) * [length, length, 1.0]
            at = p + rng.uniform(0, 1, (64, 1)) * (q - p)
            u, v = rng.normal(size=(2, 64, 3)) * size * 10.0 ** rng.uniform(-4, 0, (2, 64, 1))
            met = np.stack([at + u, at + v, at - u - v], axis=1)  # its middle is on the segment
            met[::8, 1] = met[::8, 0]  # no area
            met[::8, 2] = 2 * at[::8] - met[::8, 0]
            free = rng.uniform(-1, 1, (64, 1, 3)) + rng.normal(size=(64, 3, 3)) * size
            offset = rng.choice([0.0, 1e3]) * np.ones(3)
            corners = (np.concatenate([met, free]) + offset) * scale
            mesh = mesh_of(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), np.arange(len(corners)))
            ends = Point3(*((p + offset) * scale)), Point3(*((q + offset) * scale))
            way = local_segment(*ends, mesh.origin, mesh.inverse, 0.0)
            assert way.is_near
            (i, j, k), middle, *numbers = shear_of(way)
            arguments = (i, j, k, middle, *map(np.float32, numbers))
            for node in np.flatnonzero(mesh.child[:, 0] < 0):
                block = node - mesh.n_inner
                lanes = near_triangles(mesh.corners, block, *arguments)
                assert asked(mesh.corners, block, *arguments) == lanes
                for lane, item in enumerate(-1 - mesh.child[node].astype(int)):
                    if item < len(met) and item >= 0 and length <= 1.0:  # longer ones: rounding moves the point off
                        assert lanes >> lane & 1
                        n_met += 1
                    elif 0 <= item < len(corners):
                        n_apart += not lanes >> lane & 1
    assert min(n_met, n_apart) > 100


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
