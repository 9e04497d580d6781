"""What all routes share: the route class, and the errors that each may answer with, documented."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any, Final

from fastapi import APIRouter

from service.errors import MEDIA_TYPE
from service.route import GeometryRoute

_PROBLEM: Final = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
_OF_BODY: Final = {
    400: "The body is not JSON.",
    401: "The service asks for a key, in the header Authorization (Bearer) or X-API-Key.",
    403: "The key is wrong.",
    404: "A stored solid is not there (any more): put it again.",
    408: "The body did not arrive in time.",
    413: "The body is too large.",
    415: "The header Content-Type is another; the header Accept-Post of the answer names the right one.",
    422: "The geometry breaks a rule; `code` says which, each pointer where.",
}
_OF_ALL: Final = {
    503: "Too many requests are under way, or the store cannot be used: try again after the time in Retry-After.",
    504: "The deadline passed: ask for less at once.",
}


def responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the description of the error answers with these statuses."""
    texts = {**_OF_BODY, **_OF_ALL, 501: "Reading files is not installed.", 507: "The store is full."}
    return {
        status: {"description": texts.get(status, HTTPStatus(status).phrase), "content": _PROBLEM}
        for status in statuses
    }


def router_of(tag: str) -> APIRouter:
    """Return a router for routes that take a JSON body."""
    return APIRouter(route_class=GeometryRoute, tags=[tag], responses=responses(*_OF_BODY, *_OF_ALL))
