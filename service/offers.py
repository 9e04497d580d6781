"""httptools' parser, with offers to change the protocol declined rather than taken for the end of the request.

A client may offer HTTP/2 with any request (`Upgrade: h2c`; Java's HttpClient does so by default) and a server may
ignore it (RFC 9110, 7.8). httptools stops after the headers of such a request, and uvicorn then hands the application
a request without its body. Here the headers are parsed again without the offer, and what follows them is the body.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Final

import httptools
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

_OFFER: Final = (b"upgrade", b"http2-settings", b"connection")


class Parser:
    """httptools' parser; after an offer a new one takes its place."""

    def __init__(self, protocol: HttpToolsProtocol) -> None:
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
