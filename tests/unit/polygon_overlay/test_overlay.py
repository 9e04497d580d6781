"""Overlay: degeneracies one by one, random lattices against the reference, symmetries, extremes, options."""

from __future__ import annotations

import math
import pickle
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.errors import (
    CancelledError,
    DeadlineExceededError,
    InvalidArrayError,
    InvalidOperationError,
    NotRepresentableError,
    UnsupportedSolidError,
)
from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.overlay import Operation, overlay
from engine.polygon_overlay.result import Overlay
from engine.running.budget import Cancel
from engine.solids.polygon import Polygon
from engine.solids.primitives import Sphere
from tests.unit.polygon_overlay.checks import (
    OPERATIONS,
    assert_area_close,
    assert_counts_add_up,
    assert_equals_reference,
    assert_valid,
)

Ring = list[tuple[float, float]]


def box(x: float, y: float, width: float, height: float | None = None) -> Ring:
    height = width if height is None else height
    return [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]


def shape(result: Overlay | None) -> list[tuple[Ring, list[Ring]]]:
    """Return the pieces as nested lists."""
    assert result is not None
    return [
        ([tuple(v) for v in shell.tolist()], [[tuple(v) for v in hole.tolist()] for hole in holes])
        for shell, holes in result.pieces
    ]


def check(subject: list[Any], clip: list[Any], operation: Operation) -> Overlay:
    result = overlay(Polygon(subject), Polygon(clip), operation)
    assert_equals_reference(result, subject, clip, operation)
    assert_valid(result)
    assert_counts_add_up(result)
    assert_area_close(result)
    return result


FRAME = [box(0, 0, 6), box(1, 1, 4)]
BOW_TIE: list[Ring] = [[(0, 0), (4, 4), (4, 0), (0, 4)]]
SPIKE: list[Ring] = [[(0, 0), (4, 0), (9, 0), (4, 0), (4, 4), (0, 4)]]
PAIRS: dict[str, tuple[list[Ring], list[Ring]]] = {
    "corners": ([box(0, 0, 4)], [box(2, 2, 4)]),
    "apart": ([box(0, 0, 1)], [box(5, 5, 1)]),
    "nested": ([box(0, 0, 9)], [box(3, 3, 1)]),
    "equal": ([box(0, 0, 4)], [box(0, 0, 4)[::-1]]),
    "equal with more vertices": ([box(0, 0, 4)], [[(0, 0), (2, 0), (4, 0), (4, 4), (0, 4), (0, 1)]]),
    "shared edge": ([box(0, 0, 4)], [box(4, 0, 4)]),
    "part of an edge": ([box(0, 0, 4)], [box(4, 1, 2)]),
    "touch in a corner": ([box(0, 0, 4)], [box(4, 4, 4)]),
    "corner on an edge": ([box(0, 0, 4)], [[(4, 2), (6, 0), (6, 4)]]),
    "hole touching its shell": ([box(0, 0, 4)], [[(0, 2), (2, 1), (2, 3)]]),
    "hole touching its shell twice": ([box(0, 0, 4)], [[(0, 2), (2, 1), (4, 2), (2, 3)]]),
    "holes touching": ([box(0, 0, 6)], [[(1, 3), (3, 1), (5, 3), (5, 5), (3, 1), (1, 5)]]),
    "frame and island": (FRAME, [box(2, 2, 2)]),
    "island touching the hole": (FRAME, [[(1, 3), (3, 2), (5, 3), (3, 4)]]),
    "bow tie": (BOW_TIE, [box(1, 1, 9)]),
    "spike": (SPIKE, [box(3, -1, 4)]),
    "no area": ([[(0, 0), (4, 0), (2, 0)]], [box(1, -1, 2)]),
    "both without area": ([[(0, 0), (4, 0), (2, 0)]], [[(1, -1), (1, 1), (1, 0)]]),
    "ring twice": ([box(0, 0, 4), box(0, 0, 4)], [box(1, 1, 1)]),
    "ring thrice": ([box(0, 0, 4)] * 3, [box(1, 1, 9)]),
    "repeated points": ([[(0, 0), (0, 0), (4, 0), (4, 4), (4, 4), (0, 4)]], [box(2, -1, 4)]),
    "comb": ([[(0, 0), (7, 0), (7, 4), (6, 1), (5, 4), (4, 1), (3, 4), (2, 1), (0, 4)]], [box(-1, 2, 9, 5)]),
    "deep nesting": ([box(k, k, 20 - 2 * k) for k in range(6)], [box(-1, -1, 11, 30)]),
    "ring touching itself": ([[(0, 0), (2, 2), (4, 0), (4, 4), (2, 2), (0, 4)]], [box(1, 0, 2, 4)]),
}


