"""Many poses of one mesh against another, in one kernel call per chunk; what it leaves open is settled pose by pose."""

from __future__ import annotations

from typing import Any

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes.dual_traversal import (
    DONE,
    FULL,
    INTERRUPTED,
    SEEK_OVERLAP,
    SETTLED,
    Descent,
    Found,
    Place,
    Search,
    begin,
    place_bodies,
    search,
)
from engine.collision.meshes.frames import defect_of
from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.collision.meshes.parity import INSIDE, OUTSIDE, brought_back, locate_point
from engine.collision.meshes.placement import Placement, PoseArrays
from engine.jit import bare_kernel, inline
from engine.predicates.loading import as_point3


@inline
def n_components_inside(source: MeshArrays, source_place: Placement, mesh: MeshArrays, place: Placement) -> int:
    """Return how many components lie inside a mesh that none of them meets, or UNSETTLED."""
    n_inside, defect = 0, defect_of(place)
    for item in range(source.components.shape[0] if mesh.has_inside else 0):
        p = as_point3(source.vertices, source.triangles[source.components[item], 0])
        where = locate_point(brought_back(p, source_place, place, defect), mesh)
        if where == INSIDE:
            n_inside += 1
        elif where != OUTSIDE:
            return UNSETTLED
    return n_inside


@inline
def relation_apart(first: MeshArrays, second: MeshArrays, place: Place) -> int:
    """Return the relation of two bodies without contact, or UNSETTLED: none or all of one lies inside the other."""
    in_second = n_components_inside(first, place.a, second, place.b)
    in_first = n_components_inside(second, place.b, first, place.a)
    if in_second == 0 and in_first == 0:
        return DISJOINT
    if in_second == first.components.shape[0] and in_first == 0:
        return FIRST_INSIDE_SECOND
    if in_second == 0 and in_first == second.components.shape[0]:
        return SECOND_INSIDE_FIRST
    return UNSETTLED


@bare_kernel
def find_contacts(
    first: MeshArrays,
    first_pose: PoseArrays,
    second: MeshArrays,
    second_pose: PoseArrays,
    seek: int,
    is_start: bool,
    descent: Descent,
    found: Found,
    flag: Any,
) -> tuple[int, int, int]:
    """Run `search` for one pose of each body, from the start or from where it was left.

    Returns how it ended, the number of pairs, and, of a search from the start without any, `relation_apart`.
    """
    place, is_apart = place_bodies(first, first_pose, 0, second, second_pose, 0, descent)
    if is_start:
        begin(descent, is_apart)
    how, n_pairs = search(Search(first, second, place, descent, seek, found, flag))
    relation = UNSETTLED
    if is_start and how == DONE and n_pairs == 0:
        relation = relation_apart(first, second, place)
    return how, n_pairs, relation


@bare_kernel
def relate_poses(
    first: MeshArrays,
    second: MeshArrays,
    still: PoseArrays,
    poses: PoseArrays,
    seek: int,
    descent: Descent,
    found: Found,
    relations: Any,
    flag: Any,
) -> None:
    """Fill relations (n,) int8 for the poses (n) of the second body; still: of the first, which has none.

    `descent` and `found` (of a few rows) are work space.
    """
    for item in range(relations.shape[0]):
        place, is_apart = place_bodies(first, still, 0, second, poses, item, descent)
        begin(descent, is_apart)
        how, n_pairs, has_contact = FULL, 0, False
        while how == FULL:  # weak contacts so far: a later one may settle the question
            how, n_pairs = search(Search(first, second, place, descent, seek, found, flag))
            has_contact |= n_pairs > 0
        if how == INTERRUPTED:
            return
        if how == SETTLED:
            relations[item] = OVERLAPPING if seek == SEEK_OVERLAP else TOUCHING
        else:
            relations[item] = UNSETTLED if has_contact else relation_apart(first, second, place)
