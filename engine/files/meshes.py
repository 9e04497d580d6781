"""Mesh files through trimesh, which is installed with the extra ``formats``."""

from __future__ import annotations

import io
import logging
import re
from typing import IO, Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.errors import EmptyGeometryError, IndexOutOfRangeError, InvalidInputError
from engine.solids.checks import frozen
from engine.solids.mesh import first_equal

FORMATS: Final = ("stl", "obj", "ply", "off", "glb")


_NAMES: Final = re.compile(rb"^[ \t]*(?:g|o|s|usemtl|mtllib)(?:[ \t][^\r\n]*)?$", re.MULTILINE)
"""Lines of an OBJ file that say nothing of its shape: trimesh's time grows with their number squared."""


def read_mesh(file: IO[bytes], file_format: str) -> tuple[FloatArray, IntArray]:
    """Return the vertices and the triangles of a mesh file, for `Polyhedron` or `Surface`, which check them.

    Vertices at equal coordinates become one, in the order of the file; nothing else is repaired, and polygons are cut
    into triangles. Nothing that the file names is read.

    Parameters: file: open for reading bytes; file_format: stl, obj, ply, off or glb.
    Returns: vertices ``(n, 3) float64`` and indices of them ``(m, 3) int64``.
    Accuracy: coordinates are those of the file: decimals become the nearest double, single precision is exact in
    double. The meshes of a GLB scene are put together; a node's transform is applied in floating point, so that its
    coordinates are rounded once.
    Raises: InvalidInputError for another format, a file that cannot be read, or where trimesh is not installed;
    EmptyGeometryError for a file without faces; IndexOutOfRangeError where a face names a vertex that is not there.
    """
    if file_format not in FORMATS:
        raise InvalidInputError(f"format must be one of {', '.join(FORMATS)}, got {file_format!r}", ("format",))
    try:
        import trimesh
    except ImportError:
        raise InvalidInputError(
            "mesh files need the package trimesh: pip install 'exact-geometry[formats]'", ("format",)
        ) from None
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # its warnings about repairs that we do not ask for
    try:
        if file_format == "obj":
            file = io.BytesIO(_NAMES.sub(b"", file.read()))
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
    return _merged(vertices, faces)


def _merged(vertices: Any, faces: Any) -> tuple[FloatArray, IntArray]:
    """Return the vertices at different coordinates in their first order, and the faces with their new indices."""
    first = first_equal(frozen(vertices))
    if first is None:
        return vertices, faces
    is_first = first == np.arange(len(first))
    return vertices[is_first], (np.cumsum(is_first) - 1)[first][faces]
