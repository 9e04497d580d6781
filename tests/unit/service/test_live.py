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
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from tests.unit.service.asking import SPHERE, check_problem

ROOT = Path(__file__).resolve().parents[3]


class Service:
    """A running service and what it wrote to its log."""

    def __init__(self, **settings: object) -> None:
        environment = {**os.environ, **{f"GEOMETRY_{name.upper()}": str(value) for name, value in settings.items()}}
        command = [sys.executable, "-m", "service"]
        self.process = subprocess.Popen(
            command, cwd=ROOT, env={**environment, "GEOMETRY_PORT": "0"}, stderr=subprocess.PIPE, text=True
        )
        self.log: list[str] = []
        self.port = 0
        self._found = threading.Event()
        threading.Thread(target=self._read, daemon=True).start()
        assert self._found.wait(60), "".join(self.log)
        self.url = f"http://127.0.0.1:{self.port}"

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.log.append(line)
            if found := re.search(r"running on http://127\.0\.0\.1:(\d+)", line):
                self.port = int(found[1])
                self._found.set()

    def wait_until_ready(self) -> None:
        end = time.monotonic() + 300
        while httpx.get(f"{self.url}/readyz").status_code != 200:
            assert time.monotonic() < end, "".join(self.log)
            time.sleep(0.05)

    def stop(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(60)

    def send(self, *parts: bytes, half_close: bool = False) -> bytes:
        """Send raw bytes over a socket of their own and return what comes back until it is closed or an object ends."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=20) as connection:
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


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    service = Service(max_body_bytes=10_000)
    try:
        yield service
        assert service.stop() == 0, "".join(service.log)
        assert "Traceback" not in "".join(service.log)
    finally:
        service.process.kill()
        service.process.wait()
        assert service.process.stderr is not None
        service.process.stderr.close()


def test_it_becomes_ready_and_answers(service: Service) -> None:
    service.wait_until_ready()
    assert any("service: starting on" in line for line in service.log)
    assert any("service: ready: kernels warm" in line for line in service.log)
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


def test_broken_http_is_answered_or_closed(service: Service) -> None:
    for data in (
        b"\x00\x01\x02\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"CONNECT x:1 HTTP/1.1\r\n\r\n",
        b"POST /v1/solids HTTP/1.1\r\nContent-Length: x\r\n\r\n",
    ):
        assert service.send(data, half_close=True)[:12] in (b"HTTP/1.1 400", b"HTTP/1.1 404", b"")
    assert httpx.get(f"{service.url}/healthz").status_code == 200


def test_a_vanished_client_harms_nobody(service: Service) -> None:
    with socket.create_connection(("127.0.0.1", service.port)) as connection:
        connection.sendall(
            b"POST /v1/solids HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{"
        )
    assert httpx.get(f"{service.url}/healthz").status_code == 200


def test_a_wrong_setting_is_named() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "service"],
        cwd=ROOT,
        env={**os.environ, "GEOMETRY_MAX_POINTS": "many"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 1
    assert "GEOMETRY_MAX_POINTS" in done.stderr
    assert "Traceback" not in done.stderr
