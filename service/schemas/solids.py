"""Solids as JSON: one model each, a union told apart by `type`, and poses and bodies made of them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Union

from pydantic import Field, RootModel, WithJsonSchema, create_model, model_validator

import engine
from service.schemas.arrays import DIMENSION, PAIR, POINTS, Array, Axis, Numbers
from service.schemas.base import Accuracy, AtMost, Count, Schema, optional, with_example
from service.schemas.geojson import GeoJsonSolid, OrGeoJson

Number = Annotated[float, Numbers()]
Position = Annotated[Array, Numbers(DIMENSION)]
Points = Annotated[Array, Numbers(POINTS, DIMENSION), OrGeoJson("Point")]
Booleans = Annotated[Array, Numbers(Axis(0, None), kind="boolean")]
Indices = Annotated[Array, Numbers(Axis(0, None), kind="integer", minimum=0)]
IndexLists = Annotated[list[list[int]], Numbers(Axis(0, None), Axis(0, None), kind="integer", ragged=True, minimum=0)]
Segments = Annotated[Array, Numbers(POINTS, PAIR, DIMENSION), OrGeoJson("LineString")]
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


class Term(Schema):
    """coefficient * x**powers[0] * y**powers[1] (* z**powers[2])."""

    powers: Annotated[Array, Numbers(DIMENSION, kind="integer", minimum=0)] = Field(description="One for each axis.")
    coefficient: Number = Field(description="The factor before them.")


_KINDS: dict[str, Any] = {
    "number": Number,
    "position": Position,
    "rows": Annotated[Array, Numbers(Axis(1, "max_planes"), Axis(3, 4))],
    "vertices": Vertices3,
    "three": Annotated[Array, Numbers(Axis(3, 3), DIMENSION)],
    "faces": Faces,
    "rings": Annotated[list[Vertices2], AtMost("max_rings")],
    "terms": Annotated[list[Term], AtMost("max_terms", low=1)],
}
"""What stands in a field of each kind (`engine.solid_types`)."""


def _model_of(row: Any) -> type[Schema]:
    """Return the model of a type of solid, as its row has it."""
    fields: dict[str, Any] = {"type": (Literal[row.name], ...)}
    for name, field in row.fields.items():
        fields[name] = (_KINDS[field.kind], Field(description=field.about))
    title = "".join(part.title() for part in row.name.split("_"))
    base: Any = Schema
    if row.example is not None:
        base = type(title, (Schema,), {"model_config": with_example({"type": row.name, **row.example})})
    return create_model(f"{title}Solid", __base__=base, __module__=__name__, __doc__=row.about, **fields)


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


_MEMBERS = *(_model_of(row) for row in engine.solid_types.values() if row.fields), CsgSolid, StoredSolid, GeoJsonSolid
_Member: Any = Union[_MEMBERS]  # noqa: UP007 (there is no other way to write a union of a tuple)


class Solid(RootModel[Annotated[_Member, Field(discriminator="type")]]):
    """A set of points in the plane or in space, boundary included, told apart by `type`."""

    model_config = with_example(
        {
            "type": "polyhedron",
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        }
    )


class RigidPose(Schema):
    """Moves a point p to R p + t; one of `rotation`, `quaternion` and `matrix`."""

    rotation: Annotated[Array, Numbers(DIMENSION, DIMENSION)] = optional("R, a list of rows.")
    quaternion: Annotated[Array, Numbers(Axis(4, 4))] = optional("R as w, x, y, z. In space; of any length but 0.")
    matrix: Annotated[Array, Numbers(Axis(3, 4), Axis(3, 4))] = optional(
        "R and t in homogeneous coordinates. 4 rows of 4 in space, 3 of 3 in the plane, the last row 0 ... 0 1."
    )
    translation: Position = optional("t, zero if left out. Not beside `matrix`, which has it.")
    tolerance: Annotated[float, WithJsonSchema({"type": "number", "format": "double"})] = optional(
        "How far an entry of R^T R may be from that of the unit matrix: 0 to 0.1, 1e-12 if left out. A matrix farther "
        "than 1e-12 stands for the rotation nearest to it, each entry the nearest double; 1e-6 takes float32 matrices."
    )
    rounded: bool = optional("Take R with six digits. A tolerance of 1e-5, which takes float32 too.")

    @model_validator(mode="after")
    def _is_one_pose(self) -> RigidPose:
        given = [name for name in ("rotation", "quaternion", "matrix") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"a pose has one of rotation, quaternion and matrix, got {' and '.join(given) or 'none'}")
        if self.matrix is not None and self.translation is not None:
            raise ValueError("a pose has its translation in the last column of matrix; leave translation out")
        return self


class Body(Schema):
    """A solid in its place; without a pose, where it stands."""

    solid: Solid
    pose: RigidPose = optional("Where the body is; left out, where its solid stands.")


class StoredSolidSummary(Schema):
    """What the store holds under an id."""

    id: SolidId
    type: str = Field(description="Type of the solid.")
    dimension: Annotated[int, Numbers(kind="integer", minimum=2)] = Field(description="2 or 3.")
    vertices: Count = optional("Number of vertices, for solids that have them.")
    faces: Count = optional("Number of faces, planes, rings, terms or operands, for solids that have them.")
    memory: Count = Field(description="Bytes its arrays hold.")
    collapsed: Count = optional(
        "Triangles of a file that are left out: two of their corners have equal coordinates.", [248]
    )


class InspectRequest(Schema):
    """What keeps this mesh from being a closed solid? Nothing is repaired unless an option asks for it."""

    model_config = with_example(
        {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3]]},
        {
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1e-9, 0]],
            "faces": [[0, 2, 1], [0, 4, 3], [1, 3, 2], [0, 3, 2]],
            "weld": 1e-6,
            "orient": True,
            "fill_t_junctions": True,
        },
    )

    vertices: Vertices3 = Field(description="Positions; those at equal coordinates are one.")
    faces: Faces = Field(description="Indices of vertices, three or more a face; more than three are cut.")
    weld: Number = optional("First make one of vertices that are at most so far apart.")
    orient: bool = optional("Turn faces so that neighbours run alike, closed shells outward and cavities inward.")
    fill_t_junctions: bool = optional("Split open edges at the vertices that lie exactly on them.")


class MeshAdvice(Schema):
    """A kind of thing that was found, and what would mend it."""

    kind: str = Field(description="The name of a field of the answer.")
    mend: str = Field(description="What would mend it.")


Edges = Annotated[Array, Numbers(Axis(0, None), PAIR, kind="integer", minimum=0)]
Triples = Annotated[Array, Numbers(Axis(0, None), Axis(3, 3), kind="integer", minimum=0)]


class InspectResponse(Schema):
    """What was found, each thing with its places, by the numbers of vertices and of faces as triangles, cut."""

    closed: bool = Field(description="Whether a polyhedron of this mesh is taken: no open and no turned edges.")
    shells: Count = Field(description="Parts of faces that hang together by edges.")
    open_edges: Edges = Field(description="Edges that an odd number of faces use, by their vertices.")
    turned_edges: Edges = Field(description="Other edges that are not used equally often in both directions.")
    t_junctions: Triples = Field(description="An open edge, and a vertex of another exactly on it.")
    duplicate_faces: Edges = Field(description="A face, and the first with the same vertices.")
    flat_faces: Indices = Field(description="Faces without area.")
    inverted_shells: IndexLists = Field(description="The faces of each closed shell that is inside out.")
    self_crossings: Edges = Field(
        description="Pairs of faces with a common point besides common vertices and edges, and none of the above."
    )
    advice: list[MeshAdvice] = Field(description="What would mend each kind of thing that was found.")
    mended: list[str] = Field(description="What the options did.")
    vertices: Vertices3 = optional("With an option: those of the mesh after it.")
    faces: Triples = optional("With an option: the triangles after it; the numbers above are of these.")
    accuracy: Accuracy


CsgSolid.model_rebuild()
