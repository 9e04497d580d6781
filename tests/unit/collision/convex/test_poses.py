"""Eight poses at a time: what the lanes answer is what the exact path answers; they may only leave poses open."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron, Pose, Relation, collide_poses
from engine.arrays import read_only
from engine.collision.codes import UNSETTLED
from engine.collision.collide import collide_pair
from engine.collision.convex.body import convex_body_of, pooled
from engine.collision.convex.poses import lane_arrays, relate_in_lanes
from engine.collision.meshes.mesh_arrays import STILL
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import Work
from tests.unit.collision.convex.test_pair import BODIES, ball_of_belts, poses

HULLS = ("box", "corner", "small", "large", "inward")


def in_lanes(
    first: Polyhedron, second: Polyhedron, placed: list[Pose], boolean: bool = False, flag: int = 0
) -> list[int] | None:
    """Return the answers, None where the pair has no lanes."""
    bodies = [body for body in (convex_body_of(first), convex_body_of(second)) if body is not None]
    lanes = lane_arrays(*bodies)
    if lanes is None:
        return None
    found = np.full(len(placed), UNSETTLED, np.int8)
    still = STILL
    turns = read_only(np.array([pose.rotation for pose in placed]))
    moves = read_only(np.array([pose.translation for pose in placed]))
    with np.errstate(all="ignore"):
        flags = np.array([flag], np.uint8)
        relate_in_lanes(pooled(bodies), lanes, still, PoseArrays(turns, moves, True), boolean, found, flags)
    return found.tolist()


def moved(body: Polyhedron, scale: float, shift: float) -> Polyhedron:
    return Polyhedron(body.vertices * scale + shift, body.triangles)


@pytest.mark.parametrize("second", HULLS)
@pytest.mark.parametrize("first", HULLS)
def test_answers_are_those_of_the_exact_path(first: str, second: str) -> None:
    one, other = BODIES[first], BODIES[second]
    placed = [*poses(11, 0.5, 1), *poses(10, 0.05, 2)]
    found = in_lanes(one, other, placed)
    assert found is not None
    exact = [collide_pair(one, other, (None, pose), Work(witness=False)).relation for pose in placed]
    assert all(answer in (right, UNSETTLED) for answer, right in zip(found, exact))
    assert found.count(UNSETTLED) <= 5
    booleans = in_lanes(one, other, placed, boolean=True)
    assert booleans is not None
    assert all((a == Relation.DISJOINT) == (b == Relation.DISJOINT) for a, b in zip(found, booleans) if a >= 0 <= b)


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-6, 1e-8, 1e-12, 0.0, -1e-12, -1e-8, -1e-6, -1e-5, -1e-3])
def test_near_contact_is_decided_or_left_open(gap: float) -> None:
    """Corner on corner and corner on face, from clearly apart to clearly within: never the wrong answer."""
    one = BODIES["box"]
    spike = Polyhedron([[0, 0, 0], [1, -1, -1], [1, 1, -1], [1, 0, 1]], [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])
    placed = [Pose(np.eye(3), [1 + gap, y, z]) for y in (0.0, 0.1, 0.45) for z in (0.0, -0.2)]
    found = in_lanes(one, spike, placed)
    assert found is not None
    right = Relation.DISJOINT if gap > 0 else Relation.OVERLAPPING
    if abs(gap) >= 1e-3:
        assert found.count(right) >= len(placed) - 1
    assert all(answer in (right, UNSETTLED) for answer in found)
    if gap == 0.0:
        assert found == [UNSETTLED] * len(placed)
        turns, moves = [pose.rotation for pose in placed], [pose.translation for pose in placed]
        assert collide_poses(one, spike, turns, moves).tolist() == [Relation.TOUCHING] * len(placed)


@pytest.mark.parametrize("shift", [1e3, 1e6, 1e9, 1e15])
def test_bodies_far_from_the_origin(shift: float) -> None:
    one, other = moved(ball_of_belts(5, 2), 1.0, shift), moved(ball_of_belts(4, 3), 0.5, -shift)
    placed = [
        Pose(pose.rotation, one.vertices.mean(0) - pose.rotation @ other.vertices.mean(0) + pose.translation)
        for pose in poses(10, 0.8, 3)
    ]
    found = in_lanes(one, other, placed)
    if found is None:  # rounded to so few places that they are not convex any more
        return
    exact = [collide_pair(one, other, (None, pose), Work(witness=False)).relation for pose in placed]
    assert all(answer in (right, UNSETTLED) for answer, right in zip(found, exact))
    assert shift > 1e6 or found.count(UNSETTLED) <= 1


@pytest.mark.parametrize("scale", [1e-320, 1e-200, 1e-30, 1e30, 1e70, 1e200, 1e306])
def test_the_ends_of_the_exponent_range_prove_nothing_wrong(scale: float) -> None:
    body = ball_of_belts(5, 2)
    one = Polyhedron(body.vertices * scale, body.triangles)
    if convex_body_of(one) is None:
        return
    placed = [Pose(pose.rotation, pose.translation * scale) for pose in poses(9, 0.8, 4)]
    placed.append(Pose(np.eye(3), [1.7e308, 0, 0]))
    found, unscaled = in_lanes(one, one, placed), in_lanes(body, body, poses(9, 0.8, 4))
    assert unscaled is not None
    assert found is None or all(UNSETTLED in (a, b) or a == b for a, b in zip(found, unscaled))
    assert found is None or found[-1] in (Relation.DISJOINT, UNSETTLED)


def test_a_raised_flag_ends_the_search() -> None:
    body = ball_of_belts(5, 2)
    assert in_lanes(body, body, poses(20, 0.5, 5), flag=1) == [UNSETTLED] * 20


def test_answers_do_not_depend_on_the_neighbours_in_the_lanes() -> None:
    body, placed = ball_of_belts(5, 2), poses(40, 0.6, 6)
    together = in_lanes(body, body, placed)
    assert together == [answer for pose in placed for answer in in_lanes(body, body, [pose]) or []]
