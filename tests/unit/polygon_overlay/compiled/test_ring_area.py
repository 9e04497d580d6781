"""Areas as certified doubles against the nearest double of the exact sum, and left unsure where they must be."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.errors import NotRepresentableError
from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.implicit_rings import ImplicitRings
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.result import Overlay
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay import families as families
from tests.unit.polygon_overlay.checks import OPERATIONS, structure
from tests.unit.polygon_overlay.families import FAMILIES, star


def in_integers(result: Overlay) -> Overlay:
    return replace(result, exact=result.exact.exact_rings())


def assert_nearest(result: Overlay) -> None:
    assert result.area == float(result.area_exact)
    areas = sorted(result.piece_areas.tolist())
    assert areas == sorted(float(area) for area, _ in structure(result))


@pytest.mark.some(10)
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_areas_are_nearest(family: Any) -> None:
    for seed in range(3):
        subject, clip = (Polygon(rings) for rings in families.drawn(family, seed))
        for operation in OPERATIONS:
            assert_nearest(overlay(subject, clip, operation))


def test_most_areas_are_sure_without_the_exact_sum() -> None:
    random = np.random.default_rng(1)
    for n in (5, 40, 400):
        found = overlay(Polygon([star(random, n)]), Polygon([star(random, n) + 0.1]), "union").exact
        assert isinstance(found, ImplicitRings)
        assert found.certified_areas(np.array([0, found.n_rings]))[1] == 0


@pytest.mark.parametrize("x", [0.0, 1.5, 3.0, -3.0, -1e7, 2.0**40])
def test_areas_of_long_rings_wherever_they_lie(x: float) -> None:
    """Counted from zero, or from their first vertex where all are between its half and its double."""
    angles = np.arange(500) * np.pi / 250
    rings = [np.stack([x + shift + np.cos(angles), np.sin(angles)], axis=1) for shift in (0.0, 0.3)]
    for subject, clip in (rings, (rings[0][::-1], rings[1])):
        found = overlay(Polygon([subject]), Polygon([clip]), "union")
        assert_nearest(found)
        assert isinstance(found.exact, ImplicitRings)
        assert found.exact.certified_areas(np.array([0, found.exact.n_rings]))[1] == 0


def test_a_tie_and_a_sum_that_cancels_are_left_to_the_exact_sum() -> None:
    far, width = 2.0**27, 2.0**27 + 1  # (2^27 + 1)^2 = 2^54 + 2^28 + 1 is not a double
    square = Polygon([[(0, 0), (width, 0), (width, width), (0, width)]])
    for result in (overlay(square, square), overlay(square, Polygon([[(-1, -1), (0, -1), (0, 0)]]), "union")):
        assert result.area == float(result.area_exact)
    sliver = Polygon([[(0, 0), (far, far + 1), (2 * far, 2 * far + 2), (far + 1, far + 2)]])
    assert_nearest(overlay(sliver, Polygon([[(-1, -1), (3 * far, -1), (0, 3 * far)]])))


@pytest.mark.parametrize("scale", [2.0**300, 2.0**-300, 2.0**-520, 2.0**511])
def test_areas_at_the_ends(scale: float) -> None:
    random = np.random.default_rng(2)
    result = overlay(Polygon([star(random, 9) * scale]), Polygon([star(random, 9) * scale]), "difference")
    assert result.area == float(result.area_exact)


@pytest.mark.parametrize("scale", [2.0**-538, 2.0**-600, 2.0**-1074, 2.0**509])
def test_pieces_are_told_from_holes_where_areas_are_no_doubles(scale: float) -> None:
    frame = Polygon([np.array([(0, 0), (k, 0), (k, k), (0, k)]) * scale for k in (8, 7)])
    result = overlay(frame, Polygon([[(9e9, 9e9), (9.1e9, 9e9), (9e9, 9.1e9)]]), "difference")
    assert result.piece_areas.tolist() == [float(result.area_exact)] == [15 * scale * scale]
    assert in_integers(result).piece_areas.tolist() == result.piece_areas.tolist()


def test_an_area_that_is_no_double_is_refused() -> None:
    square = Polygon([[(0, 0), (2.0**600, 0), (2.0**600, 2.0**600)]])
    with pytest.raises(NotRepresentableError):
        _ = overlay(square, square).area


@pytest.mark.parametrize("operation", OPERATIONS)
def test_areas_of_a_batch_are_those_of_its_pairs(operation: Any) -> None:
    random = np.random.default_rng(3)
    pairs = [families.drawn(family, seed) for family in FAMILIES for seed in range(3)]
    pairs += [
        ([star(random, 6)], [star(random, 7) + np.array([3.0, 0])]),
        ([star(random, 6) * 1e300], [star(random, 7)]),
    ]
    subjects, clips = ([Polygon(pair[k]) for pair in pairs] for k in (0, 1))
    batch = overlay_batch(subjects, clips, operation, workers=1)
    for area, status, subject, clip in zip(batch.areas, batch.status, subjects, clips, strict=True):
        if status:
            assert np.isnan(area)
            continue
        exact = overlay(subject, clip, operation).area_exact
        assert area == (np.inf if exact >= 2**1024 else float(exact))


def test_areas_add_up() -> None:
    random = np.random.default_rng(4)
    subject, clip = Polygon([star(random, 50)]), Polygon([star(random, 60)])
    parts = [Fraction(overlay(subject, clip, name).area) for name in ("intersection", "difference")]
    whole = overlay(subject, subject).area_exact
    assert abs(sum(parts) - whole) <= Fraction(np.spacing(float(whole)))
