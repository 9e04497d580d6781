"""HTTP/1.1 over httptools, one request at a time: nothing that a client sends ahead, or after its body, is accepted.

| what a client sends | what becomes of it |
|---|---|
| headers that do not arrive in time, or do not end | 408, 431, the connection is closed |
| what is no HTTP/1.1 | 400, closed |
| trailers | counted and dropped: they are no headers (RFC 9110, 6.5.1); 431 and closed where they do not end |
| lines of chunks: sizes and extensions | as trailers, with 16 bytes a chunk and twice its data left out of the count |
| a body whose answer was sent before it was whole | some of it is dropped (`_DROPPED`, `_LINGER`), then closed |
| requests ahead of the answer to one before | stay as bytes, those of one read or two; the rest stays in the socket |

A client that reads its answer too slowly is dropped: the next 200 kB by `write_seconds`, all of it by `answer_seconds`.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable
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

_OFFER: Final = (b"upgrade", b"http2-settings", b"connection")


class Parser:
    """httptools' parser; after an upgrade offer a new one replaces it."""

    def __init__(self, protocol: HttpToolsProtocol) -> None:
        self._protocol = protocol
        self._parser = _new_parser(protocol)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._parser, name)

    def is_offer(self) -> bool:
        """Return whether the request offers another protocol (CONNECT offers nothing else, and is refused)."""
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
        lines = [method + b" " + protocol.url + b" HTTP/" + self._parser.get_http_version().encode()]
        lines += [name + b": " + value for name, value in protocol.headers if name not in _OFFER]
        if not self._parser.should_keep_alive():
            lines.append(b"connection: close")
        self._parser = _new_parser(protocol)
        self._parser.feed_data(b"\r\n".join([*lines, b"", b""]))


def _new_parser(protocol: HttpToolsProtocol) -> Any:
    """Return a parser as uvicorn makes it."""
    parser = httptools.HttpRequestParser(protocol)
    with suppress(AttributeError):  # older httptools
        parser.set_dangerous_leniencies(lenient_data_after_close=True)
    return parser


_MOST_HEADER_BYTES: Final = 2**16
_MOST_OVERHEAD: Final = 2**14
"""Bytes of a body's trailers and chunk lines beyond the allowance for chunks."""
_FREE_OF_CHUNK: Final = 16
"""Bytes of each chunk's line that do not count, and `_FREE_OF_DATA` for each byte of its data, itself included."""
_FREE_OF_DATA: Final = 3
_STEP: Final = 2**11
"""Bytes parsed per step if chunks or requests may end among them: a millisecond for chunks of one byte."""
_EVENTS: Final = 64
"""Parts of a body after which a connection yields to others."""
_DROPPED: Final = 2**20
_LINGER: Final = 2.0
"""Bytes and seconds that a client may go on sending after its answer: closing at once might lose the answer."""
_END: Final = b"\n\r\n"
"""End of headers, and of a chunked body."""


@cache
def _settings() -> Settings:
    """Return the settings of this process: uvicorn makes protocols without the application's."""
    return Settings()


