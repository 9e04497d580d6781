"""Questions and answers about points and one solid: containment, bounds, and the textbook's methods beside ours."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from service.schemas.arrays import DIMENSION, PAIR, POINTS, Array, Axis, Numbers
from service.schemas.base import Accuracy, AtMost, Count, Schema, optional, with_example
from service.schemas.geojson import OrGeoJson
from service.schemas.solids import (
    Body,
    Booleans,
    IndexLists,
    Indices,
    Number,
    Points,
    Position,
    RigidPose,
    Segments,
    Solid,
)

Doubles = Annotated[Array, Numbers(Axis(0, None))]
Positions = Annotated[Array, Numbers(Axis(0, None), DIMENSION)]
Integers = Annotated[Array, Numbers(Axis(0, None), kind="integer")]


class ContainsRequest(Schema):
    """Which of these points lie in this solid?"""

    model_config = with_example(
        {
            "solid": {"type": "sphere", "center": [0, 0, 0], "radius": 5},
            "points": [[3, 4, 0], [3, 4, 1e-300], [0, 0, 0]],
        }
    )

    solid: Solid = Field(description="Any but a surface.")
    points: Points = Field(
        description="Positions of the solid's dimension. Or GeoJSON: Point, MultiPoint, or a collection of these."
    )


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


class DistancesRequest(Schema):
    """How far are these points from this solid?"""

    model_config = with_example(
        {
            "solid": {"type": "aabb", "min": [0, 0, 0], "max": [2, 2, 2]},
            "points": [[3, 1, 1], [1, 1, 0.5], [5, 6, 1]],
            "signed": True,
        },
        {"solid": {"type": "sphere", "center": [0, 0], "radius": 5}, "points": [[3, 4], [6, 8]], "within": 5},
        {
            "solid": {"type": "polygon", "rings": [[[0, 0], [4, 0], [4, 4]]]},
            "points": [[9, 0]],
            "pose": {"rotation": [[0, -1], [1, 0]], "translation": [2, 0]},
            "to": "boundary",
            "nearest": True,
        },
        {"lines": [[[0, 0], [4, 0], [4, 3]], [[9, 9], [9, 5]]], "points": [[5, 1], [8, 9]], "nearest": True},
    )

    solid: Solid = optional("Neither implicit nor csg; a triangle of space is flat here. Either this or `lines`.")
    lines: Annotated[
        Array, Numbers(Axis(1, "max_points"), Axis(2, "max_points"), PAIR, ragged=True), OrGeoJson("LineString")
    ] = optional("Polylines of the plane, two positions or more each, or GeoJSON of lines: distances from the nearest.")
    points: Points = Field(description="Positions of the solid's dimension, or GeoJSON of points.")
    pose: RigidPose = optional("Where the solid is; where its coordinates have it, unless given.")
    to: Literal["solid", "boundary"] = optional("solid, unless given: points in it are 0 away.")
    signed: bool = optional("Distances from the boundary, negative inside.")
    within: Annotated[float, Numbers(minimum=0)] = optional(
        "A distance: the answer is then for each point whether it is at most so far away, decided exactly."
    )
    nearest: bool = optional("Also the nearest points, and what of the solid they lie on.")

    @model_validator(mode="after")
    def _has_one_target(self) -> DistancesRequest:
        if (self.solid is None) == (self.lines is None):
            raise ValueError("distances are measured from one of solid and lines; give one of the two")
        return self


class NearestFeature(Schema):
    """What of a solid a nearest point lies on."""

    kind: Literal["vertex", "edge", "face", "ball", "plane", "inside"] = Field(
        description="inside: the point itself lies in the solid."
    )
    indices: list[Count] = Field(description="Of a vertex, an edge's two, a face or a plane; else none.")


class DistancesResponse(Schema):
    """One answer for each point."""

    distances: Doubles = optional("Without `within`: each the nearest double.")
    within: Booleans = optional("With `within`.")
    nearest: Positions = optional("With `nearest`: the nearest point of the solid, each coordinate the nearest double.")
    faces: Integers = optional("With `nearest`: the face it is on, of several the least; -1 for none.")
    features: list[NearestFeature] = optional("With `nearest`: what of the solid it is.")
    accuracy: Accuracy


class SceneDistancesResponse(Schema):
    """Of each point the nearest body, or whether one is near."""

    distances: Doubles = optional("From the nearest body, each the nearest double; 0 within it.")
    bodies: Indices = optional("That body; of several at one double the first.")
    nearest: Positions = optional("The nearest point of it.")
    within: Booleans = optional("With `within`, instead of the others.")
    accuracy: Accuracy


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


NEEDED = {
    "contains": ("points", "solid"),
    "collide": ("first", "second"),
    "clip_segments": ("segments", "region"),
    "clip_polygons": ("polygons", "region"),
}
"""The fields of each operation, in the order of the engine's arguments."""
_TETRAHEDRON = {
    "type": "polyhedron",
    "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
}


