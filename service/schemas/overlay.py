"""Question and answer of Boolean operations on polygons."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import Array, Axis, Numbers
from service.schemas.limits import AtMost, left_out
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
        },
        {
            "subject": {"type": "polygon", "rings": [[[0, 0], [1, 0], [1, 1], [0, 1]]]},
            "clip": {"type": "polygon", "rings": [[[0.9999999999999999, 0.3], [2, 0.2], [2, 0.4]]]},
            "operation": "intersection",
            "area": True,
        },
        {
            "subject": {"type": "polygon", "rings": [_SQUARE]},
            "clip": {"type": "polygon", "rings": [[[4.00001, 0], [8, 0], [8, 4], [3.99999, 4]]]},
            "operation": "union",
            "grid": 0.001,
        },
    )

    subject: Solid = Field(description="A polygon.")
    clip: Solid = Field(description="A polygon.")
    operation: Literal["intersection", "union", "difference", "symmetric_difference"] = Field(
        description="How the two are combined; difference is the subject without the clip."
    )
    area: bool = left_out("Compute the area; if left out, where it costs next to nothing: up to 100 vertices.")
    grid: Number = left_out(
        "Snap the result to multiples of this power of two or ten, so that borders that nearly coincide do; no edge "
        "moves by more than 0.71 of it. `area` is then that of the output."
    )


class OverlayBatchRequest(Schema):
    """What is the intersection, union, difference or symmetric difference of these pairs of polygons?"""

    model_config = with_example(
        {
            "subjects": [{"type": "polygon", "rings": [_SQUARE]}, {"type": "polygon", "rings": []}],
            "clips": [
                {"type": "polygon", "rings": [[[2, 2], [6, 2], [6, 6], [2, 6]]]},
                {"type": "polygon", "rings": [_SQUARE]},
            ],
            "operation": "union",
        }
    )

    subjects: Annotated[list[Solid], AtMost("max_polygons")] = Field(description="Polygons.")
    clips: Annotated[list[Solid], AtMost("max_polygons")] = Field(description="As many polygons, each for one subject.")
    operation: Literal["intersection", "union", "difference", "symmetric_difference"] = Field(
        description="How the two of each pair are combined; difference is the subject without the clip."
    )


class OverlayPiece(Schema):
    """A connected part: `[shell, *holes]` are the coordinates of a GeoJSON Polygon."""

    shell: LinearRing = Field(description="Counter-clockwise; the last position repeats the first.")
    holes: list[LinearRing] = Field(description="Clockwise; the last position of each repeats its first.")


class OverlayCollapse(Schema):
    """A part of the exact result that rounding lost."""

    kind: Literal["piece", "hole"] = Field(description="What it was.")
    area: Number = left_out("Its area, correctly rounded; left out where it is beyond float64.")
    near: Position = Field(description="Its first vertex, rounded.")


class OverlayRounding(Schema):
    """What rounding to float64 did to the exact result.

    The output has `pieces_exact` - collapsed pieces - `pieces_joined` + `pieces_parted` pieces; likewise for holes.
    """

    rounds: Count = Field(description="How often the rings were rounded; 0 if the exact result is made of float64.")
    snapped: bool = Field(description="The coarser lattice of snap rounding was needed.")
    vertices_moved: Count = Field(description="Vertices that are not correctly rounded vertices of the exact result.")
    largest_displacement: Number = Field(description="Bound on the distance of an edge from its exact edge.")
    pieces_exact: Count = Field(description="Pieces of the exact result.")
    holes_exact: Count = Field(description="Holes of the exact result.")
    pieces_joined: Count = Field(description="Pieces fewer, since rounding joined some.")
    pieces_parted: Count = Field(description="Pieces more, since rounding parted some.")
    holes_joined: Count = Field(description="Holes fewer, since rounding joined some.")
    holes_parted: Count = Field(description="Holes more, since rounding parted some.")


class OverlayResponse(Schema):
    """The pieces: their coordinates together are those of a GeoJSON MultiPolygon."""

    pieces: list[OverlayPiece] = Field(description="Connected parts; none where the result is empty.")
    area: Number = left_out(
        "Area of the exact result, correctly rounded; left out where it is beyond float64, or was not asked for."
    )
    collapsed: list[OverlayCollapse] = Field(description="Parts that rounding lost; none where it lost nothing.")
    rounding: OverlayRounding
    accuracy: Accuracy


class OverlaidPair(Schema):
    """The result of one pair."""

    status: Literal["done", "not_representable"] = Field(
        description="not_representable: a coordinate of the result is beyond float64; there are no pieces then."
    )
    pieces: list[OverlayPiece] = Field(description="Their coordinates together are those of a GeoJSON MultiPolygon.")
    largest_displacement: Number = Field(description="Bound on the distance of an edge from its exact edge.")


class OverlayBatchResponse(Schema):
    """One entry for each pair."""

    overlays: list[OverlaidPair] = Field(description="In the order of the request.")
    accuracy: Accuracy
