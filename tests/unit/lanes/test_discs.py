"""Eight discs against eight: compiled lanes say what Python says, and part nothing that meets."""

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
from engine.lanes.boxes import (
    discs_meeting,
    meeting,
    place_discs,
    unseparated_discs,
)
from tests.unit.bounding.test_trees import faces_below, surfaces

TURNED = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@kernel
def ask(first: Any, second: Any, frames: Any, scales: Any, work: Any, found: Any) -> None:
    place_discs(second, 0, frames, np.float32(scales[1] / scales[0]), np.float32(scales[0] / scales[1]), work)
    for lane in range(8):
        found[lane] = unseparated_discs(lane, first, 0, work)
    low, high = found[8], found[9]
    found[8], found[9] = discs_meeting(low, high, first, 0, second, 0, frames, (scales[0], scales[1]), work)


@kernel
def place(first: Any, still: Any, second: Any, poses: Any, descent: Any) -> None:
    place_bodies(first, still, 0, second, poses, 0, descent)


@pytest.mark.parametrize("names", [("flat", "flat"), ("sphere", "waves"), ("waves", "soup"), ("line", "sphere")])
@pytest.mark.parametrize("size", [1.0, 2.0**-9])
def test_compiled_lanes_equal_python_and_keep_what_meets(names: tuple[str, str], size: float) -> None:
    first, second = surfaces()[names[0]], surfaces()[names[1]]
    second = Surface(size * second.vertices, second.triangles)
    a, b = mesh_body_of(first), mesh_body_of(second)
    rng, descent, n_boxes, n_kept = np.random.default_rng(3), new_descent(), 0, 0
    for item in range(12):
        gap = 1e-4 * (item - 4)
        move = first.vertices[rng.integers(len(first.vertices))] - TURNED @ second.vertices[0] + [0.0, 0.0, gap]
        place(a.arrays, STILL, b.arrays, PoseArrays(TURNED[None], move[None], True), descent)
        boxes = meeting(a.arrays.boxes, 0, b.arrays.boxes, 0, descent.frames)
        found = np.array([0] * 8 + list(boxes), np.int64)
        scales = np.array([a.arrays.scale, b.arrays.scale])
        ask(a.arrays.discs, b.arrays.discs, descent.frames, scales, descent.work, found)
        work, ratio = np.zeros_like(descent.work), np.float32(scales[1] / scales[0])
        place_discs(b.arrays.discs, 0, descent.frames, ratio, np.float32(1.0) / ratio, work)
        lanes = [unseparated_discs(lane, a.arrays.discs, 0, work) for lane in range(8)]
        assert found[:8].tolist() == lanes
        before, kept = (low | high << 32 for low, high in (boxes, (int(found[8]), int(found[9]))))
        assert kept == before & sum(bits << (8 * lane) for lane, bits in enumerate(lanes))
        n_boxes, n_kept = n_boxes + before.bit_count(), n_kept + kept.bit_count()
        ours, theirs = a.arrays.vertices[a.arrays.triangles], b.arrays.vertices[b.arrays.triangles] @ TURNED.T + move
        for lane in range(8):
            for other in range(8):
                if before >> (8 * lane + other) & 1 and not kept >> (8 * lane + other) & 1:
                    left = faces_below(a, int(a.arrays.child[0, lane]))
                    right = faces_below(b, int(b.arrays.child[0, other]))
                    assert not collide_triangles(
                        ours[left].repeat(len(right), axis=0), np.tile(theirs[right], (len(left), 1, 1))
                    ).any()
    assert 0 < n_kept <= n_boxes
