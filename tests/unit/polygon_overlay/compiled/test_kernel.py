"""The compiled overlay against the one in Python integers: equal results, whatever the degeneracy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.in_integers import overlay_exactly
from engine.polygon_overlay.run import Operation, overlay_compiled
from engine.running.budget import Budget
from engine.types import read_only
from tests.unit.polygon_overlay.checks import OPERATIONS, assert_valid
from tests.unit.polygon_overlay.families import FAMILIES, star
from tests.unit.polygon_overlay.test_overlay import PAIRS

Rings = list[Any]


def arrays(rings: Rings) -> RingArrays:
    found = [np.asarray(ring, float) for ring in rings]
    return RingArrays(read_only(np.concatenate(found)), read_only(np.cumsum([0, *map(len, found)])))


def agree(subject: Rings, clip: Rings, operation: Operation) -> bool:
    """Tell whether the kernel settled the pair; then everything but the tightness of a bound is equal."""
    first, second = arrays(subject), arrays(clip)
    compiled = overlay_compiled(first, second, operation, Budget())
    if compiled is None:
        return False
    result, (exact, _) = compiled[0], overlay_exactly(first, second, operation, Budget())
    assert result.vertices.tolist() == exact.vertices.tolist()
    assert result.ring_offsets.tolist() == exact.ring_offsets.tolist()
    assert result.piece_offsets.tolist() == exact.piece_offsets.tolist()
    assert (result.n_pieces_exact, result.n_holes_exact) == (exact.n_pieces_exact, exact.n_holes_exact)
    for name in ("rounds", "vertices_moved", "collapsed", "snapped"):
        assert getattr(result, name) == getattr(exact, name), name
    for name in ("pieces_joined", "pieces_parted", "holes_joined", "holes_parted"):
        assert getattr(result, name) == getattr(exact, name), name
    assert result.largest_displacement >= exact.largest_displacement * (1 - 2.0**-50)
    assert result.area_exact == exact.area_exact
    assert result.area == exact.area
    return True


@pytest.mark.parametrize("name", PAIRS)
def test_pairs_by_degeneracy(name: str) -> None:
    assert all(agree(*PAIRS[name], operation) for operation in OPERATIONS)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_families(family: Any) -> None:
    for seed in range(4):
        for operation in OPERATIONS:
            agree(*family(np.random.default_rng([5, seed])), operation)


def soup(random: np.random.Generator, n_rings: int) -> Rings:
    return list(random.random((n_rings, 1, 2)) + random.uniform(-0.2, 0.2, (n_rings, 5, 2)))


def scattered(random: np.random.Generator, n_rings: int) -> Rings:
    """Small rings far apart: many components, holes in holes, and a tree in the order of the curve."""
    return [0.02 * star(random, 6) + random.random(2) for _ in range(n_rings)]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("make", [soup, scattered])
def test_many_rings(make: Any, seed: int) -> None:
    random = np.random.default_rng(seed)
    subject, clip = make(random, 16), make(random, 24)
    for operation in OPERATIONS:
        assert agree([*subject, [(-2, -2), (2, -2), (2, 2), (-2, 2)]], clip, operation)


@pytest.mark.parametrize("seed", range(6))
def test_stretches_beyond_the_common_box(seed: int) -> None:
    """Vertices beyond it are left out: stretches there and back, repeated points, and corners passed included."""
    random = np.random.default_rng([8, seed])
    far = random.integers(0, 2, (2, 40, 1)) * random.integers(-2, 3, (2, 40, 2))
    subject, clip = random.integers(-1, 2, (2, 40, 2)) + far + [[[0, 0]], [[2, 1]]]
    for operation in OPERATIONS:
        assert agree([subject], [clip], operation)
        assert agree([subject], [clip + np.array([30, 0])], operation)  # boxes apart


@pytest.mark.parametrize("factor", [2.0**100, 2.0**-110, 2.0**400, 2.0**-500])
def test_scale(factor: float) -> None:
    random = np.random.default_rng(7)
    subject, clip = [star(random, 30)], [star(random, 20)]
    plain = overlay_compiled(arrays(subject), arrays(clip), "union", Budget())
    scaled = overlay_compiled(arrays([subject[0] * factor]), arrays([clip[0] * factor]), "union", Budget())
    assert plain is not None
    assert scaled is not None
    assert (scaled[0].vertices == plain[0].vertices * factor).all()


def test_exponents_too_far_apart_are_left_open() -> None:
    subject, clip = [[(0, 0), (1e300, 0), (1e300, 1)]], [[(0, 0), (5e-324, 0), (0, 5e-324)]]
    assert overlay_compiled(arrays(subject), arrays(clip), "union", Budget()) is None


def test_thousands_of_vertices() -> None:
    """More events than there is room for at first, long chains, a tree of several levels."""
    random = np.random.default_rng(3)
    angles = np.linspace(0, 2 * np.pi, 3000, endpoint=False)
    rings = [
        np.stack([k + r * np.cos(angles), r * np.sin(angles)], axis=1)
        for k, r in ((0.0, 1 + 0.01 * random.random(3000)), (0.1, 1 + 0.01 * random.random(3000)))
    ]
    assert agree(rings[:1], rings[1:], "symmetric_difference")
    result = overlay_compiled(arrays(rings[:1]), arrays(rings[1:]), "difference", Budget())
    assert result is not None
    assert_valid(result[0])


def test_a_raised_flag_ends_the_kernel() -> None:
    budget = Budget()
    budget.flag[0] = 1
    with pytest.raises(Exception, match="another part"):
        overlay_compiled(arrays(PAIRS["corners"][0]), arrays(PAIRS["corners"][1]), "union", budget)


def test_a_signal_handler_may_overlay() -> None:
    """It runs when the kernel returns, before what that left in this thread's scratch is copied."""
    random = np.random.default_rng(5)
    pair, other = (tuple(arrays([star(random, n)]) for _ in range(2)) for n in (30, 9))

    class Interrupted(Budget):
        def check(self) -> None:
            overlay_compiled(other[0], other[1], "union", Budget())

    expected = overlay_compiled(pair[0], pair[1], "union", Budget())
    found = overlay_compiled(pair[0], pair[1], "union", Interrupted())
    assert expected is not None
    assert found is not None
    assert found[0].vertices.tolist() == expected[0].vertices.tolist()
