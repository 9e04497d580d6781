"""SIGTERM ends the process, and its worker processes, in time whatever runs; workers may start slowly."""

from __future__ import annotations

import json
import os
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import httpx
import pytest

from tests.unit.service.asking import SPHERE
from tests.unit.service.test_live import Service

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are read from /proc")
DRAIN = 1.0
STUCK = "import time, engine\nengine.bounds = lambda *_, **__: time.sleep(60)\n"
"""A call that looks at no deadline."""
BOUNDS = json.dumps({"solid": SPHERE}).encode() + b" " * 5_000


@contextmanager
def started(folder: Path, **settings: object) -> Iterator[Service]:
    """Start a service in which POST /v1/bounds never ends."""
    (folder / "sitecustomize.py").write_text(STUCK, "utf-8")
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    service = Service(around={**os.environ, "PYTHONPATH": path}, drain_seconds=DRAIN, **settings)
    try:
        yield service
    finally:
        service.close()


def children_of(service: Service) -> list[int]:
    """Return the worker processes that run Python code of their own."""
    pid, found = service.process.pid, []
    for child in map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()):
        with suppress(OSError):
            if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                found.append(child)
    return found


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def check_end(service: Service) -> None:
    children, begin = children_of(service), time.monotonic()
    assert service.stop() == 0, "".join(service.log)
    assert time.monotonic() - begin < DRAIN + 4  # 2 where nothing else runs
    while any(map(is_running, children)):  # killed a moment ago
        assert time.monotonic() - begin < DRAIN + 6
        time.sleep(0.01)
    assert not any("Traceback" in line for line in service.log), "".join(service.log)


def ask(service: Service, path: str, body: bytes, length: int | None = None) -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", service.port), timeout=60)
    head = f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: "
    connection.sendall(head.encode() + b"%d\r\n\r\n" % (length or len(body)) + body)
    return connection


@pytest.mark.some(1)
@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("deadline", [0.5, 100])
def test_threads_that_cannot_be_stopped_are_left_behind(tmp_path: Path, workers: int, deadline: float) -> None:
    with started(tmp_path, workers=workers, deadline_seconds=deadline) as service, ExitStack() as stack:
        service.wait_until_ready()
        asked = [stack.enter_context(ask(service, "/v1/bounds", BOUNDS)) for _ in range(8)]
        unread = json.dumps({"solid": SPHERE, "points": [[0.1, 0.2, 0.3]] * 200_000}).encode()
        stack.enter_context(ask(service, "/v1/contains", unread[:-1]))
        partial = stack.enter_context(ask(service, "/v1/solids", b"{", 100))
        time.sleep(1)
        check_end(service)
        for connection in asked:
            assert connection.recv(2**16)[9:12] == (b"504" if deadline < 1 else b"503")
        assert partial.recv(2**16)[9:12] == b"503"


@pytest.mark.full
def test_workers_may_start_slowly_and_end_while_one_says_nothing(tmp_path: Path) -> None:
    """Stopped for seven seconds while they start, as on a busy machine; and stopped for ever when the end comes."""
    with started(tmp_path, workers=2) as service:
        end = time.monotonic() + 60
        while len(first := children_of(service)) < 2:
            assert time.monotonic() < end
            time.sleep(0.01)
        for sig in (signal.SIGSTOP, signal.SIGCONT):
            for child in first:
                os.kill(child, sig)
            time.sleep(7 if sig == signal.SIGSTOP else 0)
        service.wait_until_ready()
        time.sleep(1)
        assert children_of(service) == first
        os.kill(first[0], signal.SIGKILL)
        service.wait_for_line("takes its place")
        (line,) = [json.loads(line) for line in service.log if "takes its place" in line]
        assert line["level"] == "warning"
        assert str(first[0]) in line["message"]
        assert httpx.get(f"{service.url}/healthz").status_code == 200
        os.kill(first[1], signal.SIGSTOP)
        check_end(service)
