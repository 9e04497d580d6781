"""Questions: which points lie in a solid, how do bodies lie to each other, what remains of segments and polygons?"""

from __future__ import annotations

from typing import Any, Final

from starlette.responses import JSONResponse

import engine
from service.convert import answers, areas, cutting, octets, questions
from service.openapi import router_of
from service.schemas.bodies import (
    ClearanceRequest,
    ClearanceResponse,
    CollideRequest,
    CollideResponse,
    CollideSceneRequest,
    CollideSceneResponse,
)
from service.schemas.clipping import (
    ClipLinesRequest,
    ClipLinesResponse,
    ClipPolygonsRequest,
    ClipPolygonsResponse,
    ClipSegmentsRequest,
    ClipSegmentsResponse,
    LayersClipRequest,
    LayersContainsRequest,
    LayersJoinRequest,
    LayersNearestRequest,
    LayersOverlayRequest,
    LayersResponse,
    LayersSplitRequest,
    LayersUnionRequest,
    OverlayBatchRequest,
    OverlayBatchResponse,
    OverlayRequest,
    OverlayResponse,
)
from service.schemas.cutting import (
    CutRequest,
    CutResponse,
    OverlapRequest,
    OverlapResponse,
    SectionRequest,
    SectionResponse,
    VolumeRequest,
    VolumeResponse,
)
from service.schemas.hits import HitsRequest, HitsResponse
from service.schemas.points import (
    NEEDED,
    BoundsRequest,
    BoundsResponse,
    CompareRequest,
    CompareResponse,
    ContainsRequest,
    ContainsResponse,
    ContainsSceneRequest,
    ContainsSceneResponse,
    DistancesRequest,
    DistancesResponse,
)
from service.work import CallOf

router = router_of()


@router.post("/v1/contains", operation_id="contains", tags=["containment"])
def contains(question: ContainsRequest, call: CallOf) -> ContainsResponse:
    """Tell for each point whether it lies in the solid, boundary included, and which lie exactly on the boundary."""
    solid = questions.to_solid(question.solid, call, ("solid",))
    points = questions.to_items(question.points, solid.dimension, call)
    return answers.from_locations(*call.compute(engine.locate, points, solid))


@router.post("/v1/contains/scene", operation_id="contains_scene", tags=["containment"])
def contains_scene(question: ContainsSceneRequest, call: CallOf) -> ContainsSceneResponse:
    """List for each point the bodies that hold it, boundary included."""
    solids, poses = questions.to_bodies(question.bodies, call)
    points = questions.to_items(question.points, solids[0].dimension, call)
    result = call.compute(
        engine.locate_scene, points, solids, poses, rewrite_error=questions.rewrite_error_paths_for_scene
    )
    return answers.from_scene_locations(*result)


@router.post("/v1/collide", operation_id="collide", tags=["collision"])
def collide(question: CollideRequest, call: CallOf) -> CollideResponse:
    """Tell how the first body lies to the second, for each pose of the second, with one reason."""
    first = questions.to_solid(question.first, call, ("first",))
    second = questions.to_solid(question.second, call, ("second",))
    options = {"detail": bool(question.detail), "boolean": bool(question.boolean)}
    witness = not question.boolean if question.witness is None else question.witness
    if question.poses is None:
        return answers.from_collision(*call.compute(engine.collide, first, second, witness=witness, **options))
    rotations, translations = questions.to_poses(question.poses, second.dimension)
    result = call.compute(
        engine.collide_poses,
        first,
        second,
        rotations,
        translations,
        witnesses=witness,
        **options,
        rewrite_error=questions.rewrite_error_paths_for_poses,
    )
    return answers.from_pose_collisions(*result, witness)


