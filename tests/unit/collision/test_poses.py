"""Poses: generated ones, and those between which bodies part."""

from __future__ import annotations

import math
import random
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from engine import Polyhedron, Pose, Relation, collide, collide_poses
from tests.reference.collision import relation
from tests.reference.contact import triangles_meet
from tests.reference.shapes import Solid, box
from tests.reference.solids import image
from tests.unit.collision.lattices import QUARTERS, TURNS, aabb, points, polyhedron, solid, surface
from tests.unit.collision.test_collide import made
from tests.unit.collision.test_collide_poses import rotations

MESHES = (
    "igl_bunny",
    "igl_decimated-knight",
    "igl_3holes",
    "c3d_spot",
    "c3d_fandisk",
    "igl_armadillo",
    "igl_bumpy",
    "syn_gear",
    "syn_menger2",
    "syn_sliver_uv",
    "tm_quadknot",
    "tm_rabbit",
)
STEPS = np.arange(-3, 5)
"""Doubles to look at: 0 is the last with a common point, 1 the first without."""

Array = npt.NDArray[np.float64]


def bisected(first: Polyhedron, second: Polyhedron, turns: Array, seed: int) -> Array:
    """Return moves (n_turns, n_steps, 3) of the second body along x around where it leaves the first."""
    random = np.random.default_rng(seed)
    n = len(turns)
    middle, size = np.empty((2, 3)), np.empty(2)
    for item, body in enumerate((first, second)):
        low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
        middle[item], size[item] = (low + high) / 2, np.linalg.norm(high - low)
    moves = middle[0] - turns @ middle[1] + random.uniform(-0.2, 0.2, (n, 3)) * size.min()
    near, far = moves[:, 0].copy(), moves[:, 0] + size.sum()
    while True:  # bound: an interval of doubles halves
        between = near + (far - near) / 2
        is_open = (near < between) & (between < far)
        if not is_open.any():
            break
        moves[:, 0] = between
        is_apart = collide_poses(first, second, turns, moves, boolean=True) == Relation.DISJOINT
        near = np.where(is_open & ~is_apart, between, near)
        far = np.where(is_open & is_apart, between, far)
    found = np.repeat(moves[:, None], len(STEPS), axis=1)
    for item, step in enumerate(STEPS.tolist()):
        at = near
        for _ in range(abs(step)):
            at = np.nextafter(at, np.copysign(np.inf, step))
        found[:, item, 0] = at
    assert (found[:, 4, 0] == far).all()
    return found


def have_common_point(first: Polyhedron, second: Polyhedron, turn: Array, move: Array) -> bool:
    """Tell exactly whether some pair of triangles meets, of those that no axis parts by a thousand roundings."""
    one, other = first.vertices[first.triangles], (second.vertices @ turn.T + move)[second.triangles]
    slack = 1e-12 * max(np.abs(corners).max() for corners in (one, other))
    low, high, their_low, their_high = one.min(axis=1), one.max(axis=1), other.min(axis=1), other.max(axis=1)
    their_low, their_high = their_low - slack, their_high + slack
    faces = np.flatnonzero(((low <= their_high.max(axis=0)) & (their_low.min(axis=0) <= high)).all(axis=1))
    theirs = np.flatnonzero(((their_low <= high.max(axis=0)) & (low.min(axis=0) <= their_high)).all(axis=1))
    near: list[npt.NDArray[np.int64]] = []
    for face in faces.tolist():
        meet = (low[face] <= their_high[theirs]) & (their_low[theirs] <= high[face])
        met = theirs[meet.all(axis=1)]
        near.append(np.stack([np.full(len(met), face), met], axis=1))
    pairs = np.concatenate([np.empty((0, 2), np.int64), *near])
    pairs = pairs[~are_parted(one[pairs[:, 0]], other[pairs[:, 1]], slack)]
    pose = {"rotation": turn.tolist(), "translation": move.tolist()}
    for face, met in pairs.tolist():
        corners = [image(p, None) for p in first.vertices[first.triangles[face]].tolist()]
        their_corners = [image(p, pose) for p in second.vertices[second.triangles[met]].tolist()]
        if triangles_meet(tuple(corners), tuple(their_corners)):
            return True
    return False


def are_parted(triangles: Array, others: Array, slack: float) -> npt.NDArray[np.bool_]:
    """Return for pairs of triangles (n, 3, 3) whether a normal or a product of edges certainly separates them."""
    sides, their_sides = (np.roll(corners, -1, axis=1) - corners for corners in (triangles, others))
    axes = [np.cross(edges[:, 0], edges[:, 1]) for edges in (sides, their_sides)]
    axes += [np.cross(sides[:, i], their_sides[:, k]) for i in range(3) for k in range(3)]
    parted = np.zeros(len(others), np.bool_)
    for axis in axes:
        length = np.linalg.norm(axis, axis=1)
        u = axis / np.where(length > 0, length, 1.0)[:, None]
        heights, their_heights = (np.einsum("nij,nj->ni", corners, u) for corners in (triangles, others))
        parted |= heights.max(axis=1) + slack < their_heights.min(axis=1)
        parted |= their_heights.max(axis=1) + slack < heights.min(axis=1)
    return parted


