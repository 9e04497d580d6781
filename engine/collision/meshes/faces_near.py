"""The faces of a body near a box of its tree, one after another."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.jit import inline
from engine.lanes.boxes import inside_box
from engine.lanes.lanes import lowest_bit
from engine.types import Point3

SLACK = 2.0**-20
"""By how much a box in the tree's coordinates is widened for its rounding to float32."""
ABOVE_ALL = 1e6
"""In the coordinates of a tree, which are at most 2."""


@inline
def box_between(a: Point3, b: Point3, slack: float) -> tuple[Any, Any]:
    """Return the ends of the box from a to b, widened, as far as it matters, as triples of float32."""
    x, y, z = max(a.x - slack, -ABOVE_ALL), max(a.y - slack, -ABOVE_ALL), max(a.z - slack, -ABOVE_ALL)
    p, q, r = min(b.x + slack, ABOVE_ALL), min(b.y + slack, ABOVE_ALL), min(b.z + slack, ABOVE_ALL)
    return (np.float32(x), np.float32(y), np.float32(z)), (np.float32(p), np.float32(q), np.float32(r))


@inline
def next_face(mesh: MeshArrays, stack: Any, n: int, box: tuple[Any, Any]) -> tuple[int, int]:
    """Return a face whose box meets a box, -1 if there is none left, and how much waits on the stack (STACK,) int32,
    which begins with the root, 0: nodes, and faces as in `MeshArrays.child`."""
    while n > 0:  # bound: each node and face enters once
        n -= 1
        child = int(stack[n])
        if child < 0:
            return -1 - child, n
        lanes = inside_box(mesh.boxes, child, box[0], box[1])
        while lanes != 0:
            stack[n] = mesh.child[child, lowest_bit(lanes)]
            lanes &= lanes - 1
            n += 1
    return -1, 0
