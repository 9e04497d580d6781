"""Indexed meshes: the common base of polyhedra and surfaces.

A mesh stores the faces as given, and triangles whose indices point to the first vertex at each position, so that two
faces share an edge if and only if they have the same two indices there. A mesh of triangles without repeated positions,
the common case, has one array for both.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, pairwise
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from engine.bounding.trees import MANY
from engine.compiling.jit import entry_of
from engine.errors import (
    InconsistentOrientationError,
    IndexOutOfRangeError,
    InvalidArrayError,
    NotClosedError,
    RepeatedIndexError,
    RingTooShortError,
)
from engine.running.budget import Budget, Cancel, poll
from engine.solids.base import Solid
from engine.solids.checks import as_nested_offsets, as_points, check_not_empty, digits, frozen, shown
from engine.solids.ear_cutting import cut_faces
from engine.solids.mesh_checks import check_topology
from engine.solids.pictures import svg_of_mesh
from engine.types import FloatArray, IntArray, read_only

_BLOCK: Final = 1 << 15
"""Number of faces in a list that are checked between two polls of the deadline."""
_N_NAMED: Final = 3  # edges that a message names


class Mesh(Solid):
    """Base of `Polyhedron` and `Surface`; 3D."""

    __slots__ = ("_face_offsets", "_triangle_faces", "_triangles", "face_indices", "vertices")

    vertices: FloatArray
    """``(n, 3)``: as given."""
    face_indices: IntArray
    """The vertex indices of all faces as given, one face after another."""
    _must_close: ClassVar[bool] = False
    _pickled: ClassVar[tuple[str, ...]] = ("vertices", "_face_offsets", "face_indices")
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
        given, indices = as_faces(faces, len(points))
        budget.check()
        offsets = np.arange(0, len(indices) + 1, 3) if given is None else given
        merged = np.empty(len(indices), np.int64)
        named = np.full((_N_NAMED, 5), -1)
        i_face, n_different, n_odd, n_turned = entry_of(check_topology)(
            points.view(np.uint64), offsets, indices, self._must_close, merged, named, budget.flag
        )
        budget.check()
        if i_face >= 0:
            raise _repeated_index(i_face, indices[offsets[i_face] : offsets[i_face + 1]])
        triangles, triangle_faces = indices if n_different == len(points) else merged, None
        if n_odd + n_turned > 0:
            raise _unbalanced_edges(points, indices, named, n_odd, n_turned)
        if given is not None:
            triangles, triangle_faces = cut_faces(points, offsets, indices, triangles, budget)
        for array in (given, indices, triangles, triangle_faces):
            if array is not None:
                array.setflags(write=False)
        self._set(
            dimension=3,
            vertices=points,
            face_indices=indices,
            _face_offsets=given,
            _triangles=None if triangles is indices else triangles,
            _triangle_faces=triangle_faces,
        )

    @classmethod
    def restored(cls, *values: Any) -> Mesh:
        vertices, offsets, indices = values
        if offsets is not None:
            (offsets,) = as_nested_offsets(len(indices), face_offsets=offsets)
        if offsets is None or (np.diff(offsets) == 3).all():
            return cls(vertices, indices.reshape(-1, 3))
        return cls(vertices, [indices[start:stop].tolist() for start, stop in pairwise(offsets.tolist())])

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

    def _repr_svg_(self) -> str:
        return svg_of_mesh(self.vertices, self.triangles)


def as_faces(faces: object, n_vertices: int) -> tuple[IntArray | None, IntArray]:
    """Return the offsets of the faces (None: all are triangles) and their vertex indices, one face after another.
    faces: an integer array ``(m, k)``, or a list of lists of whole numbers, three or more each. Raises:
    InvalidArrayError, EmptyGeometryError, RingTooShortError, IndexOutOfRangeError.
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
    indices = np.array(flat if flat.dtype != object else flat.clip(-1, n_vertices), np.int64)
    if indices.view(np.uint64).max() >= n_vertices:  # negative numbers are the largest
        position = int(np.argmax(indices.view(np.uint64) >= n_vertices))
        i_face, i_corner = _place(offsets, position)
        raise IndexOutOfRangeError(
            f"faces[{i_face}][{i_corner}] is {shown(int(flat[position]))}, "
            f"but the vertices are numbered 0 to {n_vertices - 1}",
            ("faces", i_face, i_corner),
        )
    return offsets, indices


