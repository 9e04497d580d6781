"""Kernels for placed bodies settle nearly every segment, as exact arithmetic does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Aabb, Convex, HalfSpace, Polyhedron, Pose, Solid, Sphere, Surface
from engine.parallel import Budget
from engine.scenes.bodies import Bodies
from engine.scenes.posed_mesh import MOST_MET, WANTS_BODY, scratch_for
from engine.scenes.standing import Standing
from engine.scenes.through import OTHER, cut_pairs
from engine.segment_clipping.boundary_cut import SETTLED
from engine.segment_clipping.pieces import Pieces, first_of, joined, room_for
from engine.segment_clipping.profiles import exact_pieces
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


def cut_on(segments: Any, solid: Solid, pose: Pose | None) -> tuple[Pieces, Any]:
    """Return the pieces of segments within a placed solid that are settled, and the state of each segment."""
    standing, n = Standing(Bodies((solid,), (pose,)), {}), np.array([0, 0, 0, len(segments), 0])
    room = MOST_MET + 2 * len(segments)
    out, names, state = room_for(room, solid.dimension), np.empty(room, np.int64), np.empty(len(segments), np.uint8)
    places, parts = np.arange(len(segments)), []
    with Budget() as budget:
        while n[0] < len(segments):
            where, cut = standing.where(budget), standing.cut(budget)
            cut_pairs(segments, places, places * 0, where, cut, scratch_for(1), budget.flag, out, names, state, n)
            parts.append(Pieces(*(each.copy() for each in first_of(out, int(n[1])))))
            if n[2] < 0:
                standing.prepare(0, int(n[2]), budget)
    return joined(parts), state


@pytest.mark.parametrize("solid", BODIES, ids=lambda solid: f"{solid.type} {solid.dimension}")
@pytest.mark.parametrize("place", ["unposed", "near", "far"])
def test_agrees_with_exact_arithmetic_and_leaves_little(solid: Solid, place: str) -> None:
    rng = np.random.default_rng(7)
    dimension = solid.dimension
    turn, _ = np.linalg.qr(rng.normal(size=(dimension, dimension)))
    turn[0] *= np.sign(np.linalg.det(turn))
    shift = rng.uniform(-1, 1, dimension) + (1000.0 if place == "far" else 0.0)
    pose = None if place == "unposed" else Pose(turn, shift)
    segments = rng.uniform(-2, 2, (200, 2, dimension)) + (0.0 if pose is None else shift)
    segments[:20, 1] = segments[:20, 0] + rng.normal(size=(20, dimension)) * 1e-9
    found, state = cut_on(segments, solid, pose)
    assert (state == SETTLED).mean() > 0.97
    with Budget() as budget:
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
    solids = Aabb([0, 0], [1, 1]), Sphere([0, 0], 1e200), Aabb([0, 0], [1e-200, 1])
    poses = tiny, Pose([[1, 0], [0, 1]], [1, 0]), Pose([[0, -1], [1, 0]], [1, 0])
    bodies = Bodies(solids, poses)
    with Budget() as budget:
        for body in range(3):
            bodies.prepare(body, WANTS_BODY, budget)
        assert bodies.table(budget).of_kernels.kinds.tolist() == [OTHER] * 3
