"""Questions and answers of clipping segments and lines."""

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
        {"region": {"type": "aabb", "min": [0, 0], "max": [2, 2]}, "segments": [[[-1, 1], [3, 1]], [[5, 5], [6, 6]]]}
    )

    region: Solid = Field(description="half_space, aabb, convex, sphere, polygon or polyhedron.")
    segments: Annotated[Array, Numbers(POINTS, PAIR, DIMENSION)] = Field(description="Two end points each.")


class SegmentPiece(Schema):
    """A part of a segment that lies in the region; it may be a single point."""

    segment: Count = Field(description="Index of the segment that it is a part of.")
    start: Position = Field(description="Each coordinate is the float64 nearest to the exact one.")
    end: Position = Field(description="As `start`; equal to it where the piece is a point.")
    t: Annotated[Array, Numbers(PAIR)] = Field(description="Parameters of both ends: 0 and 1 are the segment's own.")
    faces: Annotated[Array, Numbers(PAIR, kind="integer", minimum=-1)] = Field(
        description="Plane or face of the region crossed at either end, -1 where the end is the segment's own."
    )


class ClipSegmentsResponse(Schema):
    """The pieces, by segment and then along it."""

    pieces: list[SegmentPiece] = Field(description="None where nothing remains.")
    accuracy: Accuracy


class ClipLinesRequest(Schema):
    """What remains of these polylines within this region?"""

    model_config = with_example(
        {
            "region": {"type": "aabb", "min": [0, 0], "max": [2, 2]},
            "lines": [[[-1, 1], [1, 1], [1, 3]], [[5, 5], [6, 6]]],
        }
    )

    region: Solid = Field(description="half_space, aabb, convex, sphere, polygon or polyhedron.")
    lines: Annotated[Array, Numbers(POINTS, Axis(2, "max_points"), DIMENSION, ragged=True)] = Field(
        description="Two positions or more each."
    )


class LinePiece(Schema):
    """A connected part of a line that lies in the region; it may be a single point, given twice."""

    line: Count = Field(description="Index of the line that it is a part of.")
    positions: Annotated[Array, Numbers(Axis(2, None), DIMENSION)] = Field(
        description="Both ends, each coordinate the float64 nearest to the exact one, and the line's own between them."
    )
    segments: Annotated[Array, Numbers(PAIR, kind="integer", minimum=0)] = Field(
        description="The segments of the line that both ends lie on: segment k goes from position k to k + 1."
    )
    t: Annotated[Array, Numbers(PAIR)] = Field(description="Parameters of both ends on those segments.")
    faces: Annotated[Array, Numbers(PAIR, kind="integer", minimum=-1)] = Field(
        description="Plane or face of the region crossed at either end, -1 where the end is the line's own."
    )


class ClipLinesResponse(Schema):
    """The pieces, by line and then along it."""

    pieces: list[LinePiece] = Field(description="None where nothing remains.")
    accuracy: Accuracy
