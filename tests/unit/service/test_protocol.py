"""What surrounds requests is bounded: trailers, lines of chunks, bodies after answers, requests ahead."""

from __future__ import annotations

import json
import re
import socket
import time
from collections.abc import Iterator
from contextlib import suppress

import httpx
import pytest

from benchmarks.measure import memory_of
from tests.contract.test_deadlines import vanishing
from tests.unit.service.asking import SPHERE
from tests.unit.service.test_live import Service, running

HEAD = b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n%s\r\n\r\n"
CHUNKED = HEAD % b"Transfer-Encoding: chunked"
KEY = b"\r\nX-API-Key: secret"
BODY = json.dumps(SPHERE).encode()
HEALTH = b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"
MB = 2**20


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    with running(api_keys="secret", deadline_seconds=5, answer_seconds=3, write_seconds=30) as service:
        service.wait_until_ready()
        yield service


def connect(service: Service) -> socket.socket:
    return socket.create_connection(("127.0.0.1", service.port), timeout=30)


def pumped(service: Service, first: bytes, part: bytes) -> tuple[int, bytes]:
    """Send `first`, then `part` again and again, 30 MB at most; return how much was taken, and what came back."""
    sent, answer = 0, b""
    with connect(service) as connection:
        with suppress(OSError):
            connection.sendall(first)
            while sent < 30 * MB:
                connection.sendall(part)
                sent += len(part)
        with suppress(OSError):
            while more := connection.recv(2**16):
                answer += more
    return sent, answer


def chunk(data: bytes, extension: bytes = b"") -> bytes:
    return b"%x%s\r\n%s\r\n" % (len(data), extension, data)


TAKEN = 12 * MB
"""Sent at most to one who does not read: buffers of both ends of a socket, and what is dropped."""


@pytest.mark.parametrize("key", [b"", KEY], ids=["no key", "key"])
@pytest.mark.parametrize(
    ("first", "part"),
    [
        (chunk(b"{") + b"0\r\n", b"a:b\r\n" * 10_000),
        (chunk(b"{") + b"0\r\na:", b"b" * 50_000),
        (b"1;a=", b"b" * 50_000),
        (b"", chunk(b" ", b";a=" + b"b" * 8_000) * 8),
    ],
    ids=["trailers", "one trailer", "one extension", "extensions"],
)
def test_what_surrounds_a_body_has_an_end(service: Service, key: bytes, first: bytes, part: bytes) -> None:
    before = memory_of(service.process.pid)
    sent, answer = pumped(service, HEAD % (b"Transfer-Encoding: chunked" + key) + first, part)
    assert sent < TAKEN
    assert answer[9:12] in ((b"431",) if key else (b"401", b"431")), answer
    assert answer.count(b"HTTP/1.1 ") == 1
    assert memory_of(service.process.pid) - before < 20
    assert httpx.get(f"{service.url}/healthz").status_code == 200


@pytest.mark.parametrize("length", [b"Transfer-Encoding: chunked", b"Content-Length: 60000000"])
def test_after_an_answer_a_body_is_not_read_on(service: Service, length: bytes) -> None:
    part = chunk(b" " * 2**16) if length.startswith(b"T") else b" " * 2**16
    sent, answer = pumped(service, HEAD % length, part)
    assert sent < TAKEN
    assert answer[9:12] == b"401"
    assert b"\r\nconnection: close" in answer


def test_an_answered_body_of_some_length_may_end(service: Service) -> None:
    """Who is still sending gets the answer, and the connection is closed."""
    with connect(service) as connection:
        connection.sendall(HEAD % b"Content-Length: 300000")
        time.sleep(0.3)
        connection.sendall(b" " * 300_000)
        answer = b""
        while more := connection.recv(2**16):
            answer += more
    assert answer.startswith(b"HTTP/1.1 401 "), answer


def test_trailers_are_no_headers(service: Service) -> None:
    """They give no key, no name, no type."""
    assert service.send(CHUNKED + chunk(BODY) + b"0\r\nX-API-Key: secret\r\n\r\n").startswith(b"HTTP/1.1 401 ")
    last = b"0\r\nX-Request-ID: evil\r\nContent-Type: text/plain\r\nContent-Encoding: gzip\r\n\r\n"
    answer = service.send(HEAD % (b"Transfer-Encoding: chunked" + KEY) + chunk(BODY) + last)
    assert answer[9:12] in (b"200", b"201"), answer
    assert b"evil" not in answer
    assert not any("evil" in line for line in service.log)