def _flatten(faces: Sequence[Any]) -> tuple[IntArray, npt.NDArray[Any]]:
    """Return the number of corners of each face in a list, and the vertex indices of all faces, one after another.
    Raises InvalidArrayError for an index that is no whole number."""
    parts = []
    for first in range(0, len(faces) or 1, _BLOCK):
        poll()
        parts.append(_flatten_some(faces[first : first + _BLOCK], first))
    if len(parts) == 1:
        return parts[0]
    return np.concatenate([counts for counts, _ in parts]), np.concatenate([indices for _, indices in parts])


def _flatten_some(faces: Sequence[Any], first: int) -> tuple[IntArray, npt.NDArray[Any]]:
    """Return the numbers of corners, and the vertex indices, of some faces of a list, whose first has number `first`
    there."""
    rows = faces
    if not set(map(type, faces)) <= {list, tuple}:
        rows = [face.tolist() if isinstance(face, np.ndarray) else face for face in faces]
        for i_face, face in enumerate(rows, first):
            if not isinstance(face, (list, tuple)):
                raise InvalidArrayError(
                    f"faces[{i_face}] must be a list of vertex indices, got {shown(face)}", ("faces", i_face)
                )
    counts = np.array(list(map(len, rows)), np.int64)
    items = list(chain.from_iterable(rows))
    if not set(map(type, items)) <= {int}:
        for i_face, face in enumerate(rows, first):
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
    """Return (face, corner in that face) for a position in the flat list of vertex indices. offsets: of faces, None if
    all are triangles."""
    if offsets is None:
        return position // 3, position % 3
    i_face = int(np.searchsorted(offsets, position, side="right")) - 1
    return i_face, position - int(offsets[i_face])


def first_equal(points: FloatArray) -> IntArray | None:
    """Return for each point the first index with equal coordinates; None if all differ. points: (n, 3) float64 without
    -0.0.
    """
    n = len(points)
    every, first = np.arange(n), np.empty(n, np.int64)
    one_face, no_flag = np.array([0, n]), np.zeros(1, np.uint8)
    none = np.empty((0, 5), np.int64)
    n_different = entry_of(check_topology)(points.view(np.uint64), one_face, every, False, first, none, no_flag)[1]
    return None if n_different == n else first


def _repeated_index(i_face: int, face: IntArray) -> RepeatedIndexError:
    """Return the error for a face that has a vertex twice."""
    values, counts = np.unique(face, return_counts=True)
    return RepeatedIndexError(
        f"faces[{i_face}] = {shown(face.tolist(), 200)} names vertex {int(values[counts > 1][0])} more than once; "
        "leave the face out or split it there",
        ("faces", i_face),
    )


def _unbalanced_edges(
    vertices: FloatArray, indices: IntArray, named: IntArray, n_odd: int, n_turned: int
) -> NotClosedError | InconsistentOrientationError:
    """Return the error for edges that are not used equally often in both directions, with some of these. indices:
    vertex at each corner; named: filled by `check_topology`; n_odd, n_turned: its two counts."""
    kind: type[NotClosedError | InconsistentOrientationError]
    if n_odd > 0:
        kind, n, claim = NotClosedError, n_odd, "are open"
        advice = "close the mesh, or use a surface for collision only"
    else:
        kind, n, claim = InconsistentOrientationError, n_turned, "are not used equally often in both directions"
        advice = "turn the faces that run the wrong way"
    lines = [
        f"edge {indices[corner]}-{indices[following]} of face {face}, "
        f"from {digits(vertices[indices[corner]])} to {digits(vertices[indices[following]])}, "
        f"used {forth} times in this direction and {back} in the other"
        for face, corner, following, forth, back in named[named[:, 0] >= 0].tolist()
    ]
    more = "; ..." if n > len(lines) else ""
    return kind(f"{n} edges {claim}: {'; '.join(lines)}{more}; {advice}", ("faces", int(named[0, 0])))


