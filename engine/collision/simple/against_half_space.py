"""A body with faces or edges (mesh, box, polygon, triangle) against a half-space, by signs.

A linear function is largest and smallest over a body at vertices. What of the body lies beyond the half-space is told
by its faces with vertices there; the half-space always sticks out of the body.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import FlagArray, FloatArray, IntArray
from engine.collision.exact_images import HalfSpaceImage, as_vector, image_half_space, value_at
from engine.collision.meshes.face_state import state_at
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays, mesh_body_of
from engine.collision.result import NO_CONTACT, SECOND_WITHIN, Collision, Parts, Poses, Witness, Work
from engine.collision.simple.boundary import Boundary, boundary_of, first_triangle_at, pulled_back
from engine.compiling.direct import entry_of
from engine.compiling.jit import inline, kernel
from engine.predicates.rational import sign_of
from engine.predicates.vectors import as_point3, dot
from engine.solids.base import Solid
from engine.solids.half_space import HalfSpace
from engine.solids.registry import own_box
from engine.types import Point3, Relation

_Function = tuple[FloatArray, FloatArray, float, float]
"""Of points: weights of the coordinates, their sizes, which bound their errors, an offset, and its size."""
_FEW_UNSURE = 16
"""Vertices whose side of a plane is asked one by one; more are asked together."""
_BLOCK = 64
_MANY = 64 * _BLOCK


def collide_half_space_body(space: HalfSpace, body: Solid, poses: Poses, work: Work) -> Collision:
    """Return the relation of a half-space (first) and a body with vertices (second), exact."""
    function = _function_in_frame(space, poses)
    if (side := _side_of_box(function, body)) != 0:
        return SECOND_WITHIN if side > 0 else NO_CONTACT
    if body.dimension == 3:
        answer = _by_scan(function, space, body, poses, work)
        if answer is not None:
            return answer
    plane, boundary = image_half_space(space, poses[0]), boundary_of(body, poses[1], work)
    signs = boundary.signs(plane)
    if (signs < 0).all():
        return NO_CONTACT
    if (signs > 0).all():
        return SECOND_WITHIN
    enters = bool((signs > 0).any())
    face = boundary.number_at(int(np.argmax(signs > 0 if enters else signs == 0)))
    if enters and boundary.has_inside and _reaches(boundary, boundary.faces_at(signs > 0), plane, 1):
        return Collision(Relation.OVERLAPPING, Witness("surface", second_face=face))
    return Collision(Relation.TOUCHING, Witness("surface", second_face=face, piercing=enters))


def _by_scan(function: _Function, space: HalfSpace, body: Solid, poses: Poses, work: Work) -> Collision | None:
    """Return the relation of a half-space and a mesh where floats tell the sides of nearly all vertices, else None.

    The face at the first vertex beyond the plane, or on it, is named. Where nothing cancels a face that reaches beyond,
    there is open interior beside it.
    """
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
        return NO_CONTACT
    if before < 0 and first[0] < 0:
        return SECOND_WITHIN
    enters = first[1] >= 0
    triangle = entry_of(first_triangle_at)(mesh.arrays, first[1] if enters else first[0])
    overlaps = enters and mesh.has_inside
    if overlaps and state_at(mesh.arrays, triangle) == STATE_STACKED:
        return None
    relation = Relation.OVERLAPPING if overlaps else Relation.TOUCHING
    return Collision(relation, Witness("surface", second_face=int(mesh.faces[triangle]), piercing=enters != overlaps))


@inline
def _side(mesh: MeshArrays, vertex: int, plane: FloatArray) -> int:
    """Return 1 or -1 where that is sure, else 0.

    Each weight may be off by 2^-50 of its size, which is no less than the weight, and 2^-1070; the sum of three
    products and a number by 2^-50 of the sum of magnitudes more.
    """
    p = as_point3(mesh.vertices, vertex)
    around = Point3(abs(p.x), abs(p.y), abs(p.z))
    value = dot(as_point3(plane, 0), p) + plane[2, 0]
    size = dot(as_point3(plane, 1), around) + plane[2, 1]
    slack = 2.0**-48 * size + 2.0**-1060 * (around.x + around.y + around.z) + 2.0**-1000
    return int(value > slack) - int(value < -slack)


@kernel
def scan_sides(mesh: MeshArrays, plane: FloatArray, unsure: IntArray, flag: FlagArray) -> tuple[int, int, int]:
    """Look along the vertices of a mesh until one lies surely beyond a plane and one surely before it.

    plane: (3, 3), the weights of the coordinates; their sizes, which bound their errors; the offset and its size.
    Returns: the first vertex surely beyond, and surely before, -1 where there is none; and how many passed on the way
    are unsure: the first of them are listed in `unsure` (n,) int64. One more than fit there where the flag was raised.
    """
    beyond, before, n_unsure, n = -1, -1, 0, mesh.vertices.shape[0]
    for start in range(0, n, _BLOCK):  # many vertices at once, without branches
        stop, n_beyond, n_before = min(start + _BLOCK, n), 0, 0
        for vertex in range(start, stop):
            side = _side(mesh, vertex, plane)
            n_beyond += side > 0
            n_before += side < 0
        is_sure = n_beyond + n_before == stop - start
        if is_sure and (n_beyond == 0 or beyond >= 0) and (n_before == 0 or before >= 0):
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


def _function_in_frame(space: HalfSpace, poses: Poses) -> _Function:
    """Return the function of a half-space in the frame of a body, rounded.

    Under a pose of the body a weight is the sum of three products, the offset one of four numbers: seven roundings of
    2^-53 of their magnitudes, whose sum is the size, and what underflows, below 2^-1070. Under a pose of its own both
    are rationals, rounded once.
    """
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
    """Return the side of a plane, 1 or -1, on which the box around a body surely lies, 0 where it may meet it.

    The largest and the smallest of n . p + d over a box are sums of products of its bounds: seven roundings of 2^-53
    of the sum of magnitudes at most, and as much for what weights and offset are off by, far below 2^-48 of it.
    """
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
    """Tell whether something live of these faces lies on one side, 1 or -1, of a plane."""
    return boundary.has_live(faces, lambda corners: any(side * value_at(plane, p) > 0 for p in corners))


def half_space_body_parts(space: HalfSpace, body: Solid, poses: Poses, work: Work) -> Parts:
    """Return what of a half-space and a body with vertices (second) that overlap lies outside the other."""
    boundary, plane = boundary_of(body, poses[1], work), image_half_space(space, poses[0])
    signs = boundary.signs(plane)
    sticks_out = _reaches(boundary, boundary.faces_at(signs < 0), plane, -1)
    meet = np.intersect1d(boundary.faces_at(signs <= 0), boundary.faces_at(signs >= 0), assume_unique=True)
    return Parts(True, sticks_out, len(meet) > 0)
