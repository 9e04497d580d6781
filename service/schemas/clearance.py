"""Question and answer of clearance."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import Numbers
from service.schemas.limits import AtMost, left_out
from service.schemas.problem import Accuracy, Count, Schema, with_example
from service.schemas.solids import Number, Position, RigidPose, Solid


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
    poses: Annotated[list[RigidPose], AtMost("max_poses")] = left_out(
        "Poses of `second`, one answer each; without them one answer for where it stands."
    )
    at_least: Annotated[float, Numbers(minimum=0)] = left_out(
        "A distance: the answer is then whether the bodies are so far apart or more, decided exactly."
    )


class ClearanceFeature(Schema):
    """What of a body its nearest point lies on."""

    kind: Literal["vertex", "edge", "face", "ball", "plane"] = Field(description="Of a mesh, a ball or a half-space.")
    indices: list[Count] = Field(description="Of a vertex, an edge's two, or a face; none of a ball or a plane.")


class ClearanceAnswer(Schema):
    """How far two bodies are apart."""

    distance: Number = Field(description="The nearest double; 0 exactly where they have a common point.")
    points: list[Position] = left_out("A point of each at that distance; not where they meet, nor of several poses.")
    features: list[ClearanceFeature] = left_out("What these points lie on.")


class ClearanceResponse(Schema):
    """One answer for each pose, or a single one."""

    clearances: list[ClearanceAnswer] = left_out("Without `at_least`.")
    clear: list[bool] = left_out("With `at_least`: whether they are so far apart, or more.")
    accuracy: Accuracy
