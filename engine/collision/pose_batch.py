"""Many poses of one mesh against another, in one kernel call per chunk; what it leaves open is settled pose by pose."""

from __future__ import annotations

from typing import Any

from engine.collision.dual_traversal import INTERRUPTED, SEEK_OVERLAP, search
from engine.collision.parity import INSIDE, OUTSIDE, locate_point
from engine.collision.placement import Placement, PoseArrays, as_placement, placed_point
from engine.collision.shell import ShellArrays
from engine.jit import inline, kernel

UNSETTLED = -1
"""Written in place of a relation: weak contacts, undecided signs, or components of which only some lie inside."""

DISJOINT, FIRST_INSIDE_SECOND, SECOND_INSIDE_FIRST, OVERLAPPING, TOUCHING = range(5)  # as in engine.types.Relation

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
    n_inside = 0
    for item in range(components.shape[0]):
        q = placed_point(source.vertices, source.triangles[components[item], 0], source_place)
        where = locate_point(q, source_place.error, shell, place)
        if where == INSIDE:
            n_inside += 1
        elif where != OUTSIDE:
            return _UNSURE
    if n_inside == 0:
        return _NONE
    return _ALL if n_inside == components.shape[0] else _SOME


@kernel
def relate_poses(
    first: ShellArrays,
    first_components: Any,
    first_has_inside: bool,
    second: ShellArrays,
    second_components: Any,
    second_has_inside: bool,
    poses: PoseArrays,
    seek: int,
    pairs: Any,
    kinds: Any,
    relations: Any,
    flag: Any,
) -> None:
    """Fill relations (n,) int8 for the poses (n) of the second body; `pairs` and `kinds` hold one row of work space."""
    still = as_placement(poses.rotations, poses.translations, 0, False, True, 0.0)
    for item in range(relations.shape[0]):
        place = as_placement(poses.rotations, poses.translations, item, True, False, poses.reach)
        n_pairs, is_settled = search(first, still, second, place, seek, False, pairs, kinds, flag)
        if n_pairs == INTERRUPTED:
            return
        if is_settled:
            relations[item] = OVERLAPPING if seek == SEEK_OVERLAP else TOUCHING
            continue
        relations[item] = UNSETTLED
        if n_pairs > 0:
            continue
        in_second = components_inside(first, first_components, still, second, place, second_has_inside)
        in_first = components_inside(second, second_components, place, first, still, first_has_inside)
        if in_second == _NONE and in_first == _NONE:
            relations[item] = DISJOINT
        elif in_second == _ALL and in_first == _NONE:
            relations[item] = FIRST_INSIDE_SECOND
        elif in_second == _NONE and in_first == _ALL:
            relations[item] = SECOND_INSIDE_FIRST
