"""The service as a process of its own on loopback: start, ready, calls over real sockets, SIGTERM, exit 0."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx
import pytest

from service.settings import Settings
from tests.unit.service.asking import SPHERE, check_problem

ROOT = Path(__file__).resolve().parents[3]


PATIENCE = 1.5
"""Seconds for headers and bodies: a request of this process must not be as slow by itself, on a busy machine either."""


class Service:
    """A running service and what it wrote to its log; by another Python, from its folder, where that is named."""

    def __init__(
        self,
        python: str = sys.executable,
        folder: Path = ROOT,
        around: Mapping[str, str] = os.environ,
        **settings: object,
    ) -> None:
        environment = {**around, **{f"GEOMETRY_{name.upper()}": str(value) for name, value in settings.items()}}
        self.process = subprocess.Popen(
            [python, "-m", "service"],
            cwd=folder,
            env={**environment, "GEOMETRY_PORT": "0"},
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.log: list[str] = []
        self.port = 0
        self._found = threading.Event()
        threading.Thread(target=self._read, daemon=True).start()
        assert self._found.wait(300), "".join(self.log)
        self.url = f"http://127.0.0.1:{self.port}"

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.log.append(line)
            if found := re.search(r"running on http://[\d.]+:(\d+)", line):
                self.port = int(found[1])
                self._found.set()

    def wait_until_ready(self) -> None:
        end = time.monotonic() + 900  # a cold cache is filled meanwhile
        while True:
            with suppress(httpx.ConnectError):  # worker processes begin to listen later
                if httpx.get(f"{self.url}/readyz").status_code == 200:
                    return
            assert time.monotonic() < end, "".join(self.log)
            time.sleep(0.05)

    def wait_for_line(self, words: str) -> None:
        """Wait until the log says so: it arrives a little after what it tells of."""
        end = time.monotonic() + 60
        while not any(words in line for line in self.log):
            assert time.monotonic() < end, "".join(self.log)
            time.sleep(0.01)

    def stop(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(300)

    def close(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)  # worker processes too
        self.process.wait()
        assert self.process.stderr is not None
        self.process.stderr.close()

    def wait_until_in_flight(self, count: int, key: str = "") -> None:
        """Wait until so many requests are under way, the one that asks for it left out."""
        end, asked = time.monotonic() + 300, f"\ngeometry_requests_in_flight {count + 1}.0\n"
        while asked not in httpx.get(f"{self.url}/metrics", headers={"X-API-Key": key}, timeout=120).text:
            assert time.monotonic() < end, "".join(self.log)
            time.sleep(0.05)

    def send(self, *parts: bytes, half_close: bool = False) -> bytes:
        """Send raw bytes over a socket of their own and return what comes back until it is closed or an object ends."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=120) as connection:
            for part in parts:
                connection.sendall(part)
                time.sleep(0.02)
            if half_close:
                connection.shutdown(socket.SHUT_WR)
            answer = b""
            while chunk := connection.recv(2**16):
                answer += chunk
                if b"\r\n\r\n" in answer and answer.endswith(b"}"):
                    break
            return answer


@contextmanager
def running(**settings: object) -> Iterator[Service]:
    """Start a service; check that it ends with 0, and that no traceback is in its log."""
    service = Service(**settings)
    try:
        yield service
        assert service.stop() == 0, "".join(service.log)
        assert "Traceback" not in "".join(service.log)
    finally:
        service.close()


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    with running(max_body_bytes=10_000, header_seconds=PATIENCE, body_seconds=PATIENCE) as service:
        yield service


def test_it_becomes_ready_and_answers(service: Service) -> None:
    service.wait_until_ready()
    assert any('"starting on ' in line for line in service.log)
    assert all(json.loads(line)["level"] in ("info", "warning") for line in service.log)
    service.wait_for_line('"ready: kernels warm')
    answer = httpx.post(f"{service.url}/v1/solids", json=SPHERE)
    assert answer.status_code == 201
    head = httpx.head(service.url + answer.headers["location"])
    assert (head.status_code, head.content) == (200, b"")
    missing = httpx.head(f"{service.url}/v1/solids/{'0' * 64}")
    assert (missing.status_code, missing.content) == (404, b"")


