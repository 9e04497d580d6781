"""How far apart are bodies?"""

from __future__ import annotations

from typing import Any

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.clearance import ClearanceRequest, ClearanceResponse
from service.work import CallOf

router = router_of("clearance")


@router.post("/v1/clearance", operation_id="clearance")
def clearance(question: ClearanceRequest, call: CallOf) -> ClearanceResponse:
    """Tell how far apart two bodies are, exactly, for each pose of the second; or whether at least so far."""
    first = questions.to_solid(question.first, call, ("first",))
    second = questions.to_solid(question.second, call, ("second",))
    found: Any
    if question.poses is None:
        found, accuracy = call.compute(engine.clearance, first, second, at_least=question.at_least)
        found = [found]
    else:
        rotations, translations = questions.to_poses(question.poses, second.dimension)
        found, accuracy = call.compute(
            engine.clearance_poses,
            first,
            second,
            rotations,
            translations,
            at_least=question.at_least,
            retold=questions.tell_of_poses,
        )
        if len(translations) == 1 and question.at_least is None:  # of one pose the points are told, too
            pose = engine.Pose(rotations[0], translations[0])
            found, accuracy = call.compute(engine.clearance, first, second, second_pose=pose)
            found = [found]
    return answers.from_clearances(found, accuracy, question.at_least is not None)
