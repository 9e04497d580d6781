"""Questions and answers of containment."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from service.schemas.arrays import DIMENSION, POINTS, Array, Axis, Numbers
from service.schemas.limits import AtMost
from service.schemas.problem import Accuracy, Schema, with_example
from service.schemas.solids import Body, Solid

Points = Annotated[Array, Numbers(POINTS, DIMENSION)]
Booleans = Annotated[Array, Numbers(Axis(0, None), kind="boolean")]
Indices = Annotated[Array, Numbers(Axis(0, None), kind="integer", minimum=0)]
IndexLists = Annotated[list[list[int]], Numbers(Axis(0, None), Axis(0, None), kind="integer", ragged=True, minimum=0)]


class ContainsRequest(Schema):
    """Which of these points lie in this solid?"""

    model_config = with_example(
        {
            "solid": {"type": "sphere", "center": [0, 0, 0], "radius": 5},
            "points": [[3, 4, 0], [3, 4, 1e-300], [0, 0, 0]],
        }
    )

    solid: Solid = Field(description="Any but a surface.")
    points: Points = Field(description="Positions of the solid's dimension.")


class ContainsResponse(Schema):
    """One answer for each point."""

    contained: Booleans = Field(description="For each point whether the solid holds it; its boundary counts.")
    boundary: Indices = Field(description="Indices of the points exactly on the boundary, ascending.")
    accuracy: Accuracy


class ContainsSceneRequest(Schema):
    """Which of these bodies hold each of these points?"""

    model_config = with_example(
        {
            "bodies": [
                {"solid": {"type": "aabb", "min": [0, 0], "max": [1, 1]}},
                {
                    "solid": {"type": "aabb", "min": [0, 0], "max": [1, 1]},
                    "pose": {"rotation": [[0, -1], [1, 0]], "translation": [2, 0]},
                },
            ],
            "points": [[0.5, 0.5], [1, 0.5], [9, 9]],
        }
    )

    bodies: Annotated[list[Body], AtMost("max_bodies", low=1)] = Field(
        description="Solids of one dimension in their places."
    )
    points: Points = Field(description="Positions of the bodies' dimension.")


class ContainsSceneResponse(Schema):
    """For each point the bodies that hold it."""

    bodies: IndexLists = Field(description="For each point the indices of the bodies that hold it, ascending.")
    boundary: IndexLists = Field(description="For each point those of them on whose boundary it lies.")
    accuracy: Accuracy
