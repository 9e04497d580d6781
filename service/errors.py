"""The table from error codes to HTTP statuses, and the conversion of any error to problem+json.

Codes of the engine's errors are passed on unchanged; those that only HTTP knows are added here. The table is part of
the API: `docs` lists it, the tests hold it against the engine's tree of errors.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from http import HTTPStatus
from typing import Any, Final

import orjson
from pydantic import ValidationError
from starlette.responses import Response

import engine
from engine import EngineError
from service.metrics import count_refusal
from service.schemas.arrays import MAX_ERRORS, Fault, Path

PROBLEM_TYPE: Final = "urn:exact-geometry:problem:"
MEDIA_TYPE: Final = "application/problem+json"

_KINDS: Final = [kind for kind in vars(engine).values() if isinstance(kind, type) and issubclass(kind, EngineError)]
ENGINE_STATUS: Final[dict[str, int]] = {
    EngineError.code: 422,
    **{kind.code: 422 for kind in _KINDS},
    "deadline_exceeded": 504,
    "cancelled": 503,
}
SERVICE_STATUS: Final[dict[str, int]] = {
    "not_json": 400,
    "bad_request": 400,
    "missing_key": 401,
    "wrong_key": 403,
    "wrong_origin": 403,
    "not_found": 404,
    "unknown_solid": 404,
    "unknown_scene": 404,
    "method_not_allowed": 405,
    "slow_body": 408,
    "slow_headers": 408,
    "large_headers": 431,
    "body_too_large": 413,
    "unsupported_media_type": 415,
    "invalid_request": 422,
    "missing_field": 422,
    "unknown_field": 422,
    "unknown_type": 422,
    "limit_exceeded": 422,
    "answer_too_large": 422,
    "invalid_mesh": 422,
    "queue_full": 503,
    "store_unavailable": 503,
    "store_full": 507,
    "not_ready": 503,
    "out_of_memory": 503,
    "internal": 500,
    "not_installed": 501,
}
STATUS: Final = {**ENGINE_STATUS, **SERVICE_STATUS}

_AGAIN: Final = ("queue_full", "not_ready", "store_unavailable", "cancelled", "out_of_memory")
_HEADERS: Final[dict[str, dict[str, str]]] = {
    **{code: {"Retry-After": "1"} for code in _AGAIN},
    "missing_key": {"WWW-Authenticate": "Bearer"},
    **{code: {"Connection": "close"} for code in ("slow_body", "body_too_large")},
}
_PYDANTIC_CODES: Final = {
    "missing": "missing_field",
    "extra_forbidden": "unknown_field",
    "union_tag_invalid": "unknown_type",
    "union_tag_not_found": "unknown_type",
    "recursion_loop": "too_deep",
}
_MOST_MISTAKES: Final = 5000
"""Largest number of faults read from pydantic: no other thread runs while it lists them, 2 us each."""
_MOST_PROBLEM: Final = 1000
_MOST_PART: Final = 100
"""Characters of a sentence, and of a field's name in a pointer."""
_CALLED_HERE: Final = {
    "LineString": "a line is no solid; /v1/clip/lines takes it as lines, /v1/clip/segments as segments",
    "Point": "a point is no solid; /v1/contains takes it as points",
    "xor": "here it is symmetric_difference",
    "and": "here it is intersection",
    "or": "here it is union",
    "minus": "here it is difference",
    "box": "here it is aabb",
    "mesh": "here it is polyhedron",
    "plane": "here it is half_space",
}
_HTTP_CODES: Final = {404: "not_found", 405: "method_not_allowed", 413: "body_too_large", 415: "unsupported_media_type"}


class ServiceError(Exception):
    """An error of the service alone: HTTP, limits, the store, the queue."""

    def __init__(self, code: str, detail: str, where: Path = ()) -> None:
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.where = where
        self.headers: dict[str, str] = {}


def pointer(path: Iterable[str | int]) -> str:
    """Return `path` as a JSON pointer (RFC 6901).

    >>> pointer(("solid", "faces", 3, "a/b~c"))
    '/solid/faces/3/a~1b~0c'
    """
    return "".join(f"/{str(part).replace('~', '~0').replace('/', '~1')}" for part in path)


def faults_of(error: Exception) -> list[Fault]:
    """Return the faults of any error, with their paths; at least one."""
    if isinstance(error, EngineError):
        code = error.code if error.code in ENGINE_STATUS else EngineError.code
        return [Fault(error.where, code, error.message.replace("None (NoneType)", "null"))]
    if isinstance(error, ServiceError):
        return [Fault(error.where, error.code, error.detail)]
    if isinstance(error, MemoryError):
        return [Fault((), "out_of_memory", "this request needs more memory than there is now; ask for less at once")]
    return [Fault((), "internal", "the service failed on this request; it is logged, please report it")]


