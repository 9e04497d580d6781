"""Question and answer of Boolean operations on polygons."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import Array, Axis, Numbers
from service.schemas.limits import left_out
from service.schemas.problem import Accuracy, Count, Schema, with_example
from service.schemas.solids import Number, Position, Solid

LinearRing = Annotated[Array, Numbers(Axis(4, None), Axis(2, 2))]
_SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


class OverlayRequest(Schema):
    """What is the intersection, union, difference or symmetric difference of these two polygons?"""

    model_config = with_example(
        {
            "subject": {"type": "polygon", "rings": [_SQUARE, [[1, 1], [2, 1], [1, 2]]]},
            "clip": {"type": "polygon", "rings": [[[2, 2], [6, 2], [6, 6], [2, 6]]]},
            "operation": "difference",
        }
    )

    subject: Solid = Field(description="A polygon.")
    clip: Solid = Field(description="A polygon.")
    operation: Literal["intersection", "union", "difference", "symmetric_difference"]
    output: Literal["valid", "nearest"] = left_out(
        "valid (if left out): rings that are simple and cross nowhere; nearest: every vertex correctly rounded and no "
        "more, which may be invalid."
    )
    area: bool = left_out("Compute the area; if left out, where it costs next to nothing: up to 100 vertices.")


class OverlayPiece(Schema):
    """A connected part: `[shell, *holes]` are the coordinates of a GeoJSON Polygon."""

    shell: LinearRing = Field(description="Counter-clockwise; the last position repeats the first.")
    holes: list[LinearRing] = Field(description="Clockwise; the last position of each repeats its first.")


class OverlayCollapse(Schema):
    """A part of the exact result that rounding lost."""

    kind: Literal["piece", "hole"]
    area: Number = left_out("Its area, correctly rounded; left out where it is beyond float64.")
    near: Position = Field(description="Its first vertex, rounded.")


class OverlayRounding(Schema):
    """What rounding to float64 did to the exact result.

    The output has `pieces_exact` - collapsed pieces - `pieces_joined` + `pieces_parted` pieces; likewise for holes.
    """

    may_be_invalid: bool = Field(description="`nearest` was asked for, and rounding moved a vertex.")
    rounds: Count = Field(description="How often the rings were rounded; 0 if the exact result is made of float64.")
    snapped: bool = Field(description="The coarser lattice of snap rounding was needed.")
    vertices_moved: Count = Field(description="Vertices that are not correctly rounded vertices of the exact result.")
    largest_displacement: Number = Field(description="Bound on the distance of an edge from its exact edge.")
    pieces_exact: Count
    holes_exact: Count
    pieces_joined: Count
    pieces_parted: Count
    holes_joined: Count
    holes_parted: Count


class OverlayResponse(Schema):
    """The pieces: their coordinates together are those of a GeoJSON MultiPolygon."""

    pieces: list[OverlayPiece]
    area: Number = left_out(
        "Area of the exact result, correctly rounded; left out where it is beyond float64, or was not asked for."
    )
    collapsed: list[OverlayCollapse]
    rounding: OverlayRounding
    accuracy: Accuracy
