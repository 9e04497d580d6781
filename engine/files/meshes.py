"""Mesh files through trimesh, which is installed with the extra ``formats``."""

from __future__ import annotations

import logging
from typing import IO, Final

import numpy as np

from engine.errors import EmptyGeometryError, InvalidInputError
from engine.solids.base import FloatArray, IntArray
from engine.solids.polyhedron import Polyhedron

FORMATS: Final = ("stl", "obj", "ply", "off", "glb")


def read_polyhedron(file: IO[bytes], file_format: str) -> Polyhedron:
    """Return the polyhedron that a mesh file describes, with the checks and the errors of its constructor.

    Vertices at equal coordinates become one, as everywhere; nothing else is repaired. Coordinates are those of the
    file: decimals become the nearest double, single precision is exact in double. The meshes of a GLB scene are put
    together; a node's transform is applied in floating point, so that its coordinates are rounded once.
    Raises: InvalidInputError for another format, a file that cannot be read, or where trimesh is not installed.
    """
    vertices, faces = read_mesh(file, file_format)
    return Polyhedron(vertices, faces)


def read_mesh(file: IO[bytes], file_format: str) -> tuple[FloatArray, IntArray]:
    """Return vertices ``(n, 3)`` and triangles ``(m, 3)`` of a mesh file; see `read_polyhedron`."""
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
        scene = trimesh.load_scene(file, file_type=file_format, process=False, maintain_order=True, skip_materials=True)
        mesh = scene.to_mesh()
    except Exception as error:  # the parsers raise whatever the bytes lead them to
        raise InvalidInputError(
            f"the file cannot be read as {file_format}: {type(error).__name__}: {error}", ("file",)
        ) from error
    if not len(mesh.faces):
        raise EmptyGeometryError(f"the {file_format} file holds no faces", ("file",))
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
