"""The union of a coverage: what the arrangement of all edges says, sources too; and when it is left to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import engine
from engine.polygon_overlay import overlay as module
from engine.polygon_overlay.coverage import union_of_coverage
from engine.polygon_overlay.pair_arrays import polygon_arrays_of
from engine.running.budget import Budget

FIELDS = ("vertices", "ring_offsets", "piece_offsets", "sources", "n_pieces_exact", "n_holes_exact", "rounds",
          "area_exact", "piece_areas", "collapsed")  # fmt: skip
Random = np.random.Generator


def grid(random: Random, n: int, moved: float) -> Any:
    places = np.stack(np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij"), -1)
    return places + random.uniform(-moved, moved, places.shape)


def cells(places: Any) -> list[list[Any]]:
    n = len(places) - 1
    ends = [(i, j) for i in range(n) for j in range(n)]
    return [[np.array([places[i, j], places[i + 1, j], places[i + 1, j + 1], places[i, j + 1]])] for i, j in ends]


def parcels(random: Random) -> list[list[Any]]:
    """Cells of a grid, begun anywhere, either way round."""
    return [
        [np.roll(cell[0], random.integers(4), axis=0)[:: random.choice([-1, 1])]]
        for cell in cells(grid(random, 12, 0.2))
    ]


def with_gaps(random: Random) -> list[list[Any]]:
    """Holes of the union, parcels that meet at one corner only, islands."""
    return [cell for cell in parcels(random) if random.random() < 0.7]


def with_islands(random: Random) -> list[list[Any]]:
    """Every parcel with a hole; some holes are filled, some by a parcel with a hole."""
    found = []
    for (cell,) in parcels(random):
        inner = cell.mean(axis=0) + 0.5 * (cell - cell.mean(axis=0))
        found.append([cell, inner])
        kind = random.integers(3)
        if kind:
            found.append(
                [inner[::-1]] if kind == 1 else [inner[::-1], inner.mean(axis=0) + 0.5 * (inner - cell.mean(axis=0))]
            )
    return found


def with_junctions(random: Random) -> list[list[Any]]:
    """Some cells in two halves, whose middles are no vertices of the cells beside."""
    found = []
    for cell in cells(grid(random, 12, 0.0)):
        (a, b, c, d), e, f = cell[0], cell[0][:2].mean(axis=0), cell[0][2:].mean(axis=0)
        found += [[np.array([a, e, f, d])], [np.array([e, b, c, f])]] if random.random() < 0.2 else [cell]
    return found


def of_many_corners(random: Random) -> list[list[Any]]:
    """Sides of nine edges that wind, the same for both neighbours."""
    places, found = grid(random, 6, 0.1), []
    bends = {}
    for cell in cells(places):
        ring = []
        for a, b in zip(cell[0], np.roll(cell[0], -1, axis=0)):
            key = tuple(sorted([tuple(a), tuple(b)]))
            if key not in bends:
                t = np.linspace(0, 1, 10)[:, None]
                bends[key] = np.array(key[0]) + t * (np.array(key[1]) - key[0]) + 0.02 * random.normal(size=(10, 2))
                bends[key][0], bends[key][-1] = key
            ring.append(bends[key][:-1] if tuple(a) == key[0] else bends[key][:0:-1])
        found.append([np.concatenate(ring)])
    return found


def overlapping(random: Random) -> list[list[Any]]:
    """A coverage, and one more parcel across some of it, or one twice."""
    found = parcels(random)
    return [*found, [found[5][0] + random.choice([0.0, 0.25])], [found[60][0] + 1e-9]]


def crossing_itself(random: Random) -> list[list[Any]]:
    return [*parcels(random), [np.array([[20, 0], [21, 1], [21, 0], [20, 1.0]])]]


def equal(random: Random) -> list[list[Any]]:
    """Parcels twice and more often, either way round."""
    found = parcels(random)
    return [*found, *([[found[5][0][:: random.choice([-1, 1])]] for _ in range(400)])]


def pie(random: Random) -> list[list[Any]]:
    """Two hundred slices with one common corner."""
    t = np.sort(random.uniform(0, 2 * np.pi, 200))
    rim = np.stack([np.cos(t), np.sin(t)], 1)
    return [[np.array([[0.0, 0.0], a, b])] for a, b in zip(rim, np.roll(rim, -1, axis=0))]


FAMILIES: dict[Callable[[Random], list[list[Any]]], bool | None] = {
    parcels: True, with_gaps: True, with_islands: True, with_junctions: True, of_many_corners: None, overlapping: False,
    crossing_itself: False, pie: None, equal: False,
}  # fmt: skip
"""Whether the union is made without the arrangement of all; None: as it happens."""


@pytest.mark.some(60)
@pytest.mark.parametrize("draw", FAMILIES)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("unit", [1.0, 0.1, 2.0**100, 2.0**-90])
def test_equals_the_arrangement(
    draw: Callable[[Random], list[list[Any]]], seed: int, unit: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(seed)
    polygons = [engine.Polygon([ring * unit for ring in rings]) for rings in draw(random)]
    random.shuffle(polygons)
    result = engine.union_all(polygons)
    with monkeypatch.context() as patch:
        patch.setattr(module, "union_of_coverage", lambda *_: None)
        expected = engine.union_all(polygons)
    for name in FIELDS:
        assert np.array_equal(getattr(result, name), getattr(expected, name)), name
    is_made = union_of_coverage(polygon_arrays_of(polygons), Budget()) is not None
    assert FAMILIES[draw] is None or is_made == FAMILIES[draw]


def test_far_from_the_origin_and_moved_by_an_ulp() -> None:
    """Parcels of one grid, one of them begun an ulp aside: its sides are no longer those of its neighbours."""
    places = grid(np.random.default_rng(4), 12, 0.2) + 1e9
    exact = [engine.Polygon(cell) for cell in cells(places)]
    assert engine.union_all(exact).n_pieces == 1
    assert engine.union_all(exact).n_holes == 0
    others = [*exact[:70], *exact[71:]]
    for way in (0.0, 1e10):
        moved = cells(places)[70][0].copy()
        moved[0] = np.nextafter(moved[0], way)
        result = engine.union_all([*others, engine.Polygon([moved])])
        apart = engine.Polygon(engine.union_all(others).rings), engine.Polygon([moved])
        assert result.area_exact == engine.overlay(*apart, "union").area_exact


def test_ends_at_its_deadline_and_takes_polygons_without_rings() -> None:
    polygons = [engine.Polygon(cell) for cell in cells(grid(np.random.default_rng(5), 20, 0.2))]
    with pytest.raises(engine.DeadlineExceededError):
        engine.union_all(polygons, deadline=0.0)
    empty = engine.Polygon([])
    result = engine.union_all([empty, *polygons, empty])
    assert np.array_equal(result.sources, engine.union_all(polygons).sources + 1)
