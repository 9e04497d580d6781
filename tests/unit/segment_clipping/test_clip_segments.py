"""Segments on convex regions and spheres against the rational reference, family by family."""

from __future__ import annotations

import doctest
import itertools
import math
import time

import numpy as np
import pytest

from engine.errors import (
    CancelledError,
    DeadlineExceededError,
    InvalidArrayError,
    NotFiniteError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.running.budget import Cancel
from engine.segment_clipping import clip_segments as segments_module
from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.base import Solid
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle
from tests.unit.segment_clipping.scenes import (
    assert_same_uncompiled,
    check,
    families,
    lattice_segments,
    random_segments,
    through,
)

FAMILIES = ["random", "lattice", "targets", "tiny", "long", "mixed", "denormal", "chords"]
CORNERS = {n: np.array(list(itertools.product([-1.0, 2.0], repeat=n))) for n in (2, 3)}


def boxes(rng: np.random.Generator, dimension: int) -> list[Solid]:
    low = rng.uniform(-1.5, 0, dimension)
    return [
        Aabb([-1] * dimension, [2] * dimension),
        Aabb(low, low + rng.uniform(0, 2, dimension)),
        Aabb([-1] * dimension, [-1] + [2] * (dimension - 1)),
    ]


def convexes(rng: np.random.Generator, dimension: int) -> list[Solid]:
    normals = rng.normal(size=(8, dimension))
    lattice = rng.integers(-2, 3, (6, dimension)).astype(float)
    lattice[~lattice.any(axis=1), 0] = 1.0
    lattice_rows = np.c_[lattice, rng.integers(0, 4, 6)]
    return [
        HalfSpace([1, 2, -1][:dimension], 1.0),
        HalfSpace(rng.normal(size=dimension), 0.1),
        Convex(np.c_[normals, rng.uniform(0.1, 1.5, 8)]),
        Convex(lattice_rows),
        Convex(np.r_[lattice_rows, lattice_rows[:2], -lattice_rows[:1]]),  # repeated, and flat
        Convex(np.c_[normals, np.full(8, -1.0)]),  # mostly empty
    ]


def spheres(rng: np.random.Generator, dimension: int) -> list[Solid]:
    return [
        Sphere([0] * dimension, 1.0),
        Sphere([1] * dimension, 2.0),
        Sphere(rng.uniform(-1, 1, dimension), rng.uniform(0.1, 1)),
        Sphere([1] * dimension, 0.0),
    ]


REGIONS = {"aabb": boxes, "convex": convexes, "sphere": spheres}


@pytest.mark.some(24)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", REGIONS)
@pytest.mark.parametrize("family", FAMILIES)
def test_equals_the_reference(kind: str, dimension: int, family: str, pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng([dimension, len(kind), FAMILIES.index(family)])
    n = 2500 if pytestconfig.getoption("--full") else 40
    for region in REGIONS[kind](rng, dimension):
        check(families(rng, CORNERS[dimension], n)[family], region)


@pytest.mark.parametrize("scale", [2.0**1000, 2.0**-950, 1e300, 1e-300, 5e-324])
@pytest.mark.parametrize("kind", REGIONS)
def test_whole_scenes_of_any_size(kind: str, scale: float) -> None:
    rng = np.random.default_rng(5)
    segments = np.r_[random_segments(rng, 15, 3), lattice_segments(rng, 15, 3)] * scale
    for region in REGIONS[kind](rng, 3):
        match region:
            case Aabb():
                check(segments, Aabb(region.min * scale, region.max * scale))
            case Sphere():
                check(segments, Sphere(region.center * scale, region.radius * scale))
            case HalfSpace():
                check(segments, HalfSpace(region.normal, region.offset * scale))
            case Convex():
                rows = region.planes.copy()
                rows[:, -1] *= scale
                check(segments, Convex(rows))


@pytest.mark.parametrize("offset", [1e6, 1e9])
@pytest.mark.parametrize("kind", REGIONS)
def test_far_from_the_origin(kind: str, offset: float) -> None:
    rng = np.random.default_rng(6)
    segments = np.r_[random_segments(rng, 30, 3), through(rng, CORNERS[3], 30)] + offset
    match REGIONS[kind](rng, 3)[0]:
        case Aabb() as box:
            check(segments, Aabb(box.min + offset, box.max + offset))
        case Sphere() as ball:
            check(segments, Sphere(ball.center + offset, ball.radius))
        case HalfSpace() as side:
            check(segments, HalfSpace(side.normal, side.offset - side.normal.sum() * offset))


def test_zeros_are_positive() -> None:
    """Of coordinates that a segment keeps, too, also where another one is settled by exact signs."""
    segments = [[[-0.0, -1.0], [0.0, -1.8523598966538355]], [[-1.0, -0.0], [-1.4299810403064286, -0.0]]]
    for region in (Aabb([-1, -1], [1, 1]), Convex([[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1]])):
        pieces = clip_segments(segments, region)
        assert not any(np.signbit(array[array == 0.0]).any() for array in (pieces.start, pieces.end, pieces.t))


def test_empty_queries_and_report() -> None:
    box = Aabb([0, 0, 0], [1, 1, 1])
    for nothing in ([], np.zeros((0, 2, 3))):
        pieces, accuracy = clip_segments(nothing, box, report=True)
        assert (pieces.start.shape, pieces.t.shape, len(pieces)) == ((0, 3), (0, 2), 0)
        assert (accuracy.decisions, accuracy.n_items, accuracy.coordinates_ulp) == ("exact", 0, 0.5)
    flat = Aabb([0, 0, 0], [1e-310, 1, 1])
    _, accuracy = clip_segments([[[0, 0, 0], [3e-310, 1, 1]]], flat, report=True)
    assert accuracy.n_rational == accuracy.n_beyond_filter == 1


def test_kernels_see_the_deadline() -> None:
    rng = np.random.default_rng(12)
    region = Convex(np.c_[rng.normal(size=(20000, 3)), np.full(20000, 9.0)])
    segments = random_segments(rng, 400_000, 3) * 0.1  # without a deadline 20 s
    clip_segments(segments[:10], region)
    before = time.process_time()  # a busy machine may keep the call waiting
    with pytest.raises(DeadlineExceededError):
        clip_segments(segments, region, deadline=0.05, workers=1)
    assert time.process_time() - before < 5


def test_numbers_that_are_none_are_found_in_large_batches() -> None:
    for region in (boxes, convexes, spheres):
        for value in (math.nan, -math.inf):
            segments = np.zeros((5000, 2, 3)) + 9.0
            segments[4321, 1, 2] = value
            with pytest.raises(NotFiniteError) as caught:
                clip_segments(segments, region(np.random.default_rng(0), 3)[0])
            assert caught.value.where == ("segments", 4321, 1, 2)


def test_refuses_what_it_cannot_take() -> None:
    box = Aabb([0, 0], [1, 1])
    with pytest.raises(UnsupportedSolidError, match="half_space, sphere, aabb, convex, polyhedron or polygon"):
        clip_segments([[[0, 0], [1, 1]]], Triangle([[0, 0], [1, 0], [0, 1]]))
    with pytest.raises(WrongDimensionError):
        clip_segments([[[0, 0, 0], [1, 1, 1]]], box)
    with pytest.raises(InvalidArrayError):
        clip_segments([[[0, 0], [1, 1], [2, 2]]], box)
    with pytest.raises(NotFiniteError) as caught:
        clip_segments([[[0, 0], [1, math.inf]]], box)
    assert caught.value.where == ("segments", 0, 1, 1)
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError):
        clip_segments([[[0, 0], [1, 1]]], box, cancel=cancel)
    with pytest.raises(DeadlineExceededError):
        clip_segments([[[0, 0], [1, 1]]], box, deadline=0.0)


def test_the_example() -> None:
    assert doctest.testmod(segments_module) == (0, 3)


def test_uncompiled_is_the_same() -> None:
    """The kernels as plain Python, in a process of their own, on a small sample."""
    assert_same_uncompiled(__name__)


def uncompiled_sample() -> None:
    for dimension in (2, 3):
        rng = np.random.default_rng(dimension)
        for regions in REGIONS.values():
            for region in regions(rng, dimension):
                for family in families(rng, CORNERS[dimension], 4).values():
                    check(family, region)
