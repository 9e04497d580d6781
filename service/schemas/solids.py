"""Solids as JSON: one model each, a union told apart by `type`, and poses and bodies made of them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Union

from pydantic import Field, RootModel, WithJsonSchema

from service.schemas.arrays import DIMENSION, Array, Axis, Numbers
from service.schemas.limits import AtMost, left_out
from service.schemas.problem import Count, Schema, with_example

Number = Annotated[float, Numbers()]
Position = Annotated[Array, Numbers(DIMENSION)]
Vertices2 = Annotated[Array, Numbers(Axis(1, "max_points"), Axis(2, 2))]
Vertices3 = Annotated[Array, Numbers(Axis(1, "max_points"), Axis(3, 3))]
Faces = Annotated[Any, Numbers(Axis(1, "max_faces"), Axis(3, "max_points"), kind="integer", ragged=True, minimum=0)]
SolidId = Annotated[
    str,
    Field(
        pattern=r"^[0-9a-f]{64}$",
        description="Name of a stored solid, from `POST /v1/solids`.",
        examples=["d4ec9f8dc18b3ff681a012bf465bc032b17d135780bdf7d89ce1915a5487626a"],
    ),
]


class HalfSpaceSolid(Schema):
    """All points p with dot(normal, p) + offset >= 0; the normal points inward."""

    type: Literal["half_space"]
    normal: Position = Field(description="Points inward; of any length but zero.")
    offset: Number = Field(description="Over the length of the normal: how far inside the origin lies.")


class SphereSolid(Schema):
    """All points at most `radius` away from `center` (a disc in 2D)."""

    type: Literal["sphere"]
    center: Position = Field(description="The centre.")
    radius: Number = Field(description="Zero or more.")


class AabbSolid(Schema):
    """All points with min <= p <= max on each axis."""

    type: Literal["aabb"]
    min: Position = Field(description="The corner with the least coordinates.")
    max: Position = Field(description="The corner with the greatest coordinates.")


class ConvexSolid(Schema):
    """All points with a x + b y + c z + d >= 0 for every row [a, b, c, d] (2D: [a, b, c]); may be unbounded
    or empty."""

    model_config = with_example({"type": "convex", "planes": [[1, 0, 1], [0, 1, 1], [-1, -1, 1]]})

    type: Literal["convex"]
    planes: Annotated[Array, Numbers(Axis(1, "max_planes"), Axis(3, 4))] = Field(description="Its rows.")


class PolyhedronSolid(Schema):
    """Everything within a closed, consistently oriented mesh (even-odd rule); faces by index, counter-clockwise seen
    from outside, triangles or simple polygons."""

    type: Literal["polyhedron"]
    vertices: Vertices3 = Field(description="Positions; those at equal coordinates are one.")
    faces: Faces = Field(description="Indices of vertices, three or more a face.")


class SurfaceSolid(Schema):
    """A mesh that encloses nothing, open or closed; for collision only."""

    model_config = with_example(
        {"type": "surface", "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2], [0, 2, 3]]}
    )

    type: Literal["surface"]
    vertices: Vertices3 = Field(description="Positions.")
    faces: Faces = Field(description="Indices of vertices, three or more a face.")


class TriangleSolid(Schema):
    """2D: a triangle. 3D: for `contains` the prism over it, unbounded both ways; flat for bounds."""

    type: Literal["triangle"]
    vertices: Annotated[Array, Numbers(Axis(3, 3), DIMENSION)] = Field(description="Three positions, in any order.")


class PolygonSolid(Schema):
    """Everything within the rings (even-odd rule over all of them, any orientation); a repeated last vertex is
    dropped."""

    type: Literal["polygon"]
    rings: Annotated[list[Vertices2], AtMost("max_rings")] = Field(description="Shells and holes alike.")


class Term(Schema):
    """coefficient * x**powers[0] * y**powers[1] (* z**powers[2])."""

    powers: Annotated[Array, Numbers(DIMENSION, kind="integer", minimum=0)] = Field(description="One for each axis.")
    coefficient: Number = Field(description="The factor before them.")


class ImplicitSolid(Schema):
    """All points where the sum of the terms is >= 0; total degree at most 16."""

    model_config = with_example(
        {
            "type": "implicit",
            "terms": [
                {"powers": [0, 0], "coefficient": 1},
                {"powers": [2, 0], "coefficient": -1},
                {"powers": [0, 4], "coefficient": -1},
            ],
        }
    )

    type: Literal["implicit"]
    terms: Annotated[list[Term], AtMost("max_terms", low=1)] = Field(description="What is added up.")


class CsgSolid(Schema):
    """A Boolean of solids: union, intersection, or the first minus the second."""

    model_config = with_example(
        {
            "type": "csg",
            "operation": "difference",
            "operands": [
                {"type": "aabb", "min": [0, 0], "max": [2, 2]},
                {"type": "sphere", "center": [1, 1], "radius": 0.5},
            ],
        }
    )

    type: Literal["csg"]
    operation: Literal["union", "intersection", "difference"] = Field(description="How the operands are combined.")
    operands: Annotated[list[Solid], AtMost("max_operands", low=1)] = Field(description="Solids of one dimension.")


class StoredSolid(Schema):
    """A solid put into the store before; usable wherever a solid is."""

    type: Literal["stored"]
    id: SolidId


class Solid(
    RootModel[
        Annotated[
            Union[  # noqa: UP007 (a named union is what code generators need)
                HalfSpaceSolid,
                SphereSolid,
                AabbSolid,
                ConvexSolid,
                PolyhedronSolid,
                SurfaceSolid,
                TriangleSolid,
                PolygonSolid,
                ImplicitSolid,
                CsgSolid,
                StoredSolid,
            ],
            Field(discriminator="type"),
        ]
    ]
):
    """A set of points in the plane or in space, boundary included, told apart by `type`."""

    model_config = with_example(
        {
            "type": "polyhedron",
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        }
    )


class RigidPose(Schema):
    """Moves a point p to R p + t; R is a rotation, row by row, of the solid's dimension."""

    rotation: Annotated[Array, Numbers(DIMENSION, DIMENSION)] = Field(description="R, a list of rows.")
    translation: Position = Field(description="t.")
    tolerance: Annotated[float, WithJsonSchema({"type": "number", "format": "double"})] = left_out(
        "How far an entry of R^T R may be from that of the unit matrix: 0 to 0.1, 1e-12 if left out. A matrix farther "
        "than 1e-12 stands for the rotation nearest to it, each entry the nearest double; 1e-6 takes float32 matrices."
    )


class Body(Schema):
    """A solid in its place; without a pose, where it stands."""

    solid: Solid
    pose: RigidPose = left_out("Where the body is; left out, where its solid stands.")


class StoredSolidSummary(Schema):
    """What the store holds under an id."""

    id: SolidId
    type: str = Field(description="Type of the solid.")
    dimension: Annotated[int, Numbers(kind="integer", minimum=2)] = Field(description="2 or 3.")
    vertices: Count = left_out("Number of vertices, for solids that have them.")
    faces: Count = left_out("Number of faces, planes, rings, terms or operands, for solids that have them.")
    memory: Count = Field(description="Bytes its arrays hold.")
    collapsed: Count = left_out(
        "Triangles of a file that are left out: two of their corners have equal coordinates.", [248]
    )


CsgSolid.model_rebuild()
