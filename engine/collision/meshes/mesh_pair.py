"""Two placed meshes in one query: contacts, exact coordinates, states of faces, locations of vertices."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np

from engine.collision.codes import KIND, N_COLUMNS, N_CONTACTS, UNSETTLED
from engine.collision.meshes import dual_traversal as dual
from engine.collision.meshes.contact_kinds import N_NAMED, N_SIGNS, STRENGTH
from engine.collision.meshes.exact_body import ExactBody, classify_exact, exact_pair, kind_of_contact
from engine.collision.meshes.exact_regions import Sides, regions_of, sides_at
from engine.collision.meshes.mesh_arrays import NO_AREA, STATE_CLEAN, STATE_STACKED, MeshBody, join_vertices
from engine.collision.meshes.parity import INSIDE, OUTSIDE, locate_vertices, state_at, states_of
from engine.collision.meshes.placement import PoseArrays
from engine.collision.meshes.pose_batch import ONE_SETTLES, relate_poses
from engine.collision.meshes.triangle_triangle import APART, CROSSING
from engine.collision.result import Poses, Witness, Work
from engine.compiling.jit import entry_of
from engine.lanes.boxes import FRAME_ROWS
from engine.lanes.faces import WORK_ROWS
from engine.lanes.tracing import LANES
from engine.types import UNDECIDED, Int8Array, IntArray

_BLOCK = 64


def new_descent() -> dual.Descent:
    """Allocate the work space of one search."""
    frames, work = np.empty((2, FRAME_ROWS, LANES), np.float32), np.empty((WORK_ROWS, LANES), np.float32)
    return dual.Descent(
        np.empty((dual.STACK_ROWS, 2), np.int32), frames, work, np.zeros((2, 12)), np.zeros(N_SIGNS, np.int8)
    )


def new_contacts(room: int, n_faces: int = 0) -> dual.Contacts:
    """Allocate room for pairs of faces in contact. n_faces: number of faces of both bodies together if the pairs with
    only a corner in common are to be selected, 0 if all pairs are listed."""
    n = room + (N_NAMED if n_faces else 0)
    return dual.Contacts(np.full((n, 2), -1), np.empty(n, np.int8), np.zeros(n_faces, np.bool_))


class _WorkSpace(threading.local):
    """Work space of kernel calls, one for each thread."""

    def __init__(self) -> None:
        self.descent, self.contacts, self.rows = (
            new_descent(),
            new_contacts(dual.ROOM),
            np.empty((1, N_COLUMNS), np.int64),
        )
        self.row = self.rows[0]


PosedPair = tuple[PoseArrays, PoseArrays]
"""The poses of both bodies, in the form that kernels take."""
SPACE = _WorkSpace()


def unless_identity(poses: Poses) -> Poses:
    """Return both poses, None in place of a pose that is the identity."""
    a, b = poses
    return None if a is None or a.is_identity else a, None if b is None or b.is_identity else b


def relate(
    first: MeshBody, second: MeshBody, posed: PosedPair, seek: int, work: Work, known: dual.Contacts | None = None,
    n_named: int | None = None,
) -> tuple[list[int], dual.Contacts]:  # fmt: skip
    """Return the row (N_COLUMNS,) of `relate_poses` for two posed meshes, and their contacts, valid until the thread's
    next call. seek: goal of the search (SEEK_...); known: contacts and their classes if computed already, so that no
    search runs; n_named: number of contacts from which the witness is chosen, None: as `work` requests. The room for
    contacts is enlarged until all fit."""
    contacts, n_known = (SPACE.contacts, 0) if known is None else (known, len(known.kinds))
    n_named = (N_NAMED if work.witness else 0) if n_named is None else n_named
    room = len(contacts.kinds)
    while True:  # bound: each turn has more room
        entry_of(relate_poses)(
            first.arrays, second.arrays, *posed, seek, n_named, SPACE.descent, contacts, n_known,
            SPACE.rows, work.budget.flag,
        )  # fmt: skip
        row: list[int] = SPACE.row.tolist()
        n = row[N_CONTACTS]
        if n <= room:
            return row, contacts
        work.budget.check()
        room = 16 * n
        contacts = new_contacts(room, len(first.faces) + len(second.faces))


def search_goal(first: MeshBody, second: MeshBody, work: Work) -> int:
    """Return the goal (SEEK_...) at which the search for contacts may end early, given what `work` requests."""
    own, their = first.arrays.has_inside, second.arrays.has_inside
    if own and their and not work.boolean:
        return dual.SEEK_OVERLAP
    if work.boolean or not (work.witness and (own or their)):
        return dual.SEEK_CONTACT
    return dual.SEEK_PIERCING_BY_SECOND if own else dual.SEEK_PIERCING_BY_FIRST


class MeshPair:
    """One query about two meshes: kernel results, and the exact coordinates computed so far.

    | field | meaning |
    |---|---|
    | row | row of `relate_poses` |
    | is_settled | whether one contact decided the query |
    | contacts | (n, 2) faces of either body in contact, in order; if is_settled, the decisive pair alone |
    | kinds | (n,) their classes, or what `relate_poses` writes in their place |
    """

    def __init__(self, first: MeshBody, second: MeshBody, poses: Poses, work: Work, n_named: int | None = None) -> None:
        self.meshes = (first, second)
        self.n_named = n_named
        self.poses = poses
        self.posed = (first.posed(poses[0]), second.posed(poses[1]))
        self.work = work
        self.seek = search_goal(first, second, work)
        self._exact: tuple[ExactBody, ExactBody] | None = None

    @property
    def exact(self) -> tuple[ExactBody, ExactBody]:
        """Both bodies in integer coordinates, made at first use."""
        if self._exact is None:
            self._exact = exact_pair(*self.meshes, self.poses)
        return self._exact

    def find_contacts(self, seen: tuple[list[int], dual.Contacts] | None = None) -> None:
        """Compute all contacts, their classes exact. seen: the row and contacts that `relate` returned, if it has run
        for the pair."""
        self.row, room = seen or relate(*self.meshes, self.posed, self.seek, self.work, n_named=self.n_named)
        self.work.budget.check()
        n, self.is_settled = abs(self.row[N_CONTACTS]), self.row[N_CONTACTS] == ONE_SETTLES
        self.contacts, self.kinds = room.pairs[:n].copy(), room.kinds[:n].copy()
        self.work.n_beyond_filter += n
        if not self.is_settled and (self.kinds == UNDECIDED).any():
            self._settle_classes(self.kinds)

    def _settle_classes(self, kinds: Int8Array) -> None:
        """Decide exactly those classes in kinds (n,) that kernels left UNDECIDED, drop pairs of faces that are APART,
        and relate the pair again by the remaining contacts. Stops at a contact that decides the query (is_settled)."""
        open_ones = np.flatnonzero(kinds == UNDECIDED)
        self.work.n_rational += len(open_ones)
        a, b = self.exact
        for index in open_ones.tolist():
            self.work.budget.check()
            i, j = self.contacts[index].tolist()
            kinds[index] = classify_exact(a.corners(i), b.corners(j))
            if kinds[index] != APART and self._is_settled_by(int(kinds[index]), i, j):
                self.contacts, self.is_settled = self.contacts[index : index + 1], True
                return
        self.contacts, self.kinds = self.contacts[kinds != APART], kinds[kinds != APART]
        if len(self.kinds):
            room = dual.Contacts(self.contacts, self.kinds, np.empty(0, np.bool_))
            self.row, _ = relate(*self.meshes, self.posed, self.seek, self.work, room, self.n_named)
            self.work.budget.check()

    def _is_settled_by(self, kind: int, i: int, j: int) -> bool:
        """Return whether a contact of faces i and j of an exact class `kind` decides the query: the rule of
        `dual_traversal.is_decisive`."""
        if self.seek == dual.SEEK_CONTACT:
            return True
        if kind != CROSSING:
            return False
        first, second = self.state(0, i), self.state(1, j)
        if self.seek == dual.SEEK_PIERCING_BY_FIRST:
            return second == STATE_CLEAN
        if self.seek == dual.SEEK_PIERCING_BY_SECOND:
            return first == STATE_CLEAN
        return STATE_CLEAN in (first, second) and STATE_STACKED not in (first, second)

    def named(self, *, piercing: bool = False) -> Witness | None:
        """Return the witness: the strongest of the first N_NAMED contacts, among equals that of the lowest faces; None
        if not requested. piercing: the value of `Witness.piercing`."""
        if not self.work.witness:
            return None
        best = tuple(self.row[KIND:N_CONTACTS])
        if best[0] == UNSETTLED:
            a, b = self.exact
            candidates = []
            for i, j in self.contacts[:N_NAMED].tolist():
                self.work.budget.check()
                kind = kind_of_contact(a.corners(i), b.corners(j))
                candidates.append((STRENGTH.index(kind), int(self.meshes[0].faces[i]), int(self.meshes[1].faces[j])))
                if kind == "face_face":
                    break
            best = min(candidates)
        return Witness(STRENGTH[best[0]], best[1], best[2], "", piercing)

    def state(self, own: int, face: int) -> int:
        """Return the state (STATE_...) of a face of body `own`."""
        return state_at(self.meshes[own].arrays, face)

    def patches(self, own: int, in_contact: IntArray, place: int) -> list[IntArray]:
        """Return the patches (faces without contact, connected through vertices) of body `own` that lie at ``place`` in
        the other body, INSIDE or OUTSIDE, each as an array of faces. in_contact: the faces of `own` in contact. None
        lie anywhere if the other body has no inside."""
        mesh, other = self.meshes[own], self.meshes[1 - own]
        if not other.has_inside:
            return []
        triangles = mesh.arrays.triangles
        left_out = np.zeros(len(triangles), np.bool_)
        left_out[in_contact] = True
        parent = np.empty(len(mesh.arrays.vertices), np.int64)
        join_vertices(triangles, left_out, parent)
        free_faces = np.flatnonzero(~left_out)
        roots = parent[triangles[free_faces, 0]]
        vertices = np.unique(roots)
        locations = np.empty(len(vertices), np.int8)
        posed, theirs = self.posed[own], self.posed[1 - own]
        locate_vertices(mesh.arrays, posed, vertices, other.arrays, theirs, locations, self.work.budget.flag)
        self.work.budget.check()
        for index in np.flatnonzero(locations == UNDECIDED):
            self.work.budget.check()
            self.work.n_beyond_filter += 1
            self.work.n_rational += 1
            point = self.exact[own].vertex(int(vertices[index]))
            locations[index] = INSIDE if sides_at(self.exact[1 - own], (*point, 1), 2).at else OUTSIDE
        return [free_faces[roots == vertex] for vertex in vertices[locations == place]]

    def patch_sides(self, own: int, patch: IntArray) -> Iterator[Sides]:
        """Yield the `Sides` of body `own` (inside just above, just below, at) at each region of a patch, an array of
        its faces. If some face is not STATE_STACKED (covered by another face of its plane), the patch separates inside
        from outside throughout: then one result, with one side inside, is yielded for all of it."""
        body = self.exact[own]
        with_area = patch[body.mesh.arrays.axis[patch] != NO_AREA]
        for start in range(0, len(with_area), _BLOCK):
            self.work.budget.check()
            if (states_of(body.mesh.arrays, with_area[start : start + _BLOCK]) != STATE_STACKED).any():
                yield Sides(True, False, False)
                return
        for face in with_area.tolist():
            for q in regions_of(body, face, [body], self.work.budget):
                yield sides_at(body, q, body.axis(face))
