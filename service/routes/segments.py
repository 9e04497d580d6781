"""What remains of segments and lines within a region?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
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