@pytest.mark.parametrize("operation", OPERATIONS)
@pytest.mark.parametrize("name", PAIRS)
def test_pairs(name: str, operation: Operation) -> None:
    check(*PAIRS[name], operation)


def test_output_by_hand() -> None:
    square = Polygon([box(0, 0, 4)])
    touching = overlay(square, Polygon([[(0, 2), (2, 1), (2, 3)]]), "difference")
    assert shape(touching) == [([(0, 0), (4, 0), (4, 4), (0, 4), (0, 2)], [[(0, 2), (2, 3), (2, 1)]])]
    apart = overlay(square, Polygon([[(0, 2), (2, 1), (4, 2), (2, 3)]]), "difference")
    lower: Ring = [(0, 0), (4, 0), (4, 2), (2, 1), (0, 2)]
    upper: Ring = [(0, 2), (2, 3), (4, 2), (4, 4), (0, 4)]
    assert shape(apart) == [(lower, []), (upper, [])]
    assert shape(overlay(square, Polygon([box(4, 4, 4)]), "union")) == [(box(0, 0, 4), []), (box(4, 4, 4), [])]
    assert shape(overlay(square, Polygon([box(4, 0, 4)]), "union")) == [(box(0, 0, 8, 4), [])]
    assert shape(overlay(Polygon(SPIKE), Polygon([box(9, 9, 1)]), "difference")) == [(box(0, 0, 4), [])]


def test_third_is_rounded_once() -> None:
    result = overlay(Polygon([[(0, 0), (3, 1), (3, 0)]]), Polygon([box(1, -1, 1, 3)]))
    assert shape(result) == [([(1, 0), (2, 0), (2, 2 / 3), (1, 1 / 3)], [])]
    assert result.area_exact == Fraction(1, 2)
    assert (result.rounds, result.vertices_moved, result.snapped) == (1, 0, False)
    assert 0 < result.largest_displacement <= 2.0**-53


def random_rings(seed: Any, size: int) -> list[Ring]:
    random = np.random.default_rng(seed)
    return [[tuple(v) for v in random.integers(0, size, (n, 2)).astype(float).tolist()] for n in (8, 5)]


@pytest.mark.some(4)
@pytest.mark.parametrize("size", [3, 5, 9, 1 << 24])
@pytest.mark.parametrize("seed", range(6))
def test_random_rings_on_a_lattice(seed: int, size: int) -> None:
    subject, clip = random_rings([seed, size], size), random_rings([seed, size, 1], size)
    for operation in OPERATIONS:
        check(subject, clip, operation)


@pytest.mark.parametrize("seed", range(8))
def test_needles_one_ulp_apart(seed: int) -> None:
    """Edges that nearly coincide: crossings are ill-conditioned, and rounding makes rings invalid at once."""
    random = np.random.default_rng(seed)
    start = random.random((6, 2))
    subject = np.concatenate([start, start[::-1] + random.integers(-2, 3, (6, 2)) * 2.0**-53])
    clip = np.concatenate([start * (1 + 2.0**-52), start[::-1] + 2.0**-52])
    for operation in OPERATIONS:
        result = overlay(Polygon([subject]), Polygon([clip]), operation)
        assert_valid(result)
        assert_counts_add_up(result)
        assert_area_close(result)


def times(rings: list[Ring], factor: Any) -> Polygon:
    return Polygon([np.array(ring) * factor for ring in rings])


