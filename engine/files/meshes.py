"""Meshes from files: STL, OBJ, OFF and PLY by readers of our own, GLB through trimesh (extra ``formats``)."""

from __future__ import annotations

import io
import logging
import re
from collections.abc import Callable
from importlib import import_module
from itertools import chain
from typing import IO, Any, Final, NamedTuple, TypeVar, overload

import numpy as np

from engine.errors import (
    EmptyGeometryError,
    EngineError,
    FaceNotSimpleError,
    IndexOutOfRangeError,
    InvalidInputError,
    RingTooShortError,
)
from engine.files.octets import File, read_octets
from engine.files.ply import read_ply
from engine.running.budget import UNLIMITED, polled
from engine.solids.checks import as_points, frozen, shown
from engine.solids.ear_cutting import cut_faces
from engine.solids.mesh import Mesh, Polyhedron, first_equal
from engine.types import FloatArray, IntArray

FORMATS: Final = ("stl", "obj", "ply", "off", "glb")
_SOUPS: Final = ("stl",)
"""Formats of triangles without numbers of vertices."""
_BY_TRIMESH: Final = ("glb",)
_STL_HEAD: Final = 84
_STL_TRIANGLE: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
_STL_NAME: Final = re.compile(rb"^[ \t]*(?:end)?solid\b[^\r\n]*", re.MULTILINE | re.IGNORECASE)
_STL_VERTEX: Final = re.compile(rb"\bvertex\s+([^\s_]+)\s+([^\s_]+)\s+([^\s_]+)", re.IGNORECASE)
_STL_END: Final = re.compile(rb"\bendfacet\b", re.IGNORECASE)
M = TypeVar("M", bound=Mesh)
_ELEMENT: Final = re.compile(rb"^[ \t]*([vf])(?=\s|\Z)([^\n#]*)", re.MULTILINE)
"""The lines of an OBJ file that define vertices and faces."""
_OFF: Final = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:ST)?C?N?OFF\b")
"""The first word of an OFF file, whose rows of vertices may go on with textures, colours and normals."""
_HEAD: Final = 1 << 16
"""Bytes in which an OFF file has its first word, after comments."""
_BEYOND: Final = (-(2**63), 2**63 - 1)
_TEXTURE_AND_NORMAL: Final = re.compile(rb"/\S*")
"""The texture and normal numbers after that of a vertex."""


class _Arrays(NamedTuple):
    vertices: FloatArray
    faces: IntArray


class MeshOfFile(_Arrays):
    """Vertices and triangles, ``Polyhedron(*mesh)``; `solid` makes one too, and its errors speak of the file.

    n_collapsed: triangles that are left out, because two of their corners are at equal coordinates, though not by their
    numbers. faces_in_file, vertices_in_file: by triangle the number of its face in the file, and by vertex its own,
    counted from 0; of a format without numbers of vertices, triangle k has the vertices 3 k to 3 k + 2.
    """

    n_collapsed: int = 0
    faces_in_file: IntArray
    vertices_in_file: IntArray
    _is_soup: bool

    @overload
    def solid(self) -> Polyhedron: ...
    @overload
    def solid(self, kind: type[M]) -> M: ...
    def solid(self, kind: Any = Polyhedron) -> Any:
        """Return the polyhedron or `Surface`; raises as these, naming triangles and vertices as in the file."""
        try:
            return kind(*self)
        except InvalidInputError as error:
            names = {"faces": self.faces_in_file, "vertices": self.vertices_in_file}
            what, *place = error.where or ("",)
            if what in names and place:
                error.where = (what, int(names[str(what)][int(place[0])]), *place[1:])
            text = re.sub(r"(?<=\bfaces\[)\d+|(?<=\bface )\d+", lambda m: str(names["faces"][int(m[0])]), error.message)
            text = re.sub(r"\bedge (\d+)-(\d+) of face", self._edge, text)
            error.message = re.sub(r"\bvertices\[(\d+)\]", self._vertex, text)
            error.args = (error.message,)
            raise

    def _edge(self, match: re.Match[str]) -> str:
        first, second = (self.vertices_in_file[int(number)] for number in match.groups())
        return "an edge of face" if self._is_soup else f"edge {first}-{second} of face"

    def _vertex(self, match: re.Match[str]) -> str:
        number = int(self.vertices_in_file[int(match[1])])
        return f"face {number // 3}, corner {number % 3}" if self._is_soup else f"vertices[{number}]"


