"""Rounds of the compiled overlay: what they tell is what the integers say."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from engine.polygon_overlay import rounds as overlay_rounds
from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.compiled.kernel import PairStatus
from engine.polygon_overlay.in_integers import overlay_exactly
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.pair_arrays import PairResults, concatenate_pairs, polygon_arrays_of, take_pairs
from engine.polygon_overlay.rounds import make_pairs_valid
from engine.polygon_overlay.run import SELECTED_ARRAYS, overlay_compiled, rebuild_from_rounded_rings, run_kernel
from engine.running.budget import Budget
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay import families as families
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import agree, arrays

WORD = 62
"""Rings that would each have a bit of a label of one word."""
HARD = (
    families.rotated_lattice,
    families.nearly_lattice,
    families.nearly_coincident,
    families.far_lattice,
    families.pencils,
    families.slivers,
    families.combs,
)


@pytest.mark.parametrize("family", HARD, ids=lambda family: family.__name__)
def test_compiled_rounds_equal_those_in_integers(family: Any) -> None:
    told: Counter[str] = Counter()
    for seed in range(6):
        pair = families.drawn(family, 100 + seed)
        for operation in OPERATIONS:
            if agree(*pair, operation):
                told["settled"] += 1
                found = overlay_compiled(*map(arrays, pair), operation, Budget())
                assert found is not None
                told["rounded"] += found[0].rounds > 0
                told["changed"] += bool(found[0].collapsed or found[0].pieces_joined or found[0].pieces_parted)
    assert told["settled"] >= 20
    assert told["rounded"] > 0
    if family in (families.pencils, families.slivers, families.rotated_lattice):
        assert told["changed"] > 0


def border_in_two_versions() -> tuple[np.ndarray, np.ndarray]:
    """Two versions of a border an ulp apart: slivers by the hundred between them."""
    random = np.random.default_rng(4)
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    border = np.stack([100 + np.cos(angles), 50 + np.sin(angles)], axis=1)
    return border, border + random.choice([-1, 0, 1], border.shape) * np.spacing(border)


def test_more_rings_than_a_word_has_bits() -> None:
    """Slivers by the hundred, as pieces or as holes."""
    border, version = border_in_two_versions()
    frame = np.array([[90.0, 40], [110, 40], [110, 60], [90, 60]])
    for subject, clip in (([border], [version]), ([frame, border], [version]), ([frame, border], [frame, version])):
        for operation in ("union", "difference", "symmetric_difference"):
            assert agree(subject, clip, operation)
    found = overlay_compiled(arrays([border]), arrays([version]), "symmetric_difference", Budget())
    assert found is not None
    assert found[0].n_pieces_exact > WORD


def test_more_rings_than_a_word_has_bits_in_a_batch() -> None:
    border, version = map(Polygon, ([each] for each in border_in_two_versions()))
    (found,) = overlay_batch([border], [version], "symmetric_difference")
    assert found is not None
    assert found.vertices.tolist() == overlay(border, version, "symmetric_difference").vertices.tolist()


@pytest.mark.parametrize("n", [100, pytest.param(500, marks=pytest.mark.full)])
def test_many_rings_that_join_and_are_snapped(n: int) -> None:
    """Crowds of rings and a wandering line, each on itself an ulp off: parts near several rings."""
    random = np.random.default_rng(1)
    soup = 1000 + random.random((n // 5, 1, 2)) + random.uniform(-0.05, 0.05, (n // 5, 5, 2))
    line = 1e6 + np.cumsum(random.uniform(-1, 1, (n, 2)), axis=0)
    n_pieces = n_snapped = 0
    for rings in (list(soup), [line]):
        moved = [ring + random.choice([-1, 0, 1], ring.shape) * np.spacing(ring) for ring in rings]
        for operation in ("intersection", "difference", "symmetric_difference"):
            assert agree(rings, moved, operation)
            found = overlay_compiled(arrays(rings), arrays(moved), operation, Budget())
            assert found is not None
            n_pieces, n_snapped = max(n_pieces, found[0].n_pieces_exact), n_snapped + found[0].snapped
    assert n_pieces > WORD
    assert n < 500 or n_snapped > 0


def test_rounds_that_do_not_end_are_snapped(monkeypatch: pytest.MonkeyPatch) -> None:
    """One round instead of twelve is all there is, so that many results are snapped."""
    monkeypatch.setattr(overlay_rounds, "MAX_ROUNDS", 1)
    n_snapped = 0
    for seed in range(20):
        pair = families.drawn(families.slivers, seed)
        for operation in OPERATIONS:
            assert agree(*pair, operation)
            found = overlay_compiled(*map(arrays, pair), operation, Budget())
            assert found is not None
            n_snapped += found[0].snapped
    assert n_snapped >= 5


@pytest.mark.parametrize(
    ("family", "seed"), [(families.turned_by_less_than_an_ulp, 9), (families.nearly_equal_convex, 11)]
)
def test_crossings_next_to_an_axis_are_rounded(family: Any, seed: int) -> None:
    """A coordinate of some 2^-60 between ends of some 1: more digits than a double-double has are lost."""
    assert all(agree(*families.drawn(family, seed), operation) for operation in OPERATIONS)


@pytest.mark.parametrize("n", [4, pytest.param(100, marks=pytest.mark.full)])
def test_a_batch_equals_single_calls(n: int) -> None:
    """Rings arranged again together are those arranged pair by pair, and the objects made of them later too."""
    pairs = [families.drawn(family, seed) for seed in range(n) for family in HARD]
    subjects, clips = ([Polygon(pair[k]) for pair in pairs] for k in (0, 1))
    for operation in OPERATIONS:
        batch, accuracy = overlay_batch(subjects, clips, operation, workers=1, report=True)
        ulps = 0.5
        for number, (subject, clip) in enumerate(zip(subjects, clips, strict=True)):
            single, told = overlay(subject, clip, operation, report=True)
            ulps = max(ulps, told.coordinates_ulp)
            rings = batch.piece_offsets[batch.pair_offsets[number] : batch.pair_offsets[number + 1] + 1]
            stops = batch.ring_offsets[rings[0] : rings[-1] + 1]
            assert batch.vertices[stops[0] : stops[-1]].tolist() == single.vertices.tolist()
            assert (stops - stops[0]).tolist() == single.ring_offsets.tolist()
            assert (rings - rings[0]).tolist() == single.piece_offsets.tolist()
            assert batch.displacement[number] == single.largest_displacement
            found = batch[number]
            assert found is not None
            assert found.vertices.tolist() == single.vertices.tolist()
            assert (found.collapsed, found.rounds) == (single.collapsed, single.rounds)
            assert found.area_exact == single.area_exact
        assert accuracy.coordinates_ulp == ulps


def test_pieces_in_holes_stay_what_they_are_where_a_round_is_taken() -> None:
    """A face in a hole within a hole comes from the inner one: no holes join, and none part."""
    clip = [[(-9, -9.5), (9.3, -9), (9, 9.7), (-9.1, 9)]]
    frames = [[(x * r, y * r) for x, y in ((-1, -1.1), (1.2, -1), (1, 1.3), (-1.1, 1))] for r in (8, 6, 4, 2)]
    sliver = [(0.0, 0.0), (1.0, 1 / 3), (1.0, float(np.nextafter(1 / 3, 1)))]
    for rings in (frames, [*frames, sliver]):
        crossed = [*rings, [(-20, 0.1), (-8.5, 0.2), (-20, 0.3)]]
        for operation in OPERATIONS:
            assert agree(crossed, [*clip, [(0.1, -0.1), (0.4, 0.2), (0.5, 0.1)]], operation)
    result, _ = overlay_exactly(arrays(frames), arrays(clip), "difference", Budget())
    assert (result.n_holes, result.holes_joined, result.holes_parted) == (result.n_holes_exact, 0, 0)


def doubtful() -> PairResults:
    found = []
    for family in (families.slivers, families.pencils, families.nearly_coincident):
        for seed in range(8):
            first, second = (polygon_arrays_of([Polygon(list(each))]) for each in families.drawn(family, seed))
            found.append(run_kernel(first, second, SELECTED_ARRAYS["union"], Budget()))
    return concatenate_pairs(found)


def test_pairs_together_are_pairs_alone() -> None:
    found = doubtful()
    n_doubtful = int((found.status == PairStatus.MAY_CROSS).sum())
    assert n_doubtful > 3
    together = make_pairs_valid(found, rebuild_from_rounded_rings, Budget())
    assert len(together.pairs) <= n_doubtful
    for k, pair in enumerate(together.pairs.tolist()):
        alone = make_pairs_valid(take_pairs(found, np.array([pair])), rebuild_from_rounded_rings, Budget()).rings
        now = take_pairs(together.rings, np.array([k]))
        for name in ("vertices", "ring_offsets", "piece_offsets", "displacement"):
            assert getattr(alone, name).tolist() == getattr(now, name).tolist()
