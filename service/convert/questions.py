"""Questions: JSON models to the engine's solids, poses, scenes and arrays, and its paths back into the request."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any, Final

import numpy as np
from fastapi import Query
from pydantic import BaseModel, RootModel, TypeAdapter, ValidationError

import engine
from engine import EngineError, Scene, Solid
from service.errors import ServiceError
from service.schemas import solids
from service.schemas.arrays import limit_sentence
from service.schemas.bodies import Keep, Moved, MovedBody
from service.schemas.clipping import ClipSegmentsRequest
from service.schemas.geojson import FromGeoJson, GeoJsonSolid
from service.schemas.points import BoundsRequest, ContainsRequest
from service.schemas.solids import Body
from service.work import Call, T, Where

_LIGHT_SOLIDS: Final = ("half_space", "sphere", "aabb", "convex", "triangle")


def to_solid(model: solids.Solid, call: Call, where: Where) -> Solid:
    """Return the engine's solid for `model`, which stands at `where` in the request."""
    with call.phase("prepare"):
        return _Builder(call).build(model, where, 1)


def to_solids(models: Any, call: Call, name: str) -> list[Solid]:
    """Return the solids of a list, or of the members of GeoJSON in its place. name: of the field."""
    where: Where = (name,)
    if isinstance(models, FromGeoJson):
        models, where = models.value, (name, models.name)
    return [to_solid(model, call, (*where, k)) for k, model in enumerate(models)]


class _Builder:
    """Builds one solid and counts the members of its CSG tree."""

    def __init__(self, call: Call) -> None:
        self._call = call
        self._n_nodes = 0

    def build(self, model: solids.Solid, where: Where, depth: int) -> Solid:
        member: Any = model.root
        self._count(1, depth, where)
        if isinstance(member, solids.StoredSolid):
            try:
                solid = self._call.store.get(member.id)
            except ServiceError as error:
                error.where = (*where, "id")
                raise
            if depth > 1 and isinstance(solid, engine.Csg):
                self._count(solid.n_leaves - 1, depth + solid.depth, where)
            return solid
        if isinstance(member, solids.CsgSolid):
            operands = [
                self.build(operand, (*where, "operands", i_operand), depth + 1)
                for i_operand, operand in enumerate(member.operands)
            ]
            return _checked(where, lambda: engine.Csg(member.operation, operands))
        if isinstance(member, GeoJsonSolid):
            return self.polygon(member.sent(), where)
        return _checked(where, lambda: _made(member))

    def polygon(self, value: dict[str, Any], where: Where) -> Solid:
        """Return the polygon of GeoJSON."""
        call = self._call
        made = _checked(where, lambda: engine.Polygon(value, deadline=call.remaining(), cancel=call))
        if made.n_rings > call.settings.max_rings:
            raise ServiceError(
                "limit_exceeded", limit_sentence("max_rings", call.settings.max_rings, made.n_rings), where
            )
        return made

    def _count(self, n_nodes: int, depth: int, where: Where) -> None:
        """Count n_nodes more solids of the whole tree, members of stored ones included."""
        settings = self._call.settings
        self._call.remaining()
        self._n_nodes += n_nodes
        if self._n_nodes > settings.max_csg_nodes:
            detail = (
                f"the tree has more than {settings.max_csg_nodes} solids, with those that stored ones are made of; "
                "split it, or raise GEOMETRY_MAX_CSG_NODES"
            )
            raise ServiceError("limit_exceeded", detail, where)
        if depth > settings.max_csg_depth + 1:
            detail = (
                f"the tree is more than {settings.max_csg_depth} levels deep; flatten it (union and intersection take "
                "many operands), or raise GEOMETRY_MAX_CSG_DEPTH"
            )
            raise ServiceError("too_deep", detail, where)


def _checked(where: Where, build: Callable[[], T]) -> T:
    try:
        return build()
    except EngineError as error:
        raise error.at(*where) from None


def _made(member: Any) -> Solid:
    """Return the solid of a model whose fields are its constructor's arguments."""
    row = engine.solid_types[member.type]
    fields = {name: getattr(member, name) for name in row.fields}
    return row.solid(**{name: _plain(value) for name, value in fields.items()})


def _plain(value: Any) -> Any:
    """Return models within a list as mappings, which constructors accept."""
    if isinstance(value, list) and value and isinstance(value[0], BaseModel):
        return [{name: getattr(item, name) for name in type(item).model_fields} for item in value]
    return value


def to_bodies(models: list[solids.Body], call: Call) -> tuple[list[Solid], list[engine.Pose] | None]:
    """Return the solids of a scene and their poses (None where no body has one)."""
    made = [to_solid(body.solid, call, ("bodies", i_body, "solid")) for i_body, body in enumerate(models)]
    if all(body.pose is None for body in models):
        return made, None
    poses = [
        to_pose(body.pose, ("bodies", i_body, "pose"))
        if body.pose is not None
        else engine.Pose.identity(solid.dimension)
        for i_body, (body, solid) in enumerate(zip(models, made))
    ]
    return made, poses


def to_pose(model: solids.RigidPose, where: Where) -> engine.Pose:
    """Return the engine's pose for `model`, which stands at `where` in the request."""
    return _checked(where, lambda: _pose(model))


def _pose(model: solids.RigidPose) -> engine.Pose:
    options = {name: getattr(model, name) for name in ("tolerance", "rounded") if getattr(model, name) is not None}
    if model.matrix is not None:
        return engine.Pose.from_matrix(model.matrix, **options)
    if model.quaternion is not None:
        moved = {} if model.translation is None else {"translation": model.translation}
        return engine.Pose.from_quaternion(model.quaternion, **moved)
    return engine.Pose(model.rotation, model.translation, **options)


