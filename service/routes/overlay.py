"""What is the intersection, union, difference or symmetric difference of two polygons?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.overlay import OverlayBatchRequest, OverlayBatchResponse, OverlayRequest, OverlayResponse
from service.work import CallOf

router = router_of("clipping")


@router.post("/v1/overlay", operation_id="overlay")
def overlay(question: OverlayRequest, call: CallOf) -> OverlayResponse:
    """Combine two polygons into separate pieces with holes, concave on concave."""
    subject = questions.to_solid(question.subject, call, ("subject",))
    clip = questions.to_solid(question.clip, call, ("clip",))
    found = call.compute(engine.overlay, subject, clip, question.operation, grid=question.grid)
    return answers.from_overlay(*found, question.area)


@router.post("/v1/overlay/batch", operation_id="overlay_batch")
def overlay_batch(question: OverlayBatchRequest, call: CallOf) -> OverlayBatchResponse:
    """Combine pairs of polygons, each subject with the clip in its place."""
    subjects, clips = (
        [questions.to_solid(model, call, (name, k)) for k, model in enumerate(models)]
        for name, models in (("subjects", question.subjects), ("clips", question.clips))
    )
    found = call.compute(engine.overlay_batch, subjects, clips, question.operation)
    return answers.from_overlays(*found)
