"""The union of many and the fill rules against rationals: areas, pieces and holes, validity, sources of edges."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import engine
from engine.polygon_overlay import hidden
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.compiled.ring_nesting import Nesting, Rule
from engine.polygon_overlay.implicit_rings import NO_RINGS
from engine.polygon_overlay.in_integers import overlay_exactly
from engine.polygon_overlay.overlay import less_all, overlay_rings
from engine.polygon_overlay.pair_arrays import polygon_arrays_of
from engine.running.budget import Budget
from tests.reference import fast_overlay
from tests.reference import overlay as reference
from tests.reference.exact import Q
from tests.reference.solids import edges
from tests.unit.polygon_overlay.checks import area_error, assert_counts_add_up, assert_valid, structure
from tests.unit.polygon_overlay.compiled.test_kernel import arrays
from tests.unit.polygon_overlay.families import FAMILIES, Random, Rings, drawn

RULES: dict[str, tuple[int, Callable[[int], bool]]] = {
    "non_zero": (Rule.NON_ZERO, lambda winding: winding != 0),
    "positive": (Rule.POSITIVE, lambda winding: winding > 0),
    "negative": (Rule.NEGATIVE, lambda winding: winding < 0),
}


def square(x: float, y: float, size: float) -> list[tuple[float, float]]:
    return [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]


def circle_at(x: float, y: float) -> np.ndarray:
    turns = np.arange(16) * np.pi / 8
    return np.c_[np.cos(turns), np.sin(turns)] + np.array([x, y])


def all_at_once(polygons: list[engine.Polygon]) -> Any:
    """The union by one arrangement of all edges."""
    flat = polygon_arrays_of(polygons)
    nesting = Nesting(np.arange(len(polygons)), np.zeros(0), int(Rule.ANY))
    return overlay_rings(RingArrays(*flat[:2]), NO_RINGS, "union", Budget(), nesting)[:2]


def is_in_any(windings: tuple[int, ...]) -> bool:
    return any(winding % 2 for winding in windings)


def crowd(random: Random) -> list[Rings]:
    """Polygons of one ring or two on a lattice, that cross, touch, coincide and nest as it happens."""
    size = random.integers(3, 9)
    return [
        [random.integers(0, size, (n, 2)).astype(float) for n in random.integers(2, 6, random.integers(1, 3))]
        for _ in range(random.integers(1, 7))
    ]


def parcels(random: Random) -> list[Rings]:
    """A grid whose cells share all edges, some cells left out, some twice, each begun anywhere, either way round."""
    k = int(random.integers(1, 4))
    grid = np.stack(np.meshgrid(np.arange(k + 1.0), np.arange(k + 1.0), indexing="ij"), -1)
    grid += random.random(grid.shape) / 3
    cells = [
        np.array([grid[i, j], grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]]) for i in range(k) for j in range(k)
    ]
    return [
        [np.roll(cells[c], random.integers(4), axis=0)[:: random.choice([-1, 1])]] for c in random.integers(0, k * k, 7)
    ]


def islands(random: Random) -> list[Rings]:
    """Frames in each other's holes, some of which touch."""
    found: list[Rings] = []
    for size in (random.choice(12, 5, replace=False) + 1).tolist():
        inner = size - random.choice([0.5, 1.0])
        found.append([np.array(square(-size, -size, 2.0 * size)), np.array(square(-inner, -inner, 2.0 * inner))[::-1]])
    return found


def of_a_family(random: Random) -> list[Rings]:
    subject, clip = drawn([*FAMILIES][random.integers(len(FAMILIES))], int(random.integers(1000)))
    return [subject, *([ring] for ring in clip)]


LAYERS = (crowd, parcels, islands, of_a_family)


def far(layer: list[Rings]) -> list[Rings]:
    """Add what only integers hold beside the rest."""
    return [*layer, [np.array([[0, 0], [1e-200, 0], [0, 1e-200]])], [np.array([[0, 0], [-1e200, 0], [0, -1e200]])]]


def listed(layer: list[Rings]) -> list[Any]:
    return [[ring.tolist() for ring in rings] for rings in layer]


