"""Which points lie in a solid, or in the bodies of a scene?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.containment import ContainsRequest, ContainsResponse, ContainsSceneRequest, ContainsSceneResponse
from service.work import CallOf

router = router_of("containment")


@router.post("/v1/contains", operation_id="contains")
def contains(question: ContainsRequest, call: CallOf) -> ContainsResponse:
    """Tell for each point whether it lies in the solid, boundary included, and which lie exactly on the boundary."""
    solid = questions.to_solid(question.solid, call, ("solid",))
    points = questions.to_items(question.points, solid.dimension)
    return answers.from_locations(*call.compute(engine.locate, points, solid))


@router.post("/v1/contains/scene", operation_id="contains_scene")
def contains_scene(question: ContainsSceneRequest, call: CallOf) -> ContainsSceneResponse:
    """List for each point the bodies that hold it, boundary included."""
    solids, poses = questions.to_bodies(question.bodies, call)
    points = questions.to_items(question.points, solids[0].dimension)
    found = call.compute(engine.locate_scene, points, solids, poses, retold=questions.tell_of_scene)
    return answers.from_scene_locations(*found)
