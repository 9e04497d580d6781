"""Boxes that no pose turns, balls and half-spaces among each other: a few exact comparisons decide.

Boxes that are not flat and balls: compiled (`form_relations.py`), or in rationals: the nearest and the farthest point
of a box, or of another ball's centre, from the centre of a ball, against the sum and the difference of the radii. A
half-space and a ball: the signed distance of the centre against the radius, both sides squared. Two half-spaces overlap
unless their planes are parallel; then their thresholds along one normal decide.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Final

import numpy as np

from engine.arrays import FloatArray, read_only
from engine.collision.codes import OVERLAPPING, UNSETTLED
from engine.collision.exact_images import as_vector, image_half_space, image_point, value_at
from engine.collision.meshes.contact_kinds import STRENGTH
from engine.collision.result import (
    FIRST_WITHIN,
    NO_CONTACT,
    OVERLAP,
    SECOND_WITHIN,
    TOUCH,
    UNNAMED,
    Collision,
    PairFunction,
    Poses,
    Witness,
    Work,
)
from engine.collision.simple.against_ball import collide_body_sphere
from engine.collision.simple.form_relations import (
    FACE_AT,
    HIGH,
    KIND_AT,
    N_NUMBERS,
    RADIUS,
    THEIR_FACE_AT,
    relate_forms,
)
from engine.compiling.direct import entry_of
from engine.predicates.rational import largest_axis, squared_length
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Motion, motion_of
from engine.solids.sphere import Sphere
from engine.types import Relation

FORMS: Final = ("aabb", "sphere")


def form_of(solid: Solid) -> FloatArray | None:
    """Return a box that is not flat or a ball as kernels take it, None for others."""
    if solid.type not in FORMS:
        return None
    return solid.prepared("form", lambda: _form(solid))


def _form(solid: Solid) -> FloatArray | None:
    d, form = solid.dimension, np.zeros(N_NUMBERS)
    if isinstance(solid, Sphere):
        form[:d] = form[HIGH : HIGH + d] = solid.center
        form[RADIUS:] = solid.radius, 1.0
        return read_only(form)
    if isinstance(solid, Aabb) and bool((solid.min < solid.max).all()):
        form[:d], form[HIGH : HIGH + d] = solid.min, solid.max
        return read_only(form)
    return None


def by_forms_or(otherwise: PairFunction) -> PairFunction:
    """Return the function that asks `relate_forms` first, then another one for what that leaves open."""

    def collide_forms(first: Solid, second: Solid, poses: Poses, work: Work) -> Collision:
        d = first.dimension
        told = told_by_forms(first, second, motion_of(poses[0], d), motion_of(poses[1], d), work)
        return otherwise(first, second, poses, work) if told is None else told

    return collide_forms


def told_by_forms(first: Solid, second: Solid, motion: Motion, their_motion: Motion, work: Work) -> Collision | None:
    """Return what `relate_forms` tells of a box and a box or ball, or of two balls; None where that is not all."""
    form, other, d = form_of(first), form_of(second), first.dimension
    if form is None or other is None:
        return None
    code: int = entry_of(relate_forms)(form, *motion, other, *their_motion)
    if code == UNSETTLED:
        return None
    if not work.witness:
        return UNNAMED[code & _RELATION]
    if second.type == "aabb":
        return None if d == 2 and code >= OVERLAPPING else _named(code)
    is_turned = first.type == "aabb" and motion is not motion_of(None, d)  # its faces may count
    return None if is_turned and code >= OVERLAPPING else _BY_BALL[code]


_RELATION = (1 << KIND_AT) - 1
_BY_BALL = NO_CONTACT, FIRST_WITHIN, SECOND_WITHIN, OVERLAP, TOUCH


@lru_cache(4096)
def _named(code: int) -> Collision:
    """Return what the code of two boxes says."""
    relation, kind = code & _RELATION, code >> KIND_AT & _RELATION
    if relation < OVERLAPPING:
        return _BY_BALL[relation]
    faces = code >> FACE_AT & _RELATION, code >> THEIR_FACE_AT
    return Collision(Relation(relation), Witness(STRENGTH[kind], *faces))


def collide_form_sphere(first: Aabb | Sphere, ball: Sphere, poses: Poses, work: Work) -> Collision:
    """Return the relation of a box (2D or 3D) or a ball and a ball, exact, in rationals; a posed box is any body.

    Flat boxes and balls of radius 0 have no interior and never overlap.
    """
    center, r, s = image_point(ball.center, poses[1]), Fraction(ball.radius), Fraction(0)
    if isinstance(first, Sphere):
        low = high = image_point(first.center, poses[0])
        s = Fraction(first.radius)
    elif poses[0] is not None:
        return collide_body_sphere(first, ball, poses, work)
    else:
        low, high = as_vector(first.min), as_vector(first.max)
    near = squared_length([max(a - c, c - b, Fraction(0)) for c, a, b in zip(center, low, high)])
    if near > (r + s) ** 2:
        return NO_CONTACT
    if r > s and squared_length([max(c - a, b - c) for c, a, b in zip(center, low, high)]) < (r - s) ** 2:
        return FIRST_WITHIN
    if (s > r and near < (s - r) ** 2) or all(c - a > r and b - c > r for c, a, b in zip(center, low, high)):
        return SECOND_WITHIN
    enters = near < (r + s) ** 2
    if enters and r > 0 and (s > 0 or all(a < b for a, b in zip(low, high))):
        return OVERLAP
    return Collision(Relation.TOUCHING, Witness("surface", piercing=True)) if enters else TOUCH


def collide_half_spaces(first: HalfSpace, second: HalfSpace, poses: Poses, work: Work) -> Collision:
    """Return the relation of two half-spaces (half-planes in 2D), exact.

    Equal ones overlap; opposite ones that share only their plane touch. Neither holds the other unless its plane lies
    strictly inside.
    """
    (n, d), (m, e) = image_half_space(first, poses[0]), image_half_space(second, poses[1])
    axis = largest_axis(n)
    factor = m[axis] / n[axis]  # m = factor n if parallel
    if any(m[k] != factor * n[k] for k in range(len(n))):
        return OVERLAP
    low, bound = -d, -e / factor if factor != 0 else -d  # first: n . x >= low; factor = 0 only if not parallel
    if factor > 0:
        return FIRST_WITHIN if low > bound else (SECOND_WITHIN if low < bound else OVERLAP)
    return NO_CONTACT if low > bound else (TOUCH if low == bound else OVERLAP)


def collide_half_space_sphere(space: HalfSpace, ball: Sphere, poses: Poses, work: Work) -> Collision:
    """Return the relation of a half-space (first) and a ball (second), exact; a half-space is never inside."""
    plane = image_half_space(space, poses[0])
    value = value_at(plane, image_point(ball.center, poses[1]))
    reach = Fraction(ball.radius) ** 2 * squared_length(plane[0])
    if value**2 > reach:
        return NO_CONTACT if value < 0 else SECOND_WITHIN
    # case: the ball touches the plane from outside, or is a point on it
    return TOUCH if value**2 == reach and value <= 0 else OVERLAP
