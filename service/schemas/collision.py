"""Questions and answers of collision."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import Array, Axis, Numbers
from service.schemas.limits import AtMost, left_out
from service.schemas.problem import Accuracy, Count, Schema, with_example
from service.schemas.solids import Body, Number, RigidPose, Solid

CollisionRelation = Literal["disjoint", "first_inside_second", "second_inside_first", "overlapping", "touching"]
Detail = Literal["DC", "EC", "PO", "EQ", "TPP", "NTPP", "TPPi", "NTPPi"]
Pairs = Annotated[Array, Numbers(Axis(0, "max_pairs"), Axis(2, 2), kind="integer", minimum=0)]

_CUBE = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
_BALL = {"type": "sphere", "center": [2, 0.5, 0.5], "radius": 1}
_CHIP = {"type": "aabb", "min": [0, 0, 0], "max": [0.25, 0.25, 0.25]}
DETAIL = "Say which of the eight relations of RCC-8 holds too: tangentially inside (TPP), equal (EQ), ..."
_BOOLEAN = "Ask for disjoint or not alone: any other relation may then be answered as touching, sooner."
_FOUND = "Which relation of RCC-8, where asked for; left out if a body has no interior."


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
            ],
            "detail": True,
            "boolean": False,
            "witness": True,
        },
    )

    first: Solid = Field(description="3D: polyhedron, surface, aabb, sphere, half_space. 2D: polygon, triangle, ...")
    second: Solid = Field(description="The other body, of the same dimension.")
    poses: Annotated[list[RigidPose], AtMost("max_poses")] = left_out(
        "Poses of `second`, one answer each; without them one answer for where it stands. Time is discrete: two poses "
        "may be free while a motion between them collides."
    )
    detail: bool = left_out(DETAIL)
    boolean: bool = left_out(_BOOLEAN)
    witness: bool = left_out(
        "Name a reason for each contact: if left out, unless `boolean` is true; a single pair then has none."
    )


class CollisionWitness(Schema):
    """One reason why two bodies have a common point."""

    kind: Literal[
        "vertex_vertex", "vertex_edge", "vertex_face", "edge_edge", "edge_face", "face_face", "containment", "surface"
    ] = Field(
        description="How two faces meet; containment: one body lies in the other; surface: of a body without any."
    )
    first_face: Count = left_out("Face of the first body, if it has faces.")
    second_face: Count = left_out("Face of the second body, if it has faces.")
    containing: Literal["first", "second"] = left_out("For containment the body that contains.")
    piercing: bool = Field(description="Touching only: a point of one body lies in the open interior of the other.")


class CollisionAnswer(Schema):
    """The first true line decides: no common point, disjoint; within the other's open interior, inside; the open
    interiors meet, overlapping; else touching."""

    relation: CollisionRelation = Field(description="How the first body lies to the second.")
    witness: CollisionWitness = left_out("Left out when disjoint, and where none was asked for.")
    detail: Detail = left_out(_FOUND)


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
    skip: Pairs = left_out("Pairs of bodies to leave out.")
    only: Pairs = left_out("The only pairs to look at.")
    gap: Annotated[float, Numbers(minimum=0)] = left_out(
        "A distance: pairs that do not meet but are nearer than that, decided exactly, are listed too, as disjoint."
    )
    detail: bool = left_out(DETAIL)
    boolean: bool = left_out(_BOOLEAN)


class CollidingPair(Schema):
    """Two bodies with a common point, or nearer than the gap."""

    first: Count = Field(description="Index of a body.")
    second: Count = Field(description="Index of a later body.")
    relation: CollisionRelation = Field(description="How the first body lies to the second.")
    detail: Detail = left_out(_FOUND)
    distance: Number = left_out("With `gap` and without `boolean`: how far apart, 0 where they meet.")


class CollideSceneResponse(Schema):
    """Every pair found, by first, then second."""

    pairs: list[CollidingPair] = Field(description="Pairs that do not meet are left out.")
    accuracy: Accuracy
