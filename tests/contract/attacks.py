"""Small requests that once brought the service down, or to a stop: each sends what it has, within bounds of its own.

`tests/contract/test_attacks.py` sends them one by one and together, `python -m benchmarks soak` for long. An attack
returns the statuses that it got; 0 stands for a connection that was closed without an answer.
"""

from __future__ import annotations

import gzip
import json
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple

from benchmarks.load import head, request
from tests.unit.service.asking import SPHERE

MB = 2**20
SECONDS = 20.0
"""After which an attack gives up: an answer that takes longer is one that never came."""
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
_IN_CHUNKS = head("/v1/contains", transfer_encoding="chunked")


class Attack(NamedTuple):
    """What is sent, by which function, and which statuses may come back."""

    name: str
    send: Callable[[int], list[int]]
    allowed: frozenset[int]


ENDED = frozenset({200, 400, 408, 413, 422, 431, 503, 504})
"""Any of these is well: answered in time and within memory, or refused."""


def layer(squares: list[list[Any]], **members: Any) -> dict[str, Any]:
    """Return a FeatureCollection of squares, all of its features with these members."""
    geometries = ({"type": "Polygon", "coordinates": [ring]} for ring in squares)
    features = [{"type": "Feature", "properties": {}, **members, "geometry": each} for each in geometries]
    return {"type": "FeatureCollection", "features": features}


def small_squares(n: int) -> list[list[Any]]:
    """Return so many unit squares apart from each other."""
    return [[[x + 2.0 * k, y] for x, y in SQUARE] for k in range(n)]


def _post(path: str, document: Callable[[], Any], is_packed: bool = False) -> Callable[[int], list[int]]:
    """Return an attack of one POST, its body made once."""

    @cache
    def message() -> bytes:
        body = document()
        body = body if isinstance(body, bytes) else json.dumps(body, separators=(",", ":")).encode()
        return request(path, gzip.compress(body, 6), content_encoding="gzip") if is_packed else request(path, body)

    return lambda port: [talk(port, [message()])]


def talk(port: int, parts: Iterator[bytes] | list[bytes], seconds: float = SECONDS) -> int:
    """Send parts over a connection of their own, as fast as they are taken; return the status of the first answer."""
    end = time.monotonic() + seconds
    with socket.create_connection(("127.0.0.1", port), timeout=seconds) as connection:
        with suppress(OSError):  # closed by the service meanwhile: its answer may be there all the same
            for part in parts:
                connection.settimeout(max(0.01, end - time.monotonic()))
                connection.sendall(part)
        got = b""
        with suppress(OSError):
            while b"\r\n" not in got:
                connection.settimeout(max(0.01, end - time.monotonic()))
                more = connection.recv(2**16)
                if not more:
                    break
                got += more
    return int(got[9:12]) if got.startswith(b"HTTP/1.1 ") else 0


def _copied_properties() -> Any:
    everything = [[-1, -1], [5_000, -1], [5_000, 2], [-1, 2]]
    left = layer([everything], properties={"t": ["x" * 1_000_000] * 4})
    return {"left": left, "right": layer(small_squares(1_900)), "operation": "intersection"}


def _copied_ids() -> Any:
    everything = [[-1, -1], [5_000, -1], [5_000, 2], [-1, 2]]
    left = layer([everything], id="x" * 1_000_000)
    return {"left": left, "right": layer(small_squares(1_900)), "operation": "intersection"}


def _many_names() -> Any:
    left = layer(small_squares(1), properties={**{f"n{k}": k for k in range(60_000)}, "a": 1, "a_1": 2})
    return {"left": left, "right": layer(small_squares(1), properties={"a": 3}), "operation": "intersection"}


def _few_names_in_each() -> Any:
    """Names that only all features together have many of."""
    layers = [layer(small_squares(30_000)) for _ in "ab"]
    for each, letter in zip(layers, "ab"):
        for k, feature in enumerate(each["features"]):
            feature["properties"] = {f"{letter}{k}": 1, "a": 1, "a_1": k}
    return {"left": layers[0], "right": layers[1], "operation": "intersection"}


def _absent_names() -> Any:
    return {"layer": layer(small_squares(10_000)), "by": [f"n{k}" for k in range(1_000)]}


def _long_properties() -> Any:
    return {"layer": layer(small_squares(1), properties={"t": list(range(3_000_000))}), "by": ["t"]}