def check_meshes(first: Polyhedron, second: Polyhedron, n_turns: int, seed: int) -> int:
    """Check n_turns bisections; return the number of poses compared."""
    turns = rotations(n_turns, seed)
    moves = bisected(first, second, turns, seed)
    n_steps = len(STEPS)
    every = np.repeat(turns, n_steps, axis=0)
    found = collide_poses(first, second, every, moves.reshape(-1, 3)).reshape(n_turns, n_steps)
    swapped = [
        collide(second, first, first_pose=Pose(turn, move)).relation
        for turn, row in zip(turns, moves[:, 3:5], strict=True)
        for move in row
    ]
    assert found[:, 3:5].ravel().tolist() == swapped
    assert set(np.unique(found).tolist()) <= {Relation.DISJOINT, Relation.TOUCHING, Relation.OVERLAPPING}
    for turn, row, answers in zip(turns, moves, found, strict=True):
        expected = [have_common_point(first, second, turn, move) for move in row]
        assert (answers != Relation.DISJOINT).tolist() == expected, (turn.tolist(), row.tolist())
    return int(found.size)


def mesh(data: Path, name: str) -> Polyhedron:
    """Return a mesh, scaled by a power of two to about unit size."""
    read = np.load(data / "meshes" / f"{name}.npz")
    power = int(np.frexp(np.ptp(read["vertices"], axis=0).max())[1])
    return Polyhedron(np.ldexp(read["vertices"], -power), read["faces"])


@pytest.mark.data
def test_real_meshes_part_between_two_doubles(data: Path) -> None:
    assert check_meshes(mesh(data, "igl_bunny"), mesh(data, "igl_decimated-knight"), 1, 1) == 8


@pytest.mark.data
@pytest.mark.full
@pytest.mark.parametrize(("one", "other"), list(combinations_with_replacement(MESHES, 2)))
def test_many_real_meshes_part_between_two_doubles(data: Path, one: str, other: str) -> None:
    check_meshes(mesh(data, one), mesh(data, other), 2, 2)


def small_bodies() -> list[Solid]:
    wedge: dict[str, Any] = {
        "type": "polyhedron",
        "vertices": [[0, 0, 0], [1.1, 0, 0.3], [0.2, 0.9, 0], [0.1, 0.2, 1.3]],
        "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    }
    return [wedge, box((0, 0, 0), (1, 0.7, 0.3))]


@pytest.mark.parametrize("n_turns", [1, pytest.param(150, marks=pytest.mark.full)])
def test_small_bodies_have_the_relations_of_the_reference(n_turns: int) -> None:
    bodies = small_bodies()
    for first in bodies:
        for second in bodies:
            turns = rotations(n_turns, 7)
            turns[0] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
            moves = bisected(made(first), made(second), turns, 3)[:, 2:6]
            for turn, row in zip(turns, moves, strict=True):
                every = np.repeat(turn[None], len(row), axis=0)
                poses = [{"rotation": turn.tolist(), "translation": move.tolist()} for move in row]
                expected = [relation(first, second, None, pose) for pose in poses]
                assert collide_poses(made(first), made(second), every, row).tolist() == expected, poses
                assert expected[2] == Relation.DISJOINT


# --- Batches of poses against the rational reference: bodies and moves on a small lattice ---


STILL = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
FLIP = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]


def block(rng: random.Random, d: int) -> dict[str, Any]:
    """Return a box of whole numbers as a polyhedron."""
    low = points(rng, 1, d, 2)[0]
    return box(tuple(low), tuple(x + rng.randint(1, 3) for x in low))


def one_ulp_off(rng: random.Random, move: list[float]) -> list[float]:
    """Return a move, one coordinate of it now and then moved to the next double."""
    if rng.random() < 0.3:
        axis = rng.randrange(3)
        move[axis] = math.nextafter(move[axis], rng.choice([-math.inf, math.inf]))
    return move


@pytest.mark.some(6)
@pytest.mark.parametrize("first", [polyhedron, block, aabb, surface])
@pytest.mark.parametrize("second", [polyhedron, block, surface])
@pytest.mark.parametrize("n", [2, pytest.param(150, marks=pytest.mark.full)])
def test_agrees_with_the_reference(first: Any, second: Any, n: int) -> None:
    rng = random.Random(f"{first.__name__}{second.__name__}")
    for _ in range(n):
        a, b = first(rng, 3), second(rng, 3)
        turns = [rng.choice([STILL, TURNS[3], QUARTERS[3], FLIP]) for _ in range(12)]
        moves = [one_ulp_off(rng, move) for move in points(rng, 12, 3)]
        expected = [
            relation(a, b, None, {"rotation": turn, "translation": move})
            for turn, move in zip(turns, moves, strict=True)
        ]
        one, other = solid(a), solid(b)
        found, witnesses = collide_poses(one, other, turns, moves, witnesses=True)
        assert found.tolist() == expected, (a, b, turns, moves)
        assert [w is None for w in witnesses] == [r == Relation.DISJOINT for r in expected]
        assert collide_poses(one, other, turns, moves, workers=1).tolist() == expected
        is_apart = collide_poses(one, other, turns, moves, boolean=True) == Relation.DISJOINT
        assert is_apart.tolist() == [r == Relation.DISJOINT for r in expected]
