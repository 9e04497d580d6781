"""The route class: reads a body within its limits, decodes and checks it, calls the endpoint, encodes its answer.

A body is JSON for the endpoint's model, or octets that the endpoint takes as they are (the binary lane).

FastAPI describes the routes (parameters, models, the OpenAPI document); this class answers them. FastAPI's own handler
would decode and check on the event loop, where one large body holds up everybody else's small ones. An endpoint is a
plain function ``(question, call) -> answer``: it runs inline where body and solid are small, else in the pool.
"""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Callable, Coroutine, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final
from urllib.parse import quote

import numpy as np
from fastapi import routing
from fastapi.routing import APIRoute, APIRouter
from pydantic import TypeAdapter, ValidationError
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from engine import EngineError
from service import body, traces, wire
from service.body import JSON
from service.convert.questions import existing, is_light
from service.decoding import pieces
from service.decoding.pieces import Body
from service.errors import STATUS, ServiceError, faults_of, faults_of_validation, forget_frames, problem
from service.schemas.arrays import Fault
from service.work import Call, Pool

log = logging.getLogger("service")

LEAST_COMPRESSED: Final = 2**14
"""Bytes from which an answer is compressed if the client accepts it."""
_CODING: Final = re.compile(rb"([a-z0-9*-]+)\s*(?:;\s*q=([01](?:\.\d{0,3})?))?\s*(?:,|$)")
OF_BODY: Final = (b"content-length", b"content-type")
"""Headers that belong to the body, not to a dependency."""
Part = bytes | memoryview
Query = dict[str, tuple[TypeAdapter[Any], bool]]
Answer = Callable[[Request], Coroutine[Any, Any, Response]]


def state_of(app: Any) -> Any:
    """Return app.state, or app.state.geometry when embedded."""
    return getattr(app.state, "geometry", app.state)


class GeometryRoute(APIRoute):
    """A route whose endpoint takes ``question`` (the body's model, if any), path parameters, and ``call``."""

    @cached_property
    def adapter(self) -> TypeAdapter[Any]:
        """Return the validator of the endpoint's model."""
        body_field: Any = self.body_field
        return TypeAdapter(body_field.field_info.annotation)

    async def ask(
        self, document: Any, arguments: dict[str, Any], call: Call, state: Any, finish: Callable[[Any], bytes]
    ) -> bytes | list[Fault]:
        """Answer a question that was decoded elsewhere; return what `finish` makes of the answer, or the faults."""
        outcome: bytes | list[Fault]
        try:
            job = _Job(self.endpoint, self.adapter, arguments, call, True)
            job.document, job.finish = document, lambda answer: [finish(answer)]
            (outcome,) = await state.pool.run(call, job.answer, False)
        except Exception as error:
            outcome = faults_in(error, f"{self.name} as a tool")
        status = self.status_code or 200 if isinstance(outcome, bytes) else STATUS[outcome[0].code]
        operation = self.operation_id or self.name
        state.metrics.count(operation, status, call.seconds)
        traces.note(operation, call.seconds)
        return outcome

    def get_route_handler(self) -> Answer:
        """Return the coroutine that answers a request."""
        endpoint, status = self.endpoint, self.status_code or 200
        body_field: Any = None if self.body_field is None else self.body_field.field_info
        media_type = None if body_field is None else getattr(body_field, "media_type", JSON)
        adapter = self.adapter if body_field is not None and media_type == JSON else None
        query: Query = {
            item.name: (TypeAdapter[Any](item.field_info.annotation or Any), item.field_info.is_required())
            for item in self.dependant.query_params
        }

        guard = guard_of(self)
        upload: Any = getattr(endpoint, "upload", None)
        """What takes files of meshes in place of JSON."""

        async def handle(request: Request) -> Response:
            given = [] if guard is None else (await guard(request)).raw_headers
            state = state_of(request.app)
            call = Call(state.settings, state.store, state.memory)
            call.path = _path_of(request)
            response = None
            try:
                response = await answer(request, call)
            finally:
                if not isinstance(response, _Answer):  # it ended early, its memory is free
                    call.free()
            response.raw_headers += [header for header in given if header[0] not in OF_BODY]
            operation = self.operation_id or self.name
            state.metrics.count(operation, response.status_code, call.seconds)
            traces.note(operation, call.seconds)
            return response

        async def answer(request: Request, call: Call) -> Response:
            state = state_of(request.app)
            try:
                headers = dict(request.scope["headers"])  # a look-up in the framework's reads them all
                call.coding = _coding_wanted(headers.get(b"accept-encoding", b""))
                if b"model/" in headers.get(b"accept", b""):
                    call.file = body.file_wanted(headers[b"accept"].decode("latin-1"))
                is_small = True
                arguments = {**request.path_params, **_parse_query_params(request, query, guard is None)}
                job = _Job(endpoint, adapter, arguments, call, media_type is not None)
                if media_type is not None:
                    kind = body.media_type_of(headers) if upload is not None else ""
                    if kind in body.FILES or kind == body.MULTIPART:
                        job.endpoint, job.adapter = upload, None
                        arguments["content_type"] = headers[b"content-type"].decode("latin-1")
                    else:
                        body.check_media_type(headers, media_type)
                    job.coding = body.coding_of(headers)
                    declared = body.declared_length(headers, call.settings.max_body_bytes)
                    is_small = 0 < declared <= call.settings.inline_bytes
                    if not is_small:
                        state.pool.check_room()
                    job.body = await body.read(receive_of(request), declared, call)
                    call.start_clock()
                    state.metrics.bytes_in.inc(len(job.body))
                if is_small and state.warm.is_set() and job.adapter is not None and job.coding is None:
                    job.decode()
                    call.is_light = is_light(job.question)
                if call.is_light:
                    parts = job.answer()
                else:
                    parts = await _run(state.pool, call, job.answer, request.receive, is_small)
                is_known = b"if-none-match" in headers and _is_known(headers[b"if-none-match"], call, request.method)
                return _Answer([] if is_known else parts, call, 304 if is_known else call.status or status)
            except ClientDisconnect:
                return Response(status_code=STATUS["bad_request"])  # nobody reads it
            except Exception as error:
                faults = faults_in(error, f"{request.method} {request.url.path}")
                return problem(faults, getattr(error, "headers", None) or {})

        return handle


