"""Meshes from files, through trimesh, which is installed with the extra ``formats``."""

from __future__ import annotations

import io
import logging
import re
from typing import IO, Any, Final, NamedTuple, TypeVar

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.errors import EmptyGeometryError, IndexOutOfRangeError, InvalidInputError
from engine.solids.checks import frozen, shown
from engine.solids.mesh import Mesh, first_equal
from engine.solids.polyhedron import Polyhedron

FORMATS: Final = ("stl", "obj", "ply", "off", "glb")
_SOUPS: Final = ("stl",)
"""Formats of triangles without numbers of vertices."""
M = TypeVar("M", bound=Mesh)
_NAMES: Final = re.compile(rb"^[ \t]*(?:g|o|s|usemtl|mtllib)(?:[ \t][^\r\n]*)?$", re.MULTILINE)
"""Lines of an OBJ file that say nothing of its shape: trimesh's time grows with their number squared."""
_ELEMENT: Final = re.compile(rb"^[ \t]*([vf])[ \t]+([^\r\n]*)", re.MULTILINE)
_ODD: Final = re.compile(
    rb"^[ \t]*f[ \t](?:[^\r\n#]*[ \t])?(?:-|0+(?=[/\s]|\Z))|^[ \t]*f(?:[ \t]+[^\s\\]+){0,2}[ \t]*(?=[\r\n#]|\Z)",
    re.MULTILINE,
)
"""Lines of an OBJ file that trimesh reads as something else: indices from 0 down, faces of fewer than three corners."""


class _Arrays(NamedTuple):
    vertices: FloatArray
    faces: IntArray


class MeshOfFile(_Arrays):
    """Vertices and triangles, ``Polyhedron(*mesh)``; `solid` makes one too, and its errors speak of the file.

    n_collapsed: triangles that are left out, because two of their corners are at equal coordinates, though not by their
    numbers. faces_in_file, vertices_in_file: by triangle and by vertex its number in the file, in which triangles are
    counted from 0 and, of a format without numbers of vertices, triangle k has the vertices 3 k to 3 k + 2.
    """

    n_collapsed: int = 0
    faces_in_file: IntArray
    vertices_in_file: IntArray
    _is_soup: bool

    def solid(self, kind: type[M] = Polyhedron) -> M:  # type: ignore[assignment]
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


def read_mesh(file: IO[bytes] | bytes, file_format: str) -> MeshOfFile:
    """Return the vertices and the triangles of a mesh file, for `Polyhedron` or `Surface`, which check them.

    Vertices at equal coordinates become one, in the order of the file. Triangles of which that makes two corners one
    are left out and counted: rounded to single precision, small ones far from the origin are such, and closed meshes
    stay closed, since two edges of each become one, there and back, and the third none. Nothing else is repaired, and
    polygons are cut into triangles. Nothing that the file names is read.

    Parameters: file: open for reading bytes, or the bytes; file_format: stl, obj, ply, off or glb.
    Returns: vertices ``(n, 3) float64`` and indices of them ``(m, 3) int64``, as a tuple; its `n_collapsed` says how
    many triangles are left out, its `solid()` makes the polyhedron.
    Accuracy: coordinates are those of the file: decimals become the nearest double, single precision is exact in
    double. The meshes of a GLB scene are put together; a node's transform is applied in floating point, so that its
    coordinates are rounded once.
    Raises: InvalidInputError for another format, a file that cannot be read, or where trimesh is not installed;
    EmptyGeometryError for a file without faces; IndexOutOfRangeError where a face names a vertex that is not there.
    """
    if not isinstance(file_format, str) or file_format not in FORMATS:
        raise InvalidInputError(f"format must be one of {', '.join(FORMATS)}, got {shown(file_format)}", ("format",))
    if isinstance(file, (bytes, bytearray, memoryview)):
        file = io.BytesIO(file)
    if not callable(getattr(file, "read", None)):
        raise InvalidInputError(f"file must be open for reading bytes, or be bytes, got {shown(file)}", ("file",))
    try:
        import trimesh
    except ImportError:
        raise InvalidInputError(
            "mesh files need the package trimesh: pip install 'exact-geometry[formats]'", ("format",)
        ) from None
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # its warnings about repairs that we do not ask for
    try:
        if file_format == "obj":
            file = io.BytesIO(_counted(_NAMES.sub(b"", file.read())))
        with np.errstate(all="ignore"):
            scene = trimesh.load_scene(
                file, file_type=file_format, process=False, maintain_order=True, skip_materials=True
            )
            mesh = scene.to_mesh()
            vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except MemoryError:
        raise
    except Exception as error:  # the parsers raise whatever the bytes lead them to
        raise InvalidInputError(
            f"the file cannot be read as {file_format}: {type(error).__name__}: {error!s:.200}", ("file",)
        ) from error
    if not len(faces):
        raise EmptyGeometryError(f"the {file_format} file holds no faces", ("file",))
    if len(beyond := np.argwhere((faces < 0) | (faces >= len(vertices)))):
        face, corner = beyond[0].tolist()
        raise IndexOutOfRangeError(
            f"triangle {face} names vertex {faces[face, corner]}, the file holds {len(vertices)}; correct the file",
            ("file",),
        )
    return _merged(vertices, faces, file_format)


def _counted(text: bytes) -> bytes:
    """Return an OBJ file with its relative indices counted, from the last vertex before the face; ValueError for faces
    that are none. trimesh counts from the end of the file, takes 0 for 1, and drops faces of fewer than three corners.
    """
    if _ODD.search(text) is None:
        return text
    n_vertices = n_faces = 0

    def rewritten(match: re.Match[bytes]) -> bytes:
        nonlocal n_vertices, n_faces
        if match[1] == b"v":
            n_vertices += 1
            return match[0]
        given = [int(corner.partition(b"/")[0]) for corner in match[2].partition(b"#")[0].split()]
        corners = [n_vertices + 1 + number if number < 0 else number for number in given]
        if len(corners) < 3 or min(corners) < 1 or 0 in given:
            raise ValueError(
                f"face {n_faces} has the corners {given!s:.100}; it needs three or more, from 1, or from -1 for the "
                f"last of {n_vertices} vertices before it"
            )
        n_faces += 1
        return b"f " + b" ".join(b"%d" % number for number in corners)

    return _ELEMENT.sub(rewritten, text.replace(b"\\\r\n", b" ").replace(b"\\\n", b" "))


def _merged(vertices: FloatArray, faces: IntArray, file_format: str) -> MeshOfFile:
    """Return the vertices at different coordinates in their first order, and the faces with their new indices but for
    those that this collapses."""
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
    made.n_collapsed, made.faces_in_file, made.vertices_in_file = n_faces - len(remaining), remaining, originals
    made._is_soup = file_format in _SOUPS
    return made


def _has_equal(faces: IntArray) -> Any:
    """Tell of each triangle whether two of its corners are one vertex."""
    return (faces == np.roll(faces, 1, axis=1)).any(axis=1)
