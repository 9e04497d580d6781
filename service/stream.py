"""POST /v1/layers/stream: features against one layer, a JSON text a line in and out, without a limit on their number.

| line | in | out |
|---|---|---|
| first | `operation`, `layer` and options, as `engine.layers.FeatureStream` has them | a feature |
| others | a GeoJSON Feature each, after a record separator (RFC 8142) or not; empty ones are ignored | a feature each |

Features are answered in parts, in order: no more is read before the answers of a part are sent, so a client reads while
it writes. Each part has the deadline of a request. What is wrong is a problem that names its line: the answer if it is
in the first part, else the last line of the answer, with `"type": "Error"`.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from functools import partial
from typing import Any, Final

import numpy as np
import orjson
from fastapi.routing import APIRoute, APIRouter
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

import engine
from service import wire
from service.body import coding_of, media_type_of
from service.convert.areas import geometry_of
from service.errors import STATUS, ServiceError, problem
from service.memory import FOOTPRINT
from service.openapi import responses
from service.route import OF_BODY, Answer, faults_in, guard_of, receive_of, state_of
from service.schemas.arrays import Fault
from service.work import Call

PATH: Final = "/v1/layers/stream"
KINDS: Final = ("application/x-ndjson", "application/jsonl", "application/geo+json-seq")
PART: Final = 2**20
"""Bytes of features that are answered together, about."""
_MOST: Final = 2_000
"""Features that are answered together, at most."""
_ANSWER: Final = 2**16
"""Bytes sent at a time, about."""
Line = tuple[int, bytes]
"""Its number, from 1, and its text."""


class Stream(Response):
    """The answer to a stream of features: reads the request while it is sent."""

    def __init__(self, request: Request, given: list[tuple[bytes, bytes]]) -> None:
        """given: headers that the application's own dependencies add."""
        super().__init__()
        self._request, self._given = request, given

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        state, status, calls = state_of(self._request.app), 0, list[Call]()

        def new_call(lines: list[Line]) -> Call:
            call = Call(state.settings, state.store, state.memory)
            calls.append(call)
            call.take(FOOTPRINT * sum(len(text) for _, text in lines))
            return call

        async def begin() -> None:
            nonlocal status
            if not status:
                status = 200
                headers = [(b"content-type", KINDS[0].encode()), *self._given]
                await send({"type": "http.response.start", "status": status, "headers": headers})

        lines, ahead = list[Line](), _Ahead(receive_of(self._request))
        stream: engine.layers.FeatureStream | None = None
        try:
            _check_headers(dict(scope["headers"]))
            parts = _parts_of(ahead, state.settings.max_body_bytes, state.settings.body_seconds)
            lines = await anext(parts, [])
            call = new_call(lines)
            ahead.watch(call)
            stream = await state.pool.run(call, partial(_begun, lines, call), False)
            async for lines in parts:
                part = new_call(lines)
                ahead.watch(part)
                for text in await state.pool.run(part, partial(_answered, stream, lines, part), False):
                    await begin()
                    await send({"type": "http.response.body", "body": text, "more_body": True})
                part.free()
                calls.remove(part)
            await begin()
            await send({"type": "http.response.body", "body": b"", "more_body": False})
        except ClientDisconnect:
            pass
        except Exception as error:
            faults = faults_in(error, f"POST {PATH}")
            if stream is not None and isinstance(error, engine.EngineError):
                faults = [_with_line(fault, lines, stream.n_features) for fault in faults]
            answer = problem(faults, getattr(error, "headers", None) or {})
            if not status:
                status = answer.status_code
                answer.raw_headers += self._given
                await answer(scope, receive, send)
            else:
                text = orjson.dumps({**orjson.loads(bytes(answer.body)), "type": "Error"}) + b"\n"
                await send({"type": "http.response.body", "body": text, "more_body": False})
        finally:
            ahead.end()
            for call in calls:
                call.free()
            state.metrics.count(stream_features.__name__, status or STATUS["bad_request"], {})


