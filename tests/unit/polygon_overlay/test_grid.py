"""Overlays on a grid: on its multiples, valid, the same as snapping in fractions, and never further than 0.71 of it."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import engine
from engine.arrangement.arrange import snap_rings
from engine.polygon_overlay import grid as grids
from engine.running.budget import Budget
from engine.types import read_only
from tests.reference import fast_overlay
from tests.reference.exact import Q
from tests.unit.polygon_overlay.checks import OPERATIONS, assert_counts_add_up, assert_valid
from tests.unit.polygon_overlay.families import FAMILIES, drawn, star
from tests.unit.polygon_overlay.test_union_all import LAYERS, square

GRIDS = [2.0**-3, 0.25, 1.0, 0.1, 0.01, 1e-6, 1e-9, 2.0**-30]


def assert_on_grid(vertices: np.ndarray, size: float) -> None:
    power = round(np.log10(size))
    is_ten = size != 1.0 and size == float(f"1e{power}")
    step = Fraction(10) ** power if is_ten else Fraction(size)
    for value in set(vertices.ravel().tolist()):
        assert value == float(round(Fraction(value) / step) * step)


def snapped_in_fractions(result: engine.Overlay, size: float) -> Any:
    """Snap the valid rings of an overlay by `snap_rings`, and return the area of their union."""
    rings = [[(Fraction(x), Fraction(y)) for x, y in ring.tolist()] for ring in result.rings]
    snapped, _ = snap_rings(rings, round(np.log2(size)))
    shells = result.piece_offsets.tolist()
    pieces = [snapped[start:stop] for start, stop in pairwise(shells)]
    return fast_overlay.area_where(pieces, lambda windings: any(winding % 2 for winding in windings))


def distance_to(rings: list[np.ndarray], x: float, y: float) -> float:
    """Return about how far a point is from the edges of rings."""
    least = np.inf
    for ring in rings:
        a, b = ring, np.roll(ring, -1, axis=0)
        along, to = b - a, np.array([x, y]) - a
        length = (along**2).sum(1)
        t = np.clip((to * along).sum(1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
        least = min(least, float(np.hypot(*(to - t[:, None] * along).T).min()))
    return least


@pytest.mark.some(24)
@pytest.mark.parametrize("size", GRIDS)
@pytest.mark.parametrize("seed", range(8))
def test_valid_near_and_on_multiples(seed: int, size: float) -> None:
    random = np.random.default_rng(seed)
    subject, clip = (engine.Polygon(rings) for rings in drawn([*FAMILIES][seed % len(FAMILIES)], seed))
    if np.abs(subject.vertices).max() > 2.0**40 * size:
        return
    for operation in OPERATIONS:
        before, result = (engine.overlay(subject, clip, operation, grid=g) for g in (None, size))
        assert_valid(result)
        assert_counts_add_up(result)
        assert_on_grid(result.vertices, size)
        assert result.largest_displacement <= 0.7072 * size + 1e-14 * (1 + np.abs(subject.vertices).max())
        for x, y in random.permutation(result.vertices)[:20].tolist():
            assert distance_to(before.rings, x, y) <= 0.7072 * size + 1e-12
        if size in (0.25, 1.0, 0.125):
            area = result.area_exact
            assert Q(area.numerator, area.denominator) == snapped_in_fractions(before, size)
        again = engine.overlay(engine.Polygon(result.rings), engine.Polygon([]), "union", grid=size)
        assert np.array_equal(again.vertices, result.vertices)
        assert not again.snapped
        assert len(result.sources) == len(result.vertices)


@pytest.mark.parametrize("size", [0.5, 0.1, 1e-3])
@pytest.mark.parametrize("draw", LAYERS)
@pytest.mark.parametrize("seed", range(4))
def test_unions(draw: Any, seed: int, size: float) -> None:
    layer = [engine.Polygon(rings) for rings in draw(np.random.default_rng(seed))]
    result = engine.union_all(layer, grid=size)
    assert_valid(result)
    assert_on_grid(result.vertices, size)
    assert set(result.sources.tolist()) <= set(range(len(layer)))


def test_borders_that_nearly_coincide() -> None:
    """Parcels measured to ten digits, each with corners of its own and its neighbours' corners on its edges."""
    random = np.random.default_rng(0)
    parcels = []
    for i in range(5):
        for j in range(5):
            ring = [(i, j), (i + 0.5, j), (i + 1, j), (i + 1, j + 1), (i + 0.3, j + 1), (i, j + 1)]
            parcels.append(engine.Polygon([np.array(ring) / 3 + (random.random((6, 2)) - 0.5) * 1e-10]))
    assert engine.union_all(parcels).n_holes > 0
    result = engine.union_all(parcels, grid=1e-6)
    assert (result.n_pieces, result.n_holes) == (1, 0)
    assert result.area == pytest.approx(25 / 9, abs=1e-5)
    assert engine.overlay(parcels[0], parcels[1], grid=1e-6).n_pieces == 0


