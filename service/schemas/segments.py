"""Question and answer of clipping segments."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from service.schemas.arrays import DIMENSION, POINTS, Array, Axis, Numbers
from service.schemas.problem import Accuracy, Count, Schema, with_example
from service.schemas.solids import Position, Solid

PAIR = Axis(2, 2)


class ClipSegmentsRequest(Schema):
    """What remains of these segments within this region?"""

    model_config = with_example(
        {
            "region": {"type": "aabb", "min": [0, 0], "max": [2, 2]},
            "segments": [[[-1, 1], [3, 1]], [[5, 5], [6, 6]]],
        }
    )

    region: Solid = Field(description="half_space, aabb, convex, sphere, polygon or polyhedron.")
    segments: Annotated[Array, Numbers(POINTS, PAIR, DIMENSION)] = Field(description="Two end points each.")


class SegmentPiece(Schema):
    """A part of a segment that lies in the region; it may be a single point."""

    segment: Count = Field(description="Index of the segment that it is a part of.")
    start: Position = Field(description="Each coordinate is the float64 nearest to the exact one.")
    end: Position
    t: Annotated[Array, Numbers(PAIR)] = Field(description="Parameters of both ends: 0 and 1 are the segment's own.")
    faces: Annotated[Array, Numbers(PAIR, kind="integer", minimum=-1)] = Field(
        description="Plane or face of the region crossed at either end, -1 where the end is the segment's own."
    )


class ClipSegmentsResponse(Schema):
    """The pieces, by segment and then along it."""

    pieces: list[SegmentPiece]
    accuracy: Accuracy
