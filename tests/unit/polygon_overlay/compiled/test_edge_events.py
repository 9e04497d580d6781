"""Events along an edge: thousands on one, in the order of their parameters, those at one point united."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.polygon_overlay.compiled.test_kernel import agree


@pytest.mark.parametrize("n_teeth", [6, 40])
@pytest.mark.parametrize("is_even", [True, False])
def test_many_crossings_on_one_edge(n_teeth: int, is_even: bool) -> None:
    """A comb across a bar whose edges meet every tooth: runs sorted by insertion, then merged."""
    random = np.random.default_rng(n_teeth)
    x = np.arange(2.0 * n_teeth) if is_even else np.sort(random.uniform(0, 2 * n_teeth, 2 * n_teeth))
    comb = np.concatenate([np.stack([x, np.arange(2 * n_teeth) % 2 * 8.0], axis=1), [[2 * n_teeth, -1], [-1, -1]]])
    bar = np.array(
        [(-2.0, 3.0), (2.0 * n_teeth + 1, 3.0 + random.uniform(0, 0.1)), (2.0 * n_teeth + 1, 4.0), (-2.0, 4.0)]
    )
    assert agree([comb], [bar], "intersection")
    assert agree([comb], [bar], "symmetric_difference")


def test_many_crossings_in_a_small_part_of_an_edge() -> None:
    """Where the parameters are no address, since nearly all are one part of the edge: runs, merged."""
    x = np.concatenate([np.random.default_rng(1).permutation(60) * 2.0**-20, [500.0, 1000.0]])
    needles = [[(place, 0.0), (place + 2.0**-22, 0.0), (place, 9.0)] for place in x]
    for operation in ("intersection", "difference"):
        assert agree(needles, [[(-9.0, 1.0), (2000.0, 2.0), (2000.0, 3.0), (-9.0, 4.0)]], operation)


def test_many_lines_through_one_point() -> None:
    angles = np.arange(10) * np.pi / 10
    blades = [np.round(64 * np.array([(-np.cos(a), -np.sin(a)), (np.cos(a), np.sin(a)), (np.cos(a), 1 + np.sin(a))]))
              for a in angles]  # fmt: skip
    bar = np.array([(-70.0, -70.0), (70.0, 70.0), (70.0, 71.0)])
    agree(blades, [bar], "union")
