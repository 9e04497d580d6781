"""The eight relations of RCC-8, from the five: one table from the types of an overlapping pair to what sticks out.

Disjoint is DC, touching EC, inside NTPP. Only overlapping splits further: neither body sticks out of the other, EQ; one
does, TPP or NTPP by whether the boundaries meet; both do, PO.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

import numpy as np

from engine.arrays import FloatArray, Int8Array, IntArray
from engine.collision.codes import UNSETTLED
from engine.collision.exact_images import image_half_space, image_point, value_at
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_mesh import mesh_parts
from engine.collision.planar.outline import live_edges, outline_of
from engine.collision.planar.outline_batch import outline_parts
from engine.collision.result import BODIES, FACES, Parts, Poses, Work, meets_as
from engine.collision.simple.against_ball import body_sphere_parts
from engine.collision.simple.against_half_space import half_space_body_parts
from engine.collision.simple.boundary import live_parts
from engine.errors import InvalidInputError, UnsupportedSolidError
from engine.predicates.rational import largest_axis, minus, squared_length
from engine.running.budget import Budget
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.checks import spell
from engine.solids.half_space import HalfSpace
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface
from engine.types import Rcc8, Relation

PartsFunction = Callable[[Any, Any, Poses, Work], Parts]

NO_DETAIL = -1
"""In place of a code of `Rcc8`: a body without interior."""

UNLESS_OVERLAPPING = {
    Relation.DISJOINT: Rcc8.DC,
    Relation.TOUCHING: Rcc8.EC,
    Relation.FIRST_INSIDE_SECOND: Rcc8.NTPP,
    Relation.SECOND_INSIDE_FIRST: Rcc8.NTPPI,
}
_WHERE_PROVEN = np.array([UNLESS_OVERLAPPING.get(relation, Rcc8.PO) for relation in Relation], np.int8)


def check_has_detail(named: Iterable[tuple[tuple[str | int, ...], Solid]], boolean: bool) -> None:
    """Raise where a body, given with where it stands in the call, can have no interior by its type."""
    if boolean:
        raise InvalidInputError("detail needs the relation, which boolean leaves open; ask for one", ("detail",))
    for where, solid in named:
        if isinstance(solid, Surface):
            raise UnsupportedSolidError(
                f"{spell(where)} is a surface, which has no interior: detail is told of solids; make it a polyhedron, "
                "or ask without detail",
                where,
            )


def details_where_proven(relations: Int8Array) -> Int8Array:
    """Return the codes for pairs that a batch decided, by crossings or points outside the other: overlapping is PO."""
    return np.where(relations == UNSETTLED, np.int8(NO_DETAIL), _WHERE_PROVEN[relations])


def details_of_boxes(low: FloatArray, high: FloatArray, pairs: IntArray, relations: Int8Array) -> Int8Array:
    """Return the codes for pairs (n, 2) of boxes (n_boxes, d) that are not flat."""
    i, j = pairs.T
    i_sticks_out = ((low[i] < low[j]) | (high[j] < high[i])).any(axis=1)
    j_sticks_out = ((low[j] < low[i]) | (high[i] < high[j])).any(axis=1)
    shared = np.where(j_sticks_out, Rcc8.TPP, Rcc8.EQ)
    split = np.where(i_sticks_out, np.where(j_sticks_out, Rcc8.PO, Rcc8.TPPI), shared)
    return np.where(relations == Relation.OVERLAPPING, split, _WHERE_PROVEN[relations]).astype(np.int8)


def detail_of(first: Solid, second: Solid, poses: Poses, relation: Relation, work: Work) -> Rcc8 | None:
    """Return the relation of RCC-8 of a checked pair whose relation is known; None where a body has no interior."""
    if relation != Relation.OVERLAPPING:
        if not (has_interior(first, work.budget) and has_interior(second, work.budget)):
            return None
        return UNLESS_OVERLAPPING[relation]
    if poses[0] is not None and poses[0] == poses[1]:
        poses = None, None
    one, other = meets_as(first), meets_as(second)
    function = PARTS.get((first.dimension, one, other))
    if function is not None:
        parts = function(first, second, poses, work)
    else:
        function = PARTS[first.dimension, other, one]
        parts = function(second, first, poses[::-1], work).swapped()
    if parts.first:
        return Rcc8.PO if parts.second else (Rcc8.TPPI if parts.meet else Rcc8.NTPPI)
    return (Rcc8.TPP if parts.meet else Rcc8.NTPP) if parts.second else Rcc8.EQ


def has_interior(solid: Solid, budget: Budget) -> bool:
    """Tell whether some open set lies within a solid; asked once of each."""
    return solid.prepared("has_interior", lambda: _has_interior(solid, budget), budget.check)


def _has_interior(solid: Solid, budget: Budget) -> bool:
    if isinstance(solid, HalfSpace):
        return True
    if isinstance(solid, Sphere):
        return solid.radius > 0.0
    if isinstance(solid, Aabb):
        return bool((solid.min < solid.max).all())
    if solid.dimension == 2:
        return bool(live_edges(outline_of(solid, None, budget), budget))
    mesh = mesh_body_of(solid)
    return mesh.has_inside and any(any(live_parts(mesh, face, budget)) for face in range(len(mesh.faces)))


def _sphere_sphere(first: Sphere, second: Sphere, poses: Poses, work: Work) -> Parts:
    between = squared_length(minus(image_point(first.center, poses[0]), image_point(second.center, poses[1])))
    r, s = Fraction(first.radius), Fraction(second.radius)
    return Parts(r > s or between > (s - r) ** 2, s > r or between > (s - r) ** 2, True)


def _half_spaces(first: HalfSpace, second: HalfSpace, poses: Poses, work: Work) -> Parts:
    """Overlapping half-spaces are equal, or their planes cross, or each holds the plane of the other."""
    (n, d), (m, e) = image_half_space(first, poses[0]), image_half_space(second, poses[1])
    axis = largest_axis(n)
    factor = m[axis] / n[axis]
    is_equal = factor > 0 and all(q == factor * p for p, q in zip((*n, d), (*m, e)))
    return Parts(not is_equal, not is_equal, True)


def _half_space_sphere(space: HalfSpace, ball: Sphere, poses: Poses, work: Work) -> Parts:
    """A ball that overlaps a half-space reaches its plane."""
    plane = image_half_space(space, poses[0])
    height, reach = value_at(plane, image_point(ball.center, poses[1])), squared_length(plane[0])
    return Parts(True, height < 0 or height**2 < Fraction(ball.radius) ** 2 * reach, True)


PARTS: dict[tuple[int, str, str], PartsFunction] = {
    **{(3, first, second): mesh_parts for first in FACES[3] for second in FACES[3]},
    **{(2, first, second): outline_parts for first in FACES[2] for second in FACES[2]},
    **{(d, "half_space", body): half_space_body_parts for d, body in BODIES},
    **{(d, body, "sphere"): body_sphere_parts for d, body in BODIES},
}
for _dimension in (2, 3):
    PARTS[_dimension, "half_space", "half_space"] = _half_spaces
    PARTS[_dimension, "half_space", "sphere"] = _half_space_sphere
    PARTS[_dimension, "sphere", "sphere"] = _sphere_sphere
