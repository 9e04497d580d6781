"""How do bodies lie to each other?"""

from __future__ import annotations

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.collision import CollideRequest, CollideResponse, CollideSceneRequest, CollideSceneResponse
from service.work import CallOf

router = router_of("collision")


@router.post("/v1/collide", operation_id="collide")
def collide(question: CollideRequest, call: CallOf) -> CollideResponse:
    """Tell how the first body lies to the second, for each pose of the second, with one reason."""
    first = questions.to_solid(question.first, call, ("first",))
    second = questions.to_solid(question.second, call, ("second",))
    if question.poses is None:
        return answers.from_collision(*call.compute(engine.collide, first, second, detail=bool(question.detail)))
    rotations, translations = questions.to_poses(question.poses, second.dimension)
    options = {"witnesses": True, "detail": bool(question.detail)}
    found = call.compute(
        engine.collide_poses, first, second, rotations, translations, **options, where=questions.where_in_poses
    )
    return answers.from_pose_collisions(*found)


@router.post("/v1/collide/scene", operation_id="collide_scene")
def collide_scene(question: CollideSceneRequest, call: CallOf) -> CollideSceneResponse:
    """List every pair of bodies with a common point, and how each lies to the other."""
    solids, poses = questions.to_bodies(question.bodies, call)
    options = {"skip": question.skip, "only": question.only, "detail": bool(question.detail)}
    found = call.compute(engine.collide_scene, solids, poses, **options, where=questions.where_in_scene)
    return answers.from_scene_pairs(*found)