@router.post("/v1/collide/scene", operation_id="collide_scene", tags=["collision"])
def collide_scene(question: CollideSceneRequest, call: CallOf) -> CollideSceneResponse:
    """List every pair of bodies with a common point, or nearer than a gap, and how each lies to the other."""
    solids, poses = questions.to_bodies(question.bodies, call)
    options = {"detail": bool(question.detail), "boolean": bool(question.boolean)}
    named = {"skip": question.skip, "only": question.only, "gap": question.gap}
    result = call.compute(
        engine.collide_scene, solids, poses, **named, **options, rewrite_error=questions.rewrite_error_paths_for_scene
    )
    return answers.from_scene_pairs(*result)


@router.post("/v1/clearance", operation_id="clearance", tags=["clearance"])
def clearance(question: ClearanceRequest, call: CallOf) -> ClearanceResponse:
    """Tell how far apart two bodies are, exactly, for each pose of the second; or whether at least so far."""
    first = questions.to_solid(question.first, call, ("first",))
    second = questions.to_solid(question.second, call, ("second",))
    result: Any
    if question.poses is None:
        result, accuracy = call.compute(engine.clearance, first, second, at_least=question.at_least)
        result = [result]
    else:
        rotations, translations = questions.to_poses(question.poses, second.dimension)
        result, accuracy = call.compute(
            engine.clearance_poses,
            first,
            second,
            rotations,
            translations,
            at_least=question.at_least,
            rewrite_error=questions.rewrite_error_paths_for_poses,
        )
        if len(translations) == 1 and question.at_least is None:  # one pose: with its points
            pose = engine.Pose(rotations[0], translations[0])
            result, accuracy = call.compute(engine.clearance, first, second, second_pose=pose)
            result = [result]
    return answers.from_clearances(result, accuracy, question.at_least is not None)


@router.post("/v1/distances", operation_id="distances", tags=["clearance"])
def distances(question: DistancesRequest, call: CallOf) -> DistancesResponse:
    """Tell for each point how far it is from the solid or the lines, with a sign if wanted; whether at most a distance;
    or the nearest points too."""
    solid: Any
    if question.lines is None:
        solid = questions.to_solid(question.solid, call, ("solid",))
        dimension = solid.dimension
    else:
        lines = questions.to_items(question.lines, 2, call)
        solid, dimension = {"type": "MultiLineString", "coordinates": list(lines)}, 2
    points = questions.to_items(question.points, dimension, call)
    options: dict[str, Any] = {"to": question.to or "solid", "within": question.within}
    options |= {"signed": bool(question.signed), "nearest": bool(question.nearest)}
    if question.pose is not None:
        options["pose"] = questions.to_pose(question.pose, ("pose",))
    return answers.from_distances(*call.compute(engine.distances, points, solid, **options))


@router.post("/v1/clip/segments", operation_id="clip_segments", tags=["clipping"])
def clip_segments(question: ClipSegmentsRequest, call: CallOf) -> ClipSegmentsResponse:
    """Return the parts of each segment that lie in the region, boundary included: none, one or several."""
    region = questions.to_solid(question.region, call, ("region",))
    segments = questions.to_items(question.segments, region.dimension, call)
    return answers.from_pieces(*call.compute(engine.clip_segments, segments, region))


@router.post("/v1/hits", operation_id="hits", tags=["clipping"])
def hits(question: HitsRequest, call: CallOf) -> HitsResponse:
    """Tell where segments or rays meet a surface, how, and with which normal and barycentrics."""
    surface = questions.to_solid(question.surface, call, ("surface",))
    lines = questions.to_items(question.segments, 3, call)
    keep = question.keep or "all"
    return answers.from_hits(*call.compute(engine.hits, lines, surface, rays=bool(question.rays), keep=keep))


@router.post("/v1/clip/lines", operation_id="clip_lines", tags=["clipping"])
def clip_lines(question: ClipLinesRequest, call: CallOf) -> ClipLinesResponse:
    """Return the parts of each polyline that lie in the region; what is connected there stays in one piece."""
    region = questions.to_solid(question.region, call, ("region",))
    lines = questions.to_items(question.lines, region.dimension, call)
    lines = lines if len(lines) else []
    return answers.from_line_pieces(*call.compute(engine.clip_lines, lines, region, keep=question.keep or "inside"))


