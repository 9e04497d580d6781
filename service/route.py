"""The route class: reads a body within its limits, decodes and checks it, calls the endpoint, encodes its answer.

A body is JSON for the endpoint's model, or octets that the endpoint takes as they are (the binary lane). A large one is
received into one buffer of the declared length.

FastAPI describes the routes (parameters, models, the OpenAPI document); this class answers them. FastAPI's own handler
would decode and check on the event loop, where one large body holds up everybody else's small ones. An endpoint is a
plain function ``(question, call) -> answer``: it runs inline where body and solid are small, else in the pool.
"""

from __future__ import annotations

import asyncio
import logging
import mmap
from collections.abc import Callable, Coroutine, Iterable
from contextlib import suppress
from typing import Any, Final

import numpy as np
from fastapi.routing import APIRoute, APIRouter
from pydantic import TypeAdapter, ValidationError
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Receive

from engine import EngineError
from service import wire
from service.convert.questions import existing, is_light
from service.errors import STATUS, ServiceError, faults_of, faults_of_validation, problem
from service.json_arrays import Body
from service.work import Call, Pool

log = logging.getLogger("service")

JSON: Final = "application/json"
OCTETS: Final = "application/octet-stream"
LARGE: Final = 2**22
"""Bytes from which a body gets memory in large pages: to give 64 MB of small ones back holds all threads for 5 ms."""
Query = dict[str, tuple[TypeAdapter[Any], bool]]
Answer = Callable[[Request], Coroutine[Any, Any, Response]]


class GeometryRoute(APIRoute):
    """A route whose endpoint takes ``question`` (the body's model, if any), path parameters, and ``call``."""

    def get_route_handler(self) -> Answer:
        """Return the coroutine that answers a request."""
        endpoint, status = self.endpoint, self.status_code or 200
        body_field: Any = None if self.body_field is None else self.body_field.field_info
        media_type = None if body_field is None else getattr(body_field, "media_type", JSON)
        adapter = TypeAdapter(body_field.annotation) if body_field is not None and media_type == JSON else None
        query: Query = {
            item.name: (TypeAdapter[Any](item.field_info.annotation or Any), item.field_info.is_required())
            for item in self.dependant.query_params
        }

        async def handle(request: Request) -> Response:
            call = Call(request.app.state.settings, request.app.state.store, request.app.state.memory)
            response = await answer(request, call)
            request.app.state.metrics.count(self.operation_id or self.name, response.status_code, call.seconds)
            return response

        async def answer(request: Request, call: Call) -> Response:
            state = request.app.state
            try:
                arguments = {**request.path_params, **_queried(request, query)}
                job = _Job(endpoint, adapter, arguments, call)
                if media_type is not None:
                    headers = dict(request.scope["headers"])  # a look-up in the framework's reads them all
                    _check_media_type(headers.get(b"content-type", b""), media_type)
                    state.pool.check_room()
                    job.body = await _read(request.receive, headers.get(b"content-length", b"0"), call)
                    job.question = job.body if adapter is None else None
                if len(job.body) <= call.settings.inline_bytes and state.warm.is_set():
                    job.decode()
                    if is_light(job.question):
                        call.is_light = True
                        payload = job.answer()
                    else:
                        payload = await _run(state.pool, call, job.answer, request.receive)
                else:
                    payload = await _run(state.pool, call, job.answer, request.receive)
            except ClientDisconnect:
                return Response(status_code=STATUS["bad_request"])  # nobody reads it
            except Exception as error:
                return _failed(error, request)
            finally:
                call.free()
            headers = {"Server-Timing": call.timing(), **call.headers}
            return Response(payload, call.status or status, headers, None if payload is None else call.media_type)

        return handle


def posts_of(routers: Iterable[APIRouter]) -> dict[str, Answer]:
    """Return what answers a POST, for each path without parameters."""
    routes = [route for router in routers for route in router.routes if isinstance(route, GeometryRoute)]
    return {
        route.path: route.get_route_handler()
        for route in routes
        if route.methods == {"POST"} and not route.param_convertors
    }