def is_large(first: Solid, second: Solid | None = None) -> bool:
    """Return whether any of these is a mesh whose trees may be built on threads: of many face corners, which are at
    hand, unlike its triangles."""
    is_first = isinstance(first, Mesh) and len(first.face_indices) >= MANY
    return is_first or (isinstance(second, Mesh) and len(second.face_indices) >= MANY)


class Polyhedron(Mesh):
    """All points from which a ray crosses the faces an odd number of times, and the faces themselves; 3D.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Vertices at equal coordinates count as one; vertices that no face names are kept and mean nothing.
    faces : array_like of int, shape (m, k), or list of index lists
        Three or more each, counter-clockwise seen from outside.
    deadline : float, optional
        Seconds; no limit by default.
    cancel : Cancel, optional
        A switch with which another thread ends the call.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError
        For arrays that break a rule.
    RingTooShortError, IndexOutOfRangeError, RepeatedIndexError, NotClosedError, InconsistentOrientationError
        For faces that break a rule; the message names the face or edge.
    FaceNotSimpleError
        A face of four or more vertices crosses itself in its projection, or has two vertices at one position.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Closed: each undirected edge is used equally often in both directions. Non-manifold, self-intersecting and globally
    inverted shells are accepted, and so are triangles of zero area with three different indices (also where two of them
    stand at one position).

    Faces of more than three vertices are cut into triangles by the rule of `engine.solids.ear_cutting`; the solid is
    the one bounded by those triangles.

    Boundary: the points on any face, even on one that another face cancels under even-odd.

    Cost: linear in vertices and edges, a face of n vertices is cut in n^2 at most: 1,000 in some milliseconds. 1.4
    million triangles take about a second and 36 bytes each, vertices included.

    Examples
    --------
    >>> Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    Polyhedron(4 vertices, 4 faces)
    """

    __slots__ = ()

    type: ClassVar[str] = "polyhedron"
    _must_close: ClassVar[bool] = True

    @classmethod
    def of_arrays(cls, vertices: FloatArray, triangles: IntArray) -> Polyhedron:
        """Return a polyhedron of these arrays without a copy or checks. triangles: (m, 3). Caller guarantees that they
        are read-only, have no -0.0, and close by index with three different vertices each."""
        first = first_equal(vertices)
        indices = triangles.reshape(-1)
        merged = None if first is None else read_only(first[indices])
        polyhedron = object.__new__(cls)
        polyhedron._set(
            dimension=3, vertices=vertices, face_indices=indices, _face_offsets=None, _triangles=merged,
            _triangle_faces=None,
        )  # fmt: skip
        return polyhedron


class Surface(Mesh):
    """The faces themselves, open or closed, in any orientation; nothing is inside. For collision and bounds; 3D.

    Parameters
    ----------
    vertices, faces, deadline, cancel
        As for `Polyhedron`, whose checks it shares but for closedness.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, EmptyGeometryError
        For arrays that break a rule.
    RingTooShortError, IndexOutOfRangeError, RepeatedIndexError, FaceNotSimpleError
        For faces that break a rule; the message names the face.
    DeadlineExceededError, CancelledError
        The call was ended.

    Examples
    --------
    >>> Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]).triangles.tolist()
    [[3, 0, 1], [3, 1, 2]]
    """

    __slots__ = ()

    type: ClassVar[str] = "surface"


def used_by_faces(mesh: Mesh) -> tuple[FloatArray, IntArray]:
    """Return the vertices (n, 3) of a mesh that its faces use, and its triangles by their numbers."""
    vertices, triangles = mesh.vertices, mesh.triangles
    used = np.zeros(len(vertices), np.bool_)
    used[triangles] = True
    return (vertices, triangles) if used.all() else (vertices[used], (np.cumsum(used) - 1)[triangles])
