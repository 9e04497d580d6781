"""The binary lane: many points or segments against a stored solid, raw float64 there and back; and files of meshes."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Body, Query
from pydantic import WithJsonSchema

import engine
from service.body import OCTETS
from service.convert import answers, octets
from service.route import GeometryRoute
from service.routes.base import responses
from service.routes.solids import Id, put
from service.schemas.solids import StoredSolidSummary
from service.work import CallOf

router = APIRouter(
    route_class=GeometryRoute, tags=["binary"], responses=responses(401, 403, 404, 408, 413, 415, 422, 503, 504)
)

_BINARY: Final = {"type": "string", "format": "binary"}
Octets = Annotated[bytes, Body(media_type=OCTETS), WithJsonSchema(_BINARY)]

Format = Annotated[octets.Format, Query(description="Of the file.")]
MeshType = Annotated[
    Literal["polyhedron", "surface"],
    Query(description="polyhedron unless given; a surface may be open and holds nothing."),
]


def answers_with(text: str) -> dict[int | str, dict[str, Any]]:
    """Return the description of a binary answer."""
    header = {"description": "Members of the `accuracy` object of JSON answers.", "schema": {"type": "string"}}
    content = {OCTETS: {"schema": _BINARY}}
    return {200: {"description": text, "content": content, "headers": {"Geometry-Accuracy": header}}}


@router.post(
    "/v1/solids/{solid_id}/contains",
    operation_id="contains_stored",
    response_class=octets.Response,
    responses=answers_with("N int8: 1 inside, 0 exactly on the boundary, -1 outside."),
)
def contains_stored(solid_id: Id, question: Octets, call: CallOf) -> Any:
    """Locate points, N x dimension little-endian float64, in a stored solid."""
    solid = call.store.get(solid_id)
    points = octets.to_rows(question, (solid.dimension,))
    return octets.answer(call, *call.compute(engine.locate, points, solid))


@router.post(
    "/v1/solids/{solid_id}/clip/segments",
    operation_id="clip_segments_stored",
    response_class=octets.Response,
    responses=answers_with("N x 2 x dimension float64: the ends of what remains; NaN where nothing does."),
)
def clip_segments_stored(solid_id: Id, question: Octets, call: CallOf) -> Any:
    """Clip segments, N x 2 x dimension little-endian float64, on a stored convex region: half_space, aabb, convex or
    sphere."""
    region = octets.check_is_convex(call.store.get(solid_id))
    segments = octets.to_rows(question, (2, region.dimension))
    pieces, accuracy = call.compute(engine.clip_segments, segments, region)
    return octets.answer(call, octets.from_pieces(pieces, len(segments), region.dimension, call), accuracy)


@router.post(
    "/v1/solids/import",
    operation_id="import_solid",
    status_code=201,
    responses={200: {"description": "It was there already.", "model": StoredSolidSummary}, **responses(501, 507)},
)
def import_solid(question: Octets, format: Format, call: CallOf, type: MeshType = "polyhedron") -> StoredSolidSummary:
    """Keep a mesh from a file, vertices at equal coordinates merged, as `POST /v1/solids` keeps a solid. It must be
    closed unless it is to be a surface. Polygons are cut into triangles."""
    solid, n_collapsed = octets.to_solid(question, format, type, call)
    return answers.from_stored(put(solid, call), solid, n_collapsed or None)
