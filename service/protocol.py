"""HTTP/1.1 over httptools, with offers to change the protocol declined rather than taken for the end of the request.

A client may offer HTTP/2 with any request (`Upgrade: h2c`; Java's HttpClient does so by default) and a server may
ignore it (RFC 9110, 7.8). httptools stops after the headers of such a request, and uvicorn then hands the application
a request without its body. Here the headers are parsed again without the offer, and what follows them is the body.

Headers that do not arrive in time, or do not end, are answered with 408 or 431, what is no HTTP/1.1 with 400, and the
connection is closed. A client that does not read its answer in time is dropped.
"""

from __future__ import annotations

import asyncio
import secrets
from contextlib import suppress
from functools import cache
from http import HTTPStatus
from typing import Any, Final

import httptools
from uvicorn.protocols.http.flow_control import HIGH_WATER_LIMIT
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from service.errors import problem
from service.schemas.arrays import Fault
from service.settings import Settings

_MOST_HEADER_BYTES: Final = 2**16
_OFFER: Final = (b"upgrade", b"http2-settings", b"connection")


@cache
def _settings() -> Settings:
    """Return the settings of this process: uvicorn makes protocols without the application's."""
    return Settings()


class Protocol(HttpToolsProtocol):
    """uvicorn's protocol with a parser that reads on after an offer, and limits to what comes before a request."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.parser: Any = _Parser(self)
        self._timer: asyncio.TimerHandle | None = None  # runs while headers are waited for
        self._header_bytes = 0
        self._seconds = _settings().header_seconds
        self._writing: asyncio.TimerHandle | None = None  # runs while the client has to read
        self._is_refused = False

    def connection_made(self, transport: Any) -> None:
        """Start the clock for the first request."""
        super().connection_made(transport)
        self._start_clock()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the clocks."""
        self._stop_clock()
        self.resume_writing()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Give the client some time to read what was written."""
        super().pause_writing()
        if self._writing is None:
            self._writing = self.loop.call_later(_settings().write_seconds, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on: the client has read nearly all."""
        if self._writing is not None:
            self._writing.cancel()
            self._writing = None
        super().resume_writing()

    def data_received(self, data: bytes) -> None:
        """Parse `data`; headers without end are refused."""
        super().data_received(data)
        if self._timer is not None:
            self._header_bytes += len(data)
            if self._header_bytes > _MOST_HEADER_BYTES:
                self._refuse("large_headers", f"the headers are longer than {_MOST_HEADER_BYTES} bytes; send fewer")

    def on_message_begin(self) -> None:
        """Start the clock for a later request on the same connection."""
        super().on_message_begin()
        if self._timer is None:
            self._start_clock()

    def _start_clock(self) -> None:
        self._header_bytes = 0
        seconds = self._seconds
        detail = f"the headers did not arrive within {seconds:g} s; send them faster"
        self._timer = self.loop.call_later(seconds, self._refuse, "slow_headers", detail)

    def _stop_clock(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _refuse(self, code: str, detail: str) -> None:
        """Answer before there is a request, and close."""
        self._stop_clock()
        self._is_refused = True
        if self.transport.is_closing():
            return
        answer = problem([Fault((), code, detail)], {"connection": "close", "x-request-id": secrets.token_hex(8)})
        lines = [f"HTTP/1.1 {answer.status_code} {HTTPStatus(answer.status_code).phrase}".encode()]
        lines += [name + b": " + value for name, value in answer.raw_headers]
        self.transport.write(b"\r\n".join([*lines, b"", bytes(answer.body)]))
        self.transport.close()

    def on_headers_complete(self) -> None:
        """Start the request, unless its headers are to be parsed again."""
        if self.parser.is_offer() or self._is_refused:
            return
        wrong = self._fault_of_headers()
        if wrong:
            self._refuse("bad_request", wrong)
        else:
            self._stop_clock()
            super().on_headers_complete()

    def _fault_of_headers(self) -> str:
        """Return what HTTP/1.1 forbids about the headers, and the parser lets pass."""
        n_hosts = sum(name == b"host" for name, _ in self.headers)
        if n_hosts > 1 or (not n_hosts and self.parser.get_http_version() == "1.1"):
            return f"a request has one header Host, this one has {n_hosts}; send one"
        codings = [value.strip().lower() for name, value in self.headers if name == b"transfer-encoding"]
        if codings and codings != [b"chunked"]:
            return "the only Transfer-Encoding taken is chunked; compress with Content-Encoding: gzip"
        return ""

    def send_400_response(self, msg: str) -> None:
        """Answer what the parser refuses; where an answer is under way already, just close."""
        if self.cycle is not None and self.cycle.response_started and not self.cycle.response_complete:
            self.transport.close()
        else:
            self._refuse("bad_request", "this is no valid HTTP/1.1 request; correct its first line, headers or chunks")

    def on_body(self, body: bytes) -> None:
        """Hand a part of the body on as it is where no other waits: uvicorn copies it into a buffer and out of it."""
        cycle = self.cycle
        if self._is_refused:
            return
        if cycle.body or cycle.response_complete or self.parser.is_offer():
            if isinstance(cycle.body, bytes):
                cycle.body = bytearray(cycle.body)
            super().on_body(body)
            return
        cycle.body = body  # type: ignore[assignment]
        if len(body) > HIGH_WATER_LIMIT:
            self.flow.pause_reading()
        cycle.message_event.set()

    def on_message_complete(self) -> None:
        """End the request, unless its headers are to be parsed again."""
        if not (self.parser.is_offer() or self._is_refused):
            super().on_message_complete()


class _Parser:
    """httptools' parser; after an offer a new one takes its place."""

    def __init__(self, protocol: Protocol) -> None:
        self._protocol = protocol
        self._parser = _new_parser(protocol)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._parser, name)

    def is_offer(self) -> bool:
        """Tell whether the request offers another protocol (CONNECT asks for nothing else, and is refused)."""
        return self._parser.should_upgrade() and self._parser.get_method() != b"CONNECT"

    def feed_data(self, data: bytes) -> None:
        """Parse `data`; it may hold several requests, hence several offers."""
        while True:  # bound: each turn but the last takes the headers of a request off `data`
            try:
                self._parser.feed_data(data)
                return
            except httptools.HttpParserUpgrade as offer:
                if not self.is_offer():
                    raise
                data = data[offer.args[0] :]
                self._parse_again()

    def _parse_again(self) -> None:
        protocol, method = self._protocol, self._parser.get_method()
        lines = [method + b" " + protocol.url + b" HTTP/1.1"]
        lines += [name + b": " + value for name, value in protocol.headers if name not in _OFFER]
        if not self._parser.should_keep_alive():
            lines.append(b"connection: close")
        self._parser = _new_parser(protocol)
        self._parser.feed_data(b"\r\n".join([*lines, b"", b""]))


def _new_parser(protocol: Protocol) -> Any:
    """Return a parser as uvicorn makes it."""
    parser = httptools.HttpRequestParser(protocol)
    with suppress(AttributeError):  # older httptools
        parser.set_dangerous_leniencies(lenient_data_after_close=True)
    return parser
