"""What overlays take and answer: arrays of polygons, rings, batches, results."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.errors import InvalidArrayError, UnsupportedSolidError
from engine.polygon_overlay.batch import join_batches, overlay_batch
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.implicit_rings import ImplicitRings
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.pair_arrays import (
    NO_PAIRS,
    PairResults,
    concatenate_offsets,
    concatenate_pairs,
    one_pair,
    polygon_arrays_of,
    ring_sizes,
    take_pairs,
)
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb
from engine.solids.ragged import summed
from tests.unit.polygon_overlay.families import star


def square(x: float, y: float, size: float) -> list[tuple[float, float]]:
    return [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]


def test_pieces_with_holes() -> None:
    frame = Polygon([square(0, 0, 9), square(1, 1, 2), square(4, 4, 3), square(20, 0, 5)])
    result = overlay(frame, Polygon([square(21, 1, 1), square(100, 0, 1)]), "difference")
    assert (result.n_pieces, result.n_holes) == (2, 3)
    assert [len(piece.holes) for piece in result.pieces] == [2, 1]
    assert result.rings[0].tolist() == [list(map(float, vertex)) for vertex in square(0, 0, 9)]
    assert result.piece_areas.tolist() == [68.0, 24.0]
    assert (result.area, result.area_exact) == (92.0, 92)
    empty = overlay(frame, frame, "difference")
    assert (empty.n_pieces, empty.area, len(empty.piece_areas)) == (0, 0.0, 0)


# --- Implicit rings made exact: vertices as given, crossings as fractions, repeated points passed over ---


def test_crossings_and_vertices() -> None:
    subject = RingArrays(np.array([[0.0, 0], [0, 0], [3, 1], [0, 3]]), np.array([0, 4]))
    clip = RingArrays(np.array([[1.0, -1], [1, 5], [-2, 5]]), np.array([0, 3]))
    sources = np.array([[2, -1], [0, 4], [3, -1]])
    rings = ImplicitRings(subject, clip, sources, np.array([0, 3])).exact_rings()
    assert rings.places() == [[(3, 1), (1, Fraction(1, 3)), (0, 3)]]
    assert rings.area() == -3
    again = ImplicitRings(subject, clip, sources[[0, 1, 2, 0, 1, 2]], np.array([0, 3, 6])).some([1])
    assert again.places() == rings.places()


# --- Polygons gathered into flat arrays, and taken from these again ---


@pytest.mark.parametrize("most_rings", [0, 1, 4])
def test_gathered(most_rings: int) -> None:
    random = np.random.default_rng(most_rings)
    rings = [
        [random.random((random.integers(3, 9), 2)) for _ in range(random.integers(most_rings + 1))] for _ in "1234567"
    ]
    polygons = [Polygon(each) for each in rings]
    found = polygon_arrays_of(polygons)
    assert np.diff(found.polygon_offsets).tolist() == list(map(len, rings))
    assert np.diff(found.ring_offsets).tolist() == [len(ring) for each in rings for ring in each]
    assert found.sizes().tolist() == [sum(map(len, each)) for each in rings]
    assert found.largest_counts() == (max(found.sizes()), max(map(len, rings)))
    numbers = random.permutation(7)[:4]
    some = found.take(numbers)
    for k, number in enumerate(numbers.tolist()):
        one, other = some.polygon(k), polygons[number]
        assert (one.vertices.tolist(), one.ring_offsets.tolist()) == (
            other.vertices.tolist(),
            other.ring_offsets.tolist(),
        )


# --- Pairs taken from what was found, and put together again, are what they were ---


def pair_of(random: np.random.Generator) -> PairResults:
    sizes = random.integers(3, 6, random.integers(0, 4))
    return one_pair(random.random((sizes.sum(), 2)), summed(sizes), np.arange(len(sizes) + 1), 0.25, 7)


def same(first: PairResults, second: PairResults) -> bool:
    return all(a.tolist() == b.tolist() for a, b in zip(first, second, strict=True))


def test_taken_and_joined() -> None:
    random = np.random.default_rng(1)
    pairs = [pair_of(random) for _ in range(9)]
    together = concatenate_pairs([NO_PAIRS, *pairs])
    order = random.permutation(9)
    assert same(take_pairs(together, order), concatenate_pairs([pairs[k] for k in order.tolist()]))
    assert same(take_pairs(together, np.arange(9)), together)
    assert same(take_pairs(together, np.zeros(0, np.int64)), NO_PAIRS)


def test_offsets() -> None:
    assert concatenate_offsets([np.array([0, 2, 5]), np.array([0]), np.array([0, 1])]).tolist() == [0, 2, 5, 6]
    assert ring_sizes(one_pair(np.array([[0.0, 1], [3, 1], [3, 2]]), np.array([0, 3]), np.array([0, 1]), 0, 0)) == [1]
    assert len(ring_sizes(NO_PAIRS)) == 0


# --- Batches: refused before anything is overlaid, joined as if asked at once, iterated pair by pair ---


def drawn(n: int) -> list[list[Polygon]]:
    random = np.random.default_rng(n)
    return [[Polygon([star(random, 7)]) for _ in range(n)] for _ in range(2)]


def test_joined_batches_are_one() -> None:
    subjects, clips = drawn(40)
    whole = overlay_batch(subjects, clips, workers=1)
    parts = join_batches([overlay_batch(subjects[k : k + 10], clips[k : k + 10]) for k in range(0, 40, 10)])
    for name in ("status", "vertices", "ring_offsets", "piece_offsets", "pair_offsets", "displacement", "areas"):
        assert getattr(parts, name).tolist() == getattr(whole, name).tolist()
    for one, other in zip(parts, whole.overlays, strict=True):
        assert one is not None
        assert other is not None
        assert one.vertices.tolist() == other.vertices.tolist()
        assert one.area_exact == other.area_exact


def test_what_is_refused() -> None:
    subjects, clips = drawn(3)
    with pytest.raises(InvalidArrayError, match="equal length"):
        overlay_batch(subjects, clips[:2])
    with pytest.raises(InvalidArrayError, match="list of polygons"):
        overlay_batch(subjects[0], clips)  # type: ignore[arg-type]
    with pytest.raises(UnsupportedSolidError):
        overlay_batch([*subjects[:2], Aabb([0, 0], [1, 1])], clips)
    empty = overlay_batch([], [])
    assert (len(empty), len(empty.areas)) == (0, 0)
    with pytest.raises(IndexError):
        empty[0]
