"""Files of meshes to solids: the engine reads and checks them."""

from __future__ import annotations

import io
from typing import Literal

import engine
from service.errors import ServiceError
from service.work import Call

Format = Literal["stl", "obj", "ply", "off", "glb"]


def to_solid(octets: bytes | bytearray, kind: Format, solid_type: str, call: Call) -> engine.Solid:
    """Return the polyhedron or surface in a file."""
    with call.phase("decode"), io.BytesIO(octets) as file:
        try:
            vertices, faces = engine.read_mesh(file, kind)
        except engine.InvalidInputError as error:
            raise ServiceError("invalid_mesh", error.message) from None
    with call.phase("prepare"):
        make = engine.Polyhedron if solid_type == "polyhedron" else engine.Surface
        return make(vertices, faces)
