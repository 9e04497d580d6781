"""Rings left as rounding put them: what the compiled overlay leaves is what the integers say, collapses included."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.budget import Budget
from engine.polygon_overlay.in_integers import overlay_exactly
from engine.polygon_overlay.nearest import NearestRings, nearest_rings
from engine.polygon_overlay.run import overlay_compiled
from tests.unit.polygon_overlay import families as families
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import arrays

CROWDED = (families.rotated_lattice, families.nearly_lattice, families.slivers, families.pencils, families.combs)


def agree(family: Any, seed: int, told: Counter[str]) -> None:
    """Hold the results of a pair against those in integers, field by field."""
    first, second = map(arrays, families.drawn(family, seed))
    for operation in OPERATIONS:
        compiled = overlay_compiled(first, second, operation, "nearest", Budget())
        if compiled is None:
            continue
        result, (exact, _) = compiled[0], overlay_exactly(first, second, operation, "nearest", Budget())
        for name in ("vertices", "ring_offsets", "piece_offsets"):
            assert getattr(result, name).tolist() == getattr(exact, name).tolist(), name
        for name in ("output", "may_be_invalid", "n_pieces_exact", "n_holes_exact", "rounds", "collapsed", "snapped"):
            assert getattr(result, name) == getattr(exact, name), name
        assert (result.vertices_moved, result.pieces_joined, result.holes_parted) == (0, 0, 0)
        assert result.largest_displacement >= exact.largest_displacement * (1 - 2.0**-50)
        assert result.area_exact == exact.area_exact
        told["settled"] += 1
        told["collapsed"] += bool(result.collapsed)


@pytest.mark.parametrize("family", CROWDED, ids=lambda family: family.__name__)
def test_nearest_equals_that_in_integers(family: Any) -> None:
    told: Counter[str] = Counter()
    for seed in range(5):
        agree(family, seed, told)
    assert told["settled"] == 20
    assert told["collapsed"] > 0


@pytest.mark.full
@pytest.mark.parametrize("family", families.FAMILIES, ids=lambda family: family.__name__)
def test_nearest_equals_that_in_integers_many_times(family: Any) -> None:
    told: Counter[str] = Counter()
    for seed in range(300):
        agree(family, seed, told)
    assert told["settled"] > 0


def nearest(*pieces: list[list[tuple[float, float]]]) -> Any:
    rings = [ring for piece in pieces for ring in piece]
    vertices = np.array([vertex for ring in rings for vertex in ring], float)
    return nearest_rings(vertices, np.cumsum([0, *map(len, rings)]), np.cumsum([0, *map(len, pieces)]), Budget())


def places(found: NearestRings) -> list[Any]:
    rings = np.split(found.vertices, found.ring_offsets[1:-1])
    pieces = [rings[start:stop] for start, stop in zip(found.piece_offsets, found.piece_offsets[1:])]
    return [[list(map(tuple, ring.tolist())) for ring in piece] for piece in pieces]


def test_rings_without_area_are_left_out() -> None:
    """Points, segments, eights whose halves cancel, and flat rings that floating point cannot tell from slivers."""
    square: list[tuple[float, float]] = [(0, 0), (8, 0), (8, 8), (0, 8)]
    eight: list[tuple[float, float]] = [(1, 1), (2, 2), (1, 2), (2, 1)]
    flat: list[tuple[float, float]] = [(0.1 * k, 0.3 * k) for k in (1, 2, 4)]
    sliver = [(x, float(np.nextafter(y, 9))) if k == 1 else (x, y) for k, (x, y) in enumerate(flat)]
    assert Fraction(flat[1][1]) * 1 == 2 * Fraction(flat[0][1])
    found = nearest([square, eight, sliver, [(1, 1), (1, 1), (1, 1)]], [flat], [eight, sliver], [[(3, 3), (4, 4)]])
    assert places(found) == [[square, sliver]]
    assert found.numbers.tolist() == [0, 1, 2, 3, 8, 9, 10]
    assert (found.lost_pieces, found.lost_holes) == ([4, 5, 7], [1, 3, 6])


def test_a_ring_that_passes_its_first_vertex_twice_begins_where_it_comes_first() -> None:
    twice: list[tuple[float, float]] = [(3, 0), (3, 1), (0, 0), (0, 0), (2, 1), (2, 2), (0, 0)]
    found = nearest([twice], [[(0, 0), (1, 0), (0, 1)]])
    assert places(found) == [[[(0, 0), (1, 0), (0, 1)]], [[(0, 0), (2, 1), (2, 2), (0, 0), (3, 0), (3, 1)]]]
    assert (len(found.vertices), found.ring_offsets.tolist()) == (9, [0, 3, 9])
    assert (found.piece_offsets.tolist(), found.numbers.tolist()) == ([0, 1, 2], [7, 8, 9, 3, 4, 5, 6, 0, 1])


def test_holes_stay_with_their_shell_where_pieces_change_places() -> None:
    """What is exactly left of another piece need not be any more once both are rounded."""
    square: list[tuple[float, float]] = [(1, 0), (9, 0), (9, 9), (1, 9)]
    hole: list[tuple[float, float]] = [(3, 3), (3, 4), (4, 3)]
    left: list[tuple[float, float]] = [(0, 0), (1, 0), (0, 1)]
    found = nearest([square, hole], [left])
    assert places(found) == [[left], [square, hole]]
    assert (found.piece_offsets.tolist(), found.numbers.tolist()) == ([0, 1, 3], [7, 8, 9, 0, 1, 2, 3, 4, 5, 6])
