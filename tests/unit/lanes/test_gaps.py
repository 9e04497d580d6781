"""No bound is above a distance that occurs, on random bodies under random poses, large, small and far ones."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from engine.collision.meshes.mesh_arrays import MeshArrays, mesh_body_of
from engine.collision.meshes.placement import Placement, PoseArrays, defect_of, place_pair, set_frame
from engine.lanes.boxes import BOX_ROWS, DISC_ROWS, EMPTY, FRAME_ROWS, inverse_ratio
from engine.lanes.faces import (
    FIXED_ROWS,
    GAP_ROWS,
    child_bounds,
    near_triangle,
    place_triangles,
)
from engine.lanes.tracing import LANES
from engine.solids.mesh import Surface


def _soup(draw: np.random.Generator, size: float) -> MeshArrays:
    """Return the mesh of a wavy sheet, with triangles here and there."""
    middles = draw.normal(size=(90, 1, 3)) * [1.0, 1.0, 0.1]
    vertices = ((middles + 0.1 * draw.normal(size=(90, 3, 3))) * size).reshape(-1, 3)
    return mesh_body_of(Surface(vertices, np.arange(270).reshape(-1, 3))).arrays


def _below(mesh: MeshArrays, node: int, lane: int) -> np.ndarray:
    """Return the corners of all triangles below a child."""
    child = int(mesh.child[node, lane])
    if child < 0:
        return mesh.vertices[mesh.triangles[-1 - child]]
    parts = [_below(mesh, child, k) for k in range(LANES) if mesh.child[child, k] != EMPTY]
    return np.concatenate(parts)


def _children(mesh: MeshArrays, *, are_blocks: bool) -> Iterator[int]:
    yield from (node for node in range(len(mesh.child)) if (mesh.child[node, 0] < 0) == are_blocks)


def _placed(points: np.ndarray, place: Placement) -> np.ndarray:
    rotation = np.array([place.x, place.y, place.z]) if place.is_posed else np.eye(3)
    return points @ rotation.T + (np.array(place.shift) if place.is_posed else 0.0)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("ratio", "away"), [(1.0, 1.0), (1e-3, 0.7), (1e4, 1e4), (1.0, 1e7), (2.0**-90, 1.0), (2.0**-58, 2.0**8)]
)
def test_no_bound_is_above_a_distance(ratio: float, away: float) -> None:
    draw = np.random.default_rng(7)
    a, b = _soup(draw, 1.0), _soup(draw, ratio)
    turn, _ = np.linalg.qr(draw.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    still = PoseArrays(np.eye(3)[None], np.zeros((1, 3)), False)
    poses = PoseArrays(turn[None], away * draw.normal(size=(1, 3)), True)
    place, other = place_pair(a.extent, still, 0, b.extent, poses, 0)
    frames, work = np.empty((2, FRAME_ROWS, LANES), np.float32), np.empty((GAP_ROWS, LANES), np.float32)
    fixed, defect = np.zeros((FIXED_ROWS, LANES), np.float32), defect_of(place) + defect_of(other)
    set_frame(frames[0], place, a, other, b, defect)
    set_frame(frames[1], other, b, place, a, defect)
    for node in _children(a, are_blocks=False):
        for their_node in _children(b, are_blocks=False):
            fixed[:BOX_ROWS, 0], fixed[BOX_ROWS:, 0] = b.boxes[their_node, :, 0], b.discs[their_node, :, 0]
            child_bounds(
                a.boxes, a.discs, node, fixed, frames, 0, FRAME_ROWS, b.scale / a.scale,
                inverse_ratio(b.scale, a.scale), work,
            )  # fmt: skip
            theirs = _placed(_below(b, their_node, 0), other)
            for lane in range(LANES):
                if a.child[node, lane] != EMPTY:
                    ours = _placed(_below(a, node, lane), place)
                    least = np.linalg.norm(ours[:, None] - theirs[None], axis=2).min()
                    assert a.scale * float(work[0, lane]) <= least
    assert fixed.shape[0] == BOX_ROWS + DISC_ROWS
    for node in _children(a, are_blocks=True):
        for their_node in _children(b, are_blocks=True):
            place_triangles(b.blocks, their_node, frames, work)
            for lane in range(LANES):
                if a.child[node, lane] == EMPTY:
                    continue
                ours = _placed(_below(a, node, lane), place)
                for k in range(LANES):
                    if b.child[their_node, k] != EMPTY:
                        gap = ours[:, None] - _placed(_below(b, their_node, k), other)[None]
                        most = np.linalg.norm(gap, axis=2).min() / a.scale * (1.0 + 2.0**-22)
                        assert near_triangle(a.blocks, node, lane, frames, most, work) >> k & 1