def test_small_chunks_are_a_body_too(service: Service) -> None:
    """Chunks of a byte, and of some bytes with an extension each, far more than may surround a body otherwise."""
    spaces = chunk(b" ") * 40_000 + chunk(b" " * 30, b";a=" + b"b" * 60) * 2_000
    with connect(service) as connection:
        connection.sendall(HEAD % (b"Transfer-Encoding: chunked" + KEY) + spaces + chunk(BODY) + chunk(b""))
        assert connection.recv(2**16)[9:12] in (b"200", b"201")


def test_requests_ahead_are_answered_in_order(service: Service) -> None:
    lookup = b"GET /v1/solids/%d HTTP/1.1\r\nHost: x\r\nX-API-Key: secret\r\n\r\n"
    post = HEAD % (b"Content-Length: %d" % len(BODY) + KEY) + BODY
    with connect(service) as connection:
        connection.sendall(HEALTH * 30 + post + b"".join(lookup % i for i in range(100)) + HEALTH + b"nonsense\r\n\r\n")
        answer = b""
        while more := connection.recv(2**16):
            answer += more
    statuses = re.findall(rb"HTTP/1\.1 (\d+) ", answer)
    assert statuses[:30] == [b"200"] * 30
    assert statuses[30] in (b"200", b"201")
    assert statuses[31:] == [b"404"] * 100 + [b"200", b"400"]


def slow_request() -> bytes:
    """Return a request for seconds of work that takes next to no memory."""
    body = json.dumps({"solid": vanishing(400), "points": [[3, 5]] * 10_000}).encode()
    return (HEAD % (b"Content-Length: %d" % len(body) + KEY)).replace(b"/solids", b"/contains") + body


def test_requests_behind_a_slow_one_take_no_memory(service: Service) -> None:
    """They wait in the socket; a client that goes away is no error in the log."""
    with connect(service) as connection:
        connection.sendall(slow_request())
        service.wait_until_in_flight(1, "secret")
        before = memory_of(service.process.pid)
        connection.settimeout(1)
        sent = 0
        with suppress(OSError):
            while sent < 20 * MB:
                connection.sendall(HEALTH * 1000)
                sent += len(HEALTH) * 1000
        assert sent < TAKEN
        assert memory_of(service.process.pid) - before < 40
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # a reset at the end
    service.wait_until_in_flight(0, "secret")


def test_who_vanishes_with_requests_ahead_leaves_no_error(service: Service) -> None:
    with connect(service) as connection:
        connection.sendall(slow_request() + HEALTH * 3)
        service.wait_until_in_flight(1, "secret")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    service.wait_until_in_flight(0, "secret")
    assert not any('"level":"error"' in line for line in service.log)


def test_a_whole_answer_has_its_time(service: Service) -> None:
    """However steadily it is read."""
    key = {"X-API-Key": "secret"}
    place = httpx.post(f"{service.url}/v1/solids", json=SPHERE, headers=key).headers["location"].encode()
    body = bytes(48 * 400_000)
    head = b"POST %s/clip/segments HTTP/1.1\r\nHost: x\r\nContent-Length: %d%s\r\n\r\n" % (place, len(body), KEY)
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**12)
        connection.settimeout(30)
        connection.connect(("127.0.0.1", service.port))
        connection.sendall(head + body)
        before, received = time.monotonic(), 0
        while not any("clip/segments" in line for line in service.log):
            assert time.monotonic() - before < 20
            received += len(connection.recv(2**15))
            time.sleep(0.05)
        assert received < len(body) // 2


def test_blank_lines_hold_no_connection() -> None:
    """They ended the time that a connection may idle, and began none."""
    with running(header_seconds=1) as service, connect(service) as connection:
        connection.sendall(HEALTH)
        while b"}" not in connection.recv(2**16):
            pass
        connection.sendall(b"\r\n\r\n")
        connection.settimeout(10)
        answer = b""
        while more := connection.recv(2**16):
            answer += more
        assert answer.startswith(b"HTTP/1.1 408 ")
