"""The route class: reads a body within its limits, decodes and checks it, calls the endpoint, encodes its answer.

FastAPI describes the routes (parameters, models, the OpenAPI document); this class answers them. FastAPI's own handler
would decode and check on the event loop, where one large body holds up everybody else's small ones. An endpoint is a
plain function ``(question, call) -> answer``: it runs inline where body and solid are small, else in the pool.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi.routing import APIRoute
from pydantic import TypeAdapter, ValidationError
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Receive

from engine import EngineError
from service import wire
from service.convert.questions import existing, is_light
from service.errors import STATUS, ServiceError, faults_of, faults_of_validation, problem
from service.settings import Settings
from service.work import Call, Pool

log = logging.getLogger("service")


class GeometryRoute(APIRoute):
    """A route whose endpoint takes ``question`` (the body's model, if any), path parameters, and ``call``."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the coroutine that answers a request."""
        endpoint, status = self.endpoint, self.status_code or 200
        model = self.body_field.field_info.annotation if self.body_field is not None else None
        adapter = None if model is None else TypeAdapter(model)

        async def handle(request: Request) -> Response:
            call = Call(request.app.state.settings, request.app.state.store)
            response = await answer(request, call)
            request.app.state.metrics.count(self.operation_id or self.name, response.status_code, call.seconds)
            return response

        async def answer(request: Request, call: Call) -> Response:
            state = request.app.state
            try:
                body = b""
                if adapter is not None:
                    _check_media_type(request)
                    state.pool.check_room()
                    body = await _read(request, call.settings)
                job = _Job(endpoint, adapter, body, dict(request.path_params), call)
                if len(body) <= call.settings.inline_bytes and state.warm.is_set():
                    job.decode()
                    if job.question is not None and is_light(job.question):
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
            headers = {"Server-Timing": call.timing(), **call.headers}
            return Response(payload, call.status or status, headers, "application/json" if payload else None)

        return handle


class _Job:
    """The steps of one request that need no event loop."""

    def __init__(
        self,
        endpoint: Callable[..., Any],
        adapter: TypeAdapter[Any] | None,
        body: bytes,
        path: dict[str, Any],
        call: Call,
    ) -> None:
        self.endpoint = endpoint
        self.adapter = adapter
        self.body = body
        self.path = path
        self.call = call
        self.question: Any = None

    def decode(self) -> None:
        """Turn the body into the endpoint's model."""
        if self.adapter is None or self.question is not None:
            return
        with self.call.phase("decode"):
            document = wire.decode(self.body)
            try:
                self.question = self.adapter.validate_python(document, context=self.call.settings)
            except ValidationError as error:
                raise _InvalidBody(error, document) from None

    def answer(self) -> bytes:
        """Return the encoded answer."""
        self.call.remaining()  # it may have waited past its deadline
        self.decode()
        arguments = self.path if self.adapter is None else {**self.path, "question": self.question}
        try:
            answer = self.endpoint(**arguments, call=self.call)
        except (EngineError, ServiceError) as error:
            error.where = existing(self.question, error.where)
            raise
        with self.call.phase("encode"):
            return b"" if answer is None else wire.encode(answer)


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
    return problem(faults)


def _check_media_type(request: Request) -> None:
    given = request.headers.get("content-type", "")
    kind = given.partition(";")[0].strip().lower()
    if kind != "application/json" and not (kind.startswith("application/") and kind.endswith("+json")):
        got = f"got {given[:100]!r}" if given else "got none"
        raise ServiceError("unsupported_media_type", f"expected the header Content-Type: application/json, {got}")


async def _read(request: Request, settings: Settings) -> bytes:
    """Return the body, refused as soon as it is known to be too long, declared or not, or too slow."""
    limit = settings.max_body_bytes
    declared = request.headers.get("content-length", "0")
    if declared.isdigit() and int(declared) > limit:
        raise _too_large(limit)
    chunks, size = [], 0
    try:
        async with asyncio.timeout(settings.body_seconds):
            async for chunk in request.stream():
                size += len(chunk)
                if size > limit:
                    raise _too_large(limit)
                chunks.append(chunk)
    except TimeoutError:
        seconds = settings.body_seconds
        raise ServiceError("slow_body", f"the body did not arrive within {seconds} s; send it faster") from None
    return b"".join(chunks)


def _too_large(limit: int) -> ServiceError:
    detail = f"the body is longer than {limit} bytes; send less at once, or raise GEOMETRY_MAX_BODY_BYTES"
    return ServiceError("body_too_large", detail)


async def _run(pool: Pool, call: Call, job: Callable[[], bytes], receive: Receive) -> bytes:
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
