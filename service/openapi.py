"""The OpenAPI document: FastAPI's, with the limits of this service's settings and without what generators choke on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from service.schemas.arrays import LIMIT
from service.schemas.problem import Problem
from service.settings import Settings


def openapi_of(app: FastAPI, settings: Settings) -> Callable[[], dict[str, Any]]:
    """Return the function that FastAPI asks for its document; it is made once."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            made = get_openapi(
                title=app.title,
                version=app.version,
                description=app.description,
                routes=app.routes,
                separate_input_output_schemas=False,
            )
            schemas = made["components"]["schemas"]
            problem = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
            schemas.update(problem.pop("$defs"))
            _drop_foreign_errors(made)
            schemas["Problem"] = problem
            made["components"]["schemas"] = dict(sorted(schemas.items()))
            app.openapi_schema = _finished(made, settings)
        return app.openapi_schema

    return document


def _drop_foreign_errors(made: dict[str, Any]) -> None:
    """Take out FastAPI's own validation error, which it describes wherever a path has a parameter."""
    for item in made["paths"].values():
        for operation in item.values():
            for status, response in list(operation["responses"].items()):
                if "HTTPValidationError" in str(response.get("content")):
                    del operation["responses"][status]
    for name in ("HTTPValidationError", "ValidationError"):
        made["components"]["schemas"].pop(name, None)


def _finished(node: Any, settings: Settings) -> Any:
    """Put limits in the place of their settings' names, drop titles that only repeat a field's name, and defaults."""
    if isinstance(node, list):
        return [_finished(item, settings) for item in node]
    if not isinstance(node, dict):
        return node
    done = {}
    for key, value in node.items():
        if key == LIMIT:
            key, value = "maxItems", getattr(settings, value)
        if key == "title" and isinstance(value, str) and "openapi" not in node and "version" not in node:
            continue
        if key == "default" and "type" in node:
            continue  # generators make a value of it that is always sent; the description says it
        done[key] = _finished(value, settings)
    return done