def check(result: engine.Overlay, layer: list[Any], is_inside: Callable[[tuple[int, ...]], bool]) -> None:
    area = result.area_exact
    assert Q(area.numerator, area.denominator) == fast_overlay.area_where(layer, is_inside)
    assert_counts_add_up(result)
    if sum(len(ring) for rings in layer for ring in rings) <= 24:
        cells = reference.trapezoids(*(edges({"type": "polygon", "rings": rings}) for rings in layer))
        found = reference.structure(cells, [cell for cell in cells if is_inside(cell.windings)])
        assert structure(result) == [(Fraction(int(a.numerator), int(a.denominator)), n) for a, n in found.pieces]
    if len(result.vertices) < 300:
        assert_valid(result)


def runs_along(layer: list[Any], source: int, a: list[float], b: list[float]) -> bool:
    """Tell whether the edge from a begins along an edge of a polygon."""
    (ax, ay), (bx, by) = ([Fraction(x) for x in point] for point in (a, b))
    for ring in layer[source]:
        for c, d in pairwise([*ring, ring[0]]):
            (cx, cy), (dx, dy) = ([Fraction(x) for x in point] for point in (c, d))
            on_line = all((dx - cx) * (y - cy) == (dy - cy) * (x - cx) for x, y in ((ax, ay), (bx, by)))
            ends = sorted(((p - ax) * (bx - ax) + (q - ay) * (by - ay)) for p, q in ((cx, cy), (dx, dy)))
            if on_line and ends[0] <= 0 < ends[1]:
                return True
    return False


@pytest.mark.parametrize("draw", LAYERS)
@pytest.mark.parametrize("seed", range(12))
def test_union_equals_the_reference(draw: Callable[[Random], list[Rings]], seed: int) -> None:
    assert_union(draw, seed)


@pytest.mark.full
@pytest.mark.parametrize("draw", LAYERS)
@pytest.mark.parametrize("part", range(10))
def test_unions_of_twenty_thousand_layers(draw: Callable[[Random], list[Rings]], part: int, seed: str) -> None:
    for number in range(500 * part, 500 * part + 500):
        assert_union(draw, [number, *seed.encode()] if seed else number)


def assert_union(draw: Callable[[Random], list[Rings]], seed: int | list[int]) -> None:
    random = np.random.default_rng(seed)
    layer = listed(draw(random))
    result = engine.union_all([engine.Polygon(rings) for rings in layer])
    check(result, layer, is_in_any)
    order = random.permutation(len(layer)).tolist()
    again = engine.union_all([engine.Polygon(layer[k]) for k in order])
    for name in ("vertices", "ring_offsets", "piece_offsets"):
        assert np.array_equal(getattr(result, name), getattr(again, name))
    if not result.rounds:
        for ring, sources in zip(result.rings, np.split(result.sources, result.ring_offsets[1:-1]), strict=False):
            for (a, b), source in zip(pairwise([*ring.tolist(), ring[0].tolist()]), sources.tolist(), strict=True):
                assert runs_along(layer, source, a, b)


