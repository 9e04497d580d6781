"""Questions and answers about layers: GeoJSON FeatureCollections (RFC 7946)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema

from service.schemas.limits import AtMost, left_out
from service.schemas.problem import Accuracy, Count, Schema, with_example

_OBJECT = {"type": "object", "additionalProperties": True}
FeatureCollection = Annotated[Any, WithJsonSchema(_OBJECT)]
Feature = Annotated[dict[str, Any], WithJsonSchema(_OBJECT)]


def _square(x: float, size: float, **members: Any) -> dict[str, Any]:
    ring = [[x, x], [x + size, x], [x + size, x + size], [x, x + size], [x, x]]
    return {"type": "Feature", **members, "geometry": {"type": "Polygon", "coordinates": [ring]}}


def _collection(*features: dict[str, Any]) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": [*features]}


_PARCELS = _collection(
    _square(0, 2, id="a", properties={"owner": "Ada"}), _square(2, 2, id="b", properties={"owner": "Bo"})
)
_FLOODS = _collection(_square(1, 2, properties={"year": 1962}))
_POINT = {"type": "Feature", "properties": {"well": 7}, "geometry": {"type": "Point", "coordinates": [2, 2]}}
_AREAS = "A FeatureCollection of Polygon and MultiPolygon, in the plane; null geometries are welcome."


class LayersOverlayRequest(Schema):
    """What do these two layers have in common, or not: every feature with every one that it meets?"""

    model_config = with_example({"left": _PARCELS, "right": _FLOODS, "operation": "intersection"})

    left: FeatureCollection = Field(description=_AREAS)
    right: FeatureCollection = Field(description=_AREAS)
    operation: Literal["intersection", "union", "identity", "difference", "symmetric_difference"] = Field(
        description="intersection: a row for each pair with common area; difference: what is left of each feature of "
        "the left; identity: both; symmetric_difference: what is left of either; union: all of these."
    )


class LayersUnionRequest(Schema):
    """What do the features of a layer cover together?"""

    model_config = with_example({"layer": _PARCELS, "by": ["owner"]})

    layer: FeatureCollection = Field(description=_AREAS)
    by: Annotated[list[str], AtMost("max_operands")] = left_out(
        "Names of properties: features are united that have the same values of these; all, if left out."
    )


class LayersContainsRequest(Schema):
    """Which features of a layer hold these points?"""

    model_config = with_example({"points": _collection(_POINT), "polygons": _PARCELS, "outside": True})

    points: FeatureCollection = Field(description="A FeatureCollection of Point; null geometries are welcome.")
    polygons: FeatureCollection = Field(description=_AREAS)
    outside: bool = left_out("Also a feature for each point that nothing holds.")


class LayersResponse(Schema):
    """A GeoJSON FeatureCollection: rings are closed, shells counter-clockwise, holes clockwise."""

    type: Literal["FeatureCollection"]
    crs: FeatureCollection = left_out("The `crs` of the question, untouched.", examples=[{"type": "name"}])
    features: list[Feature] = Field(
        description="`properties` are those of the features that a row comes from, names that both layers have with _1 "
        "and _2; members named after the layers say which these were, by index and id. Geometry null: it was."
    )
    collapsed: Count = Field(description="Rows that are not here because rounding left nothing of them.")
    accuracy: Accuracy