class Protocol(HttpToolsProtocol):
    """uvicorn's protocol with a parser that ignores upgrade offers, and limits on everything around bodies."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.parser: Any = Parser(self)
        self._timers: dict[str, asyncio.TimerHandle] = {}
        """By what they wait for: headers, the client to read, it to have read a whole answer, its end."""
        self._raw = b""  # received and not parsed yet
        self._overhead = 0  # bytes of headers, trailers and lines of chunks
        self._left = 0  # bytes of a body of declared length that are to come
        self._is_chunked = self._is_in_message = self._is_in_body = False
        self._keeps_alive = True
        self.is_closing = self.is_full = False
        self._n_events = self._n_dropped = 0

    def connection_made(self, transport: Any) -> None:
        """Start the clock for the first request."""
        self._real = transport
        super().connection_made(_Transport(self, transport))  # type: ignore[arg-type]
        self._start_headers()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the clocks."""
        self.is_closing, self._raw = True, b""
        self._stop(*self._timers)
        super().connection_lost(exc)

    def close(self) -> None:
        """Close the connection once the client has read what was written, within some time."""
        if self.is_closing:
            return
        self.is_closing, self._raw = True, b""
        self._stop("headers")
        cycle, transport = self.cycle, self._real
        if cycle is not None and not cycle.response_complete:
            cycle.disconnected = True  # what it writes would go to nobody
            cycle.message_event.set()
        if self._is_in_message:
            self.is_full = False
            transport.resume_reading()
            if transport.can_write_eof():
                transport.write_eof()
            self._start("end", _LINGER, transport.abort)
        else:
            self._start("end", _settings().write_seconds, transport.abort)
            transport.close()

    def shutdown(self) -> None:
        """End after the running request."""
        self._keeps_alive = False
        super().shutdown()

    def _start(self, name: str, seconds: float, function: Callable[..., object], *arguments: object) -> None:
        self._timers[name] = self.loop.call_later(seconds, function, *arguments)

    def _stop(self, *names: str) -> None:
        for name in names:
            if name in self._timers:
                self._timers.pop(name).cancel()

    def pause_writing(self) -> None:
        """Give the client some time to read what was written, and some for the whole answer."""
        super().pause_writing()
        for name, seconds in (("reading", _settings().write_seconds), ("answer", _settings().answer_seconds)):
            if name not in self._timers:
                self._start(name, seconds, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on: the client has read nearly all."""
        self._stop("reading")
        super().resume_writing()
        if self.cycle is None or self.cycle.response_complete:
            self._stop("answer")

    def data_received(self, data: bytes) -> None:
        """Parse `data` as far as it belongs to the running request."""
        if self.is_closing:
            self._n_dropped += len(data)
            if self._n_dropped > _DROPPED:
                self.transport.abort()
            return
        self._raw += data
        self._parse()

    def _parse(self) -> None:
        """Parse the received bytes up to the end of one request; a remainder pauses reading."""
        raw, start, self._n_events = memoryview(self._raw), 0, 0
        while start < len(raw) and self._n_events < _EVENTS and not self._must_wait():  # bound: each turn takes bytes
            stop = self._end_of_piece(start)
            if stop == start:
                break
            piece, start = raw[start:stop], stop
            if not self._is_in_message and "headers" not in self._timers:  # also where it is blank lines alone
                self._start_headers()
            self._overhead += len(piece)
            super().data_received(piece)  # type: ignore[arg-type]
            self._check_overhead()
            if self.is_closing:
                return
        self._raw = self._raw[start:]
        is_waiting = self._must_wait()
        if not is_waiting and self._n_events >= _EVENTS and self._raw:
            self.loop.call_soon(self._parse)
            is_waiting = True
        was_full, self.is_full = self.is_full, is_waiting and len(self._raw) > HIGH_WATER_LIMIT
        if self.is_full:
            self._real.pause_reading()
        elif was_full and not self.flow.read_paused:
            self._real.resume_reading()

    def _must_wait(self) -> bool:
        """Return whether parsing pauses: a request is complete, and its answer must be sent first."""
        is_answered = self.cycle is None or self.cycle.response_complete
        return self.is_closing or (not self._is_in_message and not is_answered)

    def _end_of_piece(self, start: int) -> int:
        """Return where to stop parsing `_raw`: at the latest at the end of headers or of a body."""
        raw = self._raw
        if self._left:
            return min(len(raw), start + self._left)
        end_of_headers = raw.find(_END, start, start + _STEP)
        if end_of_headers >= 0:
            return end_of_headers + len(_END)
        stop = min(len(raw), start + _STEP)
        for _ in range(len(_END) - 1):  # what may be the first part of an end waits for the rest of it
            stop -= stop > start and raw[stop - 1] in b"\r\n"
        return stop

    def _check_overhead(self) -> None:
        self._overhead = max(0, self._overhead)
        most = _MOST_OVERHEAD if self._is_in_body else _MOST_HEADER_BYTES
        if self._overhead > most:
            what = "trailers and lines of chunks" if self._is_in_body else "headers"
            self._refuse("large_headers", f"the {what} are longer than {most} bytes; send fewer")

    def on_message_begin(self) -> None:
        """Note that a request has begun."""
        super().on_message_begin()
        self._is_in_message, self._is_in_body = True, False

    def _start_headers(self) -> None:
        self._overhead, seconds = 0, _settings().header_seconds
        detail = f"the headers did not arrive within {seconds:g} s; send them faster"
        self._start("headers", seconds, self._refuse, "slow_headers", detail)

    def _refuse(self, code: str, detail: str) -> None:
        """Answer before there is a request, or while its body arrives, and close."""
        is_begun = self._is_in_body and self.cycle.response_started
        if not (self.is_closing or is_begun):
            answer = problem([Fault((), code, detail)], {"connection": "close", "x-request-id": secrets.token_hex(8)})
            lines = [f"HTTP/1.1 {answer.status_code} {HTTPStatus(answer.status_code).phrase}".encode()]
            lines += [name + b": " + value for name, value in answer.raw_headers]
            self.transport.write(b"\r\n".join([*lines, b"", bytes(answer.body)]))
        self.close()

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a header; a trailer is dropped."""
        if not self._is_in_body:
            super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Start the request, unless its headers are to be parsed again."""
        if self.parser.is_offer() or self.is_closing:
            return
        wrong = self._fault_of_headers()
        if wrong:
            self._refuse("bad_request", wrong)
            return
        self._stop("headers")
        super().on_headers_complete()
        headers = dict(self.headers)
        self._is_chunked = b"transfer-encoding" in headers
        self._left = int(headers.get(b"content-length", b"").lstrip(b"0") or 0)
        self._is_in_body, self._overhead = True, 0
        self._keeps_alive, self.cycle.keep_alive = self.cycle.keep_alive, False  # should it be answered too early

    def _fault_of_headers(self) -> str:
        """Return the fault of headers that HTTP/1.1 forbids and the parser accepts."""
        n_hosts = sum(name == b"host" for name, _ in self.headers)
        if n_hosts > 1 or (not n_hosts and self.parser.get_http_version() == "1.1"):
            return f"a request has one header Host, this one has {n_hosts}; send one"
        codings = [value.strip().lower() for name, value in self.headers if name == b"transfer-encoding"]
        if codings and codings != [b"chunked"]:
            return "the only Transfer-Encoding taken is chunked; compress with Content-Encoding: gzip"
        return ""

    def send_400_response(self, msg: str) -> None:
        """Answer what the parser refuses."""
        self._refuse("bad_request", "this is no valid HTTP/1.1 request; correct its first line, headers or chunks")

    def on_body(self, body: bytes) -> None:
        """Pass a part of the body on without a copy if no other waits: uvicorn copies it into a buffer and out of
        it."""
        if self.is_closing:
            return
        cycle, size = self.cycle, len(body)
        self._n_events += 1
        self._overhead -= _FREE_OF_CHUNK + _FREE_OF_DATA * size if self._is_chunked else size
        self._left = max(0, self._left - size)
        if not cycle.body:
            cycle.body = body  # type: ignore[assignment]
        else:
            if isinstance(cycle.body, bytes):
                cycle.body = bytearray(cycle.body)
            cycle.body += body
        if len(cycle.body) > HIGH_WATER_LIMIT:
            self.flow.pause_reading()
        cycle.message_event.set()

    def on_message_complete(self) -> None:
        """End the request, unless its headers are to be parsed again."""
        if self.parser.is_offer() or self.is_closing:
            return
        self._is_in_message = self._is_in_body = False
        self.cycle.keep_alive = self._keeps_alive
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """Parse what the client has sent meanwhile."""
        if not self.flow.write_paused:
            self._stop("answer")
        super().on_response_complete()
        if self._raw:
            self.loop.call_soon(self._parse)


class _Transport:
    """A transport that closes in the protocol's way, and pauses reading while there is enough to parse."""

    def __init__(self, protocol: Protocol, real: Any) -> None:
        self._protocol, self._real = protocol, real
        self.write, self.close = real.write, protocol.close

    def is_closing(self) -> bool:
        return self._protocol.is_closing or self._real.is_closing()

    def resume_reading(self) -> None:
        if not self._protocol.is_full:
            self._real.resume_reading()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real, name)