def to_poses(models: list[solids.RigidPose], dimension: int) -> tuple[Any, Any]:
    """Return rotations ``(n, d, d)`` and translations ``(n, d)``; the engine checks that they are rigid."""
    rotations, translations = np.empty((len(models), dimension, dimension)), np.empty((len(models), dimension))
    for number, model in enumerate(models):
        pose: Any = model
        if model.rotation is None or model.translation is None or not model.tolerance is model.rounded is None:
            pose = to_pose(model, ("poses", number))
        if pose.rotation.shape != (dimension, dimension) or pose.translation.shape != (dimension,):
            raise engine.WrongDimensionError(
                f"pose {number} has a rotation of shape {pose.rotation.shape} and a translation of "
                f"{len(pose.translation)}; the bodies are {dimension}D",
                ("poses", number),
            )
        rotations[number], translations[number] = pose.rotation, pose.translation
    return rotations, translations


def to_items(items: Any, dimension: int, call: Call) -> Any:
    """Return an array; an empty JSON list has no dimension of its own, so it gets the solid's. Of GeoJSON the altitudes
    are left out of a question of the plane."""
    is_ours = not isinstance(items, FromGeoJson)
    array = items if is_ours else items.value
    if not len(array):
        return array if isinstance(array, list) else np.empty((0, *array.shape[1:-1], dimension))
    if is_ours or dimension == 3 or np.shape(array[0])[-1:] != (3,):
        return array
    call.note(
        f"{items.name}: altitudes, the third numbers of GeoJSON's positions, are left out of a question of the plane"
    )
    if isinstance(array, list):
        return [np.asarray(line, np.float64)[:, :2] for line in array]
    return np.ascontiguousarray(array[..., :2])


def to_polygons(items: Any, call: Call) -> Any:
    """Return lists of contours as they are, and polygons of what is GeoJSON."""
    if not isinstance(items, FromGeoJson):
        return items
    builder = _Builder(call)
    return [
        builder.polygon(each, ("polygons", *place)) if isinstance(each, dict) else each for place, each in items.value
    ]


def rewrite_error_paths_for_scene(error: EngineError) -> None:
    """Rewrite engine argument paths (`solids`, `poses`) to request paths (`bodies`)."""
    _rewrite_error_paths(error, "bodies", {"solids": "solid", "poses": "pose"})


def rewrite_error_paths_for_poses(error: EngineError) -> None:
    """Rewrite engine argument paths (`rotations`, `translations`) to request paths (`poses`)."""
    _rewrite_error_paths(error, "poses", {"rotations": "rotation", "translations": "translation"})


def _rewrite_error_paths(error: EngineError, name: str, parts: dict[str, str]) -> None:
    """Rewrite an argument's name, in path and message, to the list `name` whose items have these parts."""
    where = error.where
    if where and where[0] in parts:
        error.where = (name, where[1], parts[str(where[0])], *where[2:]) if len(where) > 1 else (name,)
    for argument, part in parts.items():
        error.message = re.sub(rf"\b{argument}(\[\d+\])", rf"{name}\1.{part}", error.message)


def existing(question: Any, where: Where) -> Where:
    """Return `where` as far as the request has it: an engine's error may lead into a stored solid."""
    value: Any = question
    path: list[str | int] = []
    for number, part in enumerate(where):
        value = value.root if isinstance(value, RootModel) else value
        if isinstance(value, FromGeoJson):
            return (*path, *_within_geojson(value, where[number:]))
        try:
            value = getattr(value, str(part)) if isinstance(value, BaseModel) else value[part]
        except (AttributeError, IndexError, KeyError, TypeError):
            break
        path.append(part)
    return tuple(path)


def _within_geojson(value: FromGeoJson, where: Where) -> Where:
    """Return a path below GeoJSON, of which a number means one of the items that were made of it."""
    if isinstance(where[0], str):
        return where
    if value.name in ("points", "lines"):
        return ()
    return (value.name, where[0]) if value.name else value.value[where[0]][0]


def is_light(question: Any) -> bool:
    """Return whether a small `question` certainly takes less time than a change of threads."""
    if isinstance(question, (ContainsRequest, BoundsRequest)):
        return question.solid.root.type in _LIGHT_SOLIDS
    if isinstance(question, ClipSegmentsRequest):
        return question.region.root.type in ("half_space", "aabb", "sphere")
    return False


KeepQuery = Annotated[Keep, Query(description="As in JSON: all, first or any.")]
_MOVED: TypeAdapter[list[MovedBody]] = TypeAdapter(Moved)


def to_scene(bodies: list[Body], call: Call) -> Scene:
    """Return the engine's scene of these bodies."""
    solids, poses = to_bodies(bodies, call)
    with call.phase("prepare"):
        try:
            return Scene(solids, poses)
        except EngineError as error:
            rewrite_error_paths_for_scene(error)
            raise


def to_moved(scene: Scene, moved: list[MovedBody] | None, call: Call) -> Scene:
    """Return a scene with some of its bodies moved."""
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
            pose = to_pose(item.pose, ("moved", place, "pose"))
            if pose.dimension != scene.solids[item.body].dimension:
                raise engine.WrongDimensionError(
                    f"moved[{place}] has a pose of dimension {pose.dimension}, the scene is "
                    f"{scene.solids[item.body].dimension}D",
                    ("moved", place, "pose"),
                )
            poses[item.body] = pose
        return scene.moved(poses)


def read_moved(text: str, call: Call) -> list[MovedBody]:
    """Return the moved bodies, from the query of the binary lane."""
    try:
        return _MOVED.validate_json(text, context=call)
    except ValidationError as error:
        reason = str(error.errors()[0]["msg"])
        raise ServiceError("invalid_request", f"query parameter 'moved': {reason:.200}, got {text!r:.100}") from None
