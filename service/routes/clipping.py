"""What remains of segments, lines and polygons within a region?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.polygons import ClipPolygonsRequest, ClipPolygonsResponse
from service.schemas.segments import ClipLinesRequest, ClipLinesResponse, ClipSegmentsRequest, ClipSegmentsResponse
from service.work import CallOf

router = router_of("clipping")


@router.post("/v1/clip/segments", operation_id="clip_segments")
def clip_segments(question: ClipSegmentsRequest, call: CallOf) -> ClipSegmentsResponse:
    """Return the parts of each segment that lie in the region, boundary included: none, one or several."""
    region = questions.to_solid(question.region, call, ("region",))
    segments = questions.to_items(question.segments, region.dimension)
    return answers.from_pieces(*call.compute(engine.clip_segments, segments, region))


@router.post("/v1/clip/lines", operation_id="clip_lines")
def clip_lines(question: ClipLinesRequest, call: CallOf) -> ClipLinesResponse:
    """Return the parts of each polyline that lie in the region; what is connected there stays in one piece."""
    region = questions.to_solid(question.region, call, ("region",))
    lines = question.lines
    return answers.from_line_pieces(*call.compute(engine.clip_lines, lines if len(lines) else [], region))


@router.post("/v1/clip/polygons", operation_id="clip_polygons")
def clip_polygons(question: ClipPolygonsRequest, call: CallOf) -> ClipPolygonsResponse:
    """Clip polygons on a convex region, contour by contour; what is left of a polygon stays connected."""
    region = questions.to_solid(question.region, call, ("region",))
    return answers.from_clipped(*call.compute(engine.clip_polygons, question.polygons, region))
