"""The regions that the other body cuts from a face in contact, and what lies beside them: step 3 of mesh_mesh.py.

If two open interiors meet, the border of their intersection has a piece with area on some face of either body; so
overlapping shows as a region of a face with both insides on one side of it.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import IntArray
from engine.collision.meshes.exact_body import ExactBody, Vector
from engine.collision.meshes.exact_regions import (
    even_sides,
    is_inside_exact,
    pieces_of_segment,
    regions_of,
    sides_at,
    sides_within,
)
from engine.collision.meshes.exact_triangles import as_simplex, is_in_triangle
from engine.collision.meshes.mesh_arrays import STATE_CLEAN
from engine.collision.meshes.mesh_pair import MeshPair
from engine.collision.meshes.parity import OUTSIDE


def vertices_outside(pair: MeshPair, own: int, faces: IntArray) -> frozenset[int]:
    """Return the corners of faces that lie outside the other body, if they do not lie on a face of it."""
    mesh, other = pair.meshes[own], pair.meshes[1 - own]
    vertices = np.unique(mesh.arrays.triangles[faces])
    return frozenset(vertices[pair.located(own, vertices) == OUTSIDE].tolist()) if other.has_inside else frozenset()


def has_corner_outside(pair: MeshPair, own: int, face: int, met: IntArray, outside: frozenset[int]) -> bool:
    """Tell whether a face with `met`, all it meets of the other body, surely has a corner outside that body."""
    body, other = pair.exact[own], pair.exact[1 - own]
    for vertex in pair.meshes[own].arrays.triangles[face].tolist():
        if vertex in outside and not any(may_hold(other, i, body.vertex(vertex)) for i in met.tolist()):
            return True
    return False


def look_at_regions(
    pair: MeshPair, own: int, face: int, met: IntArray | None, is_outlying: bool = False
) -> tuple[bool, bool]:
    """Tell whether both insides come up to one side of some region of a face, and whether one lies inside the other.

    met: all faces of the other body that meet this one, if known; is_outlying: a corner lies outside it.
    """
    body, other = pair.exact[own], pair.exact[1 - own]
    axis = body.axis(face)
    if axis < 0:
        return False, False
    cutters = [other]
    if body.mesh.has_inside and pair.state(own, face) != STATE_CLEAN:
        cutters.append(body)
    elif body.mesh.has_inside and met is not None:
        overlaps = _overlaps_evenly(pair, own, face, met, is_outlying)
        if overlaps is not None:
            return overlaps, False
    pierces = False
    for q in regions_of(body, face, cutters, pair.work.budget):
        theirs = sides_at(other, q, axis)
        if theirs.above or theirs.below:
            ours = sides_at(body, q, axis)
            if (ours.above and theirs.above) or (ours.below and theirs.below):
                return True, False
        pierces = pierces or theirs.at
    return False, pierces


def _overlaps_evenly(pair: MeshPair, own: int, face: int, met: IntArray, is_outlying: bool) -> bool | None:
    """Tell whether both insides come up to one side of a clean face, None where that is not known.

    It is known where the other's status is one all along the side of the face's inside. No other answer is missing: a
    point of the face in the other's open interior has both insides beside it.
    """
    body, other = pair.exact[own], pair.exact[1 - own]
    is_even_above, is_even_below = even_sides(body, face, other, met)
    if not (is_even_above or is_even_below):
        return None
    if is_even_above and is_even_below and is_outlying:
        return False
    sides = sides_within(body, face, other)
    if sides is None:
        return None
    ours, theirs = sides
    if (ours.above and not is_even_above) or (ours.below and not is_even_below):
        return None
    return (ours.above and theirs.above) or (ours.below and theirs.below)


def pierces_without_area(pair: MeshPair, own: int, face: int) -> bool:
    """Tell whether a face that is only a segment has a point in the other body's open interior."""
    body, other = pair.exact[own], pair.exact[1 - own]
    if body.axis(face) >= 0 or not other.mesh.has_inside:
        return False
    ends = as_simplex(body.corners(face))
    if len(ends) < 2:
        return False
    pieces = pieces_of_segment(body, (ends[0], ends[1]), other, pair.work.budget)
    return any(is_inside_exact(other, q) for q in pieces)


def may_hold(body: ExactBody, face: int, p: Vector) -> bool:
    """Tell whether a face holds a point; maybe, where the face has no area."""
    plane = body.plane(face)
    return not any(plane[:3]) or is_in_triangle(p, body.corners(face), plane)