def guard_of(route: APIRoute) -> Answer | None:
    """Return the solver of the dependencies that an application gave to the router, None if there are none.

    FastAPI's own handler would solve them. Newer versions do not copy them into the routes of an included router.
    """
    context = getattr(routing, "_effective_route_context_var", None)
    effective = (context and context.get()) or route
    if not effective.dependencies:
        return None
    provider = effective.dependency_overrides_provider
    given: Any = {"dependencies": effective.dependencies, "dependency_overrides_provider": provider}
    return APIRoute(effective.path, lambda: None, **given).get_route_handler()


def receive_of(request: Request) -> Receive:
    """Return the receiver of the body, also if a dependency of the host has read it: the framework stores it then."""
    known: bytes | None = getattr(request, "_body", None)
    if known is None:
        return request.receive

    async def receive() -> Message:
        return {"type": "http.request", "body": known}

    return receive


def _path_of(request: Request) -> str:
    """Return the path of the request as it stands in a URL."""
    root, path = request.scope.get("root_path", ""), request.scope["path"]
    return quote(path if path.startswith(root) else root + path)


def posts_of(routers: Iterable[APIRouter]) -> dict[str, Answer]:
    """Return the POST handler of each path without parameters."""
    routes = [route for router in routers for route in router.routes if isinstance(route, APIRoute)]
    return {
        route.path: route.get_route_handler()
        for route in routes
        if route.methods == {"POST"} and not route.param_convertors
    }


@dataclass(slots=True)
class _Job:
    """The steps of one request that need no event loop."""

    endpoint: Callable[..., Any]
    adapter: TypeAdapter[Any] | None
    arguments: dict[str, Any]
    call: Call
    takes_body: bool
    body: Body = b""
    coding: str | None = None
    question: Any = None
    document: Any = None
    """A body that was decoded elsewhere, or is long: it is freed in steps."""
    finish: Callable[[Any], Iterable[Part]] | None = None

    def decode(self) -> None:
        """Decode the body into the endpoint's model, and free it."""
        if self.question is not None:
            return
        text, self.body = self.body, b""
        with self.call.phase("decode"):
            if self.coding is not None:
                text = body.inflated(text, self.coding, self.call)
            if self.adapter is None:
                self.question = text
                return
            if self.document is None:
                self.document = wire.decode_fast(text, self.call.take, self.call.remaining)
                if self.document is not None:
                    with suppress(ValidationError):  # the other decoder keeps what pointers need
                        self.question = self.adapter.validate_python(self.document, context=self.call)
                        return
                    pieces.free_in_steps(self.document)
                self.call.remaining()
                self.call.take(wire.cost_of(text))
                self.document = wire.decode(text, self.call.remaining)
            try:
                self.question = self.adapter.validate_python(self.document, context=self.call)
            except ValidationError as error:
                raise _InvalidBody(error, self.document) from None

    def answer(self) -> list[Part]:
        """Return the encoded answer, nothing if it has no body."""
        call = self.call
        call.remaining()  # it may have waited past its deadline
        try:
            if self.takes_body:
                self.decode()
                self.arguments["question"] = self.question
            answer = self.endpoint(**self.arguments, call=call)
            if answer is None:
                return []
            with call.phase("encode"):
                return self._assemble_response_parts((self.finish or self._encoded)(answer))
        except (EngineError, ServiceError) as error:
            error.where = existing(self.question, error.where)
            forget_frames(error)
            raise
        finally:
            document, self.document, self.question, self.arguments = self.document, None, None, {}
            if not call.is_light:
                pieces.free_in_steps(document)

    def _encoded(self, answer: Any) -> Iterable[Part]:
        if isinstance(answer, np.ndarray):
            self.call.media_type = body.OCTETS
            return wire.cut(wire.octets(answer))
        if isinstance(answer, Iterator):
            return answer
        self.call.check_answer(wire.least_of(answer))
        return wire.encoded(answer, self.call.remaining)

    def _assemble_response_parts(self, parts: Iterable[Part]) -> list[Part]:
        """Return the parts of an answer, within its limits, compressed if accepted and worthwhile."""
        gathered, size = [], 0
        for part in parts:
            self.call.take_part(part)
            gathered.append(part)
            size += len(part)
        if self.call.coding is None or size < LEAST_COMPRESSED:
            self.call.coding = None
            return gathered
        return [*wire.compressed(_checked(gathered, self.call), self.call.coding)]