def forget_frames(error: BaseException) -> None:
    """Drop the frames of an error and of its causes: they reference the body, and lead back to it."""
    known: BaseException | None = error
    while known is not None:  # bound: each is raised while the next was handled
        known.with_traceback(None)
        known = known.__context__


def problem(faults: list[Fault], headers: Mapping[str, str] = {}) -> Response:
    """Return the answer for `faults`; its code and status are those of the first."""
    first = faults[0]
    count_refusal(first.code)
    status = STATUS[first.code]
    body = {
        "type": PROBLEM_TYPE + first.code,
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": _shown(first.detail, _MOST_PROBLEM),
        "code": first.code,
        "errors": [
            {
                "pointer": _shown(pointer(_shown(part, _MOST_PART) for part in fault.path), _MOST_PROBLEM),
                "detail": _shown(fault.detail, _MOST_PROBLEM),
            }
            for fault in faults[:MAX_ERRORS]
            if status == 422 or fault.path
        ],
    }
    return Response(orjson.dumps(body), status, {**_HEADERS.get(first.code, {}), **headers}, MEDIA_TYPE)


def http_fault(status: int, path: str, method: str) -> Fault:
    """Return the fault for a request for which the framework has no route."""
    code = _HTTP_CODES.get(status, "bad_request")
    detail = {
        "not_found": f"there is nothing at {path[:200]}; /docs lists what there is",
        "method_not_allowed": f"{method} is not possible at {path[:200]}; the header Allow names what is",
    }.get(code, f"the request cannot be answered ({status})")
    return Fault((), code, detail)


def faults_of_validation(error: ValidationError, document: Any) -> list[Fault]:
    """Return the faults of `document`, the decoded request, with their paths; at most `MAX_ERRORS`."""
    faults: list[Fault] = []
    if error.error_count() > _MOST_MISTAKES:
        detail = f"{error.error_count()} things are wrong, most are fields not known here; /docs has an example"
        return [Fault((), "invalid_request", detail)]
    for item in error.errors(include_url=False, include_input=False):
        path = _path_in(document, item["loc"])
        parent = document
        for part in path[:-1]:
            parent = _child(parent, part)
        if item["type"] == "numbers":
            faults += [Fault((*path, *fault.path), fault.code, fault.detail) for fault in item["ctx"]["faults"]]
        else:
            code = _PYDANTIC_CODES.get(item["type"], "invalid_request")
            faults.append(Fault(path, code, _sentence(item, parent)))
        if len(faults) >= MAX_ERRORS:
            break
    return faults[:MAX_ERRORS]


def _api_name_of(given: Any) -> str:
    """Map the vocabulary of other APIs to ours, for a hint."""
    meant = _CALLED_HERE.get(given) if isinstance(given, str) else None
    return "" if meant is None else f" ({meant})"


def _sentence(item: Any, parent: Any) -> str:
    """Return pydantic's finding as a sentence with the remedy; parent: the value's container."""
    name = _shown(item["loc"][-1], _MOST_PART) if item["loc"] else "the body"
    if item["type"] == "missing":
        return f"the field {name!r} is missing; add it"
    if item["type"] == "extra_forbidden":
        return f"the field {name!r} is not known here; leave it out"
    if item["type"] == "union_tag_invalid":
        tag, tags = item["ctx"]["tag"], item["ctx"]["expected_tags"]
        return f"there is no solid of type {tag!r:.60}{_api_name_of(tag)}; the types are {tags}"
    if item["type"] == "string_pattern_mismatch":
        return "expected the id of a stored solid, 64 hexadecimal digits: POST /v1/solids answers with it"
    if item["type"] == "literal_error":
        got = _child(parent, name)
        return f"expected {item['ctx']['expected']}, got {got!r:.60}{_api_name_of(got)}"
    if item["type"] == "union_tag_not_found":
        return "a solid is an object with a field 'type' that names what it is, for example 'sphere'"
    if item["type"] in ("model_type", "model_attributes_type"):
        return "expected a JSON object"
    if item["type"] == "value_error":
        return str(item["ctx"]["error"])
    return str(item["msg"]).replace("Input should be", "expected")


def _path_in(document: Any, loc: tuple[int | str, ...]) -> Path:
    """Return pydantic's path without the tags that it adds for unions (each stands once, before a field)."""
    path: list[int | str] = []
    value, may_be_tag = document, True
    for part in loc:
        if may_be_tag and isinstance(value, dict) and value.get("type") == part:
            may_be_tag = False
            continue
        path.append(part)
        value, may_be_tag = _child(value, part), True
    return tuple(path)


def _child(value: Any, part: int | str) -> Any:
    try:
        return value[part]
    except (KeyError, IndexError, TypeError):
        return None


def _shown(part: str | int, most: int) -> str:
    """Return text shortened, as valid UTF-8: a message may quote half a surrogate pair from the request."""
    text = str(part)
    text = text if len(text) <= most else text[: most - 3] + "..."
    return text.encode("utf-8", "replace").decode("utf-8")
