"""Many poses at once: what single questions say, or UNSETTLED."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose, Surface, collide
from engine.arrays import read_only
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.dual_traversal import SEEK_CONTACT, SEEK_OVERLAP, new_descent, new_found
from engine.collision.meshes.mesh_arrays import STILL, mesh_body_of
from engine.collision.meshes.placement import PoseArrays
from engine.collision.meshes.pose_batch import N_COLUMNS, RELATION, relate_poses
from tests.unit.collision.meshes.bodies import brick


@pytest.mark.parametrize("room", [4, 256])
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
                new_found(room),
                0,
                rows,
                np.zeros(1, np.uint8),
            )
        found = rows[:, RELATION]
        assert (found != UNSETTLED).sum() > 20
        for turn, move, how in zip(turns, moves, found.tolist()):
            if how != UNSETTLED:
                assert how == collide(first, second, second_pose=Pose(turn, move)).relation
