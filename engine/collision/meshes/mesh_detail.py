"""Which of two overlapping meshes sticks out of the other, and whether their boundaries meet: exact, face by face.

A body A sticks out of B if A's open interior meets the outside of B. Both are open and bounded by faces, so the border
of what they share has a piece with area on some face of either body: beside it, on one side, A is inside and B is not.

1. A crossing that proves overlapping (`face_state.py`) shows all four combinations around it: partial overlap.
2. Faces without contact, in patches, have one status of the other body on both sides.
3. Each face in contact is cut into regions; either side of each region tells (`exact_regions.py`). A face with nothing
   of the other body beside it but faces of its own plane is one region.

The search ends as soon as each body is known to stick out.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.collision.meshes.exact_regions import Sides, points_within, regions_of, sides_at, sides_over
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, MeshBody, mesh_body_of
from engine.collision.meshes.mesh_pair import MeshPair, unless_identity
from engine.collision.meshes.parity import INSIDE, OUTSIDE
from engine.collision.meshes.pose_batch import DETAIL, OPPOSITE, SAME_SIDE
from engine.collision.result import Parts, Poses, Work
from engine.solids.base import Solid

_BOTH, _NEITHER = Sides(True, True, True), Sides(False, False, False)
_ABOVE, _BELOW = Sides(True, False, False), Sides(False, True, False)


def mesh_parts(first: Solid, second: Solid, poses: Poses, work: Work) -> Parts:
    """Return what of two overlapping polyhedra or boxes lies outside the other."""
    with np.errstate(all="ignore"):  # kernels, where they run uncompiled
        a, b, poses = mesh_body_of(first), mesh_body_of(second), unless_identity(poses)
        if poses == (None, None) and _have_equal_faces(a, b):
            return Parts(False, False, True)
        return _OverlappingPair(a, b, poses, Work(work.budget, witness=False), DETAIL).parts()


def _have_equal_faces(first: MeshBody, second: MeshBody) -> bool:
    """Tell whether two meshes have the same triangles, in any order and orientation."""
    if first is second:
        return True
    if len(first.faces) != len(second.faces) or first.arrays.extent.reach != second.arrays.extent.reach:
        return False
    return bool((_sorted_faces(first) == _sorted_faces(second)).all())


def _sorted_faces(mesh: MeshBody) -> FloatArray:
    """Return the triangles (n, 9), corners in ascending order, rows too."""
    corners = mesh.arrays.vertices[mesh.arrays.triangles]
    order = np.lexsort(tuple(np.moveaxis(corners, 2, 0)[::-1]), axis=1)
    rows = np.take_along_axis(corners, order[:, :, None], axis=1).reshape(-1, 9)
    return rows[np.lexsort(rows.T[::-1])]


class _OverlappingPair(MeshPair):
    """Two bodies whose open interiors are known to meet, and which of them has been seen to stick out."""

    def parts(self) -> Parts:
        """Return the answer; what is not needed for it is left out."""
        self._sticks_out = [False, False]
        self.find_contacts()
        if self.is_settled:  # by a crossing: overlapping is known
            return Parts(True, True, True)
        self._search(self.contacts)
        first, second = self._sticks_out
        return Parts(first, second, len(self.contacts) > 0)

    def _search(self, contacts: IntArray) -> None:
        for own in (0, 1):
            for place, theirs in ((INSIDE, _BOTH), (OUTSIDE, _NEITHER)):
                for patch in self.patches(own, contacts[:, own], place):
                    for ours in self.sides_beside(own, patch):
                        self._see(own, ours, theirs)
                    if all(self._sticks_out):
                        return
        for own in (0, 1):
            order = np.argsort(contacts[:, own], kind="stable")
            faces, firsts = np.unique(contacts[order, own], return_index=True)
            for face, kinds in zip(faces.tolist(), np.split(self.kinds[order], firsts[1:])):
                self.work.budget.check()
                self._see_face(own, face, set(kinds.tolist()))
                if all(self._sticks_out):
                    return

    def _see(self, own: int, ours: Sides, theirs: Sides) -> None:
        """Take note of what lies on either side of a region of body `own`."""
        for mine, other in ((ours.above, theirs.above), (ours.below, theirs.below)):
            if mine and not other:
                self._sticks_out[own] = True
            if other and not mine:
                self._sticks_out[1 - own] = True

    def _see_face(self, own: int, face: int, kinds: set[int]) -> None:
        """Take note of what lies beside a face whose contacts are of some kinds (`in_detail`)."""
        body, other = self.exact[own], self.exact[1 - own]
        axis = body.axis(face)
        if axis < 0:
            return
        is_clean = self.state(own, face) == STATE_CLEAN
        is_cut = any(kind < SAME_SIDE and kind >> own & 1 for kind in kinds)
        if is_clean and not is_cut:  # one region, and its own body on one side of it: call that above
            if not kinds.isdisjoint((SAME_SIDE, OPPOSITE)):
                self._see(own, _ABOVE, _ABOVE if SAME_SIDE in kinds else _BELOW)
                return
            for q in points_within(body.corners(face)):
                theirs = sides_over(other, q, axis, body.plane(face))
                if theirs is not None and theirs.above == theirs.below:
                    self._see(own, _ABOVE, theirs)
                    return
        for q in regions_of(body, face, [other] if is_clean else [other, body], self.work.budget):
            self._see(own, sides_at(body, q, axis), sides_at(other, q, axis))
            if all(self._sticks_out):
                return
