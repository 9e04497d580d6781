"""Rings of many pairs arranged again together against the rounds of each pair alone."""

from __future__ import annotations

import numpy as np

from engine.parallel import Budget
from engine.polygon_overlay.compiled.kernel import MAY_CROSS
from engine.polygon_overlay.found import Found, joined, taken
from engine.polygon_overlay.rounds_of_many_pairs import nearest_pairs, settle_pairs
from engine.polygon_overlay.run import gathered, run_kernel
from tests.unit.polygon_overlay import families as families
from tests.unit.polygon_overlay.compiled.test_kernel import arrays


def doubtful() -> Found:
    found = []
    for family in (families.slivers, families.pencils, families.nearly_coincident):
        for seed in range(8):
            first, second = (
                gathered([each.vertices], [each.offsets]) for each in map(arrays, families.drawn(family, seed))
            )
            found.append(run_kernel(first, second, "union", Budget()))
    return joined(found)


def test_pairs_together_are_pairs_alone() -> None:
    found = doubtful()
    n_doubtful = int((found.status == MAY_CROSS).sum())
    assert n_doubtful > 3
    for settle in (settle_pairs, nearest_pairs):
        together = settle(found, Budget())
        assert len(together.pairs) <= n_doubtful
        for k, pair in enumerate(together.pairs.tolist()):
            alone, now = settle(taken(found, np.array([pair])), Budget()).found, taken(together.found, np.array([k]))
            for name in ("vertices", "ring_offsets", "piece_offsets", "displacement"):
                assert getattr(alone, name).tolist() == getattr(now, name).tolist()