def _checked(parts: list[Part], call: Call) -> Iterable[Part]:
    for part in parts:
        call.remaining()
        yield part


class _Answer(Response):
    """An answer that is sent in parts, as fast as the client reads; its memory is returned as it leaves."""

    def __init__(self, parts: list[Part], call: Call, status: int) -> None:
        self._parts, self._call = parts, call
        headers = {"Server-Timing": call.timing(), **call.headers}
        if call.coding is not None:
            headers["Content-Encoding"] = call.coding
        if parts:
            headers |= {"Content-Length": str(sum(map(len, parts))), "Vary": "Accept-Encoding"}
        super().__init__(None, status, headers, call.media_type if parts else None)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the parts; the server waits before each until the last has left (see protocol.py for the limits)."""
        parts, n_parts = self._parts, len(self._parts)
        try:
            await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
            for i_part in range(n_parts - 1):
                await send({"type": "http.response.body", "body": parts[i_part], "more_body": True})
                self._call.take(-len(parts[i_part]))
                parts[i_part] = b""
            await send({"type": "http.response.body", "body": parts[-1] if parts else b"", "more_body": False})
        finally:
            self._call.free()


class _InvalidBody(Exception):
    """A validation error with its document."""

    def __init__(self, error: ValidationError, document: Any) -> None:
        super().__init__()
        self.faults = faults_of_validation(error, document)


def faults_in(error: Exception, what: str) -> list[Fault]:
    """Return the faults of an error; an unexpected one is logged in full."""
    faults = error.faults if isinstance(error, _InvalidBody) else faults_of(error)
    if faults[0].code == "internal":
        log.error("%s failed", what, exc_info=error)
    forget_frames(error)
    return faults


def _coding_wanted(header: bytes) -> str | None:
    """Return the content coding that the client accepts for a large answer; zstd before gzip: faster and smaller."""
    if not header:
        return None
    wanted = _CODING.findall(header.lower())
    taken = {name for name, weight in wanted if not weight or float(weight)}
    return next((coding for coding in ("zstd", "gzip") if coding.encode() in taken), None)


def _is_known(tags: bytes, call: Call, method: str) -> bool:
    """Return whether the client has the answer already, by the tags of If-None-Match."""
    named = {tag.strip().removeprefix("W/") for tag in tags.decode("latin-1").split(",")}
    return method in ("GET", "HEAD") and call.headers.get("ETag", "") in named


def _parse_query_params(request: Request, query: Query, is_alone: bool) -> dict[str, Any]:
    """Return the declared query parameters; the endpoint has the defaults of absent ones.

    Others are refused, where no dependency of a host may read them (is_alone).
    """
    values: dict[str, Any] = {}
    if is_alone and (unknown := sorted(set(request.query_params) - set(query))):
        known = f"there are {', '.join(map(repr, query))}" if query else "this call has none"
        raise ServiceError("invalid_request", f"no query parameter {unknown[0]!r:.100}; {known}")
    for name, (adapter, is_required) in query.items():
        value = request.query_params.get(name)
        if value is None and not is_required:
            continue
        try:
            values[name] = adapter.validate_python(value)
        except ValidationError as error:
            expected = str(error.errors()[0]["msg"]).replace("Input should be", "expected")
            got = "nothing" if value is None else f"{value!r:.100}"
            raise ServiceError("invalid_request", f"query parameter {name!r}: {expected}, got {got}") from None
    return values


async def _run(pool: Pool, call: Call, job: Callable[[], list[Part]], receive: Receive, is_small: bool) -> list[Part]:
    """Run `job` in the pool and set the call's cancel switch if the client disconnects meanwhile."""
    watcher = asyncio.create_task(watch(call, receive))
    try:
        return await pool.run(call, job, is_small)
    finally:
        watcher.cancel()


async def watch(call: Call, receive: Receive) -> None:
    """Set the call's switch when the client disconnects."""
    while (await receive())["type"] != "http.disconnect":
        pass
    call.set()
