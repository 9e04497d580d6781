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
    Place,
    search,
    start_descent,
)
from engine.collision.meshes.frames import defect_of
from engine.collision.meshes.mesh_arrays import ShellArrays
from engine.collision.meshes.parity import INSIDE, OUTSIDE, brought_back, locate_point
from engine.collision.meshes.placement import Placement, PoseArrays
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3

_NONE, _ALL, _SOME, _UNSURE = range(4)


@inline
def components_inside(
    source: ShellArrays,
    components: Any,
    source_place: Placement,
    shell: ShellArrays,
    place: Placement,
    has_inside: bool,
) -> int:
    """Return whether none, all or some of the components lie inside a shell that none of them meets, or `_UNSURE`."""
    if not has_inside:
        return _NONE
    n_inside, defect = 0, defect_of(place)
    for item in range(components.shape[0]):
        p = as_point3(source.vertices, source.triangles[components[item], 0])
        where = locate_point(brought_back(p, source_place, place, defect), shell)
        if where == INSIDE:
            n_inside += 1
        elif where != OUTSIDE:
            return _UNSURE
    if n_inside == 0:
        return _NONE
    return _ALL if n_inside == components.shape[0] else _SOME


@inline
def relation_apart(
    first: ShellArrays,
    first_components: Any,
    first_has_inside: bool,
    second: ShellArrays,
    second_components: Any,
    second_has_inside: bool,
    place: Place,
) -> int:
    """Return the relation of two bodies without contact, or UNSETTLED."""
    in_second = components_inside(first, first_components, place.a, second, place.b, second_has_inside)
    in_first = components_inside(second, second_components, place.b, first, place.a, first_has_inside)
    if in_second == _NONE and in_first == _NONE:
        return DISJOINT
    if in_second == _ALL and in_first == _NONE:
        return FIRST_INSIDE_SECOND
    if in_second == _NONE and in_first == _ALL:
        return SECOND_INSIDE_FIRST
    return UNSETTLED


@kernel
def find_contacts(
    first: ShellArrays,
    first_components: Any,
    first_has_inside: bool,
    first_pose: PoseArrays,
    second: ShellArrays,
    second_components: Any,
    second_has_inside: bool,
    second_pose: PoseArrays,
    seek: int,
    is_start: bool,
    descent: Descent,
    pairs: Any,
    kinds: Any,
    flag: Any,
) -> tuple[int, int, int]:
    """Run `search` for one pose of each body, from the start or from where it was left.

    Returns how it ended, the number of pairs, and, of a search from the start without any, `relation_apart`.
    """
    rest, bottom = descent.rest.copy(), descent.stack[0].copy()
    place = start_descent(first, first_pose, 0, second, second_pose, 0, descent)
    if not is_start:
        descent.rest[:] = rest
        descent.stack[0, 0], descent.stack[0, 1] = bottom[0], bottom[1]
    how, n_pairs = search(first, second, place, descent, seek, pairs, kinds, flag)
    relation = UNSETTLED
    if is_start and how == DONE and n_pairs == 0:
        relation = relation_apart(
            first, first_components, first_has_inside, second, second_components, second_has_inside, place
        )
    return how, n_pairs, relation


@kernel
def relate_poses(
    first: ShellArrays,
    first_components: Any,
    first_has_inside: bool,
    second: ShellArrays,
    second_components: Any,
    second_has_inside: bool,
    still: PoseArrays,
    poses: PoseArrays,
    seek: int,
    descent: Descent,
    pairs: Any,
    kinds: Any,
    relations: Any,
    flag: Any,
) -> None:
    """Fill relations (n,) int8 for the poses (n) of the second body; still: of the first, which has none.

    `descent`, `pairs` and `kinds` (some rows) are work space.
    """
    for item in range(relations.shape[0]):
        place = start_descent(first, still, 0, second, poses, item, descent)
        how, n_pairs = search(first, second, place, descent, seek, pairs, kinds, flag)
        has_contact = n_pairs > 0
        while how == FULL:  # weak contacts so far: a later one may settle the question
            how, _ = search(first, second, place, descent, seek, pairs, kinds, flag)
        if how == INTERRUPTED:
            return
        if how == SETTLED:
            relations[item] = OVERLAPPING if seek == SEEK_OVERLAP else TOUCHING
            continue
        relations[item] = UNSETTLED
        if has_contact:
            continue
        relations[item] = relation_apart(
            first, first_components, first_has_inside, second, second_components, second_has_inside, place
        )