class CompareRequest(Schema):
    """Where does the textbook's plain float64 method go wrong on this question, and what does exactness cost?"""

    model_config = with_example(
        {
            "operation": "clip_segments",
            "region": {"type": "aabb", "min": [0, 0], "max": [1, 3]},
            "segments": [[[-0.1, 0.3], [0.2, -0.6]], [[2, 2], [0.5, 0.5]]],
        },
        {
            "operation": "contains",
            "method": "half-line",
            "solid": {"type": "polygon", "rings": [[[0, 0], [3, 1], [1, 3]]]},
            "points": [[0.3, 0.1], [0.9, 0.3], [1, 1]],
        },
        {
            "operation": "clip_polygons",
            "region": {"type": "half_space", "normal": [-1, -3], "offset": 1},
            "polygons": [[[0, 0], [1, 0], [0, 1]]],
        },
        {
            "operation": "collide",
            "first": _TETRAHEDRON,
            "second": {**_TETRAHEDRON, "vertices": [[1, 0, 0], [2, 0, 0], [1, 1, 0], [1, 0, 1]]},
        },
    )

    operation: Literal["contains", "collide", "clip_segments", "clip_polygons"] = Field(
        description="What is asked of both; it says which other fields are needed."
    )
    method: str = optional("One of the textbook's methods; left out, the first. A wrong one is answered with a list.")
    solid: Solid = optional(
        "contains: half_space, aabb, convex, polyhedron, triangle, polygon, implicit, or a csg of these."
    )
    points: Points = optional("contains.")
    first: Solid = optional("collide: a polyhedron.")
    second: Solid = optional("collide: a polyhedron.")
    region: Solid = optional("clip_segments: half_space, aabb, convex, sphere; clip_polygons: not the sphere.")
    segments: Segments = optional("clip_segments: two end points each.")
    polygons: Annotated[Array, Numbers(POINTS, Axis(1, "max_points"), DIMENSION)] = optional(
        "clip_polygons: one ring each, all of as many vertices."
    )

    @model_validator(mode="after")
    def _is_complete(self) -> CompareRequest:
        if missing := [name for name in NEEDED[self.operation] if getattr(self, name) is None]:
            raise ValueError(f"{self.operation} needs {' and '.join(missing)}")
        return self


class CompareResponse(Schema):
    """Where both differ, and what both took."""

    method: str = Field(description="The textbook's method that was asked.")
    methods: list[str] = Field(description="All that the textbook has for this question.")
    differing: Indices = Field(description="Items that plain float64 decides wrongly.")
    inexact: Indices = Field(description="Items decided rightly, with a coordinate that is not the nearest double.")
    seconds_exact: Number = Field(description="What the exact answer took.")
    seconds_plain: Number = Field(description="What the textbook's method took.")
    accuracy: Accuracy
