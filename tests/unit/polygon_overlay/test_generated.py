"""Generated families that make rounding hard: every output valid, every count and area exact.

A few pairs of each family by default, more than 100,000 with --full. Of every pair, under all four operations: exact
areas against tests/reference/fast_overlay.py, counts, the area of the output; the pair swapped, and the pair mirrored,
turned, scaled or reordered. Of every fiftieth that is small: structure against tests/reference/overlay.py, validity in
integers. Where shapely is installed it judges every output too.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.polygon_overlay.batch import OverlayBatch, overlay_batch
from engine.polygon_overlay.result import Overlay
from engine.solids.polygon import Polygon
from tests.reference import fast_overlay
from tests.reference.exact import Q
from tests.unit.polygon_overlay.checks import (
    OPERATIONS,
    area_error,
    assert_counts_add_up,
    assert_equals_reference,
    assert_valid,
)
from tests.unit.polygon_overlay.families import FAMILIES, Pair, Random, Rings, changed, drawn

BATCH = 100
CLOSELY = 50
"""Every so many pairs also go through the checks that take a hundred times as long."""


def solids(rings: Sequence[Rings]) -> list[Polygon]:
    return [Polygon(each) for each in rings]


def assert_valid_for_shapely(batch: OverlayBatch) -> None:
    """Every result as one multipolygon: simple rings, holes in shells, pieces apart save for single points.

    Where GEOS says no, integers decide: in some nearly collinear rings it finds an intersection that is not there, with
    u = 2^-53 in (0.5 + 38u, 0.5 + 22u), (8.8, 8.8), (0.5 + 41u, 0.5 + 25u), (24, 24), (17.3, 17.3), (3, 23) (3.14).
    """
    if importlib.util.find_spec("shapely") is None:
        return
    import shapely

    if not len(batch.vertices):
        return
    sizes = np.diff(batch.ring_offsets)
    closed = np.repeat(np.arange(len(sizes)), sizes + 1)
    places = np.arange(len(closed)) - closed
    places[np.cumsum(sizes + 1) - 1] = batch.ring_offsets[:-1]  # the first vertex once more at the end
    rings = shapely.linearrings(batch.vertices[places], indices=closed)
    pieces = shapely.polygons(rings, indices=counted(batch.piece_offsets))
    results = shapely.multipolygons(pieces, indices=np.unique(counted(batch.pair_offsets), return_inverse=True)[1])
    for i in np.flatnonzero(~shapely.is_valid(results)):
        assert_valid(present(batch[int(np.flatnonzero(np.diff(batch.pair_offsets))[i])]))


def counted(offsets: np.ndarray) -> np.ndarray:
    """Return for each element of consecutive groups the number of its group."""
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


def assert_invariant(random: Random, pairs: Sequence[Pair], results: dict[str, OverlayBatch]) -> None:
    """Results of changed pairs have the same areas and counts; of scaled ones the same vertices, scaled."""
    operation = str(random.choice(OPERATIONS))
    images = [changed(random, *pair) for pair in pairs]
    batch = overlay_batch(
        solids([each[0] for each in images]), solids([each[1] for each in images]), operation, workers=1
    )
    for before, after, (_, _, factor) in zip(results[operation], batch, images):
        assert before is not None
        assert after is not None
        assert after.area_exact == before.area_exact * Fraction(factor)
        assert (after.n_pieces_exact, after.n_holes_exact) == (before.n_pieces_exact, before.n_holes_exact)
        if factor != 1.0:
            np.testing.assert_array_equal(after.vertices, before.vertices * factor**0.5)


def check(random: Random, pairs: Sequence[Pair]) -> None:
    subjects, clips = solids([pair[0] for pair in pairs]), solids([pair[1] for pair in pairs])
    results = {operation: overlay_batch(subjects, clips, operation, workers=1) for operation in OPERATIONS}
    swapped = overlay_batch(clips, subjects, "difference", workers=1)
    for batch in (*results.values(), swapped):
        assert not batch.status.any()
        assert_valid_for_shapely(batch)
    for i, (subject, clip) in enumerate(pairs):
        rings = [[ring.tolist() for ring in each] for each in (subject, clip)]
        areas = fast_overlay.areas(*rings)
        largest = max(float(np.abs(ring).max()) for ring in subject + clip)
        for operation, batch in results.items():
            check_one(batch[i], areas.of(operation), largest)
            if i % CLOSELY == 0 and sum(map(len, rings[0] + rings[1])) <= 16:
                assert_valid(present(batch[i]))
                assert_equals_reference(present(batch[i]), *rings, operation)
        check_one(swapped[i], areas.clip, largest)
    assert_invariant(random, pairs, results)


def present(result: Overlay | None) -> Overlay:
    assert result is not None
    return result


def check_one(result: Overlay | None, area: Any, largest: float) -> None:
    """Assert the exact area, the counts, and that rounding moved the area by 4 ulp of perimeter times size at most."""
    result = present(result)
    exact = result.area_exact
    assert Q(exact.numerator, exact.denominator) == area
    assert_counts_add_up(result)
    error, length = area_error(result, exact)
    assert error <= 4 * 2.0**-52 * length * largest, f"the area is off by {error}"


@pytest.mark.some(10)
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_sample(family: Callable[[Random], Pair]) -> None:
    check(np.random.default_rng(9), [drawn(family, seed) for seed in range(3)])


@pytest.mark.full
@pytest.mark.parametrize("part", range(10))
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_all(family: Callable[[Random], Pair], part: int) -> None:
    n = 100 * FAMILIES[family]
    for first in range(part * n + 3, (part + 1) * n + 3, BATCH):
        check(np.random.default_rng(first), [drawn(family, seed) for seed in range(first, first + BATCH)])
