"""Question and answer of clipping polygons by Sutherland-Hodgman."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import DIMENSION, Array, Axis, Numbers
from service.schemas.limits import AtMost
from service.schemas.problem import Accuracy, Schema, with_example
from service.schemas.solids import Solid

Contour = Annotated[Array, Numbers(Axis(1, "max_points"), DIMENSION)]
Contours = Annotated[list[Contour], AtMost("max_rings", low=1)]
Indices = Annotated[Array, Numbers(Axis(0, None), kind="integer", minimum=0)]


class ClipPolygonsRequest(Schema):
    """What does Sutherland-Hodgman leave of these polygons on this convex region?"""

    model_config = with_example(
        {"region": {"type": "half_space", "normal": [-1, 0], "offset": 1}, "polygons": [[[[0, 0], [4, 0], [0, 4]]]]}
    )

    region: Solid = Field(description="half_space, aabb, convex, or a polyhedron that is convex.")
    polygons: Annotated[list[Contours], AtMost("max_polygons")] = Field(
        description="Each a list of contours, in 2D or 3D, planar or not."
    )


class ClippedPolygon(Schema):
    """What is left of one polygon; connected, contour by contour."""

    rings: list[Contour] = Field(description="Each coordinate is the float64 nearest to the exact one.")
    contours: Indices = Field(description="For each ring the contour it is left of; those that vanish are missing.")
    status: Literal["clipped", "too_complex"] = Field(description="too_complex: an exact vertex grew beyond the cap.")
    may_have_bridges: bool = Field(description="Edges along a plane may run there and back, or along another contour.")


class ClipPolygonsResponse(Schema):
    """One entry for each polygon."""

    polygons: list[ClippedPolygon] = Field(description="In the order of the request.")
    accuracy: Accuracy
