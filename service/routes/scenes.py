"""Scenes kept between requests, and segments through scenes."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Query
from starlette.responses import Response

from service.convert import answers, octets, questions
from service.convert import scenes as convert
from service.route import GeometryRoute
from service.routes.base import responses, router_of
from service.routes.binary import Octets, answers_with
from service.routes.solids import KNOWN, put
from service.schemas.collision import CollideSceneResponse
from service.schemas.containment import ContainsSceneResponse
from service.schemas.scenes import (
    SCENE_ID,
    ClipSegmentsSceneRequest,
    ClipSegmentsSceneResponse,
    SceneCollideRequest,
    SceneContainsRequest,
    SceneModel,
    SceneSegmentsRequest,
    StoredSceneSummary,
)
from service.work import CallOf

router = router_of("scenes")
lookup = APIRouter(route_class=GeometryRoute, tags=["scenes"], responses=responses(401, 403, 404, 503))
binary = APIRouter(
    route_class=GeometryRoute, tags=["binary"], responses=responses(401, 403, 404, 408, 413, 415, 422, 503, 504)
)
Id = Annotated[str, Path(description="Name of a stored scene, from `POST /v1/scenes`.", examples=[SCENE_ID])]
MovedText = Annotated[
    str, Query(description="Bodies that are elsewhere for this question, in JSON: a list of `body` and `pose`.")
]
_PIECES: Final = "Rows of 4 + 2 x dimension float64 for each piece: segment, body, t of both ends, start, end."


@router.post(
    "/v1/scenes",
    operation_id="put_scene",
    status_code=201,
    responses={200: {"description": "It was there already.", "model": StoredSceneSummary}, **responses(507)},
)
def put_scene(question: SceneModel, call: CallOf) -> StoredSceneSummary:
    """Keep a scene, so that later questions can name it and find it prepared. The same bodies in the same places have
    the same id everywhere; it may leave the store when others need the room."""
    scene = convert.to_scene(question.bodies, call)
    return convert.from_stored(put(scene, call), scene)


@lookup.get("/v1/scenes/{scene_id}", operation_id="get_scene", responses=KNOWN)
def get_scene(scene_id: Id, call: CallOf) -> StoredSceneSummary:
    """Return what the store holds under an id."""
    call.headers["ETag"] = f'"{scene_id}"'
    return convert.from_stored(scene_id, call.store.get_scene(scene_id))


@lookup.head("/v1/scenes/{scene_id}", operation_id="has_scene", response_class=Response, responses=KNOWN)
def has_scene(scene_id: Id, call: CallOf) -> None:
    """Tell by the status whether the store holds an id."""
    call.headers["ETag"] = f'"{scene_id}"'
    call.store.get_scene(scene_id)


@router.post("/v1/scenes/{scene_id}/contains", operation_id="contains_stored_scene")
def contains_stored_scene(scene_id: Id, question: SceneContainsRequest, call: CallOf) -> ContainsSceneResponse:
    """List for each point the bodies of a stored scene that hold it, boundary included."""
    scene = convert.to_moved(call.store.get_scene(scene_id), question.moved, call)
    points = questions.to_items(question.points, scene.solids[0].dimension)
    return answers.from_scene_locations(*call.compute(scene.locate, points))


@router.post("/v1/scenes/{scene_id}/collide", operation_id="collide_stored_scene")
def collide_stored_scene(scene_id: Id, question: SceneCollideRequest, call: CallOf) -> CollideSceneResponse:
    """List the pairs of bodies of a stored scene with a common point, and how each lies to the other."""
    scene = convert.to_moved(call.store.get_scene(scene_id), question.moved, call)
    options: dict[str, Any] = {"detail": bool(question.detail), "boolean": bool(question.boolean)}
    options |= {"skip": question.skip, "only": question.only, "gap": question.gap}
    moved = [item.body for item in question.moved or ()] if question.new else None
    return answers.from_scene_pairs(*call.compute(scene.collide, moved=moved, **options))


@router.post("/v1/scenes/{scene_id}/clip/segments", operation_id="clip_segments_stored_scene")
def clip_segments_stored_scene(scene_id: Id, question: SceneSegmentsRequest, call: CallOf) -> ClipSegmentsSceneResponse:
    """Tell what of segments lies within which body of a stored scene, in the exact order along each."""
    scene = convert.to_moved(call.store.get_scene(scene_id), question.moved, call)
    return convert.clipped(scene, question.segments, question.keep, call)


@router.post("/v1/clip/segments/scene", operation_id="clip_segments_scene")
def clip_segments_scene(question: ClipSegmentsSceneRequest, call: CallOf) -> ClipSegmentsSceneResponse:
    """Tell what of segments lies within which body, in the exact order along each."""
    return convert.clipped(convert.to_scene(question.bodies, call), question.segments, question.keep, call)


@binary.post(
    "/v1/scenes/{scene_id}/binary/contains",
    operation_id="contains_stored_scene_binary",
    response_class=octets.Response,
    responses=answers_with("Rows of 3 int64: point, body, and 1 inside or 0 exactly on the boundary."),
)
def contains_stored_scene_binary(scene_id: Id, question: Octets, call: CallOf, moved: MovedText = "[]") -> Any:
    """Locate points, N x dimension little-endian float64, in the bodies of a stored scene."""
    scene = convert.to_moved(call.store.get_scene(scene_id), convert.read_moved(moved, call), call)
    points = octets.to_rows(question, (scene.solids[0].dimension,))
    found, accuracy = call.compute(scene.locate, points)
    return octets.answer(call, convert.from_locations(found, call), accuracy)


@binary.post(
    "/v1/scenes/{scene_id}/binary/clip/segments",
    operation_id="clip_segments_stored_scene_binary",
    response_class=octets.Response,
    responses=answers_with(_PIECES + " Where `keep` is any: N int8, 1 where a segment meets a body."),
)
def clip_segments_stored_scene_binary(
    scene_id: Id, question: Octets, call: CallOf, keep: convert.KeepQuery = "all", moved: MovedText = "[]"
) -> Any:
    """Clip segments, N x 2 x dimension little-endian float64, on the bodies of a stored scene."""
    scene = convert.to_moved(call.store.get_scene(scene_id), convert.read_moved(moved, call), call)
    segments = octets.to_rows(question, (2, scene.solids[0].dimension))
    found, accuracy = call.compute(scene.clip_segments, segments, keep=keep)
    return octets.answer(call, convert.from_pieces(found, call), accuracy)
