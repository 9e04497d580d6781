"""Many places of a ball beside one mesh: their relations by one call of the kernel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine.collision.answers import Answers
from engine.collision.codes import DISJOINT, OVERLAPPING, UNSETTLED
from engine.collision.meshes.face_state import states_of
from engine.collision.meshes.mesh_arrays import STATE_STACKED, mesh_body_of
from engine.collision.meshes.placement import PoseArrays
from engine.collision.result import RELATIONS, SWAPPED_RELATION
from engine.collision.simple.against_ball import centers_in_frame, named
from engine.collision.simple.ball_on_mesh import relate_balls
from engine.direct import entry_of
from engine.solids.base import Solid
from engine.solids.sphere import Sphere

_SWAPPED = np.array([*(SWAPPED_RELATION.get(relation, relation) for relation in RELATIONS), UNSETTLED], np.int8)
"""What a relation, or UNSETTLED as the last, is for the two bodies in the other order."""


def ball_batch(first: Solid, second: Solid, poses: PoseArrays, answers: Answers) -> Callable[[int, int], None]:
    """Return the function that answers a range of poses of the second, UNSETTLED where floats do not prove it.

    One of the two is a ball, the other a polyhedron or a surface.
    """
    is_swapped = isinstance(first, Sphere)
    body, ball = (second, first) if is_swapped else (first, second)
    assert isinstance(ball, Sphere)
    mesh = mesh_body_of(body)

    def fill(start: int, stop: int) -> None:
        moves = poses.rotations[start:stop], poses.translations[start:stop]
        centers = centers_in_frame(ball, *((moves, None) if is_swapped else (None, moves)))
        found = np.empty((stop - start, 2), np.int64)
        is_named = answers.witnesses is not None
        entry_of(relate_balls)(mesh.arrays, centers, float(ball.radius), is_named, found, answers.budget.flag)
        answers.budget.check()
        relations, triangles = found.T
        overlapping = np.flatnonzero(relations == OVERLAPPING)
        # That a face enters says nothing of the detail, and nothing at all where even-odd cancels it.
        is_open = answers.details is not None or states_of(mesh.arrays, triangles[overlapping]) == STATE_STACKED
        relations[overlapping] = np.where(is_open, UNSETTLED, OVERLAPPING)
        answers.relations[start:stop] = _SWAPPED[relations] if is_swapped else relations
        if is_named:
            assert answers.witnesses is not None
            for row in np.flatnonzero(relations > DISJOINT).tolist():
                answer = named(mesh, *found[row].tolist())
                answers.witnesses[start + row] = (answer.swapped() if is_swapped else answer).witness

    return fill
