"""The OpenAPI document: FastAPI's, with the limits of this service's settings, an example of every part, the keys that
it may ask for, and without what generators choke on; and the errors that each route documents."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path
from typing import Any, Final

import orjson
from fastapi import APIRouter, FastAPI
from fastapi.openapi.utils import get_openapi

from service.errors import MEDIA_TYPE, STATUS, problem
from service.route import GeometryRoute
from service.schemas.arrays import LIMIT, Fault
from service.schemas.base import Problem
from service.settings import Settings

ANSWERS: Final = Path(__file__).with_name("answers.json")
"""Answers of the service to the examples of its questions, by model; written by tests/contract/test_openapi.py."""
_SCHEMAS: Final = "#/components/schemas/"
_TAGS: Final = {
    "containment": "Which points are inside?",
    "collision": "Do bodies meet?",
    "clearance": "How far are bodies apart?",
    "clipping": "What remains of segments and polygons?",
    "layers": "Polygons with attributes, as maps have them: GeoJSON.",
    "bounds": "The smallest box and ball.",
    "solids cut": "Volumes, sections, closed halves, overlaps of two.",
    "compare": "The exact answer beside the textbook's plain float64 one.",
    "solids": "Solids kept between requests.",
    "binary": "Raw float64 there and back, and files of meshes.",
    "health": "Is the service alive, ready, busy?",
}
_KEYS: Final = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "A key of this service, where it asks for one."},
    "key": {"type": "apiKey", "in": "header", "name": "X-API-Key", "description": "The same, as a header of its own."},
}
_OPEN: Final = ("/healthz", "/readyz")


def openapi_of(app: FastAPI, settings: Settings) -> Callable[[], dict[str, Any]]:
    """Return the function that FastAPI calls for its document; the document is made once."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            made = get_openapi(
                title=app.title,
                version=app.version,
                description=app.description,
                routes=app.routes,
                separate_input_output_schemas=False,
                servers=[{"url": settings.root_path or "/", "description": "This service."}],
                contact={"name": "exact-geometry"},
                license_info={"name": "MIT", "identifier": "MIT"},
            )
            _describe_keys(made, bool(settings.api_keys))
            named = {tag for item in made["paths"].values() for each in item.values() for tag in each["tags"]}
            made["tags"] = [{"name": tag, "description": _TAGS.get(tag, tag)} for tag in sorted(named, key=_place)]
            app.openapi_schema = completed(made, settings)
        return app.openapi_schema

    return document


def completed(made: dict[str, Any], settings: Settings) -> dict[str, Any]:
    """Return FastAPI's document with limits, the model of errors, and examples."""
    schemas = made["components"]["schemas"]
    problem = Problem.model_json_schema(ref_template=_SCHEMAS + "{model}")
    schemas.update(problem.pop("$defs"))
    _drop_foreign_errors(made)
    schemas["Problem"] = problem
    if "Solid" in schemas:
        schemas["Solid"]["type"] = "object"  # said by each member too; some programs look at the root alone
    made["components"]["schemas"] = dict(sorted(schemas.items()))
    done: dict[str, Any] = _finished(made, settings)
    for name, schema in done["components"]["schemas"].items():
        schema["title"] = name  # by which viewers tell the members of a union apart
    _illustrate(done)
    return done


def _place(tag: str) -> tuple[int, str]:
    return ([*_TAGS].index(tag) if tag in _TAGS else len(_TAGS), tag)


def _describe_keys(made: dict[str, Any], is_needed: bool) -> None:
    made["components"]["securitySchemes"] = _KEYS
    made["security"] = [{name: []} for name in _KEYS] if is_needed else [{}, *({name: []} for name in _KEYS)]
    for path in _OPEN:
        for operation in made["paths"][path].values():
            operation["security"] = []


def _drop_foreign_errors(made: dict[str, Any]) -> None:
    """Remove FastAPI's own validation error, which it describes wherever a path has a parameter."""
    for item in made["paths"].values():
        for operation in item.values():
            for status, response in list(operation["responses"].items()):
                if "HTTPValidationError" in str(response.get("content")):
                    del operation["responses"][status]
    for name in ("HTTPValidationError", "ValidationError"):
        made["components"]["schemas"].pop(name, None)


def _finished(node: Any, settings: Settings) -> Any:
    """Replace names of settings by their limits, drop titles that only repeat a field's name, and defaults."""
    if isinstance(node, list):
        return [_finished(item, settings) for item in node]
    if not isinstance(node, dict):
        return node
    done = {}
    for key, value in node.items():
        if key == LIMIT:
            key, value = "maxItems", getattr(settings, value)
        if key == "title" and isinstance(value, str) and not {"openapi", "version", "code"} & set(node):
            continue
        if key == "default" and "type" in node:
            continue  # generators make a value of it that is always sent; the description says it
        done[key] = _finished(value, settings)
    return done


