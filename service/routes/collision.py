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
    options = {"detail": bool(question.detail), "boolean": bool(question.boolean)}
    witness = not question.boolean if question.witness is None else question.witness
    if question.poses is None:
        return answers.from_collision(*call.compute(engine.collide, first, second, witness=witness, **options))
    rotations, translations = questions.to_poses(question.poses, second.dimension)
    found = call.compute(
        engine.collide_poses,
        first,
        second,
        rotations,
        translations,
        witnesses=witness,
        **options,
        retold=questions.tell_of_poses,
    )
    return answers.from_pose_collisions(*found, witness)


@router.post("/v1/collide/scene", operation_id="collide_scene")
def collide_scene(question: CollideSceneRequest, call: CallOf) -> CollideSceneResponse:
    """List every pair of bodies with a common point, or nearer than a gap, and how each lies to the other."""
    solids, poses = questions.to_bodies(question.bodies, call)
    options = {"detail": bool(question.detail), "boolean": bool(question.boolean)}
    named = {"skip": question.skip, "only": question.only, "gap": question.gap}
    found = call.compute(engine.collide_scene, solids, poses, **named, **options, retold=questions.tell_of_scene)
    return answers.from_scene_pairs(*found)