@pytest.mark.parametrize("operation", OPERATIONS)
@pytest.mark.parametrize("seed", range(4))
def test_symmetries(seed: int, operation: Operation) -> None:
    rings = [random_rings([seed, k], 7) for k in (1, 2)]
    subject, clip = map(Polygon, rings)
    result = overlay(subject, clip, operation)
    turned = [Polygon([ring[3:] + ring[:3] for ring in reversed(each)]) for each in rings]
    backwards = [Polygon([ring[::-1] for ring in each]) for each in rings]
    for other in (turned, backwards):
        assert shape(overlay(other[0], other[1], operation)) == shape(result)
    if operation != "difference":
        assert shape(overlay(clip, subject, operation)) == shape(result)
    for factor in (2.0**300, 2.0**-900):
        scaled = overlay(times(rings[0], factor), times(rings[1], factor), operation)
        assert (scaled.vertices == result.vertices * factor).all()
        assert scaled.area_exact == result.area_exact * Fraction(factor) ** 2
    mirrored = overlay(times(rings[0], (-1, 1)), times(rings[1], (-1, 1)), operation)
    assert mirrored.area_exact == result.area_exact
    assert sorted((mirrored.vertices * (-1, 1)).tolist()) == sorted(result.vertices.tolist())


def test_areas_add_up() -> None:
    subject, clip = Polygon(random_rings(1, 1 << 20)), Polygon(random_rings(2, 1 << 20))
    both, union, only, either = (overlay(subject, clip, operation).area_exact for operation in OPERATIONS)
    other = overlay(clip, subject, "difference").area_exact
    assert only + other == either
    assert either + both == union


def test_ends_of_the_exponent_range() -> None:
    tiny, huge = 5e-324, 1.7e308
    result = overlay(Polygon([box(0, 0, huge)]), Polygon([box(tiny, tiny, 1e308, tiny)]))
    assert shape(result) == [(box(tiny, tiny, 1e308, tiny), [])]
    triangle = Polygon([[(-huge, -huge), (huge, -huge), (0, huge)]])
    result = overlay(triangle, Polygon([box(-1.5e308, -1e308, 1e308)]))
    assert result.n_pieces == 1
    assert_valid(result)
    with pytest.raises(NotRepresentableError):
        _ = result.area
    most = 1.7976931348623157e308  # width and height together are beyond it
    left = Polygon([[(0.0, 0.0), (0.0, 1.0), (-most, 0.0)]])
    below = Polygon([[(0.0, 0.0), (0.0, -1.7976931348623155e308), (-1.0, 2.9937604643020797e292)]])
    assert_valid(overlay(left, below, "union"))
    denormal = overlay(
        Polygon([[(0, 0), (3 * tiny, tiny), (3 * tiny, 0)]]), Polygon([box(tiny, -tiny, tiny, 3 * tiny)])
    )
    assert denormal.area_exact == Fraction(1, 2) * Fraction(tiny) ** 2
    assert_valid(denormal)
    assert_counts_add_up(denormal)


def test_rounding_up_to_the_smallest_normal_number() -> None:
    """A crossing just below the middle of the largest subnormal number and the smallest normal one."""
    least = 2.0**-1022
    triangle = [(2 * least, least), (-2 * least, least), (-2 * least, -(3 - 2.0**-51) * least)]
    result = overlay(Polygon([triangle]), Polygon([box(-least, 0, 4 * least, least)]))
    assert result.vertices.max() == 2 * least
    assert result.vertices[1].tolist() == [math.nextafter(least, 0), 0]


def test_collapsed_sliver_is_listed() -> None:
    sliver = [(1.0, 1.0), (2.0, 1.0), (2.0, 1.0 + 2.0**-52)]
    result = overlay(Polygon([sliver]), Polygon([box(1.25, 0, 2.0**-30, 4)]))
    assert result.n_pieces == 0
    assert [part.kind for part in result.collapsed] == ["piece"]
    assert result.collapsed[0].area == result.area_exact > 0
    assert result.collapsed[0].near == (1.25, 1.0)


def test_empty_result() -> None:
    result = overlay(Polygon([box(0, 0, 1)]), Polygon([box(5, 5, 1)]))
    assert (result.pieces, result.n_holes, result.area, result.vertices.shape) == ([], 0, 0.0, (0, 2))


