"""What is the intersection, union, difference or symmetric difference of two polygons?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.overlay import OverlayRequest, OverlayResponse
from service.work import CallOf

router = router_of("clipping")


@router.post("/v1/overlay", operation_id="overlay")
def overlay(question: OverlayRequest, call: CallOf) -> OverlayResponse:
    """Combine two polygons into separate pieces with holes, concave on concave."""
    subject = questions.to_solid(question.subject, call, ("subject",))
    clip = questions.to_solid(question.clip, call, ("clip",))
    output = question.output or "valid"
    found = call.compute(engine.overlay, subject, clip, question.operation, output=output)
    return answers.from_overlay(*found, question.area)
