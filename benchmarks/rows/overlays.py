"""Overlays: large pairs by family, many small pairs, the four operations, pairs that touch, those of public suites."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import engine
from benchmarks import polygon_pairs, workloads
from benchmarks.rows import Question, Run, Size, asked_before

OPERATIONS = ("intersection", "union", "difference", "symmetric_difference")


def questions(size: Size) -> Iterator[Question]:
    """Yield the rows of overlay."""
    for n_vertices in (1_000,) if size.is_quick else (1_000, 10_000, 100_000):
        for family in ("smooth", "spiky", "comb", "soup") if n_vertices < 100_000 else ("smooth", "spiky", "comb"):
            yield Question(f"overlay, {family} of {n_vertices}", partial(_large, size, family, n_vertices))
    yield Question("overlay, soup of 30000", partial(_large, size, "soup", size.of(30_000, 2_000)))
    yield Question("overlay, dense comb of 300", partial(_large, size, "dense comb", 300))
    for operation in OPERATIONS[1:]:
        yield Question(f"overlay, spiky of 1000, {operation}", partial(_large, size, "spiky", 1_000, operation))
    for family in ("star", "convex"):
        for n_vertices in (4, 10, 30, 100):
            yield Question(f"overlay batch, {family} of {n_vertices}", partial(_batch, size, family, n_vertices))
    for n_vertices in (10, 100):
        name = f"overlay batch, star of {n_vertices}, two threads"
        yield Question(name, partial(_batch, size, "star", n_vertices, threads=2))
    for operation in OPERATIONS[1:]:
        yield Question(f"overlay batch, star of 10, {operation}", partial(_batch, size, "star", 10, operation))
    yield Question("overlay batch, on a lattice", partial(_lattice, size))
    yield Question("overlay batch, output nearest", partial(_batch, size, "star", 10, "union", output="nearest"))
    yield Question("overlay batch, made and read", partial(_made_and_read, size))
    yield Question("overlay, exact area of spiky of 300", partial(_area, size))
    yield Question("overlay, public pairs", partial(_public, size))


def _large(size: Size, family: str, n_vertices: int, operation: str = "intersection") -> Run:
    first, second = map(engine.Polygon, polygon_pairs.large(family, n_vertices, size.seed))
    return asked_before(lambda: engine.overlay(first, second, operation, workers=1), 2)


def _pairs(size: Size, family: str, n_vertices: int) -> tuple[np.ndarray, np.ndarray]:
    return polygon_pairs.small(family, n_vertices, max(200, size.of(40_000, 4_000) // n_vertices), size.seed)


def _batch(
    size: Size, family: str, n_vertices: int, operation: str = "intersection", threads: int = 1, output: str = "valid"
) -> Run:
    both = ([engine.Polygon([ring]) for ring in rings] for rings in _pairs(size, family, n_vertices))
    subjects, clips = both
    return asked_before(lambda: engine.overlay_batch(subjects, clips, operation, output=output, workers=threads), 2)


def _made_and_read(size: Size) -> Run:
    """From arrays to pieces, as one who asks once does."""
    first, second = (rings[:500] for rings in _pairs(size, "star", 10))

    def run() -> object:
        sides = ([engine.Polygon([ring]) for ring in rings] for rings in (first, second))
        return [[piece.shell for piece in found.pieces] for found in engine.overlay_batch(*sides, workers=1)]

    return run


def _lattice(size: Size) -> Run:
    """Shared edges and vertices, self-crossings: 6 to 9 vertices of a lattice of 5 x 5."""
    draw = workloads.generator("rows/lattice", size.seed)

    def ring() -> np.ndarray:
        return draw.integers(0, 5, (draw.integers(6, 10), 2)).astype(float)

    sides = [[engine.Polygon([ring()]) for _ in range(size.of(1000, 200))] for _ in range(2)]
    return asked_before(lambda: engine.overlay_batch(*sides, workers=1), 2)


def _area(size: Size) -> Run:
    first, second = map(engine.Polygon, polygon_pairs.large("spiky", 300, size.seed))
    return lambda: engine.overlay(first, second, workers=1).area_exact


def _public(size: Size) -> Run:
    """Pairs that users filed, of at most 300 vertices; without data, soups of 100."""
    try:
        pairs = [pair for pair in polygon_pairs.public() if sum(map(len, pair[0] + pair[1])) <= 300]
    except workloads.MissingDataError:
        pairs = [polygon_pairs.large("soup", 100, seed) for seed in range(20)]
    solids = [tuple(map(engine.Polygon, pair)) for pair in pairs]
    return asked_before(lambda: [engine.overlay(first, second, workers=1) for first, second in solids], 2)
