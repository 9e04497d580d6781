"""Questions and answers about bodies: collision, clearance, scenes that are stored, segments through scenes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import PAIR, Array, Axis, Numbers
from service.schemas.base import Accuracy, AtMost, Count, Schema, optional, with_example
from service.schemas.solids import Body, Booleans, Number, Points, Position, RigidPose, Segments, Solid

CollisionRelation = Literal["disjoint", "first_inside_second", "second_inside_first", "overlapping", "touching"]
Detail = Literal["DC", "EC", "PO", "EQ", "TPP", "NTPP", "TPPi", "NTPPi"]
Pairs = Annotated[Array, Numbers(Axis(0, "max_pairs"), Axis(2, 2), kind="integer", minimum=0)]

_CUBE = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
_BALL = {"type": "sphere", "center": [2, 0.5, 0.5], "radius": 1}
_CHIP = {"type": "aabb", "min": [0, 0, 0], "max": [0.25, 0.25, 0.25]}
DETAIL = "Say which of the eight relations of RCC-8 holds too: tangentially inside (TPP), equal (EQ), ..."
_BOOLEAN = "Ask for disjoint or not alone: any other relation may then be answered as touching, sooner."
_DETAIL = "Which relation of RCC-8, where asked for; left out if a body has no interior."


class CollideRequest(Schema):
    """How does the first body lie to the second, for each pose of the second?"""

    model_config = with_example(
        {"first": _CUBE, "second": _BALL},
        {
            "first": _CUBE,
            "second": _CHIP,
            "poses": [
                {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [0.5, 0.5, 0.5]},
                {"rotation": [[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], "translation": [1, 0, 0], "tolerance": 1e-6},
                {"rotation": [[0.866025, -0.5, 0], [0.5, 0.866025, 0], [0, 0, 1]], "rounded": True},
                {"quaternion": [1, 0, 0, 1], "translation": [0, 0, 5]},
                {"matrix": [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]},
            ],
            "detail": True,
            "boolean": False,
            "witness": True,
        },
    )

    first: Solid = Field(description="3D: polyhedron, surface, aabb, sphere, half_space. 2D: polygon, triangle, ...")
    second: Solid = Field(description="The other body, of the same dimension.")
    poses: Annotated[list[RigidPose], AtMost("max_poses")] = optional(
        "Poses of `second`, one answer each; without them one answer for where it stands. Time is discrete: two poses "
        "may be free while a motion between them collides."
    )
    detail: bool = optional(DETAIL)
    boolean: bool = optional(_BOOLEAN)
    witness: bool = optional(
        "Name a reason for each contact: if left out, unless `boolean` is true; a single pair then has none."
    )


class CollisionWitness(Schema):
    """One reason why two bodies have a common point."""

    kind: Literal[
        "vertex_vertex", "vertex_edge", "vertex_face", "edge_edge", "edge_face", "face_face", "containment", "surface"
    ] = Field(
        description="How two faces meet; containment: one body lies in the other; surface: of a body without any."
    )
    first_face: Count = optional("Face of the first body, if it has faces.")
    second_face: Count = optional("Face of the second body, if it has faces.")
    containing: Literal["first", "second"] = optional("For containment the body that contains.")
    piercing: bool = Field(description="Touching only: a point of one body lies in the open interior of the other.")


class CollisionAnswer(Schema):
    """The first true line decides: no common point, disjoint; within the other's open interior, inside; the open
    interiors meet, overlapping; else touching."""

    relation: CollisionRelation = Field(description="How the first body lies to the second.")
    witness: CollisionWitness = optional("Left out when disjoint, and where none was asked for.")
    detail: Detail = optional(_DETAIL)


class CollideResponse(Schema):
    """One answer for each pose, or a single one."""

    collisions: list[CollisionAnswer] = Field(description="In the order of the poses.")
    accuracy: Accuracy


class CollideSceneRequest(Schema):
    """Which of these bodies collide?"""

    model_config = with_example(
        {
            "bodies": [
                {"solid": _CUBE},
                {"solid": _BALL},
                {"solid": _CUBE, "pose": {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [1, 0, 0]}},
            ]
        },
        {
            "bodies": [{"solid": _CUBE}, {"solid": _CHIP}, {"solid": _BALL}],
            "only": [[0, 1], [0, 2]],
            "detail": True,
            "boolean": False,
        },
        {
            "bodies": [
                {"solid": _CUBE},
                {"solid": _CUBE},
                {"solid": _CHIP, "pose": {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [1.5, 0, 0]}},
            ],
            "skip": [[0, 1]],
            "gap": 1,
        },
    )

    bodies: Annotated[list[Body], AtMost("max_bodies")] = Field(description="Solids of one dimension in their places.")
    skip: Pairs = optional("Pairs of bodies to leave out.")
    only: Pairs = optional("The only pairs to look at.")
    gap: Annotated[float, Numbers(minimum=0)] = optional(
        "A distance: pairs that do not meet but are nearer than that, decided exactly, are listed too, as disjoint."
    )
    detail: bool = optional(DETAIL)
    boolean: bool = optional(_BOOLEAN)


class CollidingPair(Schema):
    """Two bodies with a common point, or nearer than the gap."""

    first: Count = Field(description="Index of a body.")
    second: Count = Field(description="Index of a later body.")
    relation: CollisionRelation = Field(description="How the first body lies to the second.")
    detail: Detail = optional(_DETAIL)
    distance: Number = optional("With `gap` and without `boolean`: how far apart, 0 where they meet.")


class CollideSceneResponse(Schema):
    """Every pair found, by first, then second."""

    pairs: list[CollidingPair] = Field(description="Pairs that do not meet are left out.")
    accuracy: Accuracy


class ClearanceRequest(Schema):
    """How far is the first body from the second, for each pose of the second, or is it at least so far?"""

    model_config = with_example(
        {
            "first": {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]},
            "second": {"type": "sphere", "center": [4, 5, 1], "radius": 2},
        },
        {
            "first": {"type": "polygon", "rings": [[[0, 0], [1, 0], [0, 1]]]},
            "second": {"type": "aabb", "min": [0, 0], "max": [1, 1]},
            "poses": [
                {"rotation": [[1, 0], [0, 1]], "translation": [3, 0]},
                {"rotation": [[0, -1], [1, 0]], "translation": [0, 0]},
            ],
            "at_least": 2,
        },
    )

    first: Solid = Field(description="3D: polyhedron, surface, aabb, sphere, half_space. 2D: polygon, triangle, ...")
    second: Solid = Field(description="The other body, of the same dimension.")
    poses: Annotated[list[RigidPose], AtMost("max_poses")] = optional(
        "Poses of `second`, one answer each; without them one answer for where it stands."
    )
    at_least: Annotated[float, Numbers(minimum=0)] = optional(
        "A distance: the answer is then whether the bodies are so far apart or more, decided exactly."
    )


class ClearanceFeature(Schema):
    """What of a body its nearest point lies on."""

    kind: Literal["vertex", "edge", "face", "ball", "plane"] = Field(description="Of a mesh, a ball or a half-space.")
    indices: list[Count] = Field(description="Of a vertex, an edge's two, or a face; none of a ball or a plane.")


class ClearanceAnswer(Schema):
    """How far two bodies are apart."""

    distance: Number = Field(description="The nearest double; 0 exactly where they have a common point.")
    points: list[Position] = optional("A point of each at that distance; not where they meet, nor of several poses.")
    features: list[ClearanceFeature] = optional("What these points lie on.")


class ClearanceResponse(Schema):
    """One answer for each pose, or a single one."""

    clearances: list[ClearanceAnswer] = optional("Without `at_least`.")
    clear: list[bool] = optional("With `at_least`: whether they are so far apart, or more.")
    accuracy: Accuracy


SCENE_ID = "315bb78b1ee090e1bd3ad2a5e722e5cb7734a8d5cfdc93a370402255e09757e6"
SceneId = Annotated[
    str,
    Field(
        pattern=r"^[0-9a-f]{64}$", description="Name of a stored scene, from `POST /v1/scenes`.", examples=[SCENE_ID]
    ),
]
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
    moved: Moved = optional(_MOVED)


class SceneDistancesRequest(SceneContainsRequest):
    """How far is the nearest body of the stored scene from each of these points?"""

    model_config = with_example(
        {"points": [[0.5, 0.5], [3.5, 1]], "moved": [{"body": 1, "pose": _STEP}]},
        {"points": [[0.5, 0.5], [3.5, 1]], "within": 1},
    )

    within: Annotated[float, Numbers(minimum=0)] = optional(
        "A distance: the answer is then for each point whether a body is at most so far away, decided exactly."
    )


class SceneCollideRequest(Schema):
    """Which bodies of the stored scene collide?"""

    model_config = with_example(
        {"moved": [{"body": 1, "pose": {**_STEP, "translation": [1, 0]}}], "new": True, "detail": True},
        {"gap": 2.5, "only": [[0, 1]], "skip": [], "boolean": False},
    )

    moved: Moved = optional(_MOVED)
    new: bool = optional("Only pairs with a body of `moved`: with those known before, without these bodies, all pairs.")
    skip: Pairs = optional("Pairs of bodies to leave out.")
    only: Pairs = optional("The only pairs to look at.")
    gap: Annotated[float, Numbers(minimum=0)] = optional(
        "List the pairs that do not meet but are nearer than this too, as disjoint, each with its distance."
    )
    detail: bool = optional(DETAIL)
    boolean: bool = optional("Ask for disjoint or not alone, which takes less time.")


class SceneSegmentsRequest(Schema):
    """What of these segments lies within which body of the stored scene?"""

    model_config = with_example(
        {"segments": [[[-1, 0.5], [5, 0.5]]], "keep": "first", "moved": [{"body": 0, "pose": _STEP}]}
    )

    segments: Segments = Field(description="Two end points each.")
    keep: Keep = optional(_KEEP)
    moved: Moved = optional(_MOVED)


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
    keep: Keep = optional(_KEEP)


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

    pieces: list[ScenePiece] = optional("Left out where `keep` is any.")
    met: Booleans = optional("For each segment whether it meets a body, where `keep` is any.")
    accuracy: Accuracy