def _unknown_fields(size: int) -> bytes:
    fields = b",".join(b'"%x":0' % k for k in range(size // 10))
    return b'{"solid":' + json.dumps(SPHERE).encode() + b',"points":[],' + fields + b"}"


def _empty_rings() -> bytes:
    return b'{"solid":{"type":"polygon","rings":[' + b"[]," * (16 * MB // 3) + b"[]]}" + b',"points":[]}'


def _small_objects() -> bytes:
    return b'{"solid":' + json.dumps(SPHERE).encode() + b',"points":[' + b'{"a":{}},' * (4 * MB) + b"0]}"


def trailers_for_ever(port: int) -> list[int]:
    """Send a body in chunks, and then trailers, 30 MB of them."""
    body = json.dumps({"solid": SPHERE, "points": [[0, 0, 0]]}).encode()
    trailers = b"a:b\r\n" * (2**16)
    parts = [_IN_CHUNKS, b"%x\r\n%b\r\n0\r\n" % (len(body), body), *[trailers] * (30 * MB // len(trailers)), b"\r\n"]
    return [talk(port, parts)]


def chunks_of_a_byte(port: int) -> list[int]:
    """Send chunks whose extensions are far longer than what is in them."""
    chunk = b"1;" + b"x" * 2**16 + b"\r\n \r\n"
    return [talk(port, [_IN_CHUNKS, *[chunk] * (30 * MB // len(chunk)), b"1\r\n0\r\n0\r\n\r\n"])]


def declared_alone(port: int) -> list[int]:
    """Declare four bodies of 64 MiB, send a byte of each; return what a body of 20 kB gets meanwhile."""
    idle = [socket.create_connection(("127.0.0.1", port), timeout=SECONDS) for _ in range(4)]
    try:
        for each in idle:
            each.sendall(head("/v1/contains", content_length=64 * MB) + b"{")
        time.sleep(0.1)
        body = json.dumps({"solid": SPHERE, "points": [[0.25, 0.5, 0.75]] * 1_000}).encode()
        return [talk(port, [request("/v1/contains", body)])]
    finally:
        for each in idle:
            each.close()


def pipelined(port: int) -> list[int]:
    """Send 4 MB of small requests behind one that takes its time, and go away."""
    body = json.dumps({"bodies": [{"solid": SPHERE}] * 300, "points": [[0, 0, 0]] * 10_000}).encode()
    gets = b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n" * 2_000
    return [talk(port, [request("/v1/contains/scene", body), *[gets] * (4 * MB // len(gets))], 5.0)]


def tools_with_large_answers(port: int) -> list[int]:
    """Call a tool whose answer is large."""
    bodies = [{"solid": SPHERE}] * 600
    arguments = {"bodies": bodies, "points": [[0, 0, 0]] * 20_000}
    call = {
        "jsonrpc": "2.0",
        "id": 1,
        "method": "tools/call",
        "params": {"name": "contains_scene", "arguments": arguments},
    }
    body = json.dumps(call, separators=(",", ":")).encode()
    accepted = "application/json, text/event-stream"
    version = "2025-06-18"
    return [talk(port, [request("/mcp", body, host="localhost", accept=accepted, mcp_protocol_version=version)])]


def all_attacks() -> list[Attack]:
    """Return every attack; bodies are made when one is first sent."""
    bodies: dict[str, Callable[[int], list[int]]] = {
        "properties of 4 MB copied into 1,900 rows": _post("/v1/layers/overlay", _copied_properties, True),
        "an id of 1 MB copied into 1,900 rows": _post("/v1/layers/overlay", _copied_ids, True),
        "60,000 names, two that become one": _post("/v1/layers/overlay", _many_names),
        "60,000 names in as many features": _post("/v1/layers/overlay", _few_names_in_each),
        "1,000 absent names and 10,000 features": _post("/v1/layers/union", _absent_names),
        "a property of 3,000,000 numbers": _post("/v1/layers/union", _long_properties),
        "unknown fields, 30 MB": _post("/v1/contains", lambda: _unknown_fields(30 * MB)),
        "unknown fields, 60 MB packed": _post("/v1/contains", lambda: _unknown_fields(60 * MB), True),
        "empty rings, packed": _post("/v1/contains", _empty_rings, True),
        "small objects, packed": _post("/v1/contains", _small_objects, True),
    }
    attacks = [Attack(name, send, ENDED) for name, send in bodies.items()]
    attacks += [
        Attack("trailers for ever", trailers_for_ever, ENDED | {0}),
        Attack("chunk extensions for ever", chunks_of_a_byte, ENDED | {0}),
        Attack("bodies declared and not sent", declared_alone, frozenset({200})),
        Attack("requests behind a slow one", pipelined, ENDED | {0}),
        Attack("a tool with a large answer", tools_with_large_answers, ENDED),
    ]
    return attacks