class _Job:
    """The steps of one request that need no event loop."""

    def __init__(
        self,
        endpoint: Callable[..., Any],
        adapter: TypeAdapter[Any] | None,
        arguments: dict[str, Any],
        call: Call,
    ) -> None:
        self.endpoint = endpoint
        self.adapter = adapter
        self.body: Body = b""
        self.arguments = arguments
        self.call = call
        self.question: Any = None

    def decode(self) -> None:
        """Turn the body into the endpoint's model, and let go of it."""
        if self.adapter is None or self.question is not None:
            return
        body, self.body = self.body, b""
        with self.call.phase("decode"):
            document = wire.decode_fast(body)
            if document is not None:
                try:
                    self.question = self.adapter.validate_python(document, context=self.call.settings)
                    return
                except ValidationError:  # the other decoder keeps what pointers need
                    del document
            document = wire.decode(body)
            try:
                self.question = self.adapter.validate_python(document, context=self.call.settings)
            except ValidationError as error:
                raise _InvalidBody(error, document) from None

    def answer(self) -> bytes | memoryview | None:
        """Return the encoded answer, None if there is no body."""
        self.call.remaining()  # it may have waited past its deadline
        self.decode()
        if self.question is not None:
            self.arguments["question"] = self.question
        try:
            answer = self.endpoint(**self.arguments, call=self.call)
        except (EngineError, ServiceError) as error:
            error.where = existing(self.question, error.where)
            raise
        with self.call.phase("encode"):
            if isinstance(answer, np.ndarray):
                self.call.media_type = OCTETS
                return wire.octets(answer)
            return None if answer is None else wire.encode(answer)


class _InvalidBody(Exception):
    """A validation error together with the document it is about."""

    def __init__(self, error: ValidationError, document: Any) -> None:
        super().__init__()
        self.faults = faults_of_validation(error, document)


def _failed(error: Exception, request: Request) -> Response:
    """Return the problem for `error`; what nobody expected is logged in full."""
    faults = error.faults if isinstance(error, _InvalidBody) else faults_of(error)
    if faults[0].code == "internal":
        log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return problem(faults, getattr(error, "headers", None) or {})


def _check_media_type(header: bytes, expected: str) -> None:
    given = header.decode("latin-1")
    kind = given.partition(";")[0].strip().lower()
    is_json = expected == JSON and kind.startswith("application/") and kind.endswith("+json")
    if kind != expected and not is_json:
        got = f"got {given[:100]!r}" if given else "got none"
        error = ServiceError("unsupported_media_type", f"expected the header Content-Type: {expected}, {got}")
        error.headers = {"Accept-Post": expected}
        raise error


def _queried(request: Request, query: Query) -> dict[str, Any]:
    """Return the query's parameters as declared; what is left out is the endpoint's own default."""
    found: dict[str, Any] = {}
    for name, (adapter, is_required) in query.items():
        value = request.query_params.get(name)
        if value is None and not is_required:
            continue
        try:
            found[name] = adapter.validate_python(value)
        except ValidationError as error:
            expected = str(error.errors()[0]["msg"]).replace("Input should be", "expected")
            got = "nothing" if value is None else f"{value!r:.100}"
            raise ServiceError("invalid_request", f"query parameter {name!r}: {expected}, got {got}") from None
    return found


async def _read(receive: Receive, length: bytes, call: Call) -> Body:
    """Return the body, refused as soon as it is known to be too long, declared or not, or too slow."""
    limit, seconds = call.settings.max_body_bytes, call.settings.body_seconds
    declared = int(length) if length.isdigit() else 0
    if declared > limit:
        raise _too_large(limit)
    call.take(declared)
    room = _room(declared) if declared >= LARGE else None
    parts: list[bytes] = []
    size, is_more = 0, True
    try:
        async with asyncio.timeout(seconds):
            while is_more:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise ClientDisconnect
                part, is_more = message.get("body", b""), message.get("more_body", False)
                end = size + len(part)
                if end > limit:
                    raise _too_large(limit)
                if end > declared:
                    call.take(end - max(size, declared))
                    if room is not None:  # case: a server that does not hold bodies to their declared length
                        parts, room = [bytes(room[:size])], None
                if room is None:
                    parts.append(part)
                else:
                    room[size:end] = part
                size = end
    except TimeoutError:
        raise ServiceError("slow_body", f"the body did not arrive within {seconds} s; send it faster") from None
    if room is not None:
        return room if size == declared else room[:size]
    return parts[0] if len(parts) == 1 else b"".join(parts)


def _room(size: int) -> bytearray | mmap.mmap:
    """Return so many bytes; untouched pages take no memory."""
    if not hasattr(mmap, "MADV_HUGEPAGE"):
        return bytearray(size)
    room = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    with suppress(OSError):  # a kernel without large pages
        room.madvise(mmap.MADV_HUGEPAGE)
    return room


def _too_large(limit: int) -> ServiceError:
    detail = f"the body is longer than {limit} bytes; send less at once, or raise GEOMETRY_MAX_BODY_BYTES"
    return ServiceError("body_too_large", detail)


async def _run(
    pool: Pool, call: Call, job: Callable[[], bytes | memoryview | None], receive: Receive
) -> bytes | memoryview | None:
    """Run `job` in the pool and throw the call's cancel switch if the client goes away meanwhile."""
    watcher = asyncio.create_task(_watch(call, receive))
    try:
        return await pool.run(call, job)
    finally:
        watcher.cancel()


async def _watch(call: Call, receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
    call.cancel.set()
