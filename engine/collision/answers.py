"""The answers to a call about many pairs: kernels for many pairs fill what they can, the rest is settled one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from engine.arrays import Int8Array, IntArray
from engine.budget import Budget
from engine.collision.codes import DISJOINT, UNSETTLED
from engine.collision.collide import collide_pair
from engine.collision.detail import NO_DETAIL, code_of, detail_of
from engine.collision.result import Poses, Witness, Work
from engine.solids.base import Solid
from engine.types import Accuracy

Witnesses = list[Witness | None]
PlacedPair = tuple[Solid, Solid, Poses]


@dataclass(slots=True, eq=False)
class Answers:
    """One a pair, by its number.

    relations: (n,) int8, UNSETTLED where none is known yet. witnesses, details ((n,) int8, NO_DETAIL where none is
    known): where asked for, else None. works: what settling counted.
    """

    budget: Budget
    boolean: bool
    relations: Int8Array
    witnesses: Witnesses | None
    details: Int8Array | None
    works: list[Work] = field(default_factory=list)

    def left(self, start: int = 0, stop: int | None = None) -> IntArray:
        """Return the pairs of a range to be settled one by one: open ones, and those whose witness is asked for yet."""
        relations = self.relations[start:stop]
        is_left = relations == UNSETTLED
        if self.witnesses is not None:
            is_left |= (relations != DISJOINT) & np.array([w is None for w in self.witnesses[start:stop]], np.bool_)
        left: IntArray = start + np.flatnonzero(is_left)
        return left

    def settle(self, items: IntArray, pair_of: Callable[[int], PlacedPair]) -> None:
        """Fill the answers of some pairs by `collide_pair`; threads may settle different pairs."""
        work = Work(self.budget, witness=self.witnesses is not None, boolean=self.boolean)
        self.works.append(work)
        for item in items.tolist():
            self.budget.check()
            pair = pair_of(item)
            answer = collide_pair(*pair, work)
            self.relations[item] = answer.relation
            if self.witnesses is not None:
                self.witnesses[item] = answer.witness
            if self.details is not None and self.details[item] == NO_DETAIL:
                self.details[item] = code_of(detail_of(*pair, answer.relation, work))


def accuracy_of(n_pairs: int, n_open: int, works: list[Work], method: str) -> Accuracy:
    """Return the report on many pairs; n_open: those that batches left, all of them beyond a filter."""
    beyond, rational = sum(work.n_beyond_filter for work in works), sum(work.n_rational for work in works)
    return Accuracy("exact", None, n_pairs, max(beyond, n_open), rational, method)
