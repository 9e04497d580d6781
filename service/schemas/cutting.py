"""Questions and answers about solids that are measured, cut, and overlap."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import Array, Axis, Numbers
from service.schemas.base import Accuracy, AtMost, Schema, optional, with_example
from service.schemas.solids import Indices, Number, Position, RigidPose, Solid, Triples

_BOX = {
    "type": "polyhedron",
    "vertices": [[0, 0, 0], [3, 0, 0], [0, 2, 0], [3, 2, 0], [0, 0, 1], [3, 0, 1], [0, 2, 1], [3, 2, 1]],
    "faces": [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
}
Ring = Annotated[Array, Numbers(Axis(3, None), Axis(2, 3))]
Places = Annotated[Array, Numbers(Axis(0, None), Axis(3, 3))]
Origins = Annotated[Array, Numbers(Axis(0, None), kind="integer")]


class VolumeRequest(Schema):
    """What are the volume, the area and the centroid of this solid?"""

    model_config = with_example({"solid": _BOX})

    solid: Solid = Field(description="Polyhedron, surface, aabb, sphere, bounded convex, polygon or triangle.")


class VolumeResponse(Schema):
    """Each the double nearest to the exact value."""

    volume: Number = optional("Even-odd; left out in the plane and of a surface.")
    area: Number = Field(description="In the plane of the solid, in space of its surface, every face as given.")
    centroid: Position = optional("Left out of what has no volume, or in the plane no area.")
    accuracy: Accuracy


class SectionRequest(Schema):
    """What are the sections of this solid by these planes? One of `planes`, `heights` and `through`."""

    model_config = with_example(
        {"solid": _BOX, "heights": [0.25, 0.5]},
        {"solid": _BOX, "planes": [[1, 1, 0, -2]], "flat": True},
        {"solid": _BOX, "heights": [1], "normal": [1, 0, 0]},
        {"solid": _BOX, "through": [[0, 0, 0], [3, 2, 0], [0, 0, 1]]},
    )

    solid: Solid = Field(description="A polyhedron.")
    planes: Annotated[Array, Numbers(Axis(1, "max_planes"), Axis(4, 4))] = optional(
        "Rows [a, b, c, d] of half-spaces a x + b y + c z + d >= 0."
    )
    heights: Annotated[Array, Numbers(Axis(1, "max_planes"))] = optional("Of the planes dot(normal, p) = height.")
    normal: Annotated[Array, Numbers(Axis(3, 3))] = optional("Of heights; z if left out.")
    through: Annotated[Array, Numbers(Axis(3, 3), Axis(3, 3))] = optional("Three points, through which a plane passes.")
    flat: bool = optional("Answer in the coordinates of each plane, not of space.")


class SectionPiece(Schema):
    """A polygon of a plane."""

    shell: Ring = Field(description="Counter-clockwise seen against the normal; the first position is not repeated.")
    holes: list[Ring] = Field(description="Clockwise.")
    area: Number = Field(description="The double nearest to the exact area.")


class PlaneSection(Schema):
    """The section of one plane."""

    pieces: list[SectionPiece] = Field(description="None where the plane misses the solid.")


class SectionResponse(Schema):
    """One entry for each plane."""

    sections: list[PlaneSection] = Field(description="In the order of the request.")
    accuracy: Accuracy


class CutRequest(Schema):
    """What does this region leave of this solid, closed by caps?"""

    model_config = with_example(
        {"solid": _BOX, "region": {"type": "half_space", "normal": [-1, 0, 0], "offset": 1}, "keep": "both"},
    )

    solid: Solid = Field(description="A polyhedron.")
    region: Solid = Field(description="half_space, aabb, convex or convex polyhedron, of space.")
    keep: Literal["inside", "outside", "both"] = optional("Inside the region, if left out; both: inside, then outside.")


class CutPart(Schema):
    """A closed mesh; without faces where nothing is left."""

    vertices: Places = Field(description="Each coordinate is the float64 nearest to the exact one.")
    faces: Triples = Field(description="Triangles, counter-clockwise seen from outside.")
    origins: Origins = Field(description="The face of the solid that each is part of; -1 - k: the cap on plane k.")
    collapsed: Indices = Field(description="Faces that are flat after rounding.")
    folded: Indices = Field(description="Faces that rounding turned over.")
    volume: Number = Field(description="Of the exact result, the nearest double.")
    area: Number = Field(description="Of all faces of the exact result, the nearest double.")


class CutResponse(Schema):
    """One part, or two."""

    parts: list[CutPart] = Field(description="In the order of `keep`.")
    accuracy: Accuracy


class OverlapRequest(Schema):
    """How much do these two solids have in common, for each pose of the second?"""

    model_config = with_example(
        {
            "first": {"type": "aabb", "min": [0, 0, 0], "max": [2, 2, 2]},
            "second": {"type": "aabb", "min": [0, 0, 0], "max": [2, 2, 2]},
            "poses": [{"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [1, 1, 1]}],
        },
        {
            "first": {"type": "aabb", "min": [0, 0], "max": [2, 2]},
            "second": {"type": "aabb", "min": [1, 1], "max": [3, 3]},
        },
    )

    first: Solid = Field(
        description="aabb, convex or convex polyhedron, or any polyhedron beside one of these; polygons."
    )
    second: Solid = Field(description="The other, of the same dimension.")
    poses: Annotated[list[RigidPose], AtMost("max_poses")] = optional("Poses of `second`, one answer each.")


class OverlapAnswer(Schema):
    """What two solids have in common."""

    overlap: Number = Field(description="Volume, in the plane area: the double nearest to the exact one.")
    iou: Number = Field(description="Over the volume of their union; 0 where both have none.")


class OverlapResponse(Schema):
    """One answer for each pose, or a single one."""

    overlaps: list[OverlapAnswer] = Field(description="In the order of `poses`.")
    accuracy: Accuracy