def test_what_is_lost_is_told() -> None:
    tiny, large = engine.Polygon([square(0.25, 0.25, 0.25)]), engine.Polygon([square(3, 3, 0.75)])
    result = engine.overlay(tiny, large, "union", grid=8)
    assert result.n_pieces == 0
    assert [(part.kind, part.area) for part in result.collapsed] == [
        ("piece", Fraction(1, 16)),
        ("piece", Fraction(9, 16)),
    ]
    assert engine.overlay(engine.Polygon([square(0.1, 0, 0.1)]), large, "union", grid=1).vertices.tolist() == [
        [3, 3],
        [4, 3],
        [4, 4],
        [3, 4],
    ]


def test_edge_goes_through_the_pixels_it_passes() -> None:
    long = engine.Polygon([[(0, 0), (20, 1), (20, 5), (0, 5)]])
    below = engine.Polygon([[(8, -3), (12, -3), (10.25, 0.375)]])
    assert engine.union_all([long, below]).n_pieces == 2
    assert engine.union_all([long, below], grid=1).n_pieces == 2  # they meet in a point now
    assert [10.0, 0.0] in engine.union_all([long, below], grid=1).vertices.tolist()


def test_pixels_are_half_open() -> None:
    triangle = np.array([[0.5, -0.5], [1.5, 2.5], [-1.5, 0.49999999999999994]])
    one = read_only(np.array([0, 3])), read_only(np.array([0, 1]))
    assert grids.snap_vertices(read_only(triangle), *one, Budget()).vertices.tolist() == [[1, 0], [2, 3], [-1, 0]]


@pytest.mark.parametrize("family", ["fine", "touching"])
@pytest.mark.parametrize("size", [2.0**-3, 2.0**-5, 2.0**-7])
def test_rings_that_stay_are_as_arranged_again(family: str, size: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fine rings get straight vertices, which are left out; not where rings meet in them."""
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    disc = np.round(np.column_stack([np.cos(angles), np.sin(angles)]) * 2.0**8) / 2.0**7
    subject = engine.Polygon([disc * 1.01])
    clip = engine.Polygon([disc * 1.01 + (0.7, 0.3)])
    if family == "touching":  # in (0, -2) or nearly
        subject, clip = engine.Polygon([disc]), engine.Polygon([[(-4, -2), (4, -2), (4, -4.3), (-4.1, -4)]])
    snapped = grids.snap_vertices

    def bent(vertices: Any, offsets: Any, *rest: Any) -> Any:
        found = snapped(vertices, offsets, *rest)
        return found._replace(keeps_topology=False, vertices=np.floor(vertices + 0.5), offsets=offsets, edges=None)

    for operation in OPERATIONS:
        told = []
        for known in (snapped, bent):
            monkeypatch.setattr("engine.polygon_overlay.run.snap_vertices", known)
            result = engine.overlay(subject, clip, operation, grid=size)
            assert_valid(result)
            told.append([result.vertices.tobytes(), result.ring_offsets.tolist(), result.sources.tolist()])
            told[-1] += [result.rounds, result.vertices_moved, result.largest_displacement, result.area_exact]
        assert told[0] == told[1]


def test_doubles_that_do_not_tell_multiples_apart() -> None:
    """Tenths far from zero are checked: here they stay valid."""
    far = 2.0**30
    ring = star(np.random.default_rng(1), 30, 0.0, 5.0) + far
    result = engine.overlay(engine.Polygon([ring]), engine.Polygon([ring + 0.05]), "union", grid=0.1)
    assert_valid(result)
    assert_on_grid(result.vertices, 0.1)


@pytest.mark.parametrize("size", [0.0, -1.0, 3.0, float("nan"), float("inf"), "1", True, 1e-23, 0.30000000000000004])
def test_refused_grids(size: Any) -> None:
    unit = engine.Polygon([square(0, 0, 1)])
    with pytest.raises(engine.InvalidInputError, match="power of two") as info:
        engine.overlay(unit, unit, grid=size)
    assert info.value.where == ("grid",)


def test_refusals() -> None:
    unit = engine.Polygon([square(0, 0, 1)])
    with pytest.raises(engine.InvalidInputError, match=r"2\^-51"):
        engine.overlay(unit, unit, grid=2.0**-60)
