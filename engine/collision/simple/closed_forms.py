"""Boxes without poses, balls and half-spaces among each other: a few exact comparisons decide.

Boxes: their bounds, axis by axis. A box and a ball: the nearest and the farthest point of the box from the centre. Two
balls: the squared distance of their centres against the squares of the sum and the difference of their radii. A
half-space and a ball: the signed distance of the centre against the radius, both sides squared. Two half-spaces overlap
unless their planes are parallel; then their thresholds along one normal decide.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING
from engine.collision.exact_images import as_vector, image_half_space, image_point, value_at
from engine.collision.result import (
    FIRST_WITHIN,
    NO_CONTACT,
    OVERLAP,
    SECOND_WITHIN,
    TOUCH,
    Collision,
    Kind,
    Poses,
    Witness,
    Work,
)
from engine.collision.simple.against_boundary import collide_body_sphere
from engine.jit import inline, kernel
from engine.predicates.exact_vectors import largest_axis, minus, squared_length
from engine.predicates.rational import scaled_integers
from engine.solids.aabb import Aabb
from engine.solids.half_space import HalfSpace
from engine.solids.sphere import Sphere
from engine.types import Relation


def relate_boxes(low: Any, high: Any, their_low: Any, their_high: Any) -> int:
    """Return the relation of two closed boxes of any dimension, flat ones too."""
    meet = solid = i_within = j_within = interiors = True
    for axis in range(len(low)):
        a0, a1, b0, b1 = low[axis], high[axis], their_low[axis], their_high[axis]
        meet &= a0 <= b1 and b0 <= a1
        i_within &= b0 < a0 and a1 < b1
        j_within &= a0 < b0 and b1 < a1
        solid &= a0 < a1 and b0 < b1
        interiors &= a0 < b1 and b0 < a1
    if not meet:
        return DISJOINT
    if i_within or j_within:
        return FIRST_INSIDE_SECOND if i_within else SECOND_INSIDE_FIRST
    return OVERLAPPING if solid and interiors else TOUCHING


_relate = inline(relate_boxes)


@kernel
def relate_box_pairs(low: Any, high: Any, is_box: Any, pairs: Any, relations: Any) -> None:
    """Fill relations (n,) int8 for the pairs (n, 2) of which both are boxes without pose."""
    for item in range(pairs.shape[0]):
        i, j = pairs[item, 0], pairs[item, 1]
        if is_box[i] and is_box[j]:
            relations[item] = _relate(low[i], high[i], low[j], high[j])


def touching_boxes(*bounds: list[float]) -> Witness | None:
    """Return the witness of two touching boxes of space, each low and high; None where one is flat.

    They share a part of a face, an edge or a vertex, by on how many axes they only touch; of the faces that meet there
    the first is on the first of these axes.
    """
    n, first_face, second_face = -1, 0, 0
    for axis, (a0, a1, b0, b1) in enumerate(zip(*bounds)):
        if a0 == a1 or b0 == b1:
            return None
        if a1 == b0 or b1 == a0:
            n += 1
            if n == 0:
                first_face, second_face = 2 * axis + (a1 == b0), 2 * axis + (a1 != b0)
    return Witness(_SHARED[n], first_face, second_face)


_SHARED: tuple[Kind, ...] = ("face_face", "edge_edge", "vertex_vertex")


def collide_aabb_sphere(box: Aabb, ball: Sphere, poses: Poses, work: Work) -> Collision:
    """Return the relation of a box (first) and a ball (second), exact, in 2D or 3D; a posed box is any body.

    Flat boxes and balls of radius 0 have no interior and never overlap.
    """
    if poses[0] is not None:
        return collide_body_sphere(box, ball, poses, work)
    d, numbers = box.dimension, list[Any]()
    if poses[1] is None:
        numbers = scaled_integers([*box.min.tolist(), *box.max.tolist(), *ball.center.tolist(), ball.radius])
    else:
        there, r = image_point(ball.center, poses[1]), Fraction(ball.radius)
        numbers = [*as_vector(box.min), *as_vector(box.max), *there, r]
    low, high, center, radius = numbers[:d], numbers[d : 2 * d], numbers[2 * d : -1], numbers[-1]
    near = squared_length([max(a - c, c - b, 0) for c, a, b in zip(center, low, high)])
    if near > radius * radius:
        return NO_CONTACT
    if squared_length([max(c - a, b - c) for c, a, b in zip(center, low, high)]) < radius * radius:
        return FIRST_WITHIN
    if all(c - a > radius and b - c > radius for c, a, b in zip(center, low, high)):
        return SECOND_WITHIN
    enters = near < radius * radius
    if enters and all(a < b for a, b in zip(low, high)):
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


def collide_spheres(a: Sphere, b: Sphere, poses: Poses, work: Work) -> Collision:
    """Return the relation of two balls (discs in 2D), exact. A ball of radius 0 is a point: it never overlaps."""
    d, numbers = a.dimension, list[Any]()
    if poses[0] is None and poses[1] is None:
        numbers = scaled_integers([*a.center.tolist(), *b.center.tolist(), a.radius, b.radius])
    else:
        numbers = [*image_point(a.center, poses[0]), *image_point(b.center, poses[1])]
        numbers += map(Fraction, (a.radius, b.radius))
    r, s = numbers[-2:]
    between, sum_of_both = squared_length(minus(numbers[:d], numbers[d : 2 * d])), (r + s) * (r + s)
    if between > sum_of_both:
        return NO_CONTACT
    if between < (s - r) * (s - r):
        return FIRST_WITHIN if r < s else SECOND_WITHIN
    return OVERLAP if r > 0 and s > 0 and between < sum_of_both else TOUCH
