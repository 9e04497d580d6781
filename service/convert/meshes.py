"""Files of meshes to solids: the engine reads and checks them."""

from __future__ import annotations

from typing import Literal

import engine
from service import mesh_reader
from service.work import Call

Format = Literal["stl", "obj", "ply", "off", "glb"]


def to_solid(octets: bytes | bytearray, kind: Format, solid_type: str, call: Call) -> engine.Solid:
    """Return the polyhedron or surface in a file."""
    with call.phase("decode"):
        vertices, faces = mesh_reader.read(octets, kind, call)
    with call.phase("prepare"):
        make = engine.Polyhedron if solid_type == "polyhedron" else engine.Surface
        return make(vertices, faces)
