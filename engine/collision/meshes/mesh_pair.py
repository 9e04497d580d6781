"""Two placed meshes in one question: their exact coordinates, the states of their faces, where their vertices lie.

Patches: faces without contact, connected through vertices, lie wholly inside or wholly outside the other body, so one
vertex tells. Without any contact the patches are the components of the surfaces.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from engine.arrays import Int8Array, IntArray
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.contact_kinds import FACE_FACE, N_NAMED, STRENGTH
from engine.collision.meshes.dual_traversal import (
    SEEK_CONTACT,
    SEEK_OVERLAP,
    SEEK_PIERCING_BY_FIRST,
    SEEK_PIERCING_BY_SECOND,
)
from engine.collision.meshes.exact_body import ExactBody, exact_pair
from engine.collision.meshes.exact_regions import Sides, regions_of, sides_at
from engine.collision.meshes.exact_triangles import kind_of_contact
from engine.collision.meshes.face_state import states_of
from engine.collision.meshes.mesh_arrays import NO_AREA, STATE_STACKED, MeshBody, join_vertices, mesh_body_of_triangles
from engine.collision.meshes.parity import INSIDE, OUTSIDE, locate_vertices
from engine.collision.meshes.touching import ONLY_TOUCHING, judge_contacts
from engine.collision.result import Witness, Work
from engine.solids.pose import Pose
from engine.types import UNDECIDED

_SAFE_POWER = 300
_BLOCK = 64


def simplest(
    first: MeshBody, first_pose: Pose | None, second: MeshBody, second_pose: Pose | None
) -> tuple[MeshBody, Pose | None, MeshBody, Pose | None]:
    """Return a placed pair that has the same relation: no pose for the identity, and posed bodies near the ends of the
    exponent range scaled by a power of two, where that is exact.

    Without poses the predicates scale by themselves; the filter for rounded posed coordinates does not.
    """
    first_pose, second_pose = (None if pose is None or pose.is_identity else pose for pose in (first_pose, second_pose))
    poses = [pose for pose in (first_pose, second_pose) if pose is not None]
    if not poses:
        return first, first_pose, second, second_pose
    shifts = [float(np.abs(pose.translation).max()) for pose in poses]
    largest = max(first.arrays.extent.reach, second.arrays.extent.reach, *shifts, 0.0)
    power = int(np.frexp(largest)[1])
    if abs(power) <= _SAFE_POWER or largest == 0.0:
        return first, first_pose, second, second_pose
    arrays = [first.arrays.vertices, second.arrays.vertices, *(pose.translation for pose in poses)]
    scaled = [np.ldexp(array, -power) for array in arrays]
    if any((np.ldexp(small, power) != array).any() for small, array in zip(scaled, arrays)):
        return first, first_pose, second, second_pose
    meshes = [
        mesh_body_of_triangles(vertices, mesh.arrays.triangles, mesh.faces, mesh.has_inside)
        for vertices, mesh in zip(scaled, (first, second))
    ]
    moved = [
        None if pose is None else Pose(pose.rotation, np.ldexp(pose.translation, -power))
        for pose in (first_pose, second_pose)
    ]
    return meshes[0], moved[0], meshes[1], moved[1]


def what_to_seek(first: MeshBody, second: MeshBody, work: Work) -> int:
    """Return what ends the search for contacts early."""
    if work.boolean or not (first.has_inside or second.has_inside):
        return SEEK_CONTACT
    if first.has_inside and second.has_inside:
        return SEEK_OVERLAP
    if not work.witness:
        return SEEK_CONTACT
    return SEEK_PIERCING_BY_SECOND if first.has_inside else SEEK_PIERCING_BY_FIRST


def met_by_face(contacts: IntArray, own: int) -> Iterator[tuple[int, IntArray]]:
    """Yield each face of a body in contacts (n, 2), ascending, with the faces of the other body that it meets."""
    order = np.argsort(contacts[:, own], kind="stable")
    faces, firsts = np.unique(contacts[order, own], return_index=True)
    yield from zip(faces.tolist(), np.split(contacts[order, 1 - own], firsts[1:]))


class MeshPair:
    """One question, and the exact coordinates computed for it so far."""

    def __init__(
        self, first: MeshBody, first_pose: Pose | None, second: MeshBody, second_pose: Pose | None, work: Work
    ) -> None:
        self.meshes = (first, second)
        self.poses = (first_pose, second_pose)
        self.posed = (first.posed(first_pose), second.posed(second_pose))
        self.work = work
        self.seek = what_to_seek(first, second, work)
        self._only_touch = False
        self._judged: tuple[IntArray, Int8Array] | None = None
        self._exact: tuple[ExactBody, ExactBody] | None = None

    @property
    def exact(self) -> tuple[ExactBody, ExactBody]:
        """Both bodies in exact coordinates."""
        if self._exact is None:
            self._exact = exact_pair(self.meshes[0], self.poses[0], self.meshes[1], self.poses[1])
        return self._exact

    def judge(self, contacts: IntArray, *, are_all: bool) -> int:
        """Say what contacts prove (`judge_contacts`), ONLY_TOUCHING once it is known; keep the kinds of the first."""
        kinds = np.full(min(N_NAMED, len(contacts)) if self.work.witness else 0, UNSETTLED, np.int8)
        self._judged = contacts, kinds
        (first, second), (a, b), flag = self.meshes, self.posed, self.work.budget.flag
        found = judge_contacts(
            first.arrays, a, second.arrays, b, contacts, are_all and not self._only_touch, kinds, flag
        )
        self._only_touch |= found == ONLY_TOUCHING
        self.work.budget.check()
        return ONLY_TOUCHING if self._only_touch else int(found)

    def named(self, contacts: IntArray, *, piercing: bool = False) -> Witness | None:
        """Return the strongest of the first contacts, of equal ones that of the first faces; None if none is asked."""
        if not self.work.witness:
            return None
        if self._judged is None or self._judged[0] is not contacts:
            self.judge(contacts, are_all=False)
        assert self._judged is not None
        kinds, found = self._judged[1].tolist(), []
        n = kinds.index(FACE_FACE) + 1 if FACE_FACE in kinds else len(kinds)
        for kind, (i, j) in zip(kinds[:n], contacts[:n].tolist()):
            if kind == UNSETTLED:
                self.work.budget.check()
                a, b = self.exact
                kind = STRENGTH.index(kind_of_contact(a.corners(i), b.corners(j), a.plane(i), b.plane(j)))
            found.append((kind, int(self.meshes[0].faces[i]), int(self.meshes[1].faces[j])))
        kind, first_face, second_face = min(found)
        return Witness(STRENGTH[kind], first_face, second_face, "", piercing)

    def states(self, own: int, faces: IntArray) -> Int8Array:
        return states_of(self.meshes[own].arrays, faces)

    def state(self, own: int, face: int) -> int:
        return int(self.states(own, np.array([face]))[0])

    def patches(self, own: int, in_contact: IntArray, place: int) -> list[IntArray]:
        """Return the patches (connected faces without contact) of one body that lie INSIDE or OUTSIDE the other."""
        mesh, other = self.meshes[own], self.meshes[1 - own]
        if not other.has_inside:
            return []
        triangles = mesh.arrays.triangles
        left_out = np.zeros(len(triangles), np.bool_)
        left_out[in_contact] = True
        parent = np.empty(len(mesh.arrays.vertices), np.int64)
        join_vertices(triangles, left_out, parent)
        kept = np.flatnonzero(~left_out)
        roots = parent[triangles[kept, 0]]
        vertices = np.unique(roots)
        found = self.located(own, vertices)
        for index in np.flatnonzero(found == UNDECIDED):
            self.work.budget.check()
            self.work.n_beyond_filter += 1
            self.work.n_rational += 1
            point = self.exact[own].vertex(int(vertices[index]))
            found[index] = INSIDE if sides_at(self.exact[1 - own], (*point, 1), 2).at else OUTSIDE
        return [kept[roots == vertex] for vertex in vertices[found == place]]

    def sides_beside(self, own: int, patch: IntArray) -> Iterator[Sides]:
        """Yield the status of a body beside each region of a patch of it; one that changes across a face says all."""
        body = self.exact[own]
        with_area = patch[body.mesh.arrays.axis[patch] != NO_AREA]
        for start in range(0, len(with_area), _BLOCK):
            self.work.budget.check()
            if (self.states(own, with_area[start : start + _BLOCK]) != STATE_STACKED).any():
                yield Sides(True, False, False)
                return
        for face in with_area.tolist():
            for q in regions_of(body, face, [body], self.work.budget):
                yield sides_at(body, q, body.axis(face))

    def located(self, own: int, vertices: IntArray) -> Int8Array:
        """Return where vertices that are on no face of the other body lie: INSIDE, OUTSIDE or UNDECIDED."""
        mesh, other = self.meshes[own], self.meshes[1 - own]
        found = np.empty(len(vertices), np.int8)
        posed, theirs = self.posed[own], self.posed[1 - own]
        locate_vertices(mesh.arrays, posed, vertices, other.arrays, theirs, found, self.work.budget.flag)
        self.work.budget.check()
        return found
