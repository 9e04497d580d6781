"""Raw float64 and files of meshes to arrays and solids; answers and their accuracy to raw numbers and a header."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final, Literal, cast

import numpy as np
from starlette import responses

import engine
from service import body, mesh_reader
from service.body import FILES, MULTIPART, fields_of
from service.convert.answers import from_accuracy
from service.errors import ServiceError
from service.work import Call


class Response(responses.Response):
    """Names the media type in the OpenAPI document."""

    media_type = "application/octet-stream"


def to_rows(octets: Any, shape: tuple[int, ...]) -> Any:
    """Return `octets` as float64 of shape ``(n, *shape)``; a view where the machine is little-endian."""
    width = 8 * math.prod(shape)
    if len(octets) % width:
        raise engine.InvalidArrayError(
            f"the body has {len(octets)} bytes; expected a multiple of {width}: rows of {math.prod(shape)} float64"
        )
    return np.frombuffer(octets, "<f8").astype(np.float64, copy=False).reshape(-1, *shape)


def answer(call: Call, array: Any, accuracy: engine.Accuracy, more: dict[str, int] | None = None) -> Any:
    """Return `array`, with its accuracy in a header, and more: a dictionary of structured fields (RFC 8941)."""
    members = {name: value for name, value in vars(from_accuracy(accuracy)).items() if value is not None}
    members |= more or {}
    call.headers["Geometry-Accuracy"] = ", ".join(f"{name}={value}" for name, value in members.items())
    return array


def check_is_convex(region: engine.Solid) -> engine.Solid:
    """Return `region` if a segment has at most one piece in it for certain."""
    rows = sorted(engine.solid_types.values(), key=lambda row: row.planes is None)  # those of planes first
    taken = [row.name for row in rows if row.is_convex]
    if region.type not in taken:
        raise engine.UnsupportedSolidError(
            f"a {region.type} may leave several pieces of a segment; here are taken: {', '.join(taken)}; "
            "POST /v1/clip/segments takes the others"
        )
    return region


def from_pieces(pieces: engine.SegmentPieces, n_segments: int, dimension: int, call: Call) -> Any:
    """Return both ends of the piece of each segment, NaN if it has none."""
    call.take(16 * n_segments * dimension)
    ends = np.full((n_segments, 2, dimension), np.nan)
    ends[pieces.source, 0] = pieces.start
    ends[pieces.source, 1] = pieces.end
    return ends


Format = Literal["stl", "obj", "ply", "off", "glb"]
_FILE: Final = {"type": "string", "format": "binary"}
_FORM: Final = {
    "type": "object",
    "description": "A form with a file, as `curl -F file=@bunny.stl` sends it.",
    "properties": {
        "file": {**_FILE, "description": "The mesh; its format by the ending of its name, else by its first bytes."},
        "type": {"type": "string", "enum": ["polyhedron", "surface"], "description": "polyhedron, if left out."},
    },
    "required": ["file"],
}
FILES_IN: Final = {**{kind: {"schema": _FILE} for kind in FILES}, MULTIPART: {"schema": _FORM}}
"""The files that are taken in place of JSON. The OpenAPI document names them beside the body: with two media types of a
body some generators make clients that do not run."""

FILES_OUT: Final = {kind: {"schema": _FILE} for kind in body.FILES_OUT}
"""The files that a call answers with in place of JSON, by the header Accept."""
_ROWS: Final = 4096
_PLY: Final = """ply
format binary_little_endian 1.0
element vertex {}
property double x
property double y
property double z
element face {}
property list uchar int vertex_indices
end_header
"""
_FACET: Final = "facet normal {!r} {!r} {!r}\nouter loop\n" + 3 * "vertex {!r} {!r} {!r}\n" + "endloop\nendfacet\n"


def mesh_file(vertices: Any, faces: Any, call: Call) -> Iterator[bytes]:
    """Yield a file of triangles in parts; every coordinate reads back as the same double, STL is text for that."""
    call.media_type, n = call.file or "", len(faces)
    if call.file == "model/ply":
        yield _PLY.format(len(vertices), n).encode()
        yield vertices.astype("<f8").tobytes()
        rows = np.empty(n, [("n", "u1"), ("corners", "<i4", 3)])
        rows["n"], rows["corners"] = 3, faces
        yield rows.tobytes()
    elif call.file == "model/off":
        yield f"OFF\n{len(vertices)} {n} 0\n".encode()
        for start in range(0, len(vertices), _ROWS):
            yield "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in vertices[start : start + _ROWS].tolist()).encode()
        for start in range(0, n, _ROWS):
            yield "".join(f"3 {a} {b} {c}\n" for a, b, c in faces[start : start + _ROWS].tolist()).encode()
    else:
        yield b"solid cut\n"
        for start in range(0, n, _ROWS):
            corners = vertices[faces[start : start + _ROWS]]
            with np.errstate(all="ignore"):
                normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                normals = np.nan_to_num(normals / np.linalg.norm(normals, axis=1)[:, None], posinf=0.0, neginf=0.0)
            facets = np.concatenate([normals[:, None], corners], axis=1).reshape(-1, 12).tolist()
            yield "".join(_FACET.format(*facet) for facet in facets).encode()
        yield b"endsolid cut\n"


def file_in(octets: Any, content_type: str, call: Call) -> tuple[Any, Format | None, str]:
    """Return the bytes of a file, its format, if known, and polyhedron or surface."""
    kind = FILES.get(content_type.partition(";")[0].strip().lower())
    if kind is not None:
        return octets, cast(Format, kind), "polyhedron"
    call.take(len(octets))
    fields = fields_of(octets, content_type)
    (_, word), (name, file) = fields.get("type", ("", b"polyhedron")), fields.get("file", ("", b""))
    if not file or fields.keys() - {"file", "type"} or word not in (b"polyhedron", b"surface"):
        detail = (
            "expected a form with the field file, a mesh, and perhaps type, polyhedron or surface; got "
            f"{', '.join(sorted(fields)) or 'no field'}"
        )
        raise ServiceError("invalid_request", detail[:300])
    suffix = name.rpartition(".")[2].lower()
    return file, cast(Format, suffix) if suffix in FILES.values() else None, word.decode()


def to_solid(octets: Any, kind: Format | None, solid_type: str, call: Call) -> tuple[engine.Solid, int]:
    """Return the polyhedron or surface in a file, and how many triangles are left out."""
    with call.phase("decode"):
        mesh = mesh_reader.read(octets, kind, call)
    with call.phase("prepare"):
        return mesh.solid(engine.Polyhedron if solid_type == "polyhedron" else engine.Surface), mesh.n_collapsed


def from_scene_pieces(pieces: Any, call: Call) -> Any:
    """Return pieces as rows of float64, or whether each segment meets a body as int8."""
    if isinstance(pieces, np.ndarray):
        return pieces.astype(np.int8)
    call.take(8 * len(pieces) * (4 + 2 * pieces.start.shape[1]))
    return np.column_stack([pieces.source, pieces.body, pieces.t, pieces.start, pieces.end])


def from_hits(result: Any, call: Call) -> Any:
    """Return hits as rows of float64, or whether each line has one as int8."""
    if isinstance(result, np.ndarray):
        return result.astype(np.int8)
    columns = [getattr(result, name) for name in type(result).__slots__]
    call.take(8 * len(result) * 13)
    return np.column_stack(columns)


def from_locations(located: engine.SceneLocations, call: Call) -> Any:
    """Return rows of point, body and location."""
    call.take(24 * len(located.indices))
    points = np.repeat(np.arange(len(located.offsets) - 1), np.diff(located.offsets))
    return np.column_stack([points, located.indices, 1 - located.on_boundary.astype(np.int64)])