class _Ahead:
    """Receives the next message of a body while a part is answered, so that work ends when the client disconnects."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._next: asyncio.Task[Message] | None = None

    async def __call__(self) -> Message:
        """Return the next message."""
        if self._next is None:
            return await self._receive()
        message, self._next = self._next, None
        return await message

    def watch(self, call: Call) -> None:
        """Set the call's switch if the next message is that the client disconnected."""

        def end(done: asyncio.Task[Message]) -> None:
            if not done.cancelled() and done.exception() is None and done.result()["type"] == "http.disconnect":
                call.set()

        if self._next is None:
            self._next = asyncio.get_running_loop().create_task(_next_of(self._receive))
        self._next.add_done_callback(end)

    def end(self) -> None:
        """Receive no more."""
        if self._next is not None:
            self._next.cancel()


async def _next_of(receive: Receive) -> Message:
    return await receive()


class StreamRoute(APIRoute):
    """A route that answers with a `Stream`."""

    def get_route_handler(self) -> Answer:
        """Return the coroutine that answers a request."""
        guard = guard_of(self)

        async def handle(request: Request) -> Response:
            given = [] if guard is None else (await guard(request)).raw_headers
            return Stream(request, [header for header in given if header[0] not in OF_BODY])

        return handle


router = APIRouter(route_class=StreamRoute, responses=responses(400, 404, 408, 413, 415, 422, 504))
_LINES: Final = {KINDS[0]: {"schema": {"type": "string", "description": "A JSON text a line."}}}


@router.post(
    PATH,
    operation_id="stream_features",
    tags=["layers"],
    response_class=Response,
    responses={200: {"description": "A feature a line; a problem is the last.", "content": _LINES}},
    openapi_extra={"requestBody": {"required": True, "content": _LINES}},
)
def stream_features() -> None:
    """Answer features against one layer, a JSON text a line in and out: the first line has the members `operation`
    (clip, join, nearest or contains), `layer`, which may be `{"type": "stored", "id": ...}`, a polygon or a scene of
    polygons, and options of the call of that name; the others are a feature each."""


def _check_headers(headers: dict[bytes, bytes]) -> None:
    if media_type_of(headers) not in KINDS or coding_of(headers) is not None:
        detail = f"expected the header Content-Type: {KINDS[0]}, and lines that are not compressed"
        error = ServiceError("unsupported_media_type", detail)
        error.headers = {"Accept-Post": ", ".join(KINDS)}
        raise error


async def _parts_of(receive: Receive, most: int, seconds: float) -> AsyncIterator[list[Line]]:
    """Yield the first line alone, then the others in parts. most: bytes of a line; seconds: within which something of
    the body must arrive."""
    rest, length, number, is_more, part, size = list[bytes](), 0, 0, True, list[Line](), 0
    is_first = True
    while is_more:
        try:
            async with asyncio.timeout(seconds):
                message = await receive()
        except TimeoutError:
            raise ServiceError("slow_body", f"nothing arrived within {seconds} s; send the next line sooner") from None
        if message["type"] == "http.disconnect":
            raise ClientDisconnect
        is_more = message.get("more_body", False)
        rest.append(message.get("body", b""))
        length += len(rest[-1])
        if is_more and b"\n" not in rest[-1] and length <= most:
            continue
        *whole, last = b"".join(rest).split(b"\n")
        rest, length = [last], len(last)
        for line, text in enumerate([*whole, last], number + 1):
            if len(text) > most:
                what = f"line {line} is longer than {most} bytes"
                raise ServiceError("body_too_large", f"{what}; make it shorter, or raise GEOMETRY_MAX_BODY_BYTES")
        for text in whole if is_more else [*whole, last]:
            number += 1
            text = text.strip().removeprefix(b"\x1e")
            if not text:
                continue
            part.append((number, text))
            size += len(text)
            if is_first or size >= PART or len(part) >= _MOST:
                yield part
                part, size, is_first = [], 0, False
        if part and is_more and not last:  # the client waits for what it sent, perhaps
            yield part
            part, size = [], 0
    if part:
        yield part