@router.post("/v1/clip/polygons", operation_id="clip_polygons", tags=["clipping"])
def clip_polygons(question: ClipPolygonsRequest, call: CallOf) -> ClipPolygonsResponse:
    """Clip polygons on a convex region, contour by contour; what is left of a polygon stays connected."""
    region = questions.to_solid(question.region, call, ("region",))
    polygons = questions.to_polygons(question.polygons, call)
    return areas.from_clipped(*call.compute(engine.clip_polygons, polygons, region))


@router.post("/v1/overlay", operation_id="overlay", tags=["clipping"])
def overlay(question: OverlayRequest, call: CallOf) -> OverlayResponse:
    """Combine two polygons into separate pieces with holes, concave on concave."""
    subject = questions.to_solid(question.subject, call, ("subject",))
    clip = questions.to_solid(question.clip, call, ("clip",))
    result = call.compute(engine.overlay, subject, clip, question.operation, grid=question.grid)
    return areas.from_overlay(*result, question.area)


@router.post("/v1/overlay/batch", operation_id="overlay_batch", tags=["clipping"])
def overlay_batch(question: OverlayBatchRequest, call: CallOf) -> OverlayBatchResponse:
    """Combine pairs of polygons, each subject with the clip in its place."""
    subjects = questions.to_solids(question.subjects, call, "subjects")
    clips = questions.to_solids(question.clips, call, "clips")
    result = call.compute(engine.overlay_batch, subjects, clips, question.operation)
    return areas.from_overlays(*result)


class GeoJson(JSONResponse):
    """What the document calls these answers."""

    media_type = "application/geo+json"


_AS: Final[dict[str, Any]] = {"response_class": GeoJson, "response_model": LayersResponse}


@router.post("/v1/layers/overlay", operation_id="overlay_layers", tags=["layers"], **_AS)
def overlay_layers(question: LayersOverlayRequest, call: CallOf) -> LayersResponse:
    """Overlay two layers, every feature with every one that it meets; attributes of both are kept."""
    sides = question.left, question.right
    options: dict[str, Any] = {"grid": question.grid, "min_width": question.min_width, "wrap": question.wrap}
    result = call.compute(engine.layers.overlay_features, *sides, question.operation, **options)
    return areas.from_features(*result, call)


@router.post("/v1/layers/union", operation_id="unite_layer", tags=["layers"], **_AS)
def unite_layer(question: LayersUnionRequest, call: CallOf) -> LayersResponse:
    """Unite the features of a layer, all or those that agree in some properties."""
    options: dict[str, Any] = {"grid": question.grid, "min_width": question.min_width, "wrap": question.wrap}
    options |= {"coverage": bool(question.coverage), "gaps": question.gaps or "keep"}
    result = call.compute(engine.layers.dissolve_features, question.layer, question.by, **options)
    return areas.from_features(*result, call)


@router.post("/v1/layers/clip", operation_id="clip_layer", tags=["layers"], **_AS)
def clip_layer(question: LayersClipRequest, call: CallOf) -> LayersResponse:
    """Cut the features of a layer to the union of some polygons."""
    options: dict[str, Any] = {"grid": question.grid, "min_width": question.min_width, "wrap": question.wrap}
    options["keep"] = question.keep or "inside"
    result = call.compute(engine.layers.clip_features, question.layer, question.mask, **options)
    return areas.from_features(*result, call)


@router.post("/v1/layers/split", operation_id="split_layer", tags=["layers"], **_AS)
def split_layer(question: LayersSplitRequest, call: CallOf) -> LayersResponse:
    """Split polygons by lines: a row for each piece."""
    sides = question.layer, question.lines
    return areas.from_features(*call.compute(engine.layers.split_features, *sides, min_width=question.min_width), call)


