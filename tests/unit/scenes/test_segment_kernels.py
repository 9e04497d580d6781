"""Kernels for placed bodies settle nearly every segment, as exact arithmetic does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Aabb, Convex, HalfSpace, Polyhedron, Pose, Scene, Solid, Sphere, Surface
from engine.running.budget import Budget
from engine.scenes.bodies import Bodies
from engine.scenes.near_boxes import MOST_MET, scratch_for
from engine.scenes.placements import Placements
from engine.scenes.posed_cut import WANTS_BODY
from engine.scenes.segment_kernels import cut_near
from engine.segment_clipping.exact_pieces import compare
from engine.segment_clipping.pieces import Pieces, allocate_pieces, first_of, joined
from engine.segment_clipping.profiles import exact_pieces
from engine.solids.registry import BodyKind
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
    """Return the pieces of segments within a placed solid that are settled, and whether each segment is."""
    placements, m = Placements(Bodies((solid,), (pose,)), {}), len(segments)
    n, order, parts, is_settled = np.zeros(7, np.int64), np.arange(m), [], np.ones(m, np.bool_)
    out, names = allocate_pieces(MOST_MET + 2 * m, solid.dimension), np.empty((2, MOST_MET + 2 * m), np.int64)
    left = np.empty((m, 2), np.int64)
    for each in (segments, order):  # as the engine hands them over: writable ones would be compiled anew
        each.setflags(write=False)
    with Budget() as budget:
        while n[0] < m:
            words, n[2:4] = placements.words(budget), 0
            cut_near(segments, order, m, words, scratch_for(1), budget.flag, out, names, left, n)
            parts.append(Pieces(*(each.copy() for each in first_of(out, int(n[2])))))
            is_settled[left[: n[3], 0]] = False
            if n[4] < 0:
                placements.prepare(0, int(n[4]), budget)
    return joined(parts), is_settled


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
    found, are_settled = cut_on(segments, solid, pose)
    assert are_settled.mean() > 0.97
    with Budget() as budget:
        for item, is_settled in enumerate(are_settled.tolist()):
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
        assert bodies.table(budget).rows[:, 0].tolist() == [BodyKind.OTHER] * 3


def test_touched_corners_and_sides_are_settled() -> None:
    rng, shift = np.random.default_rng(11), np.array([3.0, 5.0, 9.0])  # a point at 0 is never surely rounded
    corners = np.array(OCTAHEDRON, np.float64) + shift
    on = np.concatenate([corners, corners[np.array(FACES)[:, :2]].mean(axis=1)]).repeat(8, axis=0)
    way = np.round(rng.normal(size=on.shape) * 1024) / 1024  # on - way, on and on + way are in one line, exactly
    segments = np.stack([on - way, on + way], axis=1)
    for solid in (Polyhedron(corners, FACES), Surface(corners, FACES[:4])):
        found, are_settled = cut_on(segments, solid, None)
        assert are_settled.mean() > 0.97
        pieces = Scene([solid]).clip_segments(segments)
        with Budget() as budget:
            for item, (p, q) in enumerate(segments.tolist()):
                expected = exact_pieces(p, q, solid, None, budget)
                rounded, mine = [piece.rounded(p, q) for piece in expected], pieces.source == item
                assert pieces.t[mine].tolist() == [list(piece.t) for piece in rounded]
                assert pieces.faces[mine].tolist() == [list(piece.faces) for piece in rounded]
                assert pieces.start[mine].tolist() == [piece.start for piece in rounded]
                are_points = [compare(piece.first, piece.last) == 0 for piece in expected]
                assert (pieces.ranks[mine, 0] == pieces.ranks[mine, 1]).tolist() == are_points
        assert len(found.t) > 0.95 * len(pieces)


def far_from_the_origin(rng: np.random.Generator) -> tuple[Scene, Any]:
    """Boxes far along x, two of which a segment enters between the same two doubles, through sides along x."""
    size, ulp = 2.0 ** rng.integers(8, 16), 1.0
    far = ulp * 2.0**52
    way = np.round(size * np.array([8.0, *rng.uniform(0.5, 2.0, 2)]))
    cell = far + np.round(rng.uniform(0.2, 0.8) * way[0])
    first, second = np.array([rng.uniform(0.0, 0.4), 0.45]) + (cell - far)
    bodies: list[Solid] = [
        Aabb([far - 2 * size, second / way[0] * way[1], -5 * size], [cell + size, 9 * size, 5 * size]),
        Aabb([cell - size, -5 * size, first / way[0] * way[2]], [cell + size, 5 * size, 9 * size]),
    ]
    for _ in range(60):  # below the segment
        low = np.array([far, 0.0, 0.0]) + np.round(rng.uniform([-1, -6, -6], [9, 6, -0.1]) * size)
        bodies.append(Aabb(low, low + np.round(rng.uniform(0.1, 1.0, 3) * [size, size, 0.05 * size])))
    start = np.array([far, 0.0, 0.0])
    return Scene([bodies[k] for k in rng.permutation(len(bodies))]), [[start, start + way]]


def test_the_first_of_two_that_are_entered_between_the_same_doubles() -> None:
    """The start of the first piece found was taken for exact: half an ulp is much in the tree of a scene far away."""
    rng = np.random.default_rng(1)
    for _ in range(150):
        scene, segment = far_from_the_origin(rng)
        every, first = scene.clip_segments(segment), scene.clip_segments(segment, keep="first")
        assert (first.body[0], first.t[0, 0]) == (every.body[0], every.t[0, 0])