def _begun(lines: list[Line], call: Call) -> engine.layers.FeatureStream:
    """Return the stream that the first line asks for."""
    call.start_clock()
    document = wire.decode(lines[0][1], call.remaining) if lines else None
    if not isinstance(document, dict) or not {"operation", "layer"} <= document.keys():
        what = '{"operation": "clip", "layer": a FeatureCollection, ...options}'
        raise ServiceError("invalid_request", f"the first line must be an object like {what}")
    names = {str(name): value for name, value in document.items() if name not in ("deadline", "cancel")}
    if len(names) < len(document):
        raise ServiceError("unknown_field", "deadline and cancel are no options; the service sets them")
    try:
        names["layer"] = _layer_of(names["layer"], call)
        return engine.layers.FeatureStream(**names, deadline=call.remaining(), cancel=call)
    except engine.DeadlineExceededError:
        raise call.too_late() from None


def _layer_of(given: Any, call: Call) -> Any:
    """Return a layer as it is given, or the polygons of a stored solid or scene: a feature each, its number the id."""
    if not isinstance(given, dict) or given.get("type") != "stored":
        return given
    name = given.get("id")
    if not isinstance(name, str):
        raise ServiceError("invalid_request", "layer.id must be that of a stored polygon, or scene of polygons")
    try:
        bodies, poses = [call.store.get(name)], list[engine.Pose | None]()
    except ServiceError:
        scene = call.store.get_scene(name)
        bodies, poses = [*scene.solids], [*scene.poses]
    polygons = [body for body in bodies if isinstance(body, engine.Polygon)]
    if any(poses) or len(polygons) < len(bodies):
        raise ServiceError("unsupported_solid", "a layer is of polygons without poses; store these as a solid or scene")
    rings = (np.split(each.vertices, each.ring_offsets[1:-1]) for each in polygons)  # a union would round crossings
    features = [
        {"type": "Feature", "id": number, "geometry": {"type": "Polygon", "coordinates": given}}
        for number, given in enumerate(rings)
    ]
    return {"type": "FeatureCollection", "features": features}


def _answered(stream: engine.layers.FeatureStream, lines: list[Line], call: Call) -> list[bytes]:
    """Return the answers of some features as lines."""
    call.start_clock()
    features = []
    for number, text in lines:
        try:
            features.append(wire.decode(text, call.remaining))
        except ServiceError as error:
            raise ServiceError(error.code, f"line {number}: {error.detail}") from None
    call.instead = "send fewer properties with each feature"
    try:
        rows = stream.rows(features, deadline=call.remaining(), cancel=call)
    except engine.DeadlineExceededError:
        raise call.too_late() from None
    answers, some, size = list[bytes](), list[bytes](), 0
    for row in range(len(rows)):
        some.append(b'{"type":"Feature",%b,"geometry":%b}\n' % (rows.members(row), geometry_of(rows, row, call)))
        call.take_part(some[-1])
        size += len(some[-1])
        if size >= _ANSWER or row + 1 == len(rows):
            answers.append(b"".join(some))
            some, size = [], 0
    return answers


def _with_line(fault: Fault, lines: list[Line], first: int) -> Fault:
    """Return a fault of a feature with the number of its line, or with those of the part. lines: of the part; first:
    its first feature."""
    match fault.path:
        case ("stream", "features", int(number), *rest):
            line = lines[number - first][0]
            return Fault((line - 1, *rest), fault.code, f"line {line}: {fault.detail}")
    return Fault(fault.path, fault.code, f"lines {lines[0][0]} to {lines[-1][0]}: {fault.detail}")
