"""Layers of features with attributes against each other: GeoJSON in and out."""

from __future__ import annotations

from typing import Any, Final

from starlette.responses import JSONResponse

import engine
from service.convert import answers
from service.routes.base import router_of
from service.schemas.layers import LayersContainsRequest, LayersOverlayRequest, LayersResponse, LayersUnionRequest
from service.work import CallOf

router = router_of("layers")


class GeoJson(JSONResponse):
    """What the document calls these answers."""

    media_type = "application/geo+json"


_AS: Final[dict[str, Any]] = {"response_class": GeoJson, "response_model": LayersResponse}


@router.post("/v1/layers/overlay", operation_id="overlay_layers", **_AS)
def overlay_layers(question: LayersOverlayRequest, call: CallOf) -> LayersResponse:
    """Overlay two layers, every feature with every one that it meets; attributes of both are kept."""
    found = call.compute(engine.layers.overlay_features, question.left, question.right, question.operation)
    return answers.from_features(*found, call)


@router.post("/v1/layers/union", operation_id="unite_layer", **_AS)
def unite_layer(question: LayersUnionRequest, call: CallOf) -> LayersResponse:
    """Unite the features of a layer, all or those that agree in some properties."""
    return answers.from_features(*call.compute(engine.layers.dissolve_features, question.layer, question.by), call)


@router.post("/v1/layers/contains", operation_id="locate_in_layer", **_AS)
def locate_in_layer(question: LayersContainsRequest, call: CallOf) -> LayersResponse:
    """Join points to the features that hold them, boundary included: a row for each such pair."""
    outside = bool(question.outside)
    found = call.compute(engine.layers.locate_features, question.points, question.polygons, outside=outside)
    return answers.from_features(*found, call)