def read_mesh(file: File, file_format: str | None = None) -> MeshOfFile:
    r"""Return the vertices and the triangles of a mesh file, for `Polyhedron` or `Surface`, which check them.

    Parameters
    ----------
    file : path, file object or bytes
        A path as a string or `pathlib.Path`; or open for reading bytes, or the bytes.
    file_format : {"stl", "obj", "ply", "off", "glb"}, optional
        By default that of the path's ending, else that of the first bytes. glb needs trimesh (extra `formats`).

    Returns
    -------
    MeshOfFile
        A tuple of vertices ``(n, 3) float64`` and indices of them ``(m, 3) int64``. Its `n_collapsed` is how many
        triangles are left out; its `solid()` makes the polyhedron.

    Raises
    ------
    InvalidInputError
        Another format, a file that is not there or cannot be read, or trimesh is not installed.
    EmptyGeometryError
        A file without faces.
    IndexOutOfRangeError, RingTooShortError
        A face names a vertex that does not exist, or fewer than three.
    FaceNotSimpleError, NotFiniteError
        A polygon that cannot be cut into triangles.

    Notes
    -----
    Vertices at equal coordinates become one, in the order of the file. Triangles of which that makes two corners one
    are left out and counted: small ones far from the origin, rounded to single precision, are such. Closed meshes stay
    closed, since two edges of each become one, there and back, and the third none; of a polygon such sides are left
    out. Nothing else is repaired. Polygons are cut into triangles as the constructors do it. No other file that the
    file names is read.

    Accuracy: coordinates are those of the file: decimals become the nearest double, single precision is exact in
    double. The meshes of a GLB scene are put together; a node's transform is applied in floating point, so that its
    coordinates are rounded once.

    Cost: linear.

    References
    ----------
    trimesh reads GLB; the STL format is that of 3D Systems, 1989, PLY that of G. Turk, 1994.

    Examples
    --------
    >>> from engine import read_mesh
    >>> lines = b"OFF", b"4 4 0", b"0 0 0", b"1 0 0", b"0 1 0", b"0 0 1", b"3 0 2 1", b"3 0 1 3", b"3 1 2 3", b"3 0 3 2"
    >>> vertices, faces = read_mesh(b"\n".join(lines))
    >>> vertices.shape, faces.shape
    ((4, 3), (4, 3))
    """
    octets, suffix = read_octets(file)
    if file_format is None:
        file_format = suffix if suffix in FORMATS else _format_of(octets)
    if not isinstance(file_format, str) or file_format not in FORMATS:
        raise InvalidInputError(f"format must be one of {', '.join(FORMATS)}, got {shown(file_format)}", ("format",))
    try:
        trimesh = import_module("trimesh") if file_format in _BY_TRIMESH else None
    except ImportError:
        raise InvalidInputError(
            f"{file_format} files need the package trimesh: pip install 'exact-geometry[formats]'", ("format",)
        ) from None
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # its warnings about repairs that we do not ask for
    try:
        if file_format in _READERS:
            vertices, faces = _READERS[file_format](io.BytesIO(octets))
        elif trimesh is not None:
            with np.errstate(all="ignore"):
                scene = trimesh.load_scene(
                    io.BytesIO(octets), file_type=file_format, process=False, maintain_order=True, skip_materials=True
                )
                mesh = scene.to_mesh()
                vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except (MemoryError, EngineError):  # the deadline of `inspect`
        raise
    except Exception as error:  # the parsers raise whatever the bytes lead them to
        raise InvalidInputError(
            f"the file cannot be read as {file_format}: {type(error).__name__}: {error!s:.200}", ("file",)
        ) from error
    if not len(faces):
        raise EmptyGeometryError(f"the {file_format} file holds no faces", ("file",))
    return _merge_vertices(vertices, *_triangulate(vertices, faces), file_format)


