"""Files of meshes to solids, through trimesh (the optional extra `formats`), which only reads; the engine checks."""

from __future__ import annotations

import importlib.util
import io
from typing import Any, Literal

import numpy as np

import engine
from service.errors import ServiceError
from service.work import Call

Format = Literal["stl", "obj", "ply", "off", "glb"]


def to_solid(octets: bytes | bytearray, kind: Format, solid_type: str, call: Call) -> engine.Solid:
    """Return the polyhedron or surface in a file; coordinates are those of the file, as float64.

    STL and GLB hold float32; the nodes of a GLB may move their meshes, and that is rounded.
    """
    with call.phase("decode"):
        vertices, faces = _read(octets, kind)
        vertices, merged = _merged(np.asarray(vertices, np.float64))
    with call.phase("prepare"):
        make = engine.Polyhedron if solid_type == "polyhedron" else engine.Surface
        return make(vertices, merged[np.asarray(faces, np.int64)])


def _read(octets: bytes | bytearray, kind: Format) -> tuple[Any, Any]:
    if importlib.util.find_spec("trimesh") is None:
        raise ServiceError("invalid_mesh", "files of meshes are read where the extra 'formats' is installed")
    import trimesh

    # resolver and remote stay unset: nothing that a file names is read
    with io.BytesIO(octets) as file, np.errstate(all="ignore"):
        try:
            mesh = trimesh.load_mesh(file, file_type=kind, process=False, skip_materials=True)
            vertices, faces = mesh.vertices, mesh.faces
        except MemoryError:
            raise
        except Exception as error:  # trimesh raises whatever a broken file leads to
            detail = f"the body cannot be read as {kind}: {type(error).__name__}: {error!s:.200}"
            raise ServiceError("invalid_mesh", detail) from None
    if not len(faces):
        raise ServiceError("invalid_mesh", f"no faces were found in the body, read as {kind}")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ServiceError("invalid_mesh", f"a face names a vertex beyond the {len(vertices)} there are")
    return vertices, faces


def _merged(vertices: Any) -> tuple[Any, Any]:
    """Return the vertices at different coordinates in their first order, and for each given vertex its new index."""
    _, first, inverse = np.unique(vertices + 0.0, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return vertices[first[order]], rank[inverse.reshape(-1)]