@pytest.fixture
def small_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few polygons are taken for many: hidden ones are left out in groups of two, then of more."""
    for name, value in {"_DEEP": 0.0, "_GROUP": 2, "_GROWS": 2, "_PAYS": 1.0, "_FUTILE": 1.0}.items():
        monkeypatch.setattr(hidden, name, value)


@pytest.mark.usefixtures("small_groups")
@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("draw", [crowd, parcels, islands, of_a_family])
def test_unions_without_what_is_hidden(draw: Callable[[Random], list[Rings]], seed: int) -> None:
    assert_union(draw, 5000 + seed)


@pytest.mark.usefixtures("small_groups")
def test_a_hidden_polygon_that_fills_a_hole_stays() -> None:
    frame = [[(0, 0), (9, 0), (9, 9), (0, 9)], [(3, 3), (6, 3), (6, 6), (3, 6)]]
    layer = polygon_arrays_of([engine.Polygon(rings) for rings in (frame, [square(2, 2, 5)], [square(1, 1, 1)])])
    assert np.diff(hidden.without_hidden(layer, Budget()).polygon_offsets).tolist() == [2, 1, 0]


def test_many_on_each_other() -> None:
    random = np.random.default_rng(5)
    layer = [[circle_at(*random.normal(size=2) / 8)] for _ in range(200)]
    polygons = [engine.Polygon(rings) for rings in layer]
    few = hidden.without_hidden(polygon_arrays_of(polygons), Budget())
    assert np.count_nonzero(np.diff(few.polygon_offsets)) < 40
    result, (expected, _) = engine.union_all(polygons), all_at_once(polygons)
    for name in ("vertices", "ring_offsets", "piece_offsets"):
        assert getattr(result, name).tolist() == getattr(expected, name).tolist()
    assert result.exact.exact_rings() == expected.exact.exact_rings()


@pytest.mark.parametrize("draw", LAYERS)
@pytest.mark.parametrize("seed", range(12))
def test_what_others_leave_of_the_first(draw: Callable[[Random], list[Rings]], seed: int) -> None:
    """Compiled, and beside what only integers hold."""
    for layer in (draw(np.random.default_rng(seed)), far(draw(np.random.default_rng(seed)))):
        there = [rings for rings in listed(layer) if engine.Polygon(rings).n_rings]
        first, *others = (engine.Polygon(rings) for rings in there)
        result, _ = less_all(first, others, Budget())
        check(result, there, lambda windings: windings[0] % 2 > 0 and not is_in_any(windings[1:]))


@pytest.mark.parametrize("seed", range(20))
def test_two_are_united_as_overlay_does(seed: int) -> None:
    subject, clip = (engine.Polygon(rings) for rings in drawn([*FAMILIES][seed % len(FAMILIES)], seed))
    both, result = engine.overlay(subject, clip, "union"), engine.union_all([subject, clip])
    for name in ("vertices", "ring_offsets", "piece_offsets", "sources", "area_exact", "n_pieces_exact", "rounds"):
        assert np.array_equal(getattr(both, name), getattr(result, name)), name


@pytest.mark.parametrize("draw", LAYERS)
@pytest.mark.parametrize("seed", range(3))
def test_far_exponents(draw: Callable[[Random], list[Rings]], seed: int) -> None:
    layer = listed(far(draw(np.random.default_rng(seed))))
    result, accuracy = engine.union_all([engine.Polygon(rings) for rings in layer], report=True)
    area = result.area_exact
    assert Q(area.numerator, area.denominator) == fast_overlay.area_where(layer, is_in_any)
    assert_valid(result)
    assert accuracy.n_rational > 0
    assert set(result.sources.tolist()) <= set(range(len(layer)))


@pytest.mark.parametrize("draw", LAYERS)
@pytest.mark.parametrize("seed", range(6))
def test_integers_agree(draw: Callable[[Random], list[Rings]], seed: int) -> None:
    layer = draw(np.random.default_rng(seed))
    sources = np.repeat(np.arange(len(layer)), [len(rings) for rings in layer])
    rings = arrays([ring for rings in layer for ring in rings])
    exact, _ = overlay_exactly(rings, NO_RINGS, "union", Budget(), Nesting(sources, np.zeros(0), Rule.ANY))
    result = engine.union_all([engine.Polygon(rings) for rings in layer])
    for name in ("vertices", "ring_offsets", "piece_offsets", "area_exact", "n_pieces_exact", "n_holes_exact"):
        assert np.array_equal(getattr(exact, name), getattr(result, name)), name
    starts = np.cumsum([sum(map(len, rings)) for rings in layer])
    assert exact._edges is not None
    assert np.array_equal(np.searchsorted(starts, exact._edges, side="right"), result.sources)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("number", range(25))
def test_fill_rules(rule: Any, number: int) -> None:
    assert_filled(rule, number, number)


@pytest.mark.full
@pytest.mark.parametrize("rule", RULES)
def test_fills_of_ten_thousand_drawings(rule: Any, seed: str) -> None:
    for number in range(3333):
        assert_filled(rule, number, [number, *seed.encode()])


def assert_filled(rule: str, number: int, seed: int | list[int]) -> None:
    random = np.random.default_rng(seed)
    code, is_inside = RULES[rule]
    if number % 3:
        rings = [random.integers(0, 5, (n, 2)).astype(float) for n in random.integers(2, 8, 3)]
    else:
        rings = [ring for layer in of_a_family(random) for ring in layer]
    if number % 5 == 0:
        rings = [ring for layer in far([rings]) for ring in layer]
    found, body = engine.filled(rings, rule), [[ring.tolist() for ring in rings]]
    nesting = Nesting(np.zeros(len(rings), np.int64), np.zeros(0), code)
    exact, _ = overlay_exactly(arrays(rings), NO_RINGS, "union", Budget(), nesting)
    check(exact, body, lambda windings: is_inside(windings[0]))
    assert np.array_equal(found.vertices, exact.vertices)
    assert found.ring_offsets.tolist() == exact.ring_offsets.tolist()
    assert area_error(exact, exact.area_exact)[0] >= 0.0


def test_positive_and_negative_are_mirror_images() -> None:
    rings = [square(0, 0, 4), square(1, 1, 2)[::-1], square(1.5, 1.5, 1)[::-1]]
    turned = [ring[::-1] for ring in rings]
    assert engine.filled(rings, "positive").vertices.tolist() == engine.filled(turned, "negative").vertices.tolist()
    assert engine.filled(rings, "negative").vertices.tolist() == [list(corner) for corner in square(1.5, 1.5, 1)]


def test_nothing_and_what_is_empty() -> None:
    nothing = engine.union_all([])
    assert (nothing.n_pieces, nothing.area, nothing.sources.tolist()) == (0, 0.0, [])
    empty, unit = engine.Polygon([]), engine.Polygon([square(0, 0, 1)])
    assert engine.union_all([empty, empty]).n_pieces == 0
    assert engine.union_all([empty, unit, empty, empty, unit]).sources.tolist() == [1] * 4
    assert engine.filled([], "non_zero").n_rings == 0
    assert engine.Polygon(engine.overlay(unit, empty).rings).n_rings == 0
    for operation, area in (("intersection", 0), ("union", 1), ("difference", 1), ("symmetric_difference", 1)):
        assert engine.overlay(unit, empty, operation).area == area  # type: ignore[call-overload]
        batch = engine.overlay_batch([unit, empty, empty], [empty, empty, unit], operation)  # type: ignore[arg-type]
        assert batch.areas.tolist() == [area, 0, area if operation != "difference" else 0]
        assert isinstance(batch, engine.OverlayBatch)
        assert [one.area for one in batch if one] == batch.areas.tolist()


def test_rounded_rings_have_sources() -> None:
    random = np.random.default_rng(3)
    stars = [engine.Polygon([random.random((9, 2))]) for _ in range(4)]
    result = engine.union_all(stars)
    assert result.rounds > 0
    assert len(result.sources) == len(result.vertices)
    assert set(result.sources.tolist()) <= {0, 1, 2, 3}


@pytest.mark.parametrize(
    ("ask", "error", "where"),
    [
        (lambda: engine.union_all(engine.Polygon([])), engine.InvalidArrayError, ("polygons",)),  # type: ignore[arg-type]
        (lambda: engine.union_all([engine.Sphere([0, 0], 1)]), engine.UnsupportedSolidError, ("polygons", 0)),
        (lambda: engine.filled([], "even_odd"), engine.InvalidOperationError, ("rule",)),  # type: ignore[arg-type]
        (lambda: engine.filled([[]], "positive"), engine.RingTooShortError, ("rings", 0)),
        (lambda: engine.union_all([engine.Polygon([])], deadline=-1.0), engine.DeadlineExceededError, ()),
    ],
)
def test_refusals(ask: Callable[[], Any], error: type[engine.EngineError], where: tuple[Any, ...]) -> None:
    with pytest.raises(error) as info:
        ask()
    assert info.value.where == where


def test_polygons_that_are_there_twice_count_once_and_edges_come_from_the_first() -> None:
    """Before, each edge met each of its copies: 16,000 equal squares took eight minutes."""
    squares = [engine.Polygon([[(x, 0), (x + 2, 0), (x + 2, 2), (x, 2)]]) for x in (0, 1)]
    empty = engine.Polygon([])
    once, twice = (
        engine.union_all(squares),
        engine.union_all([squares[0], squares[0], empty, squares[1], *(squares * 2000)]),
    )
    assert (twice.vertices.tolist(), twice.area) == (once.vertices.tolist(), once.area)
    assert twice.sources.tolist() == [{0: 0, 1: 3}[source] for source in once.sources.tolist()]
