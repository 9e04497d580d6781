"""What a pair is answered by: its row, the form of an answer, exact images under poses."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

import engine
from engine import Aabb, HalfSpace, Pose, Relation, Solid
from engine.collision.codes import UNSETTLED
from engine.collision.collide import NO_DETAIL, PAIRS, TAKEN, Answers, PlacedPair, accuracy_of, pair_function
from engine.collision.exact_images import as_vector, image_half_space, image_point, value_at
from engine.collision.result import meets_as
from engine.predicates.rational import dot
from engine.running.budget import Budget
from engine.types import Rcc8
from tests.unit.collision import lattices

BOX = Aabb([0, 0, 0], [1, 1, 1])
OTHERS: list[Solid] = [BOX, Aabb([1, 0, 0], [2, 1, 1]), Aabb([5, 0, 0], [6, 1, 1])]


def pair_of(item: int) -> PlacedPair:
    return BOX, OTHERS[item], (None, None)


def test_open_pairs_are_settled_and_witnesses_added() -> None:
    with Budget(None, None) as budget:
        plain = Answers(budget, False, np.array([UNSETTLED, Relation.TOUCHING, UNSETTLED], np.int8), None, None)
        assert plain.left().tolist() == [0, 2]
        assert plain.left(1, 3).tolist() == [2]
        details = np.full(3, NO_DETAIL, np.int8)
        full = Answers(budget, False, plain.relations.copy(), [None] * 3, details)
        assert full.left().tolist() == [0, 1, 2]
        for answers in (plain, full):
            answers.settle(answers.left(), pair_of)
            assert answers.relations.tolist() == [Relation.OVERLAPPING, Relation.TOUCHING, Relation.DISJOINT]
        assert details.tolist() == [Rcc8.EQ, Rcc8.EC, Rcc8.DC]
        assert full.witnesses is not None
        assert [witness is None for witness in full.witnesses] == [False, False, True]
        report = accuracy_of(3, 2, full.works, "boxes")
        assert report.method == "boxes"


# --- The table of pairs: every two types that `collide` takes have one function, whichever stands first ---


MAKERS = {
    2: ("polygon", "triangle", "aabb", "sphere", "half_space"),
    3: ("polyhedron", "surface", "aabb", "sphere", "half_space"),
}


@pytest.mark.parametrize("d", [2, 3])
def test_every_pair_has_one_function(d: int) -> None:
    rng = random.Random(d)
    bodies = {name: lattices.solid(getattr(lattices, name)(rng, d)) for name in MAKERS[d]}
    assert ", ".join(bodies) == TAKEN[d]
    assert {*bodies} == {row.name for row in engine.solid_types.values() if d in row.meets}
    for first in bodies.values():
        for second in bodies.values():
            function, parts, is_swapped = pair_function(first, second)
            kinds = (second, first) if is_swapped else (first, second)
            assert PAIRS[d, *map(meets_as, kinds)] == (function, parts)
            assert is_swapped or pair_function(second, first)[0] is function or first.type == second.type


# --- Exact images of points and half-spaces: a point keeps its side, up to the determinant of the pose ---


@pytest.mark.parametrize("d", [2, 3])
def test_the_image_of_a_half_space_holds_the_images_of_its_points(d: int) -> None:
    rng = np.random.default_rng(d)
    for _ in range(20):
        turn, _ = np.linalg.qr(rng.normal(size=(d, d)))
        turn[:, 0] *= np.sign(np.linalg.det(turn))
        pose, normal, offset = Pose(turn, rng.normal(size=d)), rng.normal(size=d), float(rng.normal())
        points = rng.normal(size=(4, d))
        images = [image_point(point, pose) for point in points]
        rows = [as_vector(row) for row in pose.rotation]
        assert images[0][0] == dot(rows[0], as_vector(points[0])) + Fraction(float(pose.translation[0]))
        ratios = {
            value_at(image_half_space(HalfSpace(normal, offset), pose), image)
            / value_at((as_vector(normal), Fraction(offset)), p)
            for p, image in zip(map(as_vector, points), images)
        }
        assert len(ratios) == 1  # the determinant
        assert abs(ratios.pop() - 1) < 1e-11


def test_no_pose_changes_nothing() -> None:
    assert image_point([0.1, 0.2], None) == (Fraction(0.1), Fraction(0.2))
    assert image_half_space(HalfSpace([1.0, 2.0], 3.0), None) == ((1, 2), 3)
