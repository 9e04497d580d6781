"""Kernels for posed bodies settle nearly every segment, as exact arithmetic does."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Convex, HalfSpace, Polyhedron, Pose, Solid, Sphere, Surface
from engine.parallel import Budget
from engine.scenes.posed import completed, cut_posed, posed_body
from engine.scenes.profiles import exact_pieces
from engine.segment_clipping.boundary_cut import SETTLED
from tests.unit.scenes.scenes import FACES, OCTAHEDRON

BODIES: list[Solid] = [
    Aabb([-1, -1, -1], [1, 0.5, 2]),
    HalfSpace([1, 2, 3], 0.25),
    Convex([[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [-1, -1, -1, 1]]),
    Sphere([0.1, 0.2, 0.3], 1.25),
    Polyhedron(OCTAHEDRON, FACES),
    Surface([[-1, -1, 0], [1, -1, 0.5], [1, 1, 0], [-1, 1, 0.5]], [[0, 1, 2], [0, 2, 3]]),
    Aabb([-1, -1], [1, 0.5]),
    Sphere([0.1, 0.2], 1.25),
]


@pytest.mark.parametrize("solid", BODIES, ids=lambda solid: f"{solid.type} {solid.dimension}")
@pytest.mark.parametrize("is_far", [False, True])
def test_agrees_with_exact_arithmetic_and_leaves_little(solid: Solid, is_far: bool) -> None:
    rng = np.random.default_rng(7)
    dimension = solid.dimension
    turn, _ = np.linalg.qr(rng.normal(size=(dimension, dimension)))
    turn[0] *= np.sign(np.linalg.det(turn))
    shift = rng.uniform(-1, 1, dimension) + (1000.0 if is_far else 0.0)
    pose = Pose(turn, shift)
    segments = rng.uniform(-2, 2, (200, 2, dimension)) + shift
    segments[:20, 1] = segments[:20, 0] + rng.normal(size=(20, dimension)) * 1e-9
    body = posed_body(solid, pose)
    assert body is not None
    with Budget() as budget:
        parts, state = cut_posed(segments, body, getattr(solid, "radius", 0.0), budget)
        assert (state == SETTLED).mean() > 0.97
        is_surface = isinstance(solid, Surface)
        found = completed(parts, np.full(200, SETTLED, np.uint8), is_surface, None)
        for item, is_settled in enumerate((state == SETTLED).tolist()):
            mine = found.source == item
            p, q = segments[item].tolist()
            expected = [piece.rounded(p, q) for piece in exact_pieces(p, q, solid, pose, budget)] if is_settled else []
            assert found.t[mine].tolist() == [list(piece.t) for piece in expected]
            assert found.ends[0, mine].tolist() == [piece.start for piece in expected]
            assert found.ends[1, mine].tolist() == [piece.end for piece in expected]
            assert found.faces[mine].tolist() == [list(piece.faces) for piece in expected]


def test_what_has_no_range_is_left() -> None:
    tiny = Pose([[1.0, -1e-300], [1e-300, 1.0]], [0, 0])
    assert posed_body(Aabb([0, 0], [1, 1]), tiny) is None
    assert posed_body(Sphere([0, 0], 1e200), Pose([[1, 0], [0, 1]], [1, 0])) is None
    assert posed_body(Aabb([0, 0], [1e-200, 1]), Pose([[0, -1], [1, 0]], [1, 0])) is None
