"""ASGI middleware around all requests: request id, key, security headers, log line.

One ASGI callable around the application; a framework's middleware class would cost as much as a small answer. So does
the framework's routing: if the path alone determines the route, the gate calls the route itself.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import logging
import re
import secrets
import time
from collections.abc import Mapping
from typing import Final

from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import pages
from service.errors import ServiceError, faults_of, problem
from service.metrics import Metrics
from service.route import Answer
from service.settings import Settings
from service.traces import trace_of

log = logging.getLogger("service.access")

OPEN: Final = frozenset({"/healthz", "/readyz", *(path for path in pages.OPEN if path == "/" or path[-1] != "/")})
"""Paths that need no key: probes of the operator, and pages, which prompt for the key themselves."""
_OPEN_BELOW: Final = tuple(path for path in pages.OPEN if path != "/" and path[-1] == "/")
_SAFETY: Final = [
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cache-control", b"no-store"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
]
_NAME: Final = re.compile(rb"[A-Za-z0-9._-]{1,64}")


class Gate:
    """The application behind its middleware."""

    def __init__(self, app: ASGIApp, settings: Settings, posts: Mapping[str, Answer], metrics: Metrics) -> None:
        """posts: the handlers of a POST to a path, errors included."""
        self._app = app
        self._posts = posts
        self._metrics = metrics
        self._keys = [_digest(key.get_secret_value().encode()) for key in settings.api_keys]
        self._logs = settings.access_log
        self._root = settings.root_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass one request on, or answer that its key is missing or wrong."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        before, status, n_bytes = time.perf_counter(), 0, 0
        path = scope["path"]
        if self._root:
            if path == self._root or path.startswith(self._root + "/"):  # a proxy may have left it, or taken it off
                path = path[len(self._root) :] or "/"
            scope = {**scope, "root_path": self._root, "path": self._root + path}
        headers = dict(scope["headers"])
        given = headers.get(b"x-request-id", b"")
        name = given if _NAME.fullmatch(given) else secrets.token_hex(8).encode()
        trace, span = trace_of(headers)
        metrics = self._metrics
        metrics.in_flight.inc()

        async def send_on(message: Message) -> None:
            nonlocal status, n_bytes
            if message["type"] == "http.response.start":
                status = message["status"]
                own = message["headers"]
                there = {key for key, _ in own}
                added = [header for header in _SAFETY if header[0] not in there]
                message["headers"] = [*own, *added, (b"x-request-id", name)]
                if span:
                    message["headers"].append((b"traceresponse", span))
            else:
                n_bytes += len(message.get("body", b""))
            await send(message)

        try:
            if self._keys and path not in OPEN and not path.startswith(_OPEN_BELOW):
                try:
                    self._check(headers)
                except ServiceError as error:
                    await problem(faults_of(error))(scope, receive, send_on)
                    return
            answer = self._posts.get(path) if scope["method"] == "POST" else None
            if answer is None:
                await self._app(scope, receive, send_on)
            else:
                await (await answer(Request(scope, receive, send_on)))(scope, receive, send_on)
        except asyncio.CancelledError:  # the drain is over; an answer that has begun ends with the connection
            if not status:
                ended = ServiceError("cancelled", "the service is shutting down; send the request again")
                await problem(faults_of(ended), {"Connection": "close"})(scope, receive, send_on)
        finally:
            seconds = time.perf_counter() - before
            metrics.in_flight.dec()
            metrics.took.observe(seconds)
            metrics.bytes_out.inc(n_bytes)
            if self._logs:
                _record(scope, status, seconds, name, trace)

    def _check(self, headers: dict[bytes, bytes]) -> None:
        """Raise `missing_key` or `wrong_key` unless the request has a key; as slow for each wrong one."""
        scheme, _, token = headers.get(b"authorization", b"").partition(b" ")
        given = token.strip() if scheme.lower() == b"bearer" else headers.get(b"x-api-key", b"")
        if not given:
            raise ServiceError(
                "missing_key", "send a key of this service: Authorization: Bearer KEY, or X-API-Key: KEY"
            )
        matches = [hmac.compare_digest(_digest(given), key) for key in self._keys]
        if not any(matches):
            raise ServiceError("wrong_key", "the key is none of this service's; GEOMETRY_API_KEYS holds them")


def _digest(key: bytes) -> bytes:
    """Return bytes of one length, so that comparing does not leak a key's length either."""
    return hashlib.sha256(key).digest()


def _record(scope: Scope, status: int, seconds: float, name: bytes, trace: dict[str, str]) -> None:
    if not log.isEnabledFor(logging.INFO):
        return
    # as log.info() makes it, without the search for the line that called it: half of what a log line costs
    record = logging.LogRecord(log.name, logging.INFO, __file__, 0, "request", (), None)
    fields = {
        "request_id": name.decode(),
        "client": scope["client"][0] if scope.get("client") else "",
        "method": scope["method"],
        "path": scope["path"],
        "status": status,
        "milliseconds": round(1e3 * seconds, 3),
    }
    record.fields = fields | trace
    log.handle(record)
