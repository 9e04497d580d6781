"""Scenes that are stored, segments through scenes, and what moved."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import DIMENSION, POINTS, Array, Numbers
from service.schemas.collision import DETAIL, Pairs
from service.schemas.containment import Booleans, Points
from service.schemas.limits import AtMost, left_out
from service.schemas.problem import Accuracy, Count, Schema, with_example
from service.schemas.segments import PAIR
from service.schemas.solids import Body, Position, RigidPose

SCENE_ID = "315bb78b1ee090e1bd3ad2a5e722e5cb7734a8d5cfdc93a370402255e09757e6"
SceneId = Annotated[
    str,
    Field(
        pattern=r"^[0-9a-f]{64}$", description="Name of a stored scene, from `POST /v1/scenes`.", examples=[SCENE_ID]
    ),
]
Segments = Annotated[Array, Numbers(POINTS, PAIR, DIMENSION)]
Keep = Literal["all", "first", "any"]

_SQUARE = {"type": "aabb", "min": [0, 0], "max": [1, 1]}
_STEP = {"rotation": [[1, 0], [0, 1]], "translation": [3, 0]}
_BODIES = [{"solid": _SQUARE}, {"solid": _SQUARE, "pose": _STEP}]
_KEEP = (
    "all: every piece within every body, if left out. first: of each segment the one that begins first, of those that "
    "begin at one point that of the first body. any: only whether it meets a body."
)


class SceneModel(Schema):
    """Bodies that are asked again and again."""

    model_config = with_example({"bodies": _BODIES})

    bodies: Annotated[list[Body], AtMost("max_bodies", low=1)] = Field(description="All of one dimension.")


class StoredSceneSummary(Schema):
    """What the store holds under an id."""

    id: SceneId
    dimension: Annotated[int, Numbers(kind="integer", minimum=2)] = Field(description="2 or 3.")
    bodies: Count = Field(description="How many bodies it has.")
    memory: Count = Field(description="Bytes that its arrays hold, those of its solids and of what is prepared too.")


class MovedBody(Schema):
    """A body of a stored scene, for this question under another pose; nothing is changed in the store."""

    body: Count = Field(description="Index of the body.")
    pose: RigidPose = Field(description="Where it is instead.")


Moved = Annotated[list[MovedBody], AtMost("max_bodies")]
_MOVED = "Bodies that are elsewhere for this question, each once; nothing is changed in the store."


class SceneContainsRequest(Schema):
    """Which bodies of the stored scene hold each of these points?"""

    model_config = with_example({"points": [[0.5, 0.5], [3.5, 1]], "moved": [{"body": 1, "pose": _STEP}]})

    points: Points = Field(description="Of the dimension of the scene.")
    moved: Moved = left_out(_MOVED)


class SceneCollideRequest(Schema):
    """Which bodies of the stored scene collide?"""

    model_config = with_example(
        {"moved": [{"body": 1, "pose": {**_STEP, "translation": [1, 0]}}], "new": True, "detail": True},
        {"gap": 2.5, "only": [[0, 1]], "skip": [], "boolean": False},
    )

    moved: Moved = left_out(_MOVED)
    new: bool = left_out("Only pairs with a body of `moved`: with those known before, without these bodies, all pairs.")
    skip: Pairs = left_out("Pairs of bodies to leave out.")
    only: Pairs = left_out("The only pairs to look at.")
    gap: Annotated[float, Numbers(minimum=0)] = left_out(
        "List the pairs that do not meet but are nearer than this too, as disjoint, each with its distance."
    )
    detail: bool = left_out(DETAIL)
    boolean: bool = left_out("Ask for disjoint or not alone, which takes less time.")


class SceneSegmentsRequest(Schema):
    """What of these segments lies within which body of the stored scene?"""

    model_config = with_example(
        {"segments": [[[-1, 0.5], [5, 0.5]]], "keep": "first", "moved": [{"body": 0, "pose": _STEP}]}
    )

    segments: Segments = Field(description="Two end points each.")
    keep: Keep = left_out(_KEEP)
    moved: Moved = left_out(_MOVED)


class ClipSegmentsSceneRequest(Schema):
    """What of these segments lies within which of these bodies?"""

    model_config = with_example(
        {"bodies": _BODIES, "segments": [[[-1, 0.5], [5, 0.5]]]},
        {"bodies": _BODIES, "segments": [[[-1, 0.5], [5, 0.5]], [[0, 9], [1, 9]]], "keep": "any"},
    )

    bodies: Annotated[list[Body], AtMost("max_bodies")] = Field(
        description="half_space, aabb, convex, sphere, triangle, polygon, polyhedron, surface and csg of these."
    )
    segments: Segments = Field(description="Two end points each.")
    keep: Keep = left_out(_KEEP)


class ScenePiece(Schema):
    """A part of a segment that lies in a body; it may be a single point."""

    segment: Count = Field(description="Index of the segment that it is a part of.")
    body: Count = Field(description="Index of the body that it lies in.")
    start: Position = Field(description="Each coordinate is the float64 nearest to the exact one.")
    end: Position = Field(description="As `start`; equal to it where the piece is a point.")
    t: Annotated[Array, Numbers(PAIR)] = Field(description="Parameters of both ends: 0 and 1 are the segment's own.")
    faces: Annotated[Array, Numbers(PAIR, kind="integer", minimum=-1)] = Field(
        description="Plane or face of the body crossed at either end, -1 where the end is the segment's own."
    )
    ranks: Annotated[Array, Numbers(PAIR, kind="integer", minimum=0)] = Field(
        description="Places of both ends in the exact order of all ends along the segment; equal: the same point."
    )


class ClipSegmentsSceneResponse(Schema):
    """The pieces, by segment, then by where they start, then by body; or whether each segment meets a body."""

    pieces: list[ScenePiece] = left_out("Left out where `keep` is any.")
    met: Booleans = left_out("For each segment whether it meets a body, where `keep` is any.")
    accuracy: Accuracy
