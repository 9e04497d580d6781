"""The load generator: plain blocking sockets in Python, one process for each client, requests built beforehand.

It runs on the same machine and shares the cores with what it measures. A request costs it about 20 us.
"""

from __future__ import annotations

import multiprocessing
import re
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from benchmarks.measure import memory_of

NAME = "blocking sockets, Python"
_LENGTH = re.compile(rb"\r\ncontent-length: (\d+)", re.IGNORECASE)


def head(path: str, **headers: object) -> bytes:
    """Return the first line and the headers of a POST request of JSON; named with _ for -, another value or more."""
    named = {"host": "x", "content_type": "application/json", **headers}
    lines = [f"{name.replace('_', '-')}: {value}\r\n" for name, value in named.items()]
    return f"POST {path} HTTP/1.1\r\n{''.join(lines)}\r\n".encode()


def request(path: str, body: bytes, media_type: str = "application/json", **headers: object) -> bytes:
    """Return a POST request as bytes; headers: as `head` takes them."""
    return head(path, content_type=media_type, content_length=len(body), **headers) + body


def free_port() -> int:
    """Return a port that nobody listens on now."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


class Connection:
    """One connection, kept alive as long as the server allows."""

    def __init__(self, port: int, timeout: float = 120.0) -> None:
        self._address, self._timeout = ("127.0.0.1", port), timeout
        self._socket: socket.socket | None = None

    def ask(self, message: bytes) -> tuple[int, bytes]:
        """Send a request; return status and body of the answer."""
        if self._socket is None:
            self._socket = socket.create_connection(self._address, self._timeout)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.sendall(message)
        got = bytearray(self._socket.recv(2**18))
        while (end := got.find(b"\r\n\r\n")) < 0:
            got += self._more()
        head = bytes(got[:end])
        length = int(_LENGTH.search(head)[1])  # type: ignore[index]
        while len(got) < end + 4 + length:
            got += self._more()
        if b"\r\nconnection: close" in head.lower():
            self.close()
        return int(head[9:12]), bytes(got[end + 4 :])

    def _more(self) -> bytes:
        assert self._socket is not None
        chunk = self._socket.recv(2**20)
        if not chunk:
            raise ConnectionResetError("closed within an answer")
        return chunk

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def wait_until(port: int, path: str) -> None:
    """Wait until `path` answers 200; five minutes at most, the time of a first compilation."""
    message = f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode()
    for _ in range(60_000):
        with suppress(OSError):
            connection = Connection(port)
            status, _ = connection.ask(message)
            connection.close()
            if status == 200:
                return
        time.sleep(0.005)
    raise TimeoutError(f"no {path} on port {port}")


@dataclass
class Seen:
    """Results of one client."""

    statuses: Counter[int] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    """Of answers with status 200."""
    lost: int = 0
    """Connections that broke within a request."""
    span: float = 0.0


@dataclass
class Watched:
    """Of a service: the longest wait for /healthz in seconds, and its resident megabytes at most."""

    wait: float = 0.0
    memory: float = 0.0


@contextmanager
def watched(port: int, pid: int, patience: float) -> Iterator[Watched]:
    """Poll /healthz meanwhile; raise at the end if it gave no 200 within `patience` seconds."""
    seen, is_over, message = Watched(), threading.Event(), b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"

    def watch() -> None:
        connection = Connection(port, patience)
        while not is_over.is_set():
            before = time.monotonic()
            status, _ = connection.ask(message)
            assert status == 200, status
            seen.wait = max(seen.wait, time.monotonic() - before)
            seen.memory = max(seen.memory, memory_of(pid))
            is_over.wait(0.01)
        connection.close()

    with ThreadPoolExecutor(1) as pool:
        watcher = pool.submit(watch)
        try:
            yield seen
        finally:
            is_over.set()
        watcher.result()


def loop(port: int, message: bytes, seconds: float, pause: float = 0.0) -> Seen:
    """Send requests one after another, with a pause after each answer."""
    seen, connection = Seen(), Connection(port)
    start = time.perf_counter()
    while time.perf_counter() - start < seconds:
        before = time.perf_counter()
        try:
            status, _ = connection.ask(message)
        except OSError:
            connection.close()
            seen.lost += 1
            continue
        seen.statuses[status] += 1
        if status == 200:
            seen.seconds.append(time.perf_counter() - before)
        if pause:
            time.sleep(pause)
    seen.span = time.perf_counter() - start
    connection.close()
    return seen


def many(port: int, message: bytes, seconds: float, n_connections: int, pause: float = 0.0) -> Seen:
    """Run `loop` on several connections, a thread each; return what all saw."""
    with ThreadPoolExecutor(n_connections) as pool:
        outcome = list(pool.map(lambda _: loop(port, message, seconds, pause), range(n_connections)))
    total = Seen()
    for seen in outcome:
        total.statuses += seen.statuses
        total.seconds += seen.seconds
        total.lost += seen.lost
        total.span = max(total.span, seen.span)
    return total


def in_process(function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """Start `function` in a process of its own; return a function that waits for its result."""
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
    result = pool.submit(function, *arguments).result
    pool.shutdown(wait=False)
    return result
