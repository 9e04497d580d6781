"""Eight triangles against eight: compiled lanes say what Python says, and part nothing that meets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Surface, collide_triangles
from engine.collision.meshes.dual_traversal import place_bodies
from engine.collision.meshes.mesh_arrays import STILL, mesh_body_of
from engine.collision.meshes.mesh_pair import new_descent
from engine.collision.meshes.placement import PoseArrays
from engine.compiling.jit import kernel
from engine.lanes.faces import (
    CORNER_ROWS,
    WORK_ROWS,
    faces_meeting,
    meet_boxes,
    set_normals,
    unseparated_faces,
)

TURNED = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@kernel
def ask(first: Any, second: Any, frames: Any, work: Any, found: Any) -> None:
    found[0], found[1] = meet_boxes(first, 0, second, 0, frames, work)
    set_normals(first, 0, second, 0, frames, work)
    for lane in range(8):
        found[2 + lane] = unseparated_faces(lane, work)
    found[10], found[11] = faces_meeting(first, 0, second, 0, frames, work)


@kernel
def place(first: Any, still: Any, second: Any, poses: Any, descent: Any) -> None:
    place_bodies(first, still, 0, second, poses, 0, descent)


def touching_soups(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return eight triangles, n that have a corner on or near one of them once they are posed, and the translation."""
    first = rng.uniform(-1, 1, (8, 3, 3)) * rng.choice([1.0, 0.05, 0.0], (8, 1, 3)) + rng.uniform(-1, 1, (8, 1, 3))
    move = rng.uniform(-1, 1, 3)
    weights = rng.dirichlet(np.ones(3), n)
    corners = np.einsum("ij,ijk->ik", weights, first[rng.integers(0, 8, n)]) + rng.normal(size=(n, 3)) * 1e-7
    second = (corners - move)[:, None] @ TURNED + rng.normal(size=(n, 3, 3)) * rng.choice([1.0, 0.1], (n, 1, 1))
    second[:, 0] = (corners - move) @ TURNED
    return first, second, move


def unused_pairs(n_first: int, n_second: int) -> int:
    return sum(1 << (8 * a + b) for a in range(8) for b in range(8) if a >= n_first or b >= n_second)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", [1.0, 2.0**-20])
def test_compiled_lanes_equal_python_and_keep_what_meets(seed: int, size: float) -> None:
    rng, descent, n_parted, n_boxes = np.random.default_rng(seed), new_descent(), 0, 0
    for _ in range(20):
        first, second, move = touching_soups(rng, 8 - seed)
        first = first[: 8 - seed // 2]
        soups = [Surface(size * s.reshape(-1, 3), np.arange(3 * len(s)).reshape(-1, 3)) for s in (first, second)]
        a, b = (mesh_body_of(soup) for soup in soups)
        place(a.arrays, STILL, b.arrays, PoseArrays(TURNED[None], size * move[None], True), descent)
        work, found = np.zeros((WORK_ROWS, 8), np.float32), np.zeros(12, np.int64)
        ask(a.arrays.blocks, b.arrays.blocks, descent.frames, work, found)
        plain = np.zeros((WORK_ROWS, 8), np.float32)
        arguments = (a.arrays.blocks, 0, b.arrays.blocks, 0, descent.frames, plain)
        assert found[:2].tolist() == list(meet_boxes(*arguments))
        set_normals(*arguments)
        lanes = [unseparated_faces(lane, plain) for lane in range(8)]
        assert found[2:10].tolist() == lanes
        assert work.tobytes() == plain.tobytes()
        boxes, kept = (int(found[k]) | int(found[k + 1]) << 32 for k in (0, 10))
        assert kept == boxes & sum(bits << (8 * lane) for lane, bits in enumerate(lanes))
        assert boxes & unused_pairs(len(first), len(second)) == 0
        n_boxes, n_parted = n_boxes + boxes.bit_count(), n_parted + (boxes ^ kept).bit_count()
        posed = second @ TURNED.T + move
        meets = collide_triangles(
            first[a.faces].repeat(len(posed), axis=0), np.tile(posed[b.faces], (len(first), 1, 1))
        )
        for k in np.flatnonzero(meets).tolist():
            assert kept >> (8 * (k // len(posed)) + k % len(posed)) & 1
    assert 0.02 * n_boxes < n_parted < n_boxes


def test_blocks_hold_corners_in_the_tree_and_nothing_in_unused_lanes() -> None:
    mesh = mesh_body_of(Surface([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]]))
    block, origin, scale = mesh.arrays.blocks[0], mesh.arrays.origin, mesh.arrays.scale
    assert block.shape == (CORNER_ROWS, 8)
    assert (block[:, 0].reshape(3, 3) * scale + origin).tolist() == [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
    assert (block[:, 1:] == np.float32(1e30)).all()