def test_bodies_that_are_too_large_get_their_answer(service: Service) -> None:
    def chunks() -> Iterator[bytes]:
        for _ in range(30):
            yield b" " * 1000

    headers = {"Content-Type": "application/json"}
    for content in (b" " * 200_000, chunks()):
        answer = httpx.post(f"{service.url}/v1/solids", content=content, headers=headers)
        check_problem(answer, 413, "body_too_large")


def test_a_body_in_many_parts_arrives_whole(service: Service) -> None:
    """Some parts wait together, some come one by one."""
    body = json.dumps(SPHERE).encode()
    head = (
        b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    parts = [b"1\r\n" + bytes([byte]) + b"\r\n" for byte in body]
    answer = service.send(head + b"".join(parts[:20]), *parts[20:25], b"".join(parts[25:]), b"0\r\n\r\n")
    assert answer.split()[1] in (b"200", b"201"), answer


def test_a_client_that_asks_for_h2c_gets_its_answer(service: Service) -> None:
    """As Java's HttpClient does by default: the request itself is complete HTTP/1.1 and must be answered as such."""
    body = json.dumps(SPHERE).encode()
    request = (
        b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nConnection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\n"
        b"HTTP2-Settings: AAEAAEAAAAIAAAABAAMAAABkAAQBAAAAAAUAAEAA\r\nContent-Type: application/json\r\n"
        b"Content-Length: " + str(len(body)).encode() + b"\r\n\r\n"
    )
    for parts in ([request + body], [request, body], [request[:50], request[50:-2], request[-2:] + body[:5], body[5:]]):
        answer = service.send(*parts)
        assert answer.split(b"\r\n")[0] in (b"HTTP/1.1 200 OK", b"HTTP/1.1 201 Created"), answer
        assert b'"type":"sphere"' in answer
    refused = service.send(request.replace(b"Length: ", b"Length: 99999") + body)
    assert refused.startswith(b"HTTP/1.1 413 "), refused
    assert b"\nconnection: close" in refused


def test_an_offer_by_http_1_0_needs_no_host(service: Service) -> None:
    """Its headers were parsed again as HTTP/1.1, which asks for one."""
    answer = service.send(b"GET /healthz HTTP/1.0\r\nUpgrade: h2c\r\nConnection: Upgrade\r\n\r\n", half_close=True)
    assert answer.startswith(b"HTTP/1.1 200 "), answer


def test_broken_http_is_answered_or_closed(service: Service) -> None:
    for data in (
        b"\x00\x01\x02\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"CONNECT x:1 HTTP/1.1\r\n\r\n",
        b"POST /v1/solids HTTP/1.1\r\nContent-Length: x\r\n\r\n",
        b"GET /healthz HTTP/1.1\r\n\r\n",
        b"GET /healthz HTTP/1.1\r\nHost: x\r\nHost: x\r\n\r\n",
        b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
        b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
        b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
    ):
        answer = service.send(data, half_close=True)
        assert answer[:12] in (b"HTTP/1.1 400", b"HTTP/1.1 404", b""), answer
        if answer:
            assert b"\ncontent-type: application/problem+json" in answer
            assert b"\nx-request-id: " in answer
    assert service.send(b"GET /healthz HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 200 ")
    assert httpx.get(f"{service.url}/healthz").status_code == 200


def test_slow_headers_and_bodies_are_given_up(service: Service) -> None:
    request = b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{"
    for parts, code in (((), b"slow_headers"), ((request[:30],), b"slow_headers"), ((request,), b"slow_body")):
        before = time.monotonic()
        answer = service.send(*parts)
        assert answer.startswith(b"HTTP/1.1 408 "), answer
        assert b'"code":"' + code in answer
        assert b"\nconnection: close" in answer.lower()
        assert PATIENCE - 0.2 < time.monotonic() - before < Settings().header_seconds
    with httpx.Client() as client:  # an idle connection is no slow request
        for _ in range(2):
            assert client.get(f"{service.url}/healthz").status_code == 200
            time.sleep(PATIENCE + 0.5)


def test_headers_without_end_are_given_up(service: Service) -> None:
    for lines in ([b"a: b\r\n" * 2000] * 6, [b"a: ", *[b"x" * 20_000] * 5]):
        answer = service.send(b"GET /healthz HTTP/1.1\r\n", *lines)
        assert answer.startswith((b"HTTP/1.1 431 ", b"HTTP/1.1 400 ")), answer


def test_a_length_of_many_digits_is_a_number(service: Service) -> None:
    head = b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: "
    assert b" 422 " in service.send(head + b"0" * 4990 + b"2\r\n\r\n{}")[:20]
    assert service.send(head + b"9" * 4990 + b"\r\n\r\n{}")[9:12] in (b"400", b"413")


def test_a_client_that_does_not_read_is_dropped() -> None:
    """And the memory of its answer is released."""
    service = Service(write_seconds=PATIENCE)
    try:
        service.wait_until_ready()
        solid = httpx.post(f"{service.url}/v1/solids", json=SPHERE).headers["location"].encode()
        body = bytes(48 * 400_000)
        head = b"POST %s/clip/segments HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % (solid, len(body))
        with socket.socket() as connection:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**12)
            connection.settimeout(120)
            connection.connect(("127.0.0.1", service.port))
            connection.sendall(head + body)
            service.wait_until_in_flight(1)
            service.wait_until_in_flight(0)
            received = 0
            with suppress(ConnectionError):
                while part := connection.recv(2**20):
                    received += len(part)
            assert received < len(body)
        answer = httpx.post(service.url + solid.decode() + "/clip/segments", content=body, timeout=300)
        assert len(answer.content) == len(body)  # who reads gets it all
        assert service.stop() == 0, "".join(service.log)
    finally:
        service.close()


def test_a_vanished_client_harms_nobody(service: Service) -> None:
    with socket.create_connection(("127.0.0.1", service.port)) as connection:
        connection.sendall(
            b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{"
        )
    assert httpx.get(f"{service.url}/healthz").status_code == 200


def test_a_stop_lets_requests_end() -> None:
    """What has begun before SIGTERM is answered, and then the process ends with 0."""
    service = Service()
    try:
        service.wait_until_ready()
        body = json.dumps({"solid": SPHERE, "points": [[0.1, 0.2, 0.3]] * 20_000}).encode()
        head = b"POST /v1/contains HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
        connections = [socket.create_connection(("127.0.0.1", service.port), timeout=120) for _ in range(3)]
        for connection in connections:
            connection.sendall(head % len(body) + body[:-1])
        service.wait_until_in_flight(3)
        service.process.send_signal(signal.SIGTERM)
        time.sleep(0.3)
        for connection in connections:
            with connection:
                connection.sendall(body[-1:])
                assert connection.recv(2**16).startswith(b"HTTP/1.1 200 ")
        assert service.process.wait(300) == 0, "".join(service.log)
    finally:
        service.close()


def test_several_workers_share_solids_and_counters() -> None:
    service = Service(workers=2)
    try:
        service.wait_until_ready()
        path = httpx.post(f"{service.url}/v1/solids", json=SPHERE).headers["location"]
        for _ in range(20):  # connections of their own, so that either worker is asked
            assert httpx.get(service.url + path).status_code == 200
        counted = re.search(r'operation="get_solid",status="200"} (\S+)', httpx.get(f"{service.url}/metrics").text)
        assert counted is not None
        assert float(counted[1]) == 20
        assert service.stop() == 0, "".join(service.log)
    finally:
        service.close()


@pytest.mark.parametrize(("settings", "warns"), [({"api_keys": "abc"}, False), ({}, True)])
def test_a_start_for_others_without_keys_says_so(settings: dict[str, str], warns: bool) -> None:
    service = Service(host="0.0.0.0", max_point=7, **settings)
    try:
        assert any("no setting is called GEOMETRY_MAX_POINT;" in line for line in service.log)
        assert any("GEOMETRY_API_KEYS is not set" in line for line in service.log) is warns
        assert "abc" not in "".join(service.log)
        assert service.stop() == 0
    finally:
        service.close()


def test_a_wrong_setting_is_named() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "service"],
        cwd=ROOT,
        env={**os.environ, "GEOMETRY_MAX_POINTS": "many"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "GEOMETRY_MAX_POINTS" in done.stderr
    assert "Traceback" not in done.stderr
