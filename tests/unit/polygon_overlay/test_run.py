"""Kernels that make room for what they find."""

from __future__ import annotations

import numpy as np

from engine.budget import Budget
from engine.polygon_overlay.compiled.kernel import DONE
from engine.polygon_overlay.polygon_arrays import gathered
from engine.polygon_overlay.run import KEPT_ARRAYS, run_kernel
from engine.solids.polygon import Polygon


def test_room_is_made() -> None:
    """Two combs across each other: more contacts, vertices and rings than vertices in all."""
    n = 60
    teeth = np.array([[k + 0.5 * (j > 1), 0.1 if j in (0, 3) else n] for k in range(n) for j in range(4)])
    comb = np.concatenate([teeth, [[n, 0.0], [0, 0.0]]])
    sides = [gathered([Polygon([each])] * 3) for each in (comb, comb[:, ::-1])]
    found = run_kernel(*sides, KEPT_ARRAYS["intersection"], Budget())
    assert found.status.tolist() == [DONE] * 3
    assert len(set(found.counts[:, 0].tolist())) == 1
    assert found.counts[0, 0] > n * (n - 2)
