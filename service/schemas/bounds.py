"""Question and answer of bounding volumes."""

from __future__ import annotations

from service.schemas.problem import Accuracy, Schema, with_example
from service.schemas.solids import Number, Position, Solid


class BoundsRequest(Schema):
    """What is the smallest box, and the smallest sphere, that holds this solid?"""

    model_config = with_example({"solid": {"type": "triangle", "vertices": [[0, 0], [4, 0], [4, 3]]}})

    solid: Solid


class AabbBounds(Schema):
    """The smallest axis-aligned box."""

    min: Position
    max: Position


class SphereBounds(Schema):
    """The smallest sphere (circle in 2D)."""

    center: Position
    radius: Number


class BoundsResponse(Schema):
    """Both bounding volumes."""

    aabb: AabbBounds
    sphere: SphereBounds
    accuracy: Accuracy
