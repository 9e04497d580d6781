"""Two meshes: the way down both trees, one pose and many."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine import Pose, Surface, collide
from engine.collision.codes import N_COLUMNS, N_CONTACTS, RELATION, UNSETTLED
from engine.collision.meshes.dual_traversal import SEEK_CONTACT, SEEK_OVERLAP
from engine.collision.meshes.exact_body import classify_exact, exact_pair, kind_of_contact
from engine.collision.meshes.mesh_arrays import STILL, mesh_body_of
from engine.collision.meshes.mesh_pair import SPACE, MeshPair, new_contacts, new_descent, relate, unless_identity
from engine.collision.meshes.parity import INSIDE, OUTSIDE
from engine.collision.meshes.placement import PoseArrays
from engine.collision.meshes.pose_batch import ONE_SETTLES, relate_poses
from engine.collision.meshes.triangle_triangle import APART, CROSSING
from engine.collision.result import Work
from engine.types import UNDECIDED, read_only
from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs, polyhedron, surface
from tests.unit.collision.meshes.bodies import TURN, brick, mesh, with_far_shell


def test_the_identity_is_no_pose() -> None:
    assert unless_identity((None, Pose.identity())) == (None, None)
    assert unless_identity((TURN, None)) == (TURN, None)


@pytest.mark.parametrize("pose", [None, TURN])
def test_patches_inside_and_outside(pose: Pose | None) -> None:
    pair = MeshPair(mesh(1, (1, 1, 1)), mesh(3), (pose, pose), Work())
    none = np.empty(0, np.int64)
    assert [len(patch) for patch in pair.patches(0, none, INSIDE)] == [12]
    assert [len(patch) for patch in pair.patches(1, none, OUTSIDE)] == [108]
    assert pair.patches(0, none, OUTSIDE) == []
    off_plane_point = list(pair.patch_sides(0, np.arange(12)))
    assert off_plane_point
    assert all(sides.above != sides.below for sides in off_plane_point)


# --- Polyhedra, surfaces and boxes of space against each other ---


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [
        (3, aabb, polyhedron),
        (3, aabb, surface),
        (3, polyhedron, polyhedron),
        (3, polyhedron, surface),
        (3, surface, surface),
    ],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


# --- Many poses at once: what single questions say, or UNSETTLED ---


@pytest.mark.parametrize("room", [64, 4096])
@pytest.mark.parametrize("size", [1, 3])
def test_agrees_with_single_questions(size: int, room: int) -> None:
    rng = np.random.default_rng(size)
    turns, _ = np.linalg.qr(rng.normal(size=(40, 3, 3)))
    turns *= np.sign(np.linalg.det(turns))[:, None, None]
    turns[:8] = np.eye(3)
    moves = rng.integers(-3, 4, (40, 3)).astype(float)
    moves[20:] *= 0.3
    sheet = Surface([[0.5, 0.5, 0.5], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    for second, seek in ((brick(size), SEEK_OVERLAP), (brick(5, (-2, -2, -2)), SEEK_OVERLAP), (sheet, SEEK_CONTACT)):
        first = brick(2)
        a, b = mesh_body_of(first), mesh_body_of(second)
        rows = np.empty((40, N_COLUMNS), np.int64)
        poses = PoseArrays(read_only(turns), read_only(moves), True)  # the kind that the kernel is compiled for
        with np.errstate(all="ignore"):
            relate_poses(
                a.arrays,
                b.arrays,
                STILL,
                poses,
                seek,
                0,
                new_descent(),
                new_contacts(room),
                0,
                rows,
                np.zeros(1, np.uint8),
            )
        found = rows[:, RELATION]
        assert (found != UNSETTLED).sum() > 20
        for turn, move, how in zip(turns, moves, found.tolist()):
            if how != UNSETTLED:
                assert how == collide(first, second, second_pose=Pose(turn, move)).relation


# --- The search finds every pair of faces with a common point, however little room it has ---


@pytest.mark.parametrize("room", [1, 7, 512])
@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", [(2, 0, 0), (2, 1, 0.5), (2, 2, 2), (0.5, 0.5, 2), (3, 0, 0)])
def test_finds_what_looking_at_all_pairs_finds(
    room: int, pose: Pose | None, at: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SPACE, "contacts", new_contacts(room))
    a, b = mesh_body_of(with_far_shell(brick(2))), mesh(1, at)
    row, found = relate(a, b, (a.posed(pose), b.posed(pose)), SEEK_OVERLAP, Work())
    pairs = set(map(tuple, found.pairs[: row[N_CONTACTS]].tolist()))
    assert len(pairs) == row[N_CONTACTS]
    x, y = exact_pair(a, b, (pose, pose))
    every = itertools.product(range(len(a.faces)), range(len(b.faces)))
    touching = {(i, j) for i, j in every if classify_exact(x.corners(i), y.corners(j)) != APART}
    for i, j in touching - pairs:
        assert len(found.met) > 0
        assert kind_of_contact(x.corners(i), y.corners(j)) == "vertex_vertex"
        assert i in {p for p, _ in pairs}
        assert j in {q for _, q in pairs}
    assert pairs <= touching or UNDECIDED in found.kinds[: len(pairs)]
    assert CROSSING not in found.kinds[: len(pairs)]


@pytest.mark.parametrize("pose", [None, TURN])
def test_a_crossing_or_any_contact_may_settle_the_question(pose: Pose | None) -> None:
    a, b = mesh(2), mesh(2, (1, 0.5, 0.25))
    for seek in (SEEK_OVERLAP, SEEK_CONTACT):
        row, found = relate(a, b, (a.posed(pose), b.posed(pose)), seek, Work())
        assert row[N_CONTACTS] == ONE_SETTLES
        i, j = found.pairs[0].tolist()
        x, y = exact_pair(a, b, (pose, pose))
        kind = classify_exact(x.corners(i), y.corners(j))
        assert kind == CROSSING or (seek == SEEK_CONTACT and kind != APART)
