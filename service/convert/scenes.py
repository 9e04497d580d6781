"""Scenes: bodies and what moved to the engine's scenes, and pieces of segments to answers."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from fastapi import Query
from pydantic import TypeAdapter, ValidationError

import engine
from engine import EngineError, Scene
from service.convert import questions
from service.convert.answers import from_accuracy
from service.errors import ServiceError
from service.schemas import scenes
from service.schemas.solids import Body
from service.wire import Series
from service.work import Call

KeepQuery = Annotated[scenes.Keep, Query(description="As in JSON: all, first or any.")]
_MOVED: TypeAdapter[list[scenes.MovedBody]] = TypeAdapter(scenes.Moved)


def to_scene(bodies: list[Body], call: Call) -> Scene:
    """Return the engine's scene of these bodies."""
    solids, poses = questions.to_bodies(bodies, call)
    with call.phase("prepare"):
        try:
            return Scene(solids, poses)
        except EngineError as error:
            questions.tell_of_scene(error)
            raise


def to_moved(scene: Scene, moved: list[scenes.MovedBody] | None, call: Call) -> Scene:
    """Return a scene with some of its bodies elsewhere."""
    if not moved:
        return scene
    poses: dict[int, engine.Pose | None] = {}
    with call.phase("prepare"):
        for place, item in enumerate(moved):
            if item.body in poses or item.body >= len(scene):
                why = "twice" if item.body in poses else f"which is not there; the scene has {len(scene)}"
                raise engine.IndexOutOfRangeError(
                    f"moved[{place}] names body {item.body}, {why}", ("moved", place, "body")
                )
            pose = questions.to_pose(item.pose, ("moved", place, "pose"))
            if pose.dimension != scene.solids[item.body].dimension:
                raise engine.WrongDimensionError(
                    f"moved[{place}] has a pose of dimension {pose.dimension}, the scene is "
                    f"{scene.solids[item.body].dimension}D",
                    ("moved", place, "pose"),
                )
            poses[item.body] = pose
        return scene.moved(poses)


def read_moved(text: str, call: Call) -> list[scenes.MovedBody]:
    """Return what moved, from the query of the binary lane."""
    try:
        return _MOVED.validate_json(text, context=call)
    except ValidationError as error:
        reason = str(error.errors()[0]["msg"])
        raise ServiceError("invalid_request", f"query parameter 'moved': {reason:.200}, got {text!r:.100}") from None


def from_stored(name: str, scene: Scene) -> scenes.StoredSceneSummary:
    """Return what the store says of a scene."""
    return scenes.StoredSceneSummary.made(
        id=name, dimension=scene.solids[0].dimension, bodies=len(scene), memory=scene.memory
    )


def clipped(scene: Scene, segments: Any, keep: scenes.Keep | None, call: Call) -> scenes.ClipSegmentsSceneResponse:
    """Return what of segments lies within which body."""
    if len(scene):
        segments = questions.to_items(segments, scene.solids[0].dimension)
    found, accuracy = call.compute(scene.clip_segments, segments, keep=keep or "all", retold=questions.tell_of_scene)
    if isinstance(found, np.ndarray):
        return scenes.ClipSegmentsSceneResponse.made(pieces=None, met=found, accuracy=from_accuracy(accuracy))
    columns = [getattr(found, name) for name in ("source", "body", "start", "end", "t", "faces", "ranks")]

    def some(start: int, stop: int) -> list[Any]:
        names = ("segment", "body", "start", "end", "t", "faces", "ranks")
        return [dict(zip(names, row)) for row in zip(*(column[start:stop].tolist() for column in columns))]

    return scenes.ClipSegmentsSceneResponse.made(
        pieces=Series(len(found), some, weight=12), met=None, accuracy=from_accuracy(accuracy)
    )


def from_pieces(found: Any, call: Call) -> Any:
    """Return pieces as rows of float64, or whether each segment meets a body as int8."""
    if isinstance(found, np.ndarray):
        return found.astype(np.int8)
    call.take(8 * len(found) * (4 + 2 * found.start.shape[1]))
    return np.column_stack([found.source, found.body, found.t, found.start, found.end])


def from_locations(found: engine.SceneLocations, call: Call) -> Any:
    """Return rows of point, body and location."""
    call.take(24 * len(found.indices))
    points = np.repeat(np.arange(len(found.offsets) - 1), np.diff(found.offsets))
    return np.column_stack([points, found.indices, 1 - found.on_boundary.astype(np.int64)])
