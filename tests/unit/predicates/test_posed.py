"""orient3d of posed points against rational arithmetic: flush stacks, shared poses, every exponent."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from engine.compiling.jit import inline, kernel
from engine.predicates.posed import UNPOSED, PosedPoint3, orient3d_posed, orient3d_posed_exact, posed_error
from engine.predicates.rational import orient3d_rational
from engine.types import UNDECIDED

Array = npt.NDArray[np.float64]


@inline
def posed_row(points: Any, bodies: Any, row: int) -> PosedPoint3:
    return PosedPoint3(points[row, 0], points[row, 1], points[row, 2], int(bodies[row]))


@kernel
def orient3d_posed_batch(poses: Any, points: Any, bodies: Any, error: float, is_exact: bool, sides: Any) -> None:
    """Fill sides (n,) int8 for points (4, n, 3) float64 with poses bodies (4, n) int64; is_exact: skip the filter."""
    for item in range(sides.shape[0]):
        a, b = posed_row(points[0], bodies[0], item), posed_row(points[1], bodies[1], item)
        c, d = posed_row(points[2], bodies[2], item), posed_row(points[3], bodies[3], item)
        if is_exact:
            sides[item] = orient3d_posed_exact(poses, a, b, c, d)
        else:
            sides[item] = orient3d_posed(poses, a, b, c, d, error)


def rotation(draw: np.random.Generator) -> Array:
    """Return a random rotation, orthogonal to rounding."""
    q, _ = np.linalg.qr(draw.standard_normal((3, 3)))
    return q * np.sign(np.linalg.det(q))


def posed_fractions(poses: Array, point: Array, body: int) -> list[Fraction]:
    p = [Fraction(value) for value in point.tolist()]
    if body == UNPOSED:
        return p
    row = [Fraction(value) for value in poses[body].tolist()]
    return [sum((row[3 * axis + k] * p[k] for k in range(3)), row[9 + axis]) for axis in range(3)]


def exact(poses: Array, points: Array, bodies: Any) -> npt.NDArray[np.int8]:
    signs = []
    for item in range(points.shape[1]):
        signs.append(orient3d_rational(*(posed_fractions(poses, points[k, item], bodies[k, item]) for k in range(4))))
    return np.array(signs, np.int8)


def run(poses: Array, points: Array, bodies: Any, is_exact: bool) -> npt.NDArray[np.int8]:
    sides = np.empty(points.shape[1], np.int8)
    with np.errstate(all="ignore"):
        reach = float(np.abs(points).max())
        error = max((posed_error(poses, body, reach) for body in set(bodies.ravel().tolist())), default=0.0)
        orient3d_posed_batch(poses, points, bodies, error, is_exact, sides)
    return sides


def scene(seed: int, n: int) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Return lattice points of bodies of which two share a pose and a third has a copy of it moved in its own frame."""
    draw = np.random.default_rng(seed)
    r = rotation(draw)
    t = draw.standard_normal(3)
    poses = np.array(
        [[*r.ravel(), *t], [*r.ravel(), *t], [*np.eye(3).ravel(), *np.round(t)], [*rotation(draw).ravel(), *t]]
    )
    points = draw.integers(-2, 3, (4, n, 3)) / 4.0
    return (
        poses,
        points,
        draw.choice([UNPOSED, 0, 0, 0, 1, 1, 1, 2, 3], (4, n), p=[0.05, 0.2, 0.2, 0.1, 0.15, 0.1, 0.1, 0.05, 0.05]),
    )


@pytest.mark.parametrize("seed", range(4))
def test_bodies_under_equal_and_different_poses(seed: int) -> None:
    poses, points, bodies = scene(seed, 300)
    expected = exact(poses, points, bodies)
    assert (run(poses, points, bodies, True) == expected).all()
    assert (run(poses, points, bodies, False) == expected).all()
    assert np.count_nonzero(expected == 0) > 10


@pytest.mark.parametrize("exponent", [-1060, -700, -320, 250, 320, 600, 1018])
def test_a_scene_is_decided_at_every_scale(exponent: int) -> None:
    poses, points, bodies = scene(9, 200)
    poses[:, 9:] = np.round(poses[:, 9:] * 16) / 16
    plain = run(poses, points, bodies, False)
    poses[:, 9:] = np.ldexp(poses[:, 9:], exponent)
    scaled = np.ldexp(points, exponent)
    assert (run(poses, scaled, bodies, True) == plain).all()
    assert (run(poses, scaled, bodies, False) == plain).all()


def test_mixed_exponents_never_decide_wrongly() -> None:
    draw = np.random.default_rng(11)
    n_decided = 0
    for _ in range(40):
        poses, points, bodies = scene(int(draw.integers(1 << 30)), 10)
        points = np.ldexp(points, draw.integers(-90, 90, points.shape))
        poses[:, 9:] = np.ldexp(poses[:, 9:], draw.integers(-90, 90, (4, 3)))
        tiny = draw.random((4, 9)) < 0.02
        poses[:, :9][tiny] = np.ldexp(draw.standard_normal(tiny.sum()), draw.integers(-1070, -10, tiny.sum()))
        expected = exact(poses, points, bodies)
        for is_exact in (True, False):
            sides = run(poses, points, bodies, is_exact)
            # case: these matrices are no rotations, so a common pose does not promise the unposed sign
            mixed = (bodies != bodies[0]).any(axis=0)
            assert (sides == expected)[mixed & (sides != UNDECIDED)].all()
            n_decided += np.count_nonzero(sides != UNDECIDED)
    assert n_decided > 200