@router.post("/v1/layers/nearest", operation_id="join_nearest", tags=["layers"], **_AS)
def join_nearest(question: LayersNearestRequest, call: CallOf) -> LayersResponse:
    """Join features to those that are nearest, all of several that are as near: a row for each such pair."""
    options: dict[str, Any] = {"max_distance": question.max_distance, "exclusive": bool(question.exclusive)}
    options["outside"] = bool(question.outside)
    result = call.compute(engine.layers.nearest_features, question.left, question.right, **options)
    return areas.from_features(*result, call)


@router.post("/v1/layers/join", operation_id="join_layers", tags=["layers"], **_AS)
def join_layers(question: LayersJoinRequest, call: CallOf) -> LayersResponse:
    """Join features to those that they have a relation to: a row for each such pair."""
    options: dict[str, Any] = {"distance": question.distance, "outside": bool(question.outside)}
    result = call.compute(engine.layers.join_features, question.left, question.right, question.predicate, **options)
    return areas.from_features(*result, call)


@router.post("/v1/layers/contains", operation_id="locate_in_layer", tags=["layers"], **_AS)
def locate_in_layer(question: LayersContainsRequest, call: CallOf) -> LayersResponse:
    """Join points to the features that hold them, boundary included: a row for each such pair."""
    outside = bool(question.outside)
    result = call.compute(engine.layers.locate_features, question.points, question.polygons, outside=outside)
    return areas.from_features(*result, call)


@router.post("/v1/bounds", operation_id="bounds", tags=["bounds"])
def bounds(question: BoundsRequest, call: CallOf) -> BoundsResponse:
    """Return the smallest axis-aligned box and the smallest sphere that hold the solid."""
    solid = questions.to_solid(question.solid, call, ("solid",))
    return answers.from_bounds(*call.compute(engine.bounds, solid))


@router.post("/v1/volume", operation_id="volume", tags=["solids cut"])
def volume(question: VolumeRequest, call: CallOf) -> VolumeResponse:
    """Return the volume, area and centroid of a solid, each the double nearest to the exact value."""
    return cutting.measured(questions.to_solid(question.solid, call, ("solid",)), call)


@router.post("/v1/section", operation_id="section", tags=["solids cut"])
def section(question: SectionRequest, call: CallOf) -> SectionResponse:
    """Return the sections of a polyhedron by planes, as polygons with holes."""
    return cutting.sections(question, call)


@router.post(
    "/v1/cut",
    operation_id="cut",
    tags=["solids cut"],
    response_model=CutResponse,
    openapi_extra={"x-also-answers": octets.FILES_OUT},
)
def cut(question: CutRequest, call: CallOf) -> Any:
    """Cut a polyhedron by a half-space, box or convex region; what is left is closed by caps."""
    return cutting.cut(question, call)


@router.post("/v1/overlap", operation_id="overlap", tags=["solids cut"])
def overlap(question: OverlapRequest, call: CallOf) -> OverlapResponse:
    """Return the volume that two solids have in common, in the plane the area, and its part of their union."""
    return cutting.overlaps(question, call)


@router.post("/v1/compare", operation_id="compare", tags=["compare"])
def compare(question: CompareRequest, call: CallOf) -> CompareResponse:
    """Answer exactly and by the textbook's method; say where they differ and how long both took."""
    names = NEEDED[question.operation]
    values = [getattr(question, name) for name in names]
    solid = questions.to_solid(values[1], call, names[1:])
    if question.operation == "collide":
        items: Any = questions.to_solid(values[0], call, names[:1])
    else:
        items = questions.to_items(values[0], solid.dimension, call)
    result, accuracy = call.compute(_compared, question.operation, items, solid, method=question.method)
    return answers.from_comparison(result, accuracy)


def _compared(*arguments: Any, report: bool, **options: Any) -> tuple[engine.Comparison, engine.Accuracy]:
    result = engine.compare(*arguments, **options)
    return result, result.accuracy
