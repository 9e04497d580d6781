"""What all routes share: the route class, and the errors that each may answer with, documented."""

from __future__ import annotations

from typing import Any, Final

import orjson
from fastapi import APIRouter

from service.errors import MEDIA_TYPE, STATUS, problem
from service.route import GeometryRoute
from service.schemas.arrays import Fault

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
    """Return the description of the error answers with these statuses, and of those that any call may have."""
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


def router_of(tag: str) -> APIRouter:
    """Return a router for routes that take a JSON body."""
    return APIRouter(route_class=GeometryRoute, tags=[tag], responses=responses(*_OF_BODY))
