"""What is the smallest box, and the smallest sphere, that holds a solid?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.bounds import BoundsRequest, BoundsResponse
from service.work import CallOf

router = router_of("bounds")


@router.post("/v1/bounds", operation_id="bounds")
def bounds(question: BoundsRequest, call: CallOf) -> BoundsResponse:
    """Return the smallest axis-aligned box and the smallest sphere that hold the solid."""
    solid = questions.to_solid(question.solid, call, ("solid",))
    return answers.from_bounds(*call.compute(engine.bounds, solid))
