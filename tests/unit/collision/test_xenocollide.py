"""What the search claims of two placed convex bodies is so; near contact it claims nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Aabb, Pose, Relation, collide
from engine.collision.codes import UNSETTLED
from engine.collision.convex_body import ASIDE, CENTER, ConvexArrays, convex_body_of, pool_bodies
from engine.collision.convex_pair import APART, MEETING, interior_point, placed_body, refine_portal
from engine.collision.meshes.placement import PoseArrays
from engine.compiling.jit import kernel
from engine.predicates.vectors import minus
from tests.unit.collision.test_convex_pair import poses


@kernel
def ask(pool: ConvexArrays, placed: PoseArrays, found: Any) -> None:
    for item in range(found.shape[0]):
        a, b = placed_body(pool, 0, placed, 0), placed_body(pool, 1, placed, item)
        start = minus(interior_point(pool.numbers, 0, a, CENTER), interior_point(pool.numbers, 1, b, ASIDE))
        found[item] = refine_portal(a, b, start)


def claims(second: Aabb, placed: list[Pose]) -> list[int]:
    bodies = [body for body in (convex_body_of(Aabb([0, 0, 0], [1, 1, 1])), convex_body_of(second)) if body is not None]
    arrays = np.array([pose.rotation for pose in placed]), np.array([pose.translation for pose in placed])
    found = np.empty(len(placed), np.int64)
    ask(pool_bodies(bodies), PoseArrays(*arrays, True), found)
    return found.tolist()


@pytest.mark.parametrize("seed", [1, 2])
def test_claims_are_true_and_common(seed: int) -> None:
    other, placed = Aabb([0, 0, 0], [2, 1, 0.5]), [Pose(np.eye(3), np.zeros(3)), *poses(60, 1.0, seed)]
    found = claims(other, placed)
    for pose, claim in zip(placed, found):
        is_apart = collide(Aabb([0, 0, 0], [1, 1, 1]), other, second_pose=pose).relation == Relation.DISJOINT
        assert claim in ((APART if is_apart else MEETING), UNSETTLED)
    assert found.count(UNSETTLED) < 6


def test_contact_is_left_unsettled() -> None:
    assert claims(Aabb([1, 0, 0], [2, 1, 1]), [Pose(np.eye(3), np.zeros(3))] * 2) == [UNSETTLED] * 2
