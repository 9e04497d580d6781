"""What is left of many pairs, and how it is settled."""

from __future__ import annotations

import numpy as np

from engine import Aabb, Relation, Solid
from engine.budget import Budget
from engine.collision.codes import UNSETTLED
from engine.collision.collide import Answers, PlacedPair, accuracy_of
from engine.collision.detail import NO_DETAIL
from engine.types import Rcc8

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