def test_batch_equals_single_calls_whatever_the_workers() -> None:
    subjects = [Polygon(subject) for subject, _ in PAIRS.values()]
    clips = [Polygon(clip) for _, clip in PAIRS.values()]
    expected = [shape(overlay(a, b, "union")) for a, b in zip(subjects, clips, strict=True)]
    done: list[int] = []
    for workers in (1, 2):
        batch, accuracy = overlay_batch(subjects, clips, "union", workers=workers, progress=done.append, report=True)
        assert [shape(result) for result in batch.overlays] == expected
        assert not batch.status.any()
        assert accuracy.decisions == "exact"
    assert sum(done) == 2 * len(subjects)
    with pytest.raises(InvalidArrayError, match="equal length"):
        overlay_batch(subjects, clips[1:])


def test_batch_is_flat_and_tells_what_is_no_double() -> None:
    """Among ordinary pairs one that the kernel leaves open, and one whose result no double holds."""
    huge = 1.7e308
    shallow = [(-huge, -huge), (huge, huge), (huge, -huge)]
    subjects = [Polygon([box(0, 0, 4)]), Polygon([[(0, 0), (1, 1), (0, 1)]]), Polygon(FRAME), Polygon([shallow])]
    near = 1.0 + 2.0**-52
    clips = [Polygon([box(2, 2, 4)]), Polygon([[(0, 0), (1, near), (near, 0.5)]]), Polygon(BOW_TIE), Polygon(FRAME)]
    batch = overlay_batch(subjects, clips, "difference")
    assert batch.status.tolist() == [0, 0, 0, 0]
    assert len(batch) == len(batch.pair_offsets) - 1 == 4
    pieces = [piece for result in batch for piece in (result.pieces if result else [])]
    assert len(pieces) == len(batch.piece_offsets) - 1
    rings = [ring for piece in pieces for ring in (piece.shell, *piece.holes)]
    assert [len(ring) for ring in rings] == np.diff(batch.ring_offsets).tolist()
    assert (np.concatenate(rings) == batch.vertices).all()
    for pair, (subject, clip) in enumerate(zip(subjects, clips, strict=True)):
        alone, here = overlay(subject, clip, "difference"), batch[pair]
        assert here is not None
        assert here.area_exact == alone.area_exact
        assert shape(pickle.loads(pickle.dumps(batch))[pair]) == shape(alone)
    many = overlay_batch(subjects * 30, clips * 30, "difference", workers=2)  # several chunks
    for pair, here in enumerate(many):
        assert here is not None
        assert shape(here) == shape(batch[pair % 4])
        assert pair % 8 > 3 or here.area_exact == batch[pair % 4].area_exact
    with pytest.raises(IndexError):
        _ = batch[4]
    empty = overlay_batch([], [])
    assert (len(empty), empty.overlays, empty.vertices.shape) == (0, (), (0, 2))


def test_report_and_pickle() -> None:
    done: list[int] = []
    result, accuracy = overlay(Polygon(BOW_TIE), Polygon(FRAME), report=True, progress=done.append)
    assert done == [1]
    assert (accuracy.decisions, accuracy.coordinates_ulp, accuracy.n_items) == ("exact", 0.5, 12)
    assert shape(pickle.loads(pickle.dumps(result))) == shape(result)


def test_refusals() -> None:
    square, cancel = Polygon([box(0, 0, 1)]), Cancel()
    with pytest.raises(UnsupportedSolidError, match="sphere") as caught:
        overlay(square, Sphere((0, 0), 1))
    assert caught.value.where == ("clip",)
    with pytest.raises(UnsupportedSolidError) as caught:
        overlay_batch([square, 7], [square, square])  # type: ignore[list-item]
    assert caught.value.where == ("subjects", 1)
    with pytest.raises(InvalidOperationError, match="intersection, union"):
        overlay(square, square, "xor")  # type: ignore[call-overload]
    with pytest.raises(DeadlineExceededError):
        overlay(square, square, deadline=0.0)
    cancel.set()
    with pytest.raises(CancelledError):
        overlay(square, square, cancel=cancel)


@pytest.mark.parametrize("wrong", [None, 3, Polygon([[(0, 0), (1, 0), (0, 1)]]), "ab"])
def test_a_batch_that_is_no_list_is_refused(wrong: Any) -> None:
    with pytest.raises(InvalidArrayError, match="subjects must be a list of polygons"):
        overlay_batch(wrong, [])
    with pytest.raises(InvalidArrayError, match="clips must be a list of polygons"):
        overlay_batch([], wrong)
