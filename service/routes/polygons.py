"""What does Sutherland-Hodgman leave of polygons on a convex region?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.polygons import ClipPolygonsRequest, ClipPolygonsResponse
from service.work import CallOf

router = router_of("clipping")


@router.post("/v1/clip/polygons", operation_id="clip_polygons")
def clip_polygons(question: ClipPolygonsRequest, call: CallOf) -> ClipPolygonsResponse:
    """Clip polygons on a convex region, contour by contour; what is left of a polygon stays connected."""
    region = questions.to_solid(question.region, call, ("region",))
    return answers.from_clipped(*call.compute(engine.clip_polygons, question.polygons, region))
