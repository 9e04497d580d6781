"""Convex bodies as flat arrays for `convex_pairs.py`: boxes, convex regions and convex polyhedra.

Source: I. E. Sutherland, G. W. Hodgman, 1974; S. Gottschalk, 1996: see `convex_pairs.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import chain
from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.collide import posed
from engine.compiling.jit import entry_of
from engine.errors import UnsupportedSolidError
from engine.predicates.rational import nearest_pair
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.solid_cutting.convex_pairs import CORNER, PLACED, PLANE, overlap_bodies
from engine.solid_cutting.exact_sums import faces_of_half_spaces
from engine.solids.base import Solid
from engine.solids.convexity import convexity
from engine.solids.mesh import Polyhedron
from engine.solids.primitives import Aabb, Convex
from engine.types import FloatArray, IntArray, read_only

_QUADS: Final = np.array([(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)])
"""Faces of a box, corner k of which is at the high end of axis a if bit a of k is set."""
_BITS: Final = (np.arange(8)[:, None] >> np.arange(3)) & 1
_LARGEST: Final = 1 << 16
"""Faces times corners of a pair up to which tables are made of it."""


class Body(NamedTuple):
    """A convex body: corners (n, 6), high parts and low parts; faces, one after another, and where each ends."""

    points: FloatArray
    corners: IntArray
    ends: IntArray


def of_bodies(
    pairs: Sequence[tuple[Any, Any]], poses: tuple[Any, Any], is_ratio: bool, workers: int | None, budget: Budget
) -> FloatArray:
    """Return the common volumes, or ratios, of those pairs of solids that are convex bodies of space, proven to be the
    nearest doubles, NaN of others."""
    values = np.full(len(pairs), np.nan)
    if len(pairs) == 1 and poses[0] is None and poses[1] is None and all(isinstance(solid, Aabb) for solid in pairs[0]):
        return values  # in closed form sooner
    unique = {id(solid): solid for pair in pairs for solid in pair}
    boxes = [solid for solid in unique.values() if isinstance(solid, Aabb) and solid.dimension == 3]
    numbers = {id(box): number for number, box in enumerate(boxes)}
    bodies: list[Body] = []
    for key, solid in unique.items():
        if isinstance(solid, (Convex, Polyhedron)) and solid.dimension == 3:
            budget.check()
            body = solid.prepared("overlap_body", partial(_body_of, solid, budget), budget.check)
            if body is not None:
                numbers[key] = len(boxes) + len(bodies)
                bodies.append(body)
    ends = [np.array([getattr(box, name) for box in boxes]).reshape(-1, 1, 3) for name in ("min", "max")]
    has_volume = np.append((ends[0] < ends[1]).all(axis=(1, 2)), np.ones(len(bodies), np.bool_))
    which = np.array([(numbers.get(id(one), -1), numbers.get(id(other), -1)) for one, other in pairs], np.int64)
    rows: IntArray = np.flatnonzero((which >= 0).all(axis=1) & has_volume[which].all(axis=1)) if numbers else which[:0]
    if not len(rows):
        return values
    n = len(boxes)
    points = [np.concatenate([np.where(_BITS, ends[1], ends[0]), np.zeros((n, 8, 3))], axis=2).reshape(-1, 6)]
    points += [body.points for body in bodies]
    lengths = np.append(np.full(n, _QUADS.size), [len(body.corners) for body in bodies]).astype(np.int64)
    first_corners = np.cumsum(lengths) - lengths
    faces = [np.arange(4, 24 * n + 1, 4), *(body.ends + at for body, at in zip(bodies, first_corners[n:].tolist()))]
    sizes = np.array([(8, 6)] * n + [(len(body.points), len(body.ends)) for body in bodies])
    most, most_faces = sizes.max(axis=0).tolist()
    if most * most_faces > _LARGEST:
        return values
    moves = np.stack([_numbers_of(pose, pairs[int(rows[0])][k], k) for k, pose in enumerate(poses)])
    tables = (
        read_only(np.concatenate(points)),
        read_only(np.concatenate([np.tile(_QUADS.ravel(), n), *(body.corners for body in bodies)])),
        read_only(np.concatenate([np.zeros(1, np.int64), *faces])),
        read_only(np.concatenate([np.cumsum(sizes, axis=0) - sizes, sizes], axis=1)),
    )
    some = read_only(which[rows])
    made = np.full(len(rows), np.nan)

    def fill(start: int, stop: int) -> None:
        scratch = [np.empty((2, most, PLACED)), np.empty((2, most_faces, PLANE))]
        scratch += [np.empty((2, most_faces, most)), np.empty((2, most + most_faces + 8, CORNER))]
        out = made[start:stop]
        entry_of(overlap_bodies)(*tables, some[start:stop], moves, is_ratio, *scratch, out, budget.flag)

    run_chunks(fill, len(rows), budget=budget, workers=workers, first_chunk=64)
    values[rows] = made
    return values


def _numbers_of(pose: Any, solid: Solid, k: int) -> FloatArray:
    """Return the numbers of a pose, and 1.0, or zeros for none."""
    move = posed(pose, solid, ("first_pose", "second_pose")[k])
    if move is None:
        return np.zeros(13)
    return np.concatenate([move.rotation.ravel(), move.translation, [1.0]])


def _body_of(solid: Convex | Polyhedron, budget: Budget) -> Body | None:
    """Return a solid as a convex body; None if it is not convex, not bounded, or flat."""
    if isinstance(solid, Polyhedron):
        certificate = convexity(solid)
        if certificate is None:
            return None
        used, faces = np.unique(solid.triangles, return_inverse=True)
        faces = faces.reshape(-1, 3) if certificate.is_outward else faces.reshape(-1, 3)[:, ::-1]
        points = np.concatenate([solid.vertices[used], np.zeros((len(used), 3))], axis=1)
        return Body(points, faces.ravel(), np.arange(3, 3 * len(faces) + 1, 3))
    try:
        made = faces_of_half_spaces(solid.planes.tolist(), budget)
    except UnsupportedSolidError:  # it is not bounded
        return None
    if made is None:
        return None
    mesh, fans = made
    rounded = np.array([[nearest_pair(x, mesh.w) for x in point] for point in mesh.points])
    rings = [[fan[0][0], fan[0][1], *(triangle[2] for triangle in fan)] for fan in fans]
    points = np.concatenate([rounded[:, :, 0], rounded[:, :, 1]], axis=1)
    return Body(points, np.array(list(chain(*rings))), np.cumsum([len(ring) for ring in rings]))
