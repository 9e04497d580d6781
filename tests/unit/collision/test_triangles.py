"""Triangles, pair by pair."""

from __future__ import annotations

import numpy as np
import pytest

from engine import DeadlineExceededError, InvalidArrayError, NotFiniteError, Relation, WrongDimensionError
from engine.collision.codes import UNSETTLED
from engine.collision.triangles import collide_triangles, relate_triangles_2d
from tests.reference.collision import SWAPPED, relation


def lattice(seed: int, n: int, dimension: int, top: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, top + 1, (n, 3, dimension)).astype(np.float64)


def expected(first: np.ndarray, second: np.ndarray) -> list[int]:
    found = []
    for t, u in zip(first.tolist(), second.tolist()):
        if len(t[0]) == 2:
            found.append(relation({"type": "triangle", "vertices": t}, {"type": "triangle", "vertices": u}))
        else:
            bodies = [{"type": "surface", "vertices": v, "faces": [[0, 1, 2]]} for v in (t, u)]
            found.append(relation(*bodies))
    return found


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("scale", [1.0, 2.0**-1073, 2.0**1021])
def test_agrees_with_the_reference(dimension: int, scale: float) -> None:
    first, second = lattice(1, 300, dimension) * scale, lattice(2, 300, dimension) * scale
    found = collide_triangles(first, second)
    assert found.tolist() == expected(first, second)
    assert collide_triangles(second, first).tolist() == [SWAPPED[code] for code in found.tolist()]


@pytest.mark.parametrize("dimension", [2, 3])
def test_exponents_that_no_expansion_spans_are_settled(dimension: int) -> None:
    rng = np.random.default_rng(3)
    scales = 2.0 ** rng.choice([-1073, -500, 0, 500, 1000], (60, 3, dimension))
    first, second = lattice(4, 60, dimension) * scales, lattice(5, 60, dimension) * scales
    found, report = collide_triangles(first, second, report=True)
    assert found.tolist() == expected(first, second)
    assert report.decisions == "exact"


def test_one_ulp_decides_between_touching_and_disjoint() -> None:
    t = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    u = [[0.1, 0.9], [1.0, 1.0], [1.0, 2.0]]  # 0.1 + 0.9, as doubles, is a little more than 1
    v = [[np.nextafter(0.1, 0.0), 0.9], *u[1:]]
    assert collide_triangles([t, t], [u, v]).tolist() == expected(np.array([t, t]), np.array([u, v]))


@pytest.mark.parametrize("workers", [1, 2, None])
def test_threads_do_not_change_the_answer(workers: int | None) -> None:
    first, second = lattice(6, 20_000, 2, 9), lattice(7, 20_000, 2, 9)
    found = collide_triangles(first, second, workers=workers)
    assert np.bincount(found, minlength=5).tolist() == np.bincount(collide_triangles(first, second)).tolist()
    assert set(found.tolist()) == set(map(int, Relation))


def test_no_pairs_give_no_relations() -> None:
    assert collide_triangles([], []).shape == (0,)


def test_bad_input_is_named() -> None:
    t = [[[0, 0], [1, 0], [0, 1]]]
    with pytest.raises(InvalidArrayError, match="equally many"):
        collide_triangles(t, t * 2)
    with pytest.raises(WrongDimensionError):
        collide_triangles(t, [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    with pytest.raises(NotFiniteError) as caught:
        collide_triangles(t, [[[0, 0], [1, float("nan")], [0, 1]]])
    assert caught.value.where == ("second", 0, 1, 1)
    with pytest.raises(DeadlineExceededError):
        collide_triangles(t, t, deadline=0.0)


# --- The kernel for pairs of triangles of the plane: right or UNSETTLED ---


def test_agrees_with_the_reference_on_a_lattice() -> None:
    first, second = np.random.default_rng(7).integers(0, 4, (2, 400, 3, 2)).astype(float)
    found = np.empty(400, np.int8)
    relate_triangles_2d(first, second, found)
    for t, u, how in zip(first.tolist(), second.tolist(), found.tolist()):
        assert how == relation({"type": "triangle", "vertices": t}, {"type": "triangle", "vertices": u})


def test_exponents_that_no_expansion_spans_stay_unsettled() -> None:
    t = np.array([[[0.0, 0.0], [2.0**1000, 2.0**-1073], [2.0**-1073, 2.0**1000]]])
    found = np.empty(1, np.int8)
    with np.errstate(all="ignore"):
        relate_triangles_2d(t, t + 0.0, found)
    assert found[0] == UNSETTLED
