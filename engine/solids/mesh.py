"""Vertices and faces by index: what polyhedra and surfaces share.

Faces are kept as the caller gave them; beside them stand triangles whose indices point to the first vertex at each
position, so that two faces meet along an edge exactly when they name the same two indices there. A mesh of triangles
without repeated positions, the common case, keeps one array for both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from engine.arrays import FloatArray, IntArray, read_only
from engine.errors import IndexOutOfRangeError, InvalidArrayError, RepeatedIndexError, RingTooShortError
from engine.parallel import Budget, Cancel
from engine.solids.base import Solid
from engine.solids.checks import as_points, check_not_empty, frozen, shown
from engine.solids.ear_cutting import cut_faces
from engine.solids.sound_triangles import MOST_CORNERS, MOST_VERTICES, are_sound


class Mesh(Solid):
    """Base of `Polyhedron` and `Surface`; 3D."""

    __slots__ = ("_face_offsets", "_triangle_faces", "_triangles", "face_indices", "vertices")

    vertices: FloatArray
    """``(n, 3)``: as given."""
    face_indices: IntArray
    """The vertex indices of all faces as given, one face after another."""
    _must_close: ClassVar[bool] = False
    _face_offsets: IntArray | None  # None: every face is a triangle
    _triangles: IntArray | None  # None: `face_indices`, three by three
    _triangle_faces: IntArray | None  # None: triangle i is face i

    def __init__(
        self, vertices: object, faces: object, *, deadline: float | None = None, cancel: Cancel | None = None
    ) -> None:
        with Budget(deadline, cancel) as budget:
            self._fill(vertices, faces, budget)

    def _fill(self, vertices: object, faces: object, budget: Budget) -> None:
        budget.check()
        points = as_points(vertices, 3, ("vertices",))
        check_not_empty(len(points), "vertex", ("vertices",))
        budget.check()
        points = frozen(points)
        offsets, indices = as_faces(faces, len(points))
        triangles, triangle_faces = indices, None
        if offsets is not None or not self._is_small_and_sound(points, indices):
            budget.check()
            check_repeated_indices(offsets, indices)
            budget.check()
            first_equal = first_equal_points(points)
            triangles = merged = indices if first_equal is None else first_equal[indices]
            budget.check()
            self._check_faces(points, offsets, indices, merged)
            budget.check()
            if offsets is not None:
                triangles, triangle_faces = cut_faces(points, offsets, indices, merged, budget)
        for array in (offsets, indices, triangles, triangle_faces):
            if array is not None:
                array.setflags(write=False)
        self._set(
            dimension=3,
            vertices=points,
            face_indices=indices,
            _face_offsets=offsets,
            _triangles=None if triangles is indices else triangles,
            _triangle_faces=triangle_faces,
        )

    def _is_small_and_sound(self, points: FloatArray, indices: IntArray) -> bool:
        """Tell whether these are few triangles without any fault or equal points: no other check is needed then."""
        if len(points) > MOST_VERTICES or len(indices) > MOST_CORNERS:
            return False
        return bool(are_sound(points, indices, self._must_close))

    def _check_faces(self, vertices: FloatArray, offsets: IntArray | None, indices: IntArray, merged: IntArray) -> None:
        """Raise if the faces break an invariant of this kind of mesh."""

    @property
    def n_faces(self) -> int:
        """Number of faces as given."""
        return len(self.face_indices) // 3 if self._face_offsets is None else len(self._face_offsets) - 1

    @property
    def face_offsets(self) -> IntArray:
        """``(n_faces + 1,)``: face i has the vertices ``face_indices[face_offsets[i] : face_offsets[i + 1]]``."""
        if self._face_offsets is not None:
            return self._face_offsets
        return self.prepared("face_offsets", lambda: read_only(np.arange(0, len(self.face_indices) + 1, 3)))

    @property
    def triangles(self) -> IntArray:
        """``(k, 3)``: indices into `vertices`, the first index wherever several vertices have equal coordinates."""
        flat = self.face_indices if self._triangles is None else self._triangles
        return flat.reshape(-1, 3)

    @property
    def triangle_faces(self) -> IntArray:
        """``(k,)``: the face that each triangle was cut from."""
        if self._triangle_faces is not None:
            return self._triangle_faces
        return self.prepared("triangle_faces", lambda: read_only(np.arange(len(self.triangles))))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self.vertices)} vertices, {self.n_faces} faces)"


def as_faces(faces: object, n_vertices: int) -> tuple[IntArray | None, IntArray]:
    """Return the offsets of the faces (None: all triangles) and their vertex indices, one face after another.

    faces: an integer array ``(m, k)`` or a list of lists of whole numbers, three or more each.
    Raises: InvalidArrayError, EmptyGeometryError, RingTooShortError, IndexOutOfRangeError.
    """
    counts: IntArray | None
    if isinstance(faces, (list, tuple)):
        counts, flat = _flatten(faces)
    else:
        array = faces if isinstance(faces, np.ndarray) else np.asarray(faces)
        if isinstance(array, np.ma.MaskedArray):
            raise InvalidArrayError("faces is a masked array; drop the masked faces first", ("faces",))
        if array.dtype.kind not in "iu" or array.ndim != 2:
            raise InvalidArrayError(
                "faces must be an array (n_faces, n) of an integer dtype or a list of lists of whole numbers, "
                f"got dtype {array.dtype} and shape {array.shape}",
                ("faces",),
            )
        flat = array.ravel()
        counts = None if array.shape[1] == 3 else np.full(array.shape[0], array.shape[1], np.int64)
    check_not_empty(len(flat) if counts is None else len(counts), "face", ("faces",))
    offsets = None
    if counts is not None:
        if counts.min() < 3:
            i_face = int(np.argmax(counts < 3))
            raise RingTooShortError(
                f"faces[{i_face}] has {counts[i_face]} vertices; a face needs at least 3", ("faces", i_face)
            )
        offsets = None if counts.max() == 3 else np.append(np.int64(0), np.cumsum(counts))
    if flat.min() < 0 or flat.max() >= n_vertices:
        position = int(np.argmax((flat < 0) | (flat >= n_vertices)))
        i_face, i_corner = _place(offsets, position)
        raise IndexOutOfRangeError(
            f"faces[{i_face}][{i_corner}] is {shown(int(flat[position]))}, "
            f"but the vertices are numbered 0 to {n_vertices - 1}",
            ("faces", i_face, i_corner),
        )
    return offsets, np.array(flat, np.int64)


def _flatten(faces: Sequence[Any]) -> tuple[IntArray, npt.NDArray[Any]]:
    """Return the number of corners of each face and all indices; every index must be a whole number."""
    rows = [face.tolist() if isinstance(face, np.ndarray) else face for face in faces]
    for i_face, face in enumerate(rows):
        if not isinstance(face, (list, tuple)):
            raise InvalidArrayError(
                f"faces[{i_face}] must be a list of vertex indices, got {shown(face)}", ("faces", i_face)
            )
    counts = np.array([len(face) for face in rows], np.int64)
    items = [index for face in rows for index in face]
    if not set(map(type, items)) <= {int}:
        for i_face, face in enumerate(rows):
            for i_corner, index in enumerate(face):
                if isinstance(index, (bool, np.bool_)) or not isinstance(index, (int, np.integer)):
                    raise InvalidArrayError(
                        f"faces[{i_face}][{i_corner}] must be a whole number, got {shown(index)} "
                        f"({type(index).__name__})",
                        ("faces", i_face, i_corner),
                    )
    try:
        return counts, np.array(items, np.int64)
    except OverflowError:
        return counts, np.array(items, object)  # out of range: the caller names it


def _place(offsets: IntArray | None, position: int) -> tuple[int, int]:
    """Return the face and the corner in it that stand at `position` in the list of all indices."""
    if offsets is None:
        return position // 3, position % 3
    i_face = int(np.searchsorted(offsets, position, side="right")) - 1
    return i_face, position - int(offsets[i_face])


def check_repeated_indices(offsets: IntArray | None, indices: IntArray) -> None:
    """Raise if a face names one vertex twice."""
    if offsets is None:
        a, b, c = indices[0::3], indices[1::3], indices[2::3]
        is_repeated = (a == b) | (b == c) | (c == a)
        if not is_repeated.any():
            return
        i_face = int(np.argmax(is_repeated))
        face = indices[3 * i_face : 3 * i_face + 3]
    else:
        faces = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        order = np.lexsort((indices, faces))
        is_same = (faces[order][1:] == faces[order][:-1]) & (indices[order][1:] == indices[order][:-1])
        if not is_same.any():
            return
        i_face = int(faces[order][int(np.argmax(is_same))])
        face = indices[offsets[i_face] : offsets[i_face + 1]]
    values, counts = np.unique(face, return_counts=True)
    raise RepeatedIndexError(
        f"faces[{i_face}] = {_shortened(face.tolist())} names vertex {int(values[counts > 1][0])} more than once; "
        "leave the face out or split it there",
        ("faces", i_face),
    )


def _shortened(items: list[int]) -> str:
    return repr(items) if len(items) <= 12 else repr(items[:12])[:-1] + ", ...]"


def first_equal_points(points: FloatArray) -> IntArray | None:
    """Return for each point the first index with equal coordinates; None if no two points are equal.

    points: ``(n, 3)`` without -0.0, so that equal means equal bits. Sorts a 64-bit mix of the bits, then compares the
    neighbours in full; should two different points ever mix to one value, all coordinates are sorted instead.
    """
    bits = points.view(np.uint64)
    mixed = _mix(bits)
    order = np.argsort(mixed, kind="stable")
    is_same = mixed[order][1:] == mixed[order][:-1]
    if not is_same.any():
        return None
    is_equal = (points[order][1:] == points[order][:-1]).all(axis=1)
    if (is_same != is_equal).any():
        order = np.lexsort(bits.T)
        is_equal = (points[order][1:] == points[order][:-1]).all(axis=1)
    starts = np.flatnonzero(np.append(True, ~is_equal))
    first = np.empty(len(points), np.int64)
    first[order] = np.repeat(order[starts], np.diff(np.append(starts, len(points))))
    return first


def _mix(bits: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Return one number for each row ``(n, 3)``, seldom the same for two different rows."""
    mixed = bits[:, 0] * np.uint64(0x9E3779B97F4A7C15)  # odd constants of splitmix64; products wrap around
    for column in range(1, bits.shape[1]):
        mixed ^= mixed >> np.uint64(29)
        mixed = (mixed + bits[:, column]) * np.uint64(0xBF58476D1CE4E5B9)
    return mixed