def _format_of(octets: bytes) -> str:
    """Return the format that the first bytes of a file tell, obj for a text that is none of the others."""
    octets = octets.removeprefix(b"\xef\xbb\xbf")
    head = octets[:512].lstrip()
    if octets[:2] == b"\x1f\x8b":
        raise InvalidInputError("the file is compressed (gzip); unpack it first", ("file",))
    if octets[:4] == b"glTF":
        return "glb"
    if head[:3] == b"ply":
        return "ply"
    if _OFF.match(re.sub(rb"#[^\r\n]*", b"", octets[:_HEAD])):
        return "off"
    is_text = b"\0" not in octets[:512]
    return "stl" if head[:5].lower() == b"solid" or not is_text else "obj"


def _read_stl(file: IO[bytes]) -> tuple[FloatArray, IntArray]:
    """Return the corners of the triangles of an STL file, three each, and these triangles.

    A binary file has as many bytes as its number of triangles says, whatever its header begins with.
    """
    octets = file.read()
    n = int.from_bytes(octets[80:84], "little")
    if len(octets) == _STL_HEAD + n * _STL_TRIANGLE.itemsize:
        vertices = np.frombuffer(octets, _STL_TRIANGLE, n, _STL_HEAD)["corners"].reshape(-1, 3).astype(np.float64)
    else:
        octets = octets.removeprefix(b"\xef\xbb\xbf")
        if octets.lstrip()[:5].lower() != b"solid" or b"\0" in octets[:_STL_HEAD]:
            raise ValueError(f"a binary file of {n} triangles has {_STL_HEAD + 50 * n} bytes, this one {len(octets)}")
        *facets, rest = _STL_END.split(_STL_NAME.sub(b"", re.sub(rb"\r\n?", b"\n", octets)))
        corners = [_STL_VERTEX.findall(facet) for facet in polled(facets)]
        if rest.strip() or any(len(three) != 3 for three in corners):
            raise ValueError("a facet has three corners `vertex x y z` and ends with `endfacet`")
        vertices = np.array([[[*map(float, row)] for row in three] for three in polled(corners)]).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _read_obj(file: IO[bytes]) -> tuple[FloatArray, list[list[int]]]:
    """Return vertices and faces of an OBJ file, negative indices counted from the last vertex before the face."""
    vertices, faces = list[list[bytes]](), list[list[int]]()
    text = re.sub(rb"\r\n?", b"\n", file.read()).removeprefix(b"\xef\xbb\xbf").replace(b"\\\n", b" ")
    for element in polled(_ELEMENT.finditer(text)):
        kind, fields = element.groups()
        if b"_" in fields:
            raise ValueError(f"{fields[:40]!r} are no numbers")
        if kind == b"v":
            vertices.append(fields.split()[:3])
            continue
        if b"/" in fields:
            fields = _TEXTURE_AND_NORMAL.sub(b"", fields)
        corners = [*map(int, fields.split())]
        if len(corners) < 3 or min(corners) < 1:
            given, n = corners, len(vertices) + 1
            corners = [number + n if number < 0 else number for number in given]
            if len(corners) < 3 or min(corners) < 1 or 0 in given:
                raise ValueError(
                    f"face {len(faces)} has the corners {given!s:.100}; it needs three or more, from 1, or from -1 for "
                    f"the last of {len(vertices)} vertices before it"
                )
        faces.append(corners)
    if not all(len(row) == 3 for row in vertices):
        raise ValueError("a vertex has fewer than three coordinates")
    numbers = np.fromiter(map(float, polled(chain.from_iterable(vertices))), np.float64)
    return numbers.reshape(-1, 3), [[number - 1 for number in face] for face in polled(faces)]


def _read_off(file: IO[bytes]) -> tuple[FloatArray, list[list[int]]]:
    """Return vertices and faces of an OFF file."""
    text = re.sub(rb"#[^\r\n]*", b"", file.read())
    head = _OFF.match(text)
    if head is None or b"_" in text:
        raise ValueError("it begins with OFF, perhaps after ST, C or N, and has numbers alone")
    text = text[head.end() :]
    (n_vertices, n_faces, *_), *rows = [[*row.split()] for row in polled(text.splitlines()) if row.strip()]
    n, m = int(n_vertices), int(n_faces)
    if n < 0 or m < 0:
        raise ValueError(f"it says that it has {n} vertices and {m} faces")
    vertices = np.array([row[:3] for row in rows[:n]], np.float64).reshape(n, 3)
    faces = [[*map(int, row)] for row in polled(rows[n : n + m])]
    if len(faces) < m or not all(2 < row[0] < len(row) for row in faces):
        raise ValueError(f"expected {m} faces, each the number of its corners, 3 or more, and these")
    return vertices, [row[1 : row[0] + 1] for row in faces]


