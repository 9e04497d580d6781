"""Question and answer of bounding volumes."""

from __future__ import annotations

from pydantic import Field

from service.schemas.problem import Accuracy, Schema, with_example
from service.schemas.solids import Number, Position, Solid


class BoundsRequest(Schema):
    """What is the smallest box, and the smallest sphere, that holds this solid?"""

    model_config = with_example({"solid": {"type": "triangle", "vertices": [[0, 0], [4, 0], [4, 3]]}})

    solid: Solid = Field(description="Bounded, not empty, neither implicit nor csg.")


class AabbBounds(Schema):
    """The smallest axis-aligned box."""

    min: Position = Field(description="Its least coordinates.")
    max: Position = Field(description="Its greatest coordinates.")


class SphereBounds(Schema):
    """The smallest sphere (circle in 2D)."""

    center: Position = Field(description="Each coordinate is the float64 nearest to the exact one.")
    radius: Number = Field(description="The least float64 with which the sphere about that centre holds the solid.")


class BoundsResponse(Schema):
    """Both bounding volumes."""

    aabb: AabbBounds
    sphere: SphereBounds
    accuracy: Accuracy
