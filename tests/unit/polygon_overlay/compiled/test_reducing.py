"""Overlays of which most edges are never looked at, against the ordinary way: every bit of the rings is equal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.compiled.loading import LEFT_OUT, RingArrays
from engine.polygon_overlay.compiled.reducing import count_left_out, expand_rings
from engine.polygon_overlay.implicit_rings import ImplicitRings, one_polygon
from engine.polygon_overlay.pair_arrays import PolygonArrays
from engine.polygon_overlay.run import SELECTED_ARRAYS, Operation, run_blocks
from engine.running.budget import Budget
from engine.types import read_only
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.families import FAMILIES

Random = np.random.Generator
Rings = list[np.ndarray]


def arrays(rings: Rings) -> RingArrays:
    return RingArrays(read_only(np.concatenate(rings)), read_only(np.cumsum([0, *map(len, rings)])))


def curve(random: Random, n: int, waves: int = 6) -> np.ndarray:
    """A closed curve, in one of all directions, beginning anywhere."""
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False) * random.choice([-1, 1]) + random.random()
    lengths = 1 + sum(0.3 / k * np.cos(k * angles + random.uniform(0, 6)) for k in range(2, 2 + waves))
    return np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=1) * random.uniform(0.3, 1.2)


def smooth(random: Random) -> tuple[Rings, Rings]:
    return [curve(random, 150)], [curve(random, 200) + random.normal(size=2) * 0.4]


def with_holes(random: Random) -> tuple[Rings, Rings]:
    """Rings in rings, some of them smaller than a block."""

    def rings() -> Rings:
        small = [curve(random, int(random.choice([3, 7, 40]))) * 0.1 + random.normal(size=2) * 0.5 for _ in range(6)]
        return [curve(random, 120), curve(random, 90) * 0.4, *small]

    return rings(), rings()


def damaged(random: Random) -> tuple[Rings, Rings]:
    """Straight vertices, repeated points, spikes and loops within a block and from one to the next."""

    def ring() -> np.ndarray:
        made = curve(random, 150)
        for at in random.integers(0, 145, 4).tolist():
            match random.integers(5):
                case 0:
                    made[at + 1] = made[at]
                case 1:
                    made[at : at + 5, 1] = made[at, 1]  # on a straight line, there and back perhaps
                case 2:
                    made[at + 2] = made[at]
                case 3:
                    made[[at + 1, at + 3]] = made[[at + 3, at + 1]]
                case 4:
                    made[at + 1] *= 1.5
        return np.roll(made, int(random.integers(150)), axis=0)

    return [ring()], [ring() + random.normal(size=2) * 0.3]


def shared(random: Random) -> tuple[Rings, Rings]:
    """Stretches, vertices and nearly the same stretches in common, the same way round or not."""
    first = curve(random, 160)
    second = first.copy()
    second[20:60] *= random.choice([1.0, 1.0 + 2.0**-52, 1.1])
    second[60:90] *= 1.1
    second[100:130:7] *= 1.0 - 2.0**-51
    return [first], [second[:: random.choice([-1, 1])].copy()]


def lattice_walk(random: Random) -> tuple[Rings, Rings]:
    """Vertices rounded to a lattice: many straight ones, touching ones, and repeats."""
    subject, clip = smooth(random)
    scale = float(random.choice([8, 30, 200]))
    return [np.rint(ring * scale) for ring in subject], [np.rint(ring * scale) for ring in clip]


def parallels(random: Random) -> tuple[Rings, Rings]:
    """One curve within the other, some units in the last place apart."""
    ring = curve(random, 150) + 3.0
    return [ring], [ring * (1.0 + float(random.integers(1, 200)) * 2.0**-52)]


def apart(random: Random) -> tuple[Rings, Rings]:
    """Hardly a common box, or one inside the other."""
    ring = curve(random, 150, 2)
    if random.random() < 0.5:
        return [ring], [curve(random, 100, 2) * 0.2]
    return [ring], [curve(random, 100, 2) + np.array([2.0 * random.random(), 0.3])]


MAKERS = (smooth, with_holes, damaged, shared, lattice_walk, parallels, apart)


def compare(subject: Rings, clip: Rings, operation: Operation, size: int, has_area: bool = False) -> bool:
    """Compare with the ordinary way; tell whether edges were left out."""
    sides = tuple(PolygonArrays(*arrays(rings), one_polygon(len(rings))) for rings in (subject, clip))
    largest = sum(len(each.vertices) for each in sides), len(subject) + len(clip)
    expected = run_blocks(*sides, largest, SELECTED_ARRAYS[operation], Budget())
    assert expected is not None
    found = run_blocks(*sides, largest, SELECTED_ARRAYS[operation], Budget(), size=size, max_active=2.0)
    if found is None:
        return False
    if expected.status[0] == PairStatus.DONE:
        for name in ("vertices", "ring_offsets", "piece_offsets"):
            assert getattr(found, name).tobytes() == getattr(expected, name).tobytes()
        if has_area:
            exact = [
                ImplicitRings(*map(arrays, (subject, clip)), each.sources, each.ring_offsets)
                for each in (found, expected)
            ]
            assert exact[0].exact_rings().area() == exact[1].exact_rings().area()
    return True


def test_loop_beyond_the_common_box() -> None:
    """A block beyond the common box that ends where it begins; the edge after it crosses into the box."""
    angles = np.linspace(0.0, 2 * np.pi, 64, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    clip = np.array([(0.0, -3.0), (4.0, -3.0), (4.0, 3.0), (0.0, 3.0)])
    for size in (4, 16, 64):
        loop = circle[:size] - (2.0, 0.0)
        subject = np.concatenate([loop, loop[:1], [(1.0, -0.5)], circle[:32] * 2.0 + (0.5, 0.5)])
        for operation in OPERATIONS:
            assert compare([subject], [clip], operation, size, has_area=True)


@pytest.mark.parametrize("make", MAKERS, ids=lambda make: make.__name__)
def test_equal_to_the_ordinary_way(make: Callable[[Random], tuple[Rings, Rings]]) -> None:
    n_reduced = 0
    for seed in range(20):
        random = np.random.default_rng([11, seed])
        pair = make(random)
        for operation in OPERATIONS:
            n_reduced += compare(*pair, operation, int(random.integers(2, 9)), seed < 2)
    assert n_reduced > 8


@pytest.mark.full
@pytest.mark.parametrize("make", MAKERS, ids=lambda make: make.__name__)
def test_many_equal_to_the_ordinary_way(make: Callable[[Random], tuple[Rings, Rings]]) -> None:
    for seed in range(2000):
        random = np.random.default_rng([12, seed])
        pair = make(random)
        for operation in OPERATIONS:
            compare(*pair, operation, int(random.integers(2, 17)))


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_families(family: Callable[[Random], tuple[Rings, Rings]]) -> None:
    """Small and full of degeneracies: hardly a block is left out, and that few times are the hard ones."""
    for seed in range(3):
        random = np.random.default_rng([13, seed])
        pair = family(random)
        for operation in OPERATIONS:
            compare(*pair, operation, int(random.integers(1, 4)))


def test_runs_there_and_back() -> None:
    subjects, clips = np.arange(20.0).reshape(10, 2), 100.0 + np.arange(20.0).reshape(10, 2)
    names = [(2, LEFT_OUT), (5, -1), (7, 12), (18, LEFT_OUT), (14, -1), (9, LEFT_OUT), (9, -1)]
    sources, offsets = np.array(names, np.int32), np.array([0, 5, 7])
    both = np.concatenate([subjects, clips])
    selected = both[sources[:, 0]] + 0.5
    full = [2, 3, 4, 5, 7, 18, 17, 16, 15, 14, 9, 9]
    n = len(names) + int(count_left_out(sources, 0, 5)) + int(count_left_out(sources, 5, 6))
    made = np.empty((n, 2)), np.empty((n, 2), np.int32), np.empty(3, np.int64)
    expand_rings(
        selected,
        sources,
        offsets[:2],
        subjects,
        clips,
        np.zeros(1, np.uint8),
        *(each[:10] for each in made[:2]),
        made[2][:2],
    )
    assert made[2][:2].tolist() == [0, 10]
    assert made[1][:10, 0].tolist() == full[:10]
    assert made[1][:10, 1].tolist() == [-1, -1, -1, -1, 12, -1, -1, -1, -1, -1]
    is_kept = np.isin(full[:10], sources[:5, 0])
    assert (made[0][:10] == both[full[:10]] + 0.5 * is_kept[:, None]).all()