_READERS: Final[dict[str, Callable[[IO[bytes]], tuple[FloatArray, Any]]]] = {
    "obj": _read_obj,
    "off": _read_off,
    "stl": _read_stl,
    "ply": read_ply,
}
"""Formats that are not left to trimesh, which cuts polygons as fans, also those that are not convex."""


def _triangulate(vertices: FloatArray, faces: Any) -> tuple[IntArray, IntArray]:
    """Return the triangles of faces, cut like in the constructors (ear_cutting.py), and the face of each."""
    if isinstance(faces, np.ndarray):
        counts, numbers, indices = np.full(len(faces), faces.shape[1]), np.arange(len(faces)), faces.ravel()
    else:
        counts, numbers = np.fromiter(map(len, polled(faces)), np.int64), np.arange(len(faces))
        try:
            indices = np.fromiter(chain.from_iterable(polled(faces)), np.int64)
        except OverflowError:
            low, high = _BEYOND
            indices = np.fromiter((max(low, min(index, high)) for face in faces for index in face), np.int64)
    if counts.min() < 3:
        face = int(np.argmax(counts < 3))
        raise RingTooShortError(f"face {face} of the file has {counts[face]} corners; a face needs 3", ("file",))
    if len(beyond := np.flatnonzero((indices < 0) | (indices >= len(vertices)))):
        face = int(np.searchsorted(np.cumsum(counts), beyond[0], "right"))
        raise IndexOutOfRangeError(
            f"face {face} names vertex {indices[beyond[0]]}, the file holds {len(vertices)}; correct the file",
            ("file",),
        )
    if counts.max() == 3 == counts.min():
        return indices.reshape(-1, 3), numbers
    points = frozen(as_points(vertices, 3, ("vertices",)))
    first, owners = first_equal(points), np.repeat(numbers, counts)
    merged = indices if first is None else first[indices]
    ends = np.cumsum(counts)
    following = np.arange(1, len(indices) + 1)
    following[ends - 1] = ends - counts
    is_zero_edge = (merged == merged[following]) & (indices != indices[following]) & (counts[owners] > 3)
    left = np.flatnonzero(~is_zero_edge)
    left = left[np.bincount(owners[left], minlength=len(faces))[owners[left]] > 2]
    numbers, counts = np.unique(owners[left], return_counts=True)
    offsets = np.append(np.int64(0), np.cumsum(counts))
    try:
        triangles, cut_from = cut_faces(points, offsets, indices[left], indices[left], UNLIMITED)
    except FaceNotSimpleError as error:
        face = int(numbers[int(error.where[1])])
        error.message = error.message.replace(f"faces[{error.where[1]}]", f"faces[{face}]", 1)
        error.where, error.args = ("faces", face), (error.message,)
        raise
    return triangles.reshape(-1, 3), numbers[cut_from]


def _merge_vertices(vertices: FloatArray, faces: IntArray, numbers: IntArray, file_format: str) -> MeshOfFile:
    """Return the vertices without duplicates, by first occurrence, and the faces that this does not collapse."""
    n_faces, remaining = len(faces), np.arange(len(faces))
    first, originals = first_equal(frozen(vertices)), np.arange(len(vertices))
    if first is not None:
        is_first = first == originals
        merged = (np.cumsum(is_first) - 1)[first][faces]
        remaining = np.flatnonzero(~_has_equal(merged) | _has_equal(faces))
        vertices, faces, originals = vertices[is_first], merged[remaining], np.flatnonzero(is_first)
    if not len(remaining):
        raise EmptyGeometryError(
            f"all triangles of the {file_format} file have two equal corners; write it with more digits", ("file",)
        )
    made = MeshOfFile(vertices, faces)
    made.n_collapsed, made.faces_in_file, made.vertices_in_file = (
        n_faces - len(remaining),
        numbers[remaining],
        originals,
    )
    made._is_soup = file_format in _SOUPS
    return made


def _has_equal(faces: IntArray) -> Any:
    """Return by triangle whether two of its corners are one vertex."""
    return (faces == np.roll(faces, 1, axis=1)).any(axis=1)
