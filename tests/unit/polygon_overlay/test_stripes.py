"""Unions by stripes have the bytes of unions made at once, whatever lies across the sides; else there are none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import engine
from engine.polygon_overlay import overlay as overlays
from engine.polygon_overlay import stripes
from engine.polygon_overlay.run import BY_VERTEX
from engine.polygon_overlay.stripes import union_by_stripes
from engine.running.budget import Cancel
from engine.types import FloatArray, read_only

Maker = Callable[[np.random.Generator], list[engine.Polygon]]


@pytest.fixture(autouse=True)
def _small_stripes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stripes, "_LEAST", 60)
    monkeypatch.setattr(stripes, "_LEAST_IN_ALL", 0)
    monkeypatch.setattr(stripes, "_REPEATED", 4.0)


def _star(rng: np.random.Generator, n: int, size: float, at: FloatArray) -> FloatArray:
    angles = (np.sort(rng.random(n)) + np.arange(n)) * (np.pi / n)
    return at + size * rng.uniform(0.3, 1.0, (n, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _stars(rng: np.random.Generator) -> list[engine.Polygon]:
    return [engine.Polygon([_star(rng, 12, 1.0, at)[:: rng.choice([1, -1])]]) for at in rng.uniform(0, 14, (150, 2))]


def _long(rng: np.random.Generator) -> list[engine.Polygon]:
    """Edges over many stripes, in both directions, among small ones."""
    bars = [
        engine.Polygon([[(x, y), (20 - x, y + slope), (20.5 - x, y + slope + 0.3), (x + 0.1, y + 0.2)]])
        for x, y, slope in rng.uniform(0, 12, (9, 3)) * (0.2, 1, 0.1)
    ]
    return [*bars, *_stars(rng)[:70]]


def _holes(rng: np.random.Generator) -> list[engine.Polygon]:
    """Islands in holes: one ring around everything, whose edges lie far from most stripes."""
    frame = engine.Polygon([[(-9, -9), (30, -8), (29, 31), (-8, 30)], [(-5, -5), (-4, 25), (26, 26), (25, -4)]])
    sheet = engine.Polygon([[(40, -9), (80, -8), (79, 31), (42, 30)], *(
        _star(rng, 8, 1.5, np.array([x, y])) for x in range(44, 78, 4) for y in range(-4, 28, 4)
    )])  # fmt: skip
    return [frame, sheet, *_stars(rng)]


def _tee(_: np.random.Generator) -> list[engine.Polygon]:
    """One region whose parts at the left of an abscissa that is a side meet its right only across that."""
    grid = [engine.Polygon([[(x + 0.1, 50.3), (x + 0.7, 50.1), (x + 0.4, 50.9)]]) for x in range(60)]
    left = engine.Polygon([[(0, 0.25), (30, 0), (30.0, 10.0), (0.5, 10.5)]])
    return [left, engine.Polygon([[(29.5, 3), (60, 3.25), (60.5, 7), (29.25, 7.5)]]), *grid]


def _bows(rng: np.random.Generator) -> list[engine.Polygon]:
    """Polygons that cross themselves: rings meet, but none of several stripes."""
    bows = [engine.Polygon([rng.uniform((4 * x, 0), (4 * x + 2, 2), (6, 2))]) for x in range(60)]
    return [*bows, engine.Polygon([[(-1, 50), (250, 51), (120, 52)]])]


@pytest.fixture
def by_stripes(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether each union so far was made by stripes."""
    seen: list[bool] = []

    def noted(*arguments: object) -> object:
        made = union_by_stripes(*arguments)  # type: ignore[arg-type]
        seen.append(made is not None)
        return made

    monkeypatch.setattr(overlays, "union_by_stripes", noted)
    return seen


@pytest.mark.parametrize("make", [_stars, _long, _holes, _tee, _bows])
@pytest.mark.parametrize("turn", [False, True], ids=["along x", "along y"])
def test_the_bytes_are_those_of_the_whole(
    make: Maker, turn: bool, by_stripes: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    for case in range(12):
        polygons = make(np.random.default_rng(case))
        if turn:
            polygons = [
                engine.Polygon.of_arrays(read_only(each.vertices[:, ::-1].copy()), each.ring_offsets)
                for each in polygons
            ]
        made = [engine.union_all(polygons, workers=workers) for workers in (1, 3)]
        assert all(by_stripes[-2:])
        with monkeypatch.context() as whole:
            whole.setattr(overlays, "union_by_stripes", lambda *_: None)
            expected = engine.union_all(polygons)
        for each in made:
            for name in ("vertices", "ring_offsets", "piece_offsets"):
                assert getattr(each, name).tobytes() == getattr(expected, name).tobytes()
            assert each.exact.sources.tobytes() == expected.exact.sources.tobytes()  # type: ignore[union-attr]
            assert each.largest_displacement >= 0.999 * expected.largest_displacement  # to some digits
            assert each.largest_displacement == made[0].largest_displacement
            assert each.area == expected.area


class _Taken(Cancel):
    """Bytes announced, and the most at any time."""

    n_bytes = n_most = 0

    def take(self, n_bytes: int) -> None:
        self.n_bytes += n_bytes
        self.n_most = max(self.n_most, self.n_bytes)


def test_what_touches_is_united_at_once(by_stripes: list[bool]) -> None:
    """Corners on edges, shared edges, squares that meet in a corner: no margin is left."""
    rng = np.random.default_rng(0)
    squares = [
        engine.Polygon([[(x, y), (x + 2, y), (x + 2, y + 2), (x, y + 2)]])
        for x, y in rng.integers(0, 40, (300, 2)).tolist()
    ]
    first, second = (engine.union_all(squares, workers=workers) for workers in (1, 3))
    assert by_stripes == [False, False]
    taken = _Taken()
    engine.union_all(squares, cancel=taken)
    n_different = len({each.vertices.tobytes() for each in squares})
    assert taken.n_bytes == taken.n_most == BY_VERTEX * 4 * n_different  # not once more for the whole
    covered = {(x + i, y + j) for each in squares for x, y in [each.vertices[0]] for i in (0, 1) for j in (0, 1)}
    assert first.area == len(covered)
    assert first.vertices.tobytes() == second.vertices.tobytes()


def test_rings_that_meet_where_a_polygon_crosses_itself_are_simple(by_stripes: list[bool]) -> None:
    """A hole between bars and a bow touches the shell where the bow crosses itself: it is a ring of its own."""
    bow = [(4, 0), (48, 2.25), (50, 0.125), (2, 2)]
    bars = [[(1, -0.5), (9, -0.5), (8, 9), (0, 9.25)], [(40, 0), (48, -0.25), (49, 9), (41, 9)],
            [(2, 7), (48, 7.25), (46, 8), (4, 8.25)]]  # fmt: skip
    small = [[(x, y), (x + 0.07, y), (x, y + 1)] for x in np.arange(60) for y in [10 + x / 64]]
    united = engine.union_all([engine.Polygon([ring]) for ring in [bow, *bars, *small]])
    assert (len(united.piece_offsets), len(united.ring_offsets)) == (62, 63)
    for first, last in zip(united.ring_offsets, united.ring_offsets[1:]):
        assert len(np.unique(united.vertices[first:last], axis=0)) == last - first
    assert by_stripes == [False]