def _illustrate(made: dict[str, Any]) -> None:
    """Give every operation a summary, and every property a description and an example, its own or the first in a
    model's example."""
    schemas = made["components"]["schemas"]
    known: dict[str, list[Any]] = json.loads(ANSWERS.read_text("utf-8")) if ANSWERS.is_file() else {}
    for name, answers in known.items():
        if name in schemas:
            schemas[name].setdefault("examples", answers)
    for schema in schemas.values():
        for value in schema.get("examples", ()):
            for part, shown in list(_parts(schema, value, schemas)):
                part.setdefault("examples", [shown])
    for schema in schemas.values():
        for part in schema.get("properties", {}).values():
            if "const" in part:
                part.setdefault("description", f"Always `{part['const']}`.")
                part.setdefault("examples", [part["const"]])
            elif "$ref" in part:
                part.setdefault("description", schemas[_name(part)]["description"])
    for item in made["paths"].values():
        for operation in item.values():
            if operation.get("summary") == operation["operationId"].replace("_", " ").title():  # FastAPI's, of ours
                operation["summary"] = re.split("[.,:;]", operation["description"])[0]
            successes = [answer for status, answer in operation["responses"].items() if status < "300"]
            for body in (operation.get("requestBody", {}), *successes):
                for media_type, content in body.get("content", {}).items():
                    if media_type != MEDIA_TYPE and "$ref" in content.get("schema", {}):
                        content["schema"] = {"$ref": content["schema"]["$ref"]}  # a field's description may stick to it
                        shown = schemas[_name(content["schema"])].get("examples", ())
                        content["examples"] = {
                            f"example_{number}": {"value": value} for number, value in enumerate(shown, 1)
                        }


def _name(schema: dict[str, Any]) -> str:
    return str(schema["$ref"]).removeprefix(_SCHEMAS)


def _parts(schema: dict[str, Any], value: Any, schemas: dict[str, Any]) -> Iterator[tuple[dict[str, Any], Any]]:
    """Yield each property that `value` has, at any depth, with its value."""
    if "$ref" in schema:
        schema = schemas[_name(schema)]
    if "discriminator" in schema:
        schema = schemas[schema["discriminator"]["mapping"][value["type"]].removeprefix(_SCHEMAS)]
    if isinstance(value, list) and "items" in schema:
        for item in value:
            yield from _parts(schema["items"], item, schemas)
    elif isinstance(value, dict):
        for key, part in schema.get("properties", {}).items():
            if key in value:
                yield part, value[key]
                yield from _parts(part, value[key], schemas)


_SCHEMA: Final = {"$ref": "#/components/schemas/Problem"}
_OF_ANY: Final = {
    401: "The service asks for a key, in the header Authorization (Bearer) or X-API-Key.",
    403: "The key is wrong.",
    431: "The headers are too long.",
    500: "A fault of the service; it is logged.",
    503: "Too many requests are under way, or the store cannot be used: try again after the time in Retry-After.",
}
_OF_BODY: Final = {
    400: "The body is not JSON.",
    404: "A stored solid is not there (any more): put it again.",
    408: "The body did not arrive in time.",
    413: "The body is too large.",
    415: "The header Content-Type is another; the header Accept-Post of the answer names the right one.",
    422: "The geometry breaks a rule; `code` says which, each pointer where.",
    504: "The deadline passed: ask for less at once.",
}
_TEXTS: Final = {**_OF_ANY, **_OF_BODY, 501: "Reading files is not installed.", 507: "The store is full."}


def responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the descriptions of the error answers with these statuses, and of those of any call."""
    return {
        status: {
            "description": _TEXTS[status],
            "content": {MEDIA_TYPE: {"schema": _SCHEMA, "example": _example(status)}},
        }
        for status in sorted({*statuses, *_OF_ANY})
    }


def _example(status: int) -> dict[str, Any]:
    code = next(code for code, known in STATUS.items() if known == status)
    return dict(orjson.loads(problem([Fault((), code, _TEXTS[status])]).body))


def router_of(*statuses: int, tags: list[str | Enum] | None = None) -> APIRouter:
    """Return a router whose calls document errors of these statuses; by default those of calls with a JSON body."""
    return APIRouter(route_class=GeometryRoute, tags=tags, responses=responses(*(statuses or _OF_BODY)))
