"""Polyhedra, surfaces and boxes against each other in 3D: the relation, by contacts, then locations, then cells.

1. **Contacts**: every pair of faces with a common point. A strict crossing that `face_state.py` accepts proves that
the open
   interiors meet, and ends the search.
2. **Patches**: faces without contact, connected through vertices, lie wholly inside or wholly outside the other body,
so
   one vertex tells. Without any contact the patches are the components of the surfaces, and disjoint or inside follow.
   A patch inside the other body proves overlapping, if some face of it has an inside of its own body beside it.
3. **Cells**: what is left are weak contacts (a vertex on a face, flush faces, edges that touch). If the open interiors
   meet, the border of their intersection has a piece with area on some face of either body; on patches that is settled,
   so look at every cell that the two bodies cut from each face in contact (`exact_cells.py`).

Faces that cancel under even-odd (stacked) have nothing to show for themselves; their patches go through step 3 too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from engine.collision.dual_traversal import (
    FULL,
    SEEK_CONTACT,
    SEEK_OVERLAP,
    SEEK_PIERCING_BY_FIRST,
    SEEK_PIERCING_BY_SECOND,
    SETTLED,
    new_descent,
)
from engine.collision.exact_body import ExactBody, Vector, exact_pair
from engine.collision.exact_cells import cells_of, even_sides, is_inside_exact, pieces_of_segment, sides_at, sides_over
from engine.collision.exact_triangles import as_simplex, classify_exact, is_flush, is_in_triangle, kind_of_contact
from engine.collision.face_state import find_states
from engine.collision.parity import INSIDE, OUTSIDE, locate_vertices
from engine.collision.pose_batch import find_contacts
from engine.collision.result import Collision, Kind, Witness, Work
from engine.collision.separating_plane import is_separated
from engine.collision.shell import (
    STATE_CLEAN,
    STATE_CROSSED,
    STATE_STACKED,
    Shell,
    join_vertices,
    shell_of,
    shell_of_triangles,
)
from engine.collision.triangle_triangle import APART, COPLANAR, CROSSING
from engine.solids.base import IntArray, Solid
from engine.solids.pose import Pose
from engine.types import UNDECIDED, Relation

_ROOM = 1024
_SAFE_POWER = 300
_BLOCK = 64
_PROBED = 8
_NAMED = 32
WITHIN = ((1, 1, 1), (1, 1, 2), (2, 1, 1), (3, 5, 4), (7, 11, 5))
"""Weights of the corners for points within a face."""
STRENGTH: tuple[Kind, ...] = ("face_face", "edge_face", "vertex_face", "edge_edge", "vertex_edge", "vertex_vertex")
"""Of several contacts the witness is the one of the kind that stands first here; at most `_NAMED` are looked at."""


def mesh_mesh(first: Solid, second: Solid, first_pose: Pose | None, second_pose: Pose | None, work: Work) -> Collision:
    """Return the relation of two polyhedra, surfaces or 3D boxes."""
    return relate(shell_of(first), first_pose, shell_of(second), second_pose, work)


def relate(first: Shell, first_pose: Pose | None, second: Shell, second_pose: Pose | None, work: Work) -> Collision:
    """Return the relation of two placed shells."""
    with np.errstate(all="ignore"):  # kernels, where they run uncompiled
        return MeshPair(*simplest(first, first_pose, second, second_pose), work).relation()


def simplest(
    first: Shell, first_pose: Pose | None, second: Shell, second_pose: Pose | None
) -> tuple[Shell, Pose | None, Shell, Pose | None]:
    """Return a placed pair that has the same relation, scaled into the range of the kernels where that is exact.

    Two equal poses are left out: an invertible affine map, applied to both, changes no relation.
    """
    if first_pose is not None and first_pose.is_identity:
        first_pose = None
    if second_pose is not None and second_pose.is_identity:
        second_pose = None
    if first_pose is not None and first_pose == second_pose:
        first_pose = second_pose = None
    return in_range(first, first_pose, second, second_pose)


def in_range(
    first: Shell, first_pose: Pose | None, second: Shell, second_pose: Pose | None
) -> tuple[Shell, Pose | None, Shell, Pose | None]:
    """Return posed bodies near the ends of the exponent range scaled by a power of two, where that is exact.

    Without poses the predicates scale by themselves; the filter for rounded posed coordinates does not.
    """
    poses = [pose for pose in (first_pose, second_pose) if pose is not None]
    if not poses:
        return first, first_pose, second, second_pose
    largest = max(first.reach, second.reach, *(float(np.abs(pose.translation).max()) for pose in poses), 0.0)
    power = int(np.frexp(largest)[1])
    if abs(power) <= _SAFE_POWER or largest == 0.0:
        return first, first_pose, second, second_pose
    arrays = [first.arrays.vertices, second.arrays.vertices, *(pose.translation for pose in poses)]
    scaled = [np.ldexp(array, -power) for array in arrays]
    if any((np.ldexp(small, power) != array).any() for small, array in zip(scaled, arrays)):
        return first, first_pose, second, second_pose
    shells = [
        shell_of_triangles(vertices, shell.arrays.triangles, shell.faces, shell.has_inside)
        for vertices, shell in zip(scaled, (first, second))
    ]
    moved = [
        None if pose is None else Pose(pose.rotation, np.ldexp(pose.translation, -power))
        for pose in (first_pose, second_pose)
    ]
    return shells[0], moved[0], shells[1], moved[1]


def what_to_seek(first: Shell, second: Shell, work: Work) -> int:
    """Return what ends the search for contacts early."""
    if work.boolean or not (first.has_inside or second.has_inside):
        return SEEK_CONTACT
    if first.has_inside and second.has_inside:
        return SEEK_OVERLAP
    if not work.witness:
        return SEEK_CONTACT
    return SEEK_PIERCING_BY_SECOND if first.has_inside else SEEK_PIERCING_BY_FIRST


@dataclass(frozen=True, slots=True)
class Patch:
    """Faces connected through vertices, none in contact with the other body, all inside it or all outside."""

    faces: IntArray


class MeshPair:
    """One question, and the exact coordinates computed for it so far."""

    def __init__(
        self, first: Shell, first_pose: Pose | None, second: Shell, second_pose: Pose | None, work: Work
    ) -> None:
        self.shells = (first, second)
        self.poses = (first_pose, second_pose)
        self.work = work
        self.seek = what_to_seek(first, second, work)
        self.is_disjoint = False
        self._exact: tuple[ExactBody, ExactBody] | None = None

    @property
    def exact(self) -> tuple[ExactBody, ExactBody]:
        """Both bodies in exact coordinates."""
        if self._exact is None:
            self._exact = exact_pair(self.shells[0], self.poses[0], self.shells[1], self.poses[1])
        return self._exact

    def relation(self) -> Collision:
        """Return the answer."""
        contacts, is_settled = self._contacts()
        if self.is_disjoint:
            return Collision(Relation.DISJOINT)
        if is_settled:
            if self.seek == SEEK_OVERLAP:
                return self._touch(Relation.OVERLAPPING, contacts)
            return self._touch(Relation.TOUCHING, contacts, piercing=self.seek != SEEK_CONTACT)
        if len(contacts) and self._is_separated(contacts):
            return self._touch(Relation.TOUCHING, contacts)
        patches = [self._patches(own, contacts[:, own], INSIDE) for own in (0, 1)]
        if not len(contacts):
            n_inside = [sum(len(patch.faces) for patch in found) for found in patches]
            if n_inside == [0, 0]:
                return Collision(Relation.DISJOINT)
            for own in (0, 1):
                if n_inside[own] == len(self.shells[own].faces) and n_inside[1 - own] == 0:
                    relation = (Relation.FIRST_INSIDE_SECOND, Relation.SECOND_INSIDE_FIRST)[own]
                    return self._contain(relation, own, patches[own][0])
        return self._overlap_or_touch(contacts, patches)

    def _contacts(self) -> tuple[IntArray, bool]:
        """Return the pairs of faces (n, 2) with a common point, ascending, or the one pair that settles the
        question."""
        (first, second), flag = self.shells, self.work.budget.flag
        first_pose, second_pose = first.posed(self.poses[0]), second.posed(self.poses[1])
        pairs, kinds = np.empty((_ROOM, 2), np.int64), np.empty(_ROOM, np.int8)
        descent = new_descent()
        found_pairs: list[IntArray] = []
        found_kinds: list[npt.NDArray[np.int8]] = []
        how = FULL
        while how == FULL:  # bound: each turn finds new pairs
            how, n_pairs, apart = find_contacts(
                first.arrays,
                first.components,
                first.has_inside,
                first_pose,
                second.arrays,
                second.components,
                second.has_inside,
                second_pose,
                self.seek,
                not found_pairs,
                descent,
                pairs,
                kinds,
                flag,
            )
            self.work.budget.check()
            if how == SETTLED:
                return pairs[:1], True
            if apart == Relation.DISJOINT:
                self.is_disjoint = True
                return pairs[:0], False
            found_pairs.append(pairs[:n_pairs].copy())
            found_kinds.append(kinds[:n_pairs].copy())
            if (
                how == FULL
                and len(found_pairs) == 1
                and self.seek == SEEK_OVERLAP
                and self._is_overlap_near(pairs, kinds)
            ):
                return pairs[:1], True
        pairs, kinds = np.concatenate(found_pairs), np.concatenate(found_kinds)
        n_pairs = len(pairs)
        pairs, kinds = self._in_order(pairs, kinds)
        open_ones = np.flatnonzero(kinds == UNDECIDED)
        self.work.n_beyond_filter += n_pairs
        self.work.n_rational += len(open_ones)
        for index in open_ones:
            self.work.budget.check()
            i, j = int(pairs[index, 0]), int(pairs[index, 1])
            kinds[index] = classify_exact(
                self.exact[0].corners(i), self.exact[1].corners(j), self.exact[0].plane(i), self.exact[1].plane(j)
            )
            if kinds[index] != APART and self._is_settled_by(int(kinds[index]), i, j):
                return pairs[index : index + 1], True
        meet = np.concatenate(
            [np.flatnonzero(kinds == COPLANAR), np.flatnonzero((kinds != APART) & (kinds != COPLANAR))]
        )
        return pairs[meet], False

    def _is_separated(self, contacts: IntArray) -> bool:
        """Tell whether a plane is known that separates the two bodies."""
        (first, second), flag = self.shells, self.work.budget.flag
        first_pose, second_pose = first.posed(self.poses[0]), second.posed(self.poses[1])
        found = is_separated(first.arrays, first_pose, second.arrays, second_pose, contacts, flag)
        self.work.budget.check()
        return bool(found)

    def _is_overlap_near(self, pairs: IntArray, kinds: npt.NDArray[np.int8]) -> bool:
        """Tell whether the cells of a few faces in contact prove overlapping; such a pair is put first."""
        sure = np.flatnonzero(kinds != UNDECIDED)
        for index in sure[:: max(1, len(sure) // _PROBED)].tolist():
            if self._look_at_cells(0, int(pairs[index, 0]), None)[0]:
                pairs[0] = pairs[index]
                return True
        return False

    def _in_order(self, pairs: IntArray, kinds: npt.NDArray[np.int8]) -> tuple[IntArray, npt.NDArray[np.int8]]:
        """Sort pairs by the caller's faces, then by triangle."""
        faces = [self.shells[own].faces[pairs[:, own]] for own in (0, 1)]
        order = np.lexsort((pairs[:, 1], pairs[:, 0], faces[1], faces[0]))
        return pairs[order], kinds[order]

    def _is_settled_by(self, kind: int, i: int, j: int) -> bool:
        """The rule of `dual_traversal.settles` for a class found exactly."""
        if self.seek == SEEK_CONTACT:
            return True
        if kind != CROSSING:
            return False
        first, second = self._state(0, i), self._state(1, j)
        if self.seek == SEEK_PIERCING_BY_FIRST:
            return second == STATE_CLEAN
        if self.seek == SEEK_PIERCING_BY_SECOND:
            return first == STATE_CLEAN
        return max(first, second) <= STATE_CROSSED and min(first, second) == STATE_CLEAN

    def _states(self, own: int, faces: IntArray) -> npt.NDArray[np.int8]:
        states = np.empty(len(faces), np.int8)
        find_states(self.shells[own].arrays, faces, states)
        return states

    def _state(self, own: int, face: int) -> int:
        return int(self._states(own, np.array([face]))[0])

    def _patches(self, own: int, in_contact: IntArray, place: int) -> list[Patch]:
        """Return the patches of one body, away from its faces in contact, that lie INSIDE or OUTSIDE the other body."""
        shell, other = self.shells[own], self.shells[1 - own]
        if not other.has_inside:
            return []
        triangles = shell.arrays.triangles
        if len(in_contact):
            left_out = np.zeros(len(triangles), np.bool_)
            left_out[in_contact] = True
            parent = np.empty(len(shell.arrays.vertices), np.int64)
            join_vertices(triangles, left_out, parent)
            kept = np.flatnonzero(~left_out)
            roots = parent[triangles[kept, 0]]
            vertices = np.unique(roots)
        else:
            vertices = triangles[shell.components, 0]
        found = self._located(own, vertices)
        for index in np.flatnonzero(found == UNDECIDED):
            self.work.budget.check()
            self.work.n_beyond_filter += 1
            self.work.n_rational += 1
            point = self.exact[own].vertex(int(vertices[index]))
            found[index] = INSIDE if sides_at(self.exact[1 - own], (*point, 1), 2).at else OUTSIDE
        there = vertices[found == place]
        if not len(there):
            return []
        if not len(in_contact):
            parent = np.empty(len(shell.arrays.vertices), np.int64)
            join_vertices(triangles, np.zeros(len(triangles), np.bool_), parent)
            kept, roots = np.arange(len(triangles)), parent[triangles[:, 0]]
        return [Patch(kept[roots == parent[vertex]]) for vertex in there]

    def _located(self, own: int, vertices: IntArray) -> npt.NDArray[np.int8]:
        """Return where vertices that are on no face of the other body lie: INSIDE, OUTSIDE or UNDECIDED."""
        shell, other = self.shells[own], self.shells[1 - own]
        poses = [body.posed(pose) for body, pose in zip(self.shells, self.poses)]
        found = np.empty(len(vertices), np.int8)
        locate_vertices(shell.arrays, poses[own], vertices, other.arrays, poses[1 - own], found, self.work.budget.flag)
        self.work.budget.check()
        return found

    def _overlap_or_touch(self, contacts: IntArray, patches: list[list[Patch]]) -> Collision:
        """Return overlapping or touching, where no crossing has proven the first."""
        piercing = bool(patches[0] or patches[1])
        both = self.shells[0].has_inside and self.shells[1].has_inside
        for own in (0, 1):
            for patch in patches[own]:
                if both and self._has_inside_beside(own, patch):
                    if len(contacts):
                        return self._touch(Relation.OVERLAPPING, contacts)
                    return self._contain(Relation.OVERLAPPING, own, patch)
        for own in (0, 1):
            if not both and (piercing or not self.work.witness or not self.shells[1 - own].has_inside):
                continue
            faces = np.unique(contacts[:, own])
            outside = self._vertices_outside(own, faces)
            for face, state in zip(faces.tolist(), self._states(own, faces).tolist()):
                met = contacts[contacts[:, own] == face, 1 - own]
                is_outlying = self._has_corner_outside(own, face, met, outside)
                if own == 1 and both and is_outlying and state == STATE_CLEAN:
                    continue  # case: a common cell without any face of the first is one of the second, in the first
                overlaps, pierces = self._look_at_cells(own, face, met, is_outlying)
                if overlaps:
                    return self._touch(Relation.OVERLAPPING, contacts)
                piercing = piercing or pierces
        if self.work.witness and not piercing:
            piercing = any(
                self._pierces_without_area(own, face) for own in (0, 1) for face in np.unique(contacts[:, own]).tolist()
            )
        if len(contacts):
            return self._touch(Relation.TOUCHING, contacts, piercing=piercing)
        own = 0 if patches[0] else 1
        return self._contain(Relation.TOUCHING, own, patches[own][0], piercing=piercing)

    def _has_inside_beside(self, own: int, patch: Patch) -> bool:
        """Tell whether the body's own inside comes up to some face of a patch."""
        shell, body = self.shells[own], None
        with_area = patch.faces[shell.arrays.axis[patch.faces] != -1]
        for start in range(0, len(with_area), _BLOCK):
            self.work.budget.check()
            if (self._states(own, with_area[start : start + _BLOCK]) != STATE_STACKED).any():
                return True
        for face in with_area.tolist():
            body = self.exact[own]
            for q in cells_of(body, face, [body], self.work.budget):
                sides = sides_at(body, q, body.axis(face))
                if sides.above or sides.below:
                    return True
        return False

    def _vertices_outside(self, own: int, faces: IntArray) -> frozenset[int]:
        """Return the corners of faces that lie outside the other body, if they do not lie on a face of it."""
        shell, other = self.shells[own], self.shells[1 - own]
        vertices = np.unique(shell.arrays.triangles[faces])
        return (
            frozenset(vertices[self._located(own, vertices) == OUTSIDE].tolist()) if other.has_inside else frozenset()
        )

    def _has_corner_outside(self, own: int, face: int, met: IntArray, outside: frozenset[int]) -> bool:
        """Tell whether a face with `met`, all it meets of the other body, surely has a corner outside that body."""
        body, other = self.exact[own], self.exact[1 - own]
        for vertex in self.shells[own].arrays.triangles[face].tolist():
            if vertex in outside and not any(_may_hold(other, i, body.vertex(vertex)) for i in met.tolist()):
                return True
        return False

    def _look_at_cells(self, own: int, face: int, met: IntArray | None, is_outlying: bool = False) -> tuple[bool, bool]:
        """Tell whether both insides come up to one side of some cell of a face, and whether a cell lies inside the
        other. met: all faces of the other body that meet this one, if known; is_outlying: a corner lies outside it."""
        body, other = self.exact[own], self.exact[1 - own]
        axis = body.axis(face)
        if axis < 0:
            return False, False
        cutters = [other]
        if body.shell.has_inside and self._state(own, face) != STATE_CLEAN:
            cutters.append(body)
        elif body.shell.has_inside and met is not None:
            overlaps = self._overlaps_evenly(own, face, met, is_outlying)
            if overlaps is not None:
                return overlaps, False
        pierces = False
        for q in cells_of(body, face, cutters, self.work.budget):
            theirs = sides_at(other, q, axis)
            if theirs.above or theirs.below:
                ours = sides_at(body, q, axis)
                if (ours.above and theirs.above) or (ours.below and theirs.below):
                    return True, False
            pierces = pierces or theirs.at
        return False, pierces

    def _overlaps_evenly(self, own: int, face: int, met: IntArray, is_outlying: bool) -> bool | None:
        """Tell whether both insides come up to one side of a clean face; None where the other's status is not known to
        be one all along the side of the face's inside.

        No other answer is missing: a point of the face in the other's open interior has both insides beside it.
        """
        body, other = self.exact[own], self.exact[1 - own]
        corners, plane, axis = body.corners(face), body.plane(face), body.axis(face)
        is_even_above, is_even_below = even_sides(corners, plane, axis, (other.corners(i) for i in met.tolist()))
        if not (is_even_above or is_even_below):
            return None
        if is_even_above and is_even_below and is_outlying:
            return False
        for weights in WITHIN:
            x, y, z = (sum(w * p[side] for w, p in zip(weights, corners)) for side in range(3))
            q = (x, y, z, sum(weights))
            ours, theirs = sides_over(body, q, axis, plane), sides_over(other, q, axis, plane)
            if ours is None or theirs is None:
                continue
            if (ours.above and not is_even_above) or (ours.below and not is_even_below):
                return None
            return (ours.above and theirs.above) or (ours.below and theirs.below)
        return None

    def _pierces_without_area(self, own: int, face: int) -> bool:
        """Tell whether a face that is only a segment has a point in the other body's open interior."""
        body, other = self.exact[own], self.exact[1 - own]
        if body.axis(face) >= 0 or not other.shell.has_inside:
            return False
        ends = as_simplex(body.corners(face))
        if len(ends) < 2:
            return False
        pieces = pieces_of_segment(body, (ends[0], ends[1]), other, self.work.budget)
        return any(is_inside_exact(other, q) for q in pieces)

    def _touch(self, relation: Relation, contacts: IntArray, *, piercing: bool = False) -> Collision:
        """Return a relation with two faces as its witness: the strongest kind among the first contacts."""
        if not self.work.witness:
            return Collision(relation)
        named: list[tuple[int, int, int]] = []
        a, b = self.exact
        for is_short in (True, False):  # order: flush faces are found soonest, and nothing is stronger
            for i, j in contacts[: 0 if named else _NAMED].tolist():
                self.work.budget.check()
                faces = a.corners(i), b.corners(j), a.plane(i), b.plane(j)
                if is_short and not is_flush(*faces):
                    continue
                kind = STRENGTH[0] if is_short else kind_of_contact(*faces)
                named.append((STRENGTH.index(kind), int(self.shells[0].faces[i]), int(self.shells[1].faces[j])))
                if is_short:  # coplanar pairs stand first, in the order of the caller's faces
                    break
        strength, first_face, second_face = min(named)
        return Collision(relation, Witness(STRENGTH[strength], first_face, second_face, "", piercing))

    def _contain(self, relation: Relation, own: int, patch: Patch, *, piercing: bool = False) -> Collision:
        """Return a relation with a part of body `own` inside the other one as its witness."""
        if not self.work.witness:
            return Collision(relation)
        face = int(self.shells[own].faces[patch.faces].min())
        containing: Literal["first", "second"] = "second" if own == 0 else "first"
        return Collision(
            relation, Witness("containment", face if own == 0 else -1, face if own == 1 else -1, containing, piercing)
        )


def _may_hold(body: ExactBody, face: int, p: Vector) -> bool:
    """Tell whether a face holds a point; maybe, where the face has no area."""
    plane = body.plane(face)
    return not any(plane[:3]) or is_in_triangle(p, body.corners(face), plane)
