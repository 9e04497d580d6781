"""Questions and answers of hits: where segments and rays meet surfaces."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.arrays import Array, Axis, Numbers
from service.schemas.base import Accuracy, Count, Schema, optional, with_example
from service.schemas.bodies import Keep, Moved
from service.schemas.solids import Booleans, Number, Segments, Solid

_SHEET = {"type": "surface", "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2], [0, 2, 3]]}
_STEP = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [0, 0, 2]}
_LINES = "Two positions each, in space; with `rays` an origin and a direction."
_RAYS = "The segments are rays, which have no far end; t counts lengths of the direction."
_KEEP = "all: every hit, if left out. first: of each segment or ray the first. any: only whether there is one."
Three = Annotated[Array, Numbers(Axis(3, 3))]


class HitsRequest(Schema):
    """Where do these segments or rays meet this surface?"""

    model_config = with_example(
        {"surface": _SHEET, "segments": [[[0.75, 0.25, 3], [0, 0, -1]], [[0, 0.5, 3], [0, 0, -1]]], "rays": True},
        {"surface": _SHEET, "segments": [[[0.5, 0.5, 3], [0.5, 0.5, 0]], [[9, 9, 3], [9, 9, 0]]], "keep": "any"},
    )

    surface: Solid = Field(description="surface or polyhedron.")
    segments: Segments = Field(description=_LINES)
    rays: bool = optional(_RAYS)
    keep: Keep = optional(_KEEP)


class SceneHitsRequest(Schema):
    """Where do these segments or rays meet the bodies of the stored scene?"""

    model_config = with_example(
        {
            "segments": [[[0.75, 0.25, 3], [0, 0, -1]]],
            "rays": True,
            "keep": "first",
            "moved": [{"body": 0, "pose": _STEP}],
        }
    )

    segments: Segments = Field(description=_LINES)
    rays: bool = optional(_RAYS)
    keep: Keep = optional(_KEEP)
    moved: Moved = optional("Bodies that are elsewhere for this question, each once; nothing is changed in the store.")


class Hit(Schema):
    """A maximal connected common part of a segment or ray and a surface."""

    segment: Count = Field(description="Index of the segment or ray.")
    body: Count = optional("Index of the body, of a scene.", examples=[0])
    t: Number = Field(description="Parameter at which it begins, the nearest double.")
    t_end: Number = Field(description="Where it ends; equal to t but for along.")
    face: Count = Field(description="The face at t with the smallest number; those in the line's plane last.")
    triangle: Count = Field(description="Of the triangles into which faces are cut, the one of the face at t.")
    kind: Literal["across", "touch", "rim", "end", "along"] = Field(
        description="across: the line changes sides; touch: it does not; rim: at a side that an odd number of "
        "triangles has; end: at an end of the line; along: a stretch."
    )
    barycentric: Three = Field(description="Weights of the triangle's corners at t, each the nearest double.")
    normal: Three = Field(
        description="Unit normal: the face's corners are counter-clockwise seen from there. Zero without area."
    )


class HitsResponse(Schema):
    """The hits, by segment, then by t, then by body; or whether each segment or ray has one."""

    hits: list[Hit] = optional("Left out where `keep` is any.")
    met: Booleans = optional("For each segment or ray whether it has a hit, where `keep` is any.")
    accuracy: Accuracy
