"""Closed forms: axis-aligned boxes, balls and half-spaces by a few exact comparisons; a half-space and a body by signs.

Boxes that are not flat and balls: compiled (`form_relations.py`), or in rationals: the nearest and the farthest point
of a box, or of another ball's centre, from the centre of a ball, against the sum and the difference of the radii. A
half-space and a ball: the signed distance of the centre against the radius, both sides squared. Two half-spaces overlap
unless their planes are parallel; then their thresholds along one normal decide.

A linear function attains its extremes over a body with faces or edges at vertices. The faces with vertices beyond a
half-space are the part of the body outside it; the half-space always has a part outside the body.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Final

import numpy as np

from engine.collision import result
from engine.collision.codes import OVERLAPPING, UNSETTLED
from engine.collision.exact_images import HalfSpaceImage, as_vector, image_half_space, image_point, value_at
from engine.collision.meshes.contact_kinds import STRENGTH
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays, mesh_body_of
from engine.collision.meshes.parity import state_at
from engine.collision.simple import form_relations as relations
from engine.collision.simple.against_ball import collide_body_sphere
from engine.collision.simple.boundary import Boundary, boundary_of, first_triangle_at, pulled_back
from engine.collision.simple.form_relations import RELATION_MASK
from engine.compiling.jit import entry_of, inline, kernel
from engine.predicates.rational import largest_axis, minus, sign_of, squared_length
from engine.predicates.vectors import as_point3, dot
from engine.solids.base import Solid
from engine.solids.pose import Motion, motion_of
from engine.solids.primitives import Aabb, HalfSpace, Sphere
from engine.solids.registry import own_box
from engine.types import FlagArray, FloatArray, IntArray, Point3, Relation, read_only

FORMS: Final = ("aabb", "sphere")


def form_of(solid: Solid) -> FloatArray | None:
    """Return the (N_NUMBERS,) numbers of a ball, or of a box that is not flat (`form_relations.py`); None for other
    solids. Cached."""
    if solid.type not in FORMS:
        return None

    def build() -> FloatArray | None:
        d, form = solid.dimension, np.zeros(relations.N_NUMBERS)
        if isinstance(solid, Sphere):
            return form_of_point(solid.center, float(solid.radius))
        if isinstance(solid, Aabb) and bool((solid.min < solid.max).all()):
            form[:d], form[relations.HIGH : relations.HIGH + d] = solid.min, solid.max
            return read_only(form)
        return None

    return solid.prepared("form", build)


def form_of_point(point: FloatArray, radius: float = 0.0) -> FloatArray:
    """Return the numbers of a ball about a point."""
    d, form = len(point), np.zeros(relations.N_NUMBERS)
    form[:d] = form[relations.HIGH : relations.HIGH + d] = point
    form[relations.RADIUS :] = radius, 1.0
    return read_only(form)


def closed_form_or(otherwise: result.PairFunction) -> result.PairFunction:
    """Return a pair function that tries the compiled `relate_forms`, and calls `otherwise` where that is undecided."""

    def collide_forms(first: Solid, second: Solid, poses: result.Poses, work: result.Work) -> result.Collision:
        d = first.dimension
        answer = relation_closed_form(first, second, motion_of(poses[0], d), motion_of(poses[1], d), work)
        return otherwise(first, second, poses, work) if answer is None else answer

    return collide_forms


def relation_closed_form(
    first: Solid, second: Solid, motion: Motion, their_motion: Motion, work: result.Work
) -> result.Collision | None:
    """Return the relation of two solids by `relate_forms`; None if one is neither box nor ball, or the relation or its
    requested witness is undecided. motion, their_motion: rotation and translation of each."""
    form, other, d = form_of(first), form_of(second), first.dimension
    if form is None or other is None:
        return None
    code: int = entry_of(relations.relate_forms)(form, *motion, other, *their_motion)
    if code == UNSETTLED:
        return None
    if not work.witness:
        return result.UNNAMED[code & RELATION_MASK]
    if second.type == "aabb":
        return None if d == 2 and code >= OVERLAPPING else _named(code)
    is_turned = first.type == "aabb" and motion is not motion_of(None, d)  # its faces may count
    return None if is_turned and code >= OVERLAPPING else _BY_BALL[code]


_BY_BALL = result.NO_CONTACT, result.FIRST_WITHIN, result.SECOND_WITHIN, result.OVERLAP, result.TOUCH


@lru_cache(4096)
def witness_of_forms(code: int) -> result.Witness | None:
    """Return the witness encoded in a code of `relate_form_pairs`; None if UNSETTLED or disjoint."""
    return None if code == UNSETTLED else _named(code).witness


@lru_cache(4096)
def _named(code: int) -> result.Collision:
    """Return the answer, with its witness, encoded in the code that `relate_forms` returns for two boxes, or
    `relate_form_pairs`."""
    relation, kind = code & RELATION_MASK, code >> relations.KIND_AT & RELATION_MASK
    if relation < OVERLAPPING or code & relations.OF_BALL:
        return _BY_BALL[relation]
    faces = code >> relations.FACE_AT & RELATION_MASK, code >> relations.THEIR_FACE_AT & RELATION_MASK
    return result.Collision(Relation(relation), result.Witness(STRENGTH[kind], *faces))


def collide_form_sphere(first: Aabb | Sphere, ball: Sphere, poses: result.Poses, work: result.Work) -> result.Collision:
    """Return the exact relation of a box or ball (first) and a ball, in rationals. A posed box is treated as any body.
    Flat boxes and balls of radius 0 have no interior and never overlap."""
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
        return result.NO_CONTACT
    if r > s and squared_length([max(c - a, b - c) for c, a, b in zip(center, low, high)]) < (r - s) ** 2:
        return result.FIRST_WITHIN
    if (s > r and near < (s - r) ** 2) or all(c - a > r and b - c > r for c, a, b in zip(center, low, high)):
        return result.SECOND_WITHIN
    enters = near < (r + s) ** 2
    if enters and r > 0 and (s > 0 or all(a < b for a, b in zip(low, high))):
        return result.OVERLAP
    return result.Collision(Relation.TOUCHING, result.Witness("surface", piercing=True)) if enters else result.TOUCH


def collide_half_spaces(
    first: HalfSpace, second: HalfSpace, poses: result.Poses, work: result.Work
) -> result.Collision:
    """Return the exact relation of two half-spaces (half-planes in 2D). Equal ones overlap; opposite ones with a common
    plane touch. One is inside if its plane lies strictly inside."""
    (n, d), (m, e) = image_half_space(first, poses[0]), image_half_space(second, poses[1])
    axis = largest_axis(n)
    factor = m[axis] / n[axis]  # m = factor n if parallel
    if any(m[k] != factor * n[k] for k in range(len(n))):
        return result.OVERLAP
    low, bound = -d, -e / factor if factor != 0 else -d  # first: n . x >= low; factor = 0 only if not parallel
    if factor > 0:
        return result.FIRST_WITHIN if low > bound else (result.SECOND_WITHIN if low < bound else result.OVERLAP)
    return result.NO_CONTACT if low > bound else (result.TOUCH if low == bound else result.OVERLAP)


def collide_half_space_sphere(
    space: HalfSpace, ball: Sphere, poses: result.Poses, work: result.Work
) -> result.Collision:
    """Return the exact relation of a half-space (first) and a ball (second); a half-space is never inside."""
    plane = image_half_space(space, poses[0])
    value = value_at(plane, image_point(ball.center, poses[1]))
    reach = Fraction(ball.radius) ** 2 * squared_length(plane[0])
    if value**2 > reach:
        return result.NO_CONTACT if value < 0 else result.SECOND_WITHIN
    # case: the ball touches the plane from outside, or is a point on it
    return result.TOUCH if value**2 == reach and value <= 0 else result.OVERLAP


_Function = tuple[FloatArray, FloatArray, float, float]
"""A linear function of points: weights of the coordinates, sizes that bound their errors, offset, and its size."""
_FEW_UNSURE = 16
"""Most vertices whose side of a plane is decided exactly one by one; for more, in one call."""
_BLOCK = 64
_MANY = 64 * _BLOCK


def collide_half_space_body(space: HalfSpace, body: Solid, poses: result.Poses, work: result.Work) -> result.Collision:
    """Return the exact relation of a half-space (first) and a body with faces or edges (second)."""
    function = _function_in_frame(space, poses)
    if (side := _side_of_box(function, body)) != 0:
        return result.SECOND_WITHIN if side > 0 else result.NO_CONTACT
    if body.dimension == 3:
        answer = _by_scan(function, space, body, poses, work)
        if answer is not None:
            return answer
    plane, boundary = image_half_space(space, poses[0]), boundary_of(body, poses[1], work)
    signs = boundary.signs(plane)
    if (signs < 0).all():
        return result.NO_CONTACT
    if (signs > 0).all():
        return result.SECOND_WITHIN
    enters = bool((signs > 0).any())
    face = boundary.number_at(int(np.argmax(signs > 0 if enters else signs == 0)))
    if enters and boundary.has_inside and _reaches(boundary, boundary.faces_at(signs > 0), plane, 1):
        return result.Collision(Relation.OVERLAPPING, result.Witness("surface", second_face=face))
    return result.Collision(Relation.TOUCHING, result.Witness("surface", second_face=face, piercing=enters))


def _by_scan(
    function: _Function, space: HalfSpace, body: Solid, poses: result.Poses, work: result.Work
) -> result.Collision | None:
    """Return the relation of a half-space and a mesh by the sides of its vertices, in floats for nearly all, exact for
    a few; None if more are open, or if the triangle with the first vertex inside the half-space is STATE_STACKED.
    function: of the half-space, in the mesh's frame. The witness is a face at the first vertex inside, or on the plane.
    No part of that face cancels under even-odd, so the body's open interior is next to it: a vertex inside proves
    overlapping."""
    mesh, unsure = mesh_body_of(body), np.empty(_FEW_UNSURE, np.int64)
    normal, sizes, offset, size = function
    plane = np.array([normal, sizes, [offset, size, 0.0]])
    beyond, before, n_unsure = entry_of(scan_sides)(mesh.arrays, plane, unsure, work.budget.flag)
    work.budget.check()
    if n_unsure > len(unsure):
        return None
    work.n_beyond_filter += n_unsure
    work.n_rational += n_unsure
    signs: dict[int, int] = {}
    if n_unsure:
        exact, _, _ = pulled_back(image_half_space(space, poses[0]), poses[1])
        points = mesh.arrays.vertices[unsure[:n_unsure]].tolist()
        signs = {v: sign_of(value_at(exact, as_vector(p))) for v, p in zip(unsure.tolist(), points)}
    first = {sign: min((vertex for vertex in signs if signs[vertex] == sign), default=-1) for sign in (1, 0, -1)}
    first[1], before = min((v for v in (beyond, first[1]) if v >= 0), default=-1), max(before, first[-1])
    if first[1] < 0 and first[0] < 0:
        return result.NO_CONTACT
    if before < 0 and first[0] < 0:
        return result.SECOND_WITHIN
    enters = first[1] >= 0
    triangle = entry_of(first_triangle_at)(mesh.arrays, first[1] if enters else first[0])
    overlaps = enters and mesh.has_inside
    if overlaps and state_at(mesh.arrays, triangle) == STATE_STACKED:
        return None
    relation = Relation.OVERLAPPING if overlaps else Relation.TOUCHING
    return result.Collision(
        relation, result.Witness("surface", second_face=int(mesh.faces[triangle]), piercing=enters != overlaps)
    )


@inline
def _side(mesh: MeshArrays, vertex: int, plane: FloatArray) -> int:
    """Return 1 or -1 if a vertex is proven to be on the positive or the negative side of a plane, else 0. plane: (3,
    3), see `scan_sides`. Each weight may be off by 2^-50 of its size, which is no less than the weight, and 2^-1070;
    the sum of three products and a number by 2^-50 of the sum of magnitudes more."""
    p = as_point3(mesh.vertices, vertex)
    around = Point3(abs(p.x), abs(p.y), abs(p.z))
    value = dot(as_point3(plane, 0), p) + plane[2, 0]
    size = dot(as_point3(plane, 1), around) + plane[2, 1]
    slack = 2.0**-48 * size + 2.0**-1060 * (around.x + around.y + around.z) + 2.0**-1000
    return int(value > slack) - int(value < -slack)


@kernel
def scan_sides(mesh: MeshArrays, plane: FloatArray, unsure: IntArray, flag: FlagArray) -> tuple[int, int, int]:
    """Scan the vertices of a mesh until one is provably on the positive side of a plane and one on the negative side.

    plane (3, 3): the weights of the coordinates; their sizes, which bound their errors; the offset, its size, and a 0.
    Returns (beyond, before, n_unsure): the first vertex proven positive and the first proven negative, -1 for none, and
    the number of undecided vertices passed, which are listed in `unsure` (n,) int64 as far as they fit; n + 1 if the
    flag was set."""
    beyond, before, n_unsure, n = -1, -1, 0, mesh.vertices.shape[0]
    for start in range(0, n, _BLOCK):  # many vertices in one pass, without branches
        stop, n_beyond, n_before = min(start + _BLOCK, n), 0, 0
        for vertex in range(start, stop):
            side = _side(mesh, vertex, plane)
            n_beyond += side > 0
            n_before += side < 0
        is_proven = n_beyond + n_before == stop - start
        if is_proven and (n_beyond == 0 or beyond >= 0) and (n_before == 0 or before >= 0):
            continue
        for vertex in range(start, stop):
            side = _side(mesh, vertex, plane)
            if side > 0 and beyond < 0:
                beyond = vertex
            elif side < 0 and before < 0:
                before = vertex
            elif side == 0:
                if n_unsure < len(unsure):
                    unsure[n_unsure] = vertex
                n_unsure += 1
            if beyond >= 0 and before >= 0:
                return beyond, before, n_unsure
        if n_unsure > len(unsure) or (start % _MANY == 0 and flag[0] != 0):
            return beyond, before, len(unsure) + 1
    return beyond, before, n_unsure


def _function_in_frame(space: HalfSpace, poses: result.Poses) -> _Function:
    """Return the linear function n . p + d of a half-space in the pose frame of a body, rounded, with sizes that bound
    its errors (`_Function`). Under a pose of the body a weight is the sum of three products, the offset one of four
    numbers: seven roundings of 2^-53 of their magnitudes, whose sum is the size, and underflow below 2^-1070. Under its
    own pose: rationals."""
    normal, offset = space.normal, float(space.offset)
    sizes, size = np.abs(normal), abs(offset)
    if poses[0] is not None:
        _, normal, offset = pulled_back(image_half_space(space, poses[0]), poses[1])
        return normal, np.abs(normal), offset, abs(offset)
    if poses[1] is None:
        return normal, sizes, offset, size
    turn, move = poses[1].rotation, poses[1].translation
    with np.errstate(all="ignore"):  # what overflows is unsure
        offset, size = offset + float(normal @ move), size + float(sizes @ np.abs(move))
        return normal @ turn, sizes @ np.abs(turn), offset, size


def _side_of_box(function: _Function, body: Solid) -> int:
    """Return 1 or -1 if the box around a body provably lies on the positive or negative side of a plane, else 0.
    function: of the half-space, in the body's frame. error: the extremes of dot(n, p) + d over a box are sums of
    products of its bounds: at most seven roundings of 2^-53 of the sum of magnitudes, and as much for the errors of
    weights and offset, far below 2^-48 of it."""
    weights, sizes, offset, size = function
    low, high, _ = own_box(body)
    least, most, reach = offset, offset, 0.0
    for n, s, a, b in zip(weights.tolist(), sizes.tolist(), low.tolist(), high.tolist()):
        least += min(n * a, n * b)
        most += max(n * a, n * b)
        size += s * max(abs(a), abs(b))
        reach += max(abs(a), abs(b))
    slack = 2.0**-48 * size + 2.0**-1060 * reach + 2.0**-1000
    return int(least > slack) - int(most < -slack)


def _reaches(boundary: Boundary, faces: IntArray, plane: HalfSpaceImage, side: int) -> bool:
    """Return whether a part of these faces that bounds the interior has a point on side 1 or -1 of a plane, exactly."""
    return boundary.has_live(faces, lambda corners: any(side * value_at(plane, p) > 0 for p in corners))


def half_space_body_parts(space: HalfSpace, body: Solid, poses: result.Poses, work: result.Work) -> result.Parts:
    """Return which of a half-space and a body with faces or edges that overlap has a part outside the other, and
    whether the boundaries meet."""
    boundary, plane = boundary_of(body, poses[1], work), image_half_space(space, poses[0])
    signs = boundary.signs(plane)
    sticks_out = _reaches(boundary, boundary.faces_at(signs < 0), plane, -1)
    meet = np.intersect1d(boundary.faces_at(signs <= 0), boundary.faces_at(signs >= 0), assume_unique=True)
    return result.Parts(True, sticks_out, len(meet) > 0)


def sphere_sphere_parts(first: Sphere, second: Sphere, poses: result.Poses, work: result.Work) -> result.Parts:
    """Return which of two overlapping balls has a part outside the other."""
    between = squared_length(minus(image_point(first.center, poses[0]), image_point(second.center, poses[1])))
    r, s = Fraction(first.radius), Fraction(second.radius)
    return result.Parts(r > s or between > (s - r) ** 2, s > r or between > (s - r) ** 2, True)


def half_spaces_parts(first: HalfSpace, second: HalfSpace, poses: result.Poses, work: result.Work) -> result.Parts:
    """Return which of two overlapping half-spaces has a part outside the other: neither if equal, else both."""
    (n, d), (m, e) = image_half_space(first, poses[0]), image_half_space(second, poses[1])
    axis = largest_axis(n)
    factor = m[axis] / n[axis]
    is_equal = factor > 0 and all(q == factor * p for p, q in zip((*n, d), (*m, e)))
    return result.Parts(not is_equal, not is_equal, True)


def half_space_sphere_parts(space: HalfSpace, ball: Sphere, poses: result.Poses, work: result.Work) -> result.Parts:
    """Return which of a half-space and a ball that overlap has a part outside the other; their boundaries meet."""
    plane = image_half_space(space, poses[0])
    height, reach = value_at(plane, image_point(ball.center, poses[1])), squared_length(plane[0])
    return result.Parts(True, height < 0 or height**2 < Fraction(ball.radius) ** 2 * reach, True)
