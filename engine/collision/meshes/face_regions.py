"""The regions that the other body cuts from a face in contact, and what lies beside them: step 3 of mesh_mesh.py.

If two open interiors meet, the border of their intersection has a piece with area on some face of either body; so
overlapping shows as a region of a face with both insides on one side of it.
"""

from __future__ import annotations

from engine.arrays import IntArray
from engine.collision.meshes.exact_regions import even_sides, pieces_of_segment, regions_of, sides_at, sides_within
from engine.collision.meshes.exact_triangles import as_simplex
from engine.collision.meshes.mesh_arrays import STATE_CLEAN
from engine.collision.meshes.mesh_pair import MeshPair


def look_at_regions(pair: MeshPair, own: int, face: int, met: IntArray | None) -> tuple[bool, bool]:
    """Tell whether both insides come up to one side of some region of a face, and whether one lies inside the other.

    met: all faces of the other body that meet this one, if known.
    """
    body, other = pair.exact[own], pair.exact[1 - own]
    axis = body.axis(face)
    if axis < 0:
        return False, False
    cutters = [other]
    if body.mesh.has_inside and pair.state(own, face) != STATE_CLEAN:
        cutters.append(body)
    elif body.mesh.has_inside and met is not None:
        overlaps = _overlaps_evenly(pair, own, face, met)
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


def _overlaps_evenly(pair: MeshPair, own: int, face: int, met: IntArray) -> bool | None:
    """Tell whether both insides come up to one side of a clean face, None where that is not known.

    It is known where the other's status is one all along the side of the face's inside. No other answer is missing: a
    point of the face in the other's open interior has both insides beside it.
    """
    body, other = pair.exact[own], pair.exact[1 - own]
    is_even_above, is_even_below = even_sides(body, face, other, met)
    if not (is_even_above or is_even_below):
        return None
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
    # every face with area that holds a point lies across some axis
    return any(all(sides_at(other, q, axis).at for axis in range(3)) for q in pieces)
