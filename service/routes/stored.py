"""Solids and scenes that are stored, named by their content, and what is asked of them, in JSON or raw float64 (the
binary lane); and files of meshes."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

import numpy as np
from fastapi import Body, Path, Query
from pydantic import WithJsonSchema
from starlette.responses import Response

import engine
from service import mesh_reader
from service.body import OCTETS
from service.convert import answers, octets, questions
from service.openapi import responses, router_of
from service.schemas.bodies import (
    SCENE_ID,
    ClipSegmentsSceneRequest,
    ClipSegmentsSceneResponse,
    CollideSceneResponse,
    SceneCollideRequest,
    SceneContainsRequest,
    SceneDistancesRequest,
    SceneModel,
    SceneSegmentsRequest,
    StoredSceneSummary,
)
from service.schemas.geojson import ALSO
from service.schemas.hits import HitsResponse, SceneHitsRequest
from service.schemas.points import ContainsSceneResponse, SceneDistancesResponse
from service.schemas.solids import InspectRequest, InspectResponse, Solid, StoredSolidSummary
from service.store import Stored
from service.work import Call, CallOf

router = router_of()
lookup = router_of(401, 403, 404, 503)
KNOWN: Final[dict[int | str, dict[str, Any]]] = {
    304: {"description": "The client has it: one of the tags in If-None-Match is the id."}
}

_LEFT_OUT: Final[Any] = None
WeldQuery = Annotated[
    float,
    Query(
        description="For a file: first make one of vertices that are at most so far apart.",
        json_schema_extra={"format": "double"},
    ),
]
MendQuery = Annotated[bool, Query(description="For a file: as the field of this name in JSON.")]
ToQuery = Annotated[Literal["solid", "boundary"], Query(description="solid: points in it are 0 away.")]
SignedQuery = Annotated[bool, Query(description="From the boundary, negative inside.")]
WithinQuery = Annotated[
    float, Query(description="A distance to compare with, decided exactly.", json_schema_extra={"format": "double"})
]
Id = Annotated[str, Path(description="Name of a stored solid, from `POST /v1/solids`.")]


@router.post(
    "/v1/solids",
    operation_id="put_solid",
    tags=["solids"],
    status_code=201,
    responses={200: {"description": "It was there already.", "model": StoredSolidSummary}, **responses(501, 507)},
    openapi_extra={"requestBody": {ALSO: octets.FILES_IN}},
)
def put_solid(question: Solid, call: CallOf) -> StoredSolidSummary:
    """Keep a solid, so that later requests can name it: `{"type": "stored", "id": ...}`. The same solid has the same
    id everywhere; it may leave the store when others need the room. A mesh may come as a file too: as the body, or as
    the field `file` of a form, of which `type` may be surface."""
    solid = questions.to_solid(question, call, ())
    return answers.from_stored(put(solid, call), solid)


def put_mesh(question: Any, content_type: str, call: Call) -> StoredSolidSummary:
    """Keep a mesh that came as a file, or in a form, in place of JSON."""
    solid, n_collapsed = octets.to_solid(*octets.file_in(question, content_type, call), call)
    return answers.from_stored(put(solid, call), solid, n_collapsed or None)


put_solid.upload = put_mesh  # type: ignore[attr-defined]


def put(value: Stored, call: Call) -> str:
    """Put a solid or a scene into the store, say so, and return its name."""
    name, is_new = call.store.put(value)
    call.status = 201 if is_new else 200
    call.headers.update({"Location": f"{call.path.removesuffix('/import')}/{name}", "ETag": f'"{name}"'})
    return name


@router.post(
    "/v1/solids/inspect",
    operation_id="inspect_solid",
    tags=["solids"],
    responses=responses(501),
    openapi_extra={"requestBody": {ALSO: octets.FILES_IN}},
)
def inspect_solid(
    question: InspectRequest,
    call: CallOf,
    weld: WeldQuery = _LEFT_OUT,
    orient: MendQuery = False,
    fill_t_junctions: MendQuery = False,
) -> InspectResponse:
    """Tell what keeps a mesh from being a closed solid: open edges, T-junctions, crossings and more, each with its
    places and what would mend it. A file is inspected as it is, or after the mends of the query."""
    options = _mends(weld, orient, fill_t_junctions)
    options |= _mends(question.weld, question.orient, question.fill_t_junctions)
    report = call.compute(_inspected, (question.vertices, question.faces), **options)
    return answers.from_inspection(*report, bool(options))


def inspect_file(question: Any, content_type: str, call: Call, **mends: Any) -> InspectResponse:
    """Inspect a mesh that came as a file, or in a form, in place of JSON."""
    file, kind, _ = octets.file_in(question, content_type, call)
    with call.phase("decode"):
        mesh = mesh_reader.read(file, kind, call)
    return answers.from_inspection(*call.compute(_inspected, mesh, **_mends(**mends)), True)


def _mends(
    weld: float | None = None, orient: bool | None = None, fill_t_junctions: bool | None = None
) -> dict[str, Any]:
    """Return the options of `engine.inspect` that are asked for; a distance of 0 is one."""
    given = {"weld": weld, "orient": orient or None, "fill_t_junctions": fill_t_junctions or None}
    return {name: value for name, value in given.items() if value is not None}


inspect_solid.upload = inspect_file  # type: ignore[attr-defined]


def _inspected(mesh: Any, report: bool, **options: Any) -> tuple[engine.Inspection, engine.Accuracy]:
    inspection = engine.inspect(mesh, **options)
    return inspection, engine.Accuracy("exact", None, len(inspection.faces), 0, 0, "inspection")


@lookup.get("/v1/solids/{solid_id}", tags=["solids"], operation_id="get_solid", responses=KNOWN)
def get_solid(solid_id: Id, call: CallOf) -> StoredSolidSummary:
    """Return what the store holds under an id."""
    call.headers["ETag"] = f'"{solid_id}"'
    return answers.from_stored(solid_id, call.store.get(solid_id))


@lookup.head(
    "/v1/solids/{solid_id}", tags=["solids"], operation_id="has_solid", response_class=Response, responses=KNOWN
)
def has_solid(solid_id: Id, call: CallOf) -> None:
    """Tell by the status whether the store holds an id."""
    call.headers["ETag"] = f'"{solid_id}"'
    call.store.get(solid_id)


OF_OCTETS: Final = (401, 403, 404, 408, 413, 415, 422, 503, 504)
binary = router_of(*OF_OCTETS, tags=["binary"])

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


@binary.post(
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


@binary.post(
    "/v1/solids/{solid_id}/distances",
    operation_id="distances_stored",
    response_class=octets.Response,
    responses=answers_with("N float64: the distances. With `within` N int8: 1 for at most that distance, else 0."),
)
def distances_stored(
    solid_id: Id, question: Octets, call: CallOf, to: ToQuery = "solid", signed: SignedQuery = False,
    within: WithinQuery = _LEFT_OUT,
) -> Any:  # fmt: skip
    """Tell how far points, N x dimension little-endian float64, are from a stored solid."""
    solid = call.store.get(solid_id)
    points = octets.to_rows(question, (solid.dimension,))
    result, accuracy = call.compute(engine.distances, points, solid, to=to, signed=signed, within=within)
    return octets.answer(call, result if within is None else result.astype(np.int8), accuracy)


@binary.post(
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


_HITS: Final = "t, t_end, face, triangle, kind (0 across, 1 touch, 2 rim, 3 end, 4 along), 3 barycentrics, normal."
_ANY: Final = " Where `keep` is any: N int8, 1 where a line has a hit."
RaysQuery = Annotated[bool, Query(description="As in JSON: the rows are origins and directions.")]


@binary.post(
    "/v1/solids/{solid_id}/hits",
    operation_id="hits_stored",
    response_class=octets.Response,
    responses=answers_with(f"Rows of 12 float64 for each hit: segment, {_HITS}{_ANY}"),
)
def hits_stored(
    solid_id: Id, question: Octets, call: CallOf, keep: questions.KeepQuery = "all", rays: RaysQuery = False
) -> Any:
    """Tell where segments or rays, N x 2 x 3 little-endian float64, meet a stored surface or polyhedron."""
    surface = call.store.get(solid_id)
    result, accuracy = call.compute(engine.hits, octets.to_rows(question, (2, 3)), surface, keep=keep, rays=rays)
    return octets.answer(call, octets.from_hits(result, call), accuracy)


@binary.post(
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


scene_binary = router_of(*OF_OCTETS, tags=["binary"])
SceneId = Annotated[str, Path(description="Name of a stored scene, from `POST /v1/scenes`.", examples=[SCENE_ID])]
MovedText = Annotated[
    str, Query(description="Bodies that are elsewhere for this question, in JSON: a list of `body` and `pose`.")
]
_PIECES: Final = "Rows of 4 + 2 x dimension float64 for each piece: segment, body, t of both ends, start, end."


@router.post(
    "/v1/scenes",
    operation_id="put_scene",
    tags=["scenes"],
    status_code=201,
    responses={200: {"description": "It was there already.", "model": StoredSceneSummary}, **responses(507)},
)
def put_scene(question: SceneModel, call: CallOf) -> StoredSceneSummary:
    """Keep a scene, so that later questions can name it and find it prepared. The same bodies in the same places have
    the same id everywhere; it may leave the store when others need the room."""
    scene = questions.to_scene(question.bodies, call)
    return answers.from_stored_scene(put(scene, call), scene)


@lookup.get("/v1/scenes/{scene_id}", tags=["scenes"], operation_id="get_scene", responses=KNOWN)
def get_scene(scene_id: SceneId, call: CallOf) -> StoredSceneSummary:
    """Return what the store holds under an id."""
    call.headers["ETag"] = f'"{scene_id}"'
    return answers.from_stored_scene(scene_id, call.store.get_scene(scene_id))


@lookup.head(
    "/v1/scenes/{scene_id}", tags=["scenes"], operation_id="has_scene", response_class=Response, responses=KNOWN
)
def has_scene(scene_id: SceneId, call: CallOf) -> None:
    """Tell by the status whether the store holds an id."""
    call.headers["ETag"] = f'"{scene_id}"'
    call.store.get_scene(scene_id)


@router.post("/v1/scenes/{scene_id}/contains", operation_id="contains_stored_scene", tags=["scenes"])
def contains_stored_scene(scene_id: SceneId, question: SceneContainsRequest, call: CallOf) -> ContainsSceneResponse:
    """List for each point the bodies of a stored scene that hold it, boundary included."""
    scene = questions.to_moved(call.store.get_scene(scene_id), question.moved, call)
    points = questions.to_items(question.points, scene.solids[0].dimension, call)
    return answers.from_scene_locations(*call.compute(scene.locate, points))


@router.post("/v1/scenes/{scene_id}/distances", operation_id="distances_stored_scene", tags=["scenes"])
def distances_stored_scene(scene_id: SceneId, question: SceneDistancesRequest, call: CallOf) -> SceneDistancesResponse:
    """Tell for each point the nearest body of a stored scene, how far it is, and the nearest point of it; or whether a
    body is within a distance."""
    scene = questions.to_moved(call.store.get_scene(scene_id), question.moved, call)
    points = questions.to_items(question.points, scene.solids[0].dimension, call)
    return answers.from_scene_distances(*call.compute(scene.distances, points, within=question.within))


@router.post("/v1/scenes/{scene_id}/collide", operation_id="collide_stored_scene", tags=["scenes"])
def collide_stored_scene(scene_id: SceneId, question: SceneCollideRequest, call: CallOf) -> CollideSceneResponse:
    """List the pairs of bodies of a stored scene with a common point, and how each lies to the other."""
    scene = questions.to_moved(call.store.get_scene(scene_id), question.moved, call)
    options: dict[str, Any] = {"detail": bool(question.detail), "boolean": bool(question.boolean)}
    options |= {"skip": question.skip, "only": question.only, "gap": question.gap}
    moved = [item.body for item in question.moved or ()] if question.new else None
    return answers.from_scene_pairs(*call.compute(scene.collide, moved=moved, **options))


@router.post("/v1/scenes/{scene_id}/clip/segments", operation_id="clip_segments_stored_scene", tags=["scenes"])
def clip_segments_stored_scene(
    scene_id: SceneId, question: SceneSegmentsRequest, call: CallOf
) -> ClipSegmentsSceneResponse:
    """Tell what of segments lies within which body of a stored scene, in the exact order along each."""
    scene = questions.to_moved(call.store.get_scene(scene_id), question.moved, call)
    return answers.clipped_in_scene(scene, question.segments, question.keep, call)


@router.post("/v1/scenes/{scene_id}/hits", operation_id="hits_stored_scene", tags=["scenes"])
def hits_stored_scene(scene_id: SceneId, question: SceneHitsRequest, call: CallOf) -> HitsResponse:
    """Tell where segments or rays meet the surfaces of a stored scene, how, and with which normal and barycentrics."""
    scene = questions.to_moved(call.store.get_scene(scene_id), question.moved, call)
    lines = questions.to_items(question.segments, 3, call)
    keep = question.keep or "all"
    return answers.from_hits(*call.compute(scene.hits, lines, rays=bool(question.rays), keep=keep))


@router.post("/v1/clip/segments/scene", operation_id="clip_segments_scene", tags=["scenes"])
def clip_segments_scene(question: ClipSegmentsSceneRequest, call: CallOf) -> ClipSegmentsSceneResponse:
    """Tell what of segments lies within which body, in the exact order along each."""
    return answers.clipped_in_scene(questions.to_scene(question.bodies, call), question.segments, question.keep, call)


@scene_binary.post(
    "/v1/scenes/{scene_id}/binary/contains",
    operation_id="contains_stored_scene_binary",
    response_class=octets.Response,
    responses=answers_with("Rows of 3 int64: point, body, and 1 inside or 0 exactly on the boundary."),
)
def contains_stored_scene_binary(scene_id: SceneId, question: Octets, call: CallOf, moved: MovedText = "[]") -> Any:
    """Locate points, N x dimension little-endian float64, in the bodies of a stored scene."""
    scene = questions.to_moved(call.store.get_scene(scene_id), questions.read_moved(moved, call), call)
    points = octets.to_rows(question, (scene.solids[0].dimension,))
    result, accuracy = call.compute(scene.locate, points)
    return octets.answer(call, octets.from_locations(result, call), accuracy)


@scene_binary.post(
    "/v1/scenes/{scene_id}/binary/distances",
    operation_id="distances_stored_scene_binary",
    response_class=octets.Response,
    responses=answers_with(
        "Rows of 2 + dimension float64: the distance, the nearest body, its nearest point. With `within` N int8: 1 for "
        "a body at most so far away, else 0."
    ),
)
def distances_stored_scene_binary(
    scene_id: SceneId, question: Octets, call: CallOf, moved: MovedText = "[]", within: WithinQuery = _LEFT_OUT
) -> Any:
    """Tell for each point, N x dimension little-endian float64, the nearest body of a stored scene."""
    scene = questions.to_moved(call.store.get_scene(scene_id), questions.read_moved(moved, call), call)
    points = octets.to_rows(question, (scene.solids[0].dimension,))
    result, accuracy = call.compute(scene.distances, points, within=within)
    if within is not None:
        return octets.answer(call, result.astype(np.int8), accuracy)
    return octets.answer(call, np.column_stack([result.distance, result.body, result.point]), accuracy)


@scene_binary.post(
    "/v1/scenes/{scene_id}/binary/clip/segments",
    operation_id="clip_segments_stored_scene_binary",
    response_class=octets.Response,
    responses=answers_with(_PIECES + " Where `keep` is any: N int8, 1 where a segment meets a body."),
)
def clip_segments_stored_scene_binary(
    scene_id: SceneId, question: Octets, call: CallOf, keep: questions.KeepQuery = "all", moved: MovedText = "[]"
) -> Any:
    """Clip segments, N x 2 x dimension little-endian float64, on the bodies of a stored scene."""
    scene = questions.to_moved(call.store.get_scene(scene_id), questions.read_moved(moved, call), call)
    segments = octets.to_rows(question, (2, scene.solids[0].dimension))
    result, accuracy = call.compute(scene.clip_segments, segments, keep=keep)
    return octets.answer(call, octets.from_scene_pieces(result, call), accuracy)


@scene_binary.post(
    "/v1/scenes/{scene_id}/binary/hits",
    operation_id="hits_stored_scene_binary",
    response_class=octets.Response,
    responses=answers_with(f"Rows of 13 float64 for each hit: segment, body, {_HITS}{_ANY}"),
)
def hits_stored_scene_binary(
    scene_id: SceneId,
    question: Octets,
    call: CallOf,
    keep: questions.KeepQuery = "all",
    rays: RaysQuery = False,
    moved: MovedText = "[]",
) -> Any:
    """Tell where segments or rays, N x 2 x 3 little-endian float64, meet the surfaces of a stored scene."""
    scene = questions.to_moved(call.store.get_scene(scene_id), questions.read_moved(moved, call), call)
    result, accuracy = call.compute(scene.hits, octets.to_rows(question, (2, 3)), keep=keep, rays=rays)
    return octets.answer(call, octets.from_hits(result, call), accuracy)
