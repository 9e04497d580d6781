"""Nothing sent brings the service down: each attack alone, then all of them at once beside small questions."""

from __future__ import annotations

import resource
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import pytest

from benchmarks.measure import memory_of
from tests.contract.attacks import MB, SECONDS, Attack, all_attacks
from tests.unit.service.test_live import Service

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="memory of processes is read from /proc")
GIVEN = 256
"""Megabytes that requests may hold together."""
MORE = 250
"""Megabytes that the process may take beyond that: itself at rest (some 195), and what the allocator keeps."""
DEADLINE = 2.0
ADDRESS_SPACE = 4 * 2**30
ATTACKS = all_attacks()


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    settings = {"deadline_seconds": DEADLINE, "request_bytes": GIVEN * MB, "store_bytes": 16 * MB, "access_log": False}
    before = resource.getrlimit(resource.RLIMIT_AS)
    service = Service(**settings)
    try:
        service.wait_until_ready()
        resource.prlimit(service.process.pid, resource.RLIMIT_AS, (ADDRESS_SPACE, before[1]))
        yield service
        assert service.stop() == 0, "".join(service.log)
        assert "Traceback" not in "".join(service.log)
    finally:
        service.close()


@dataclass
class Seen:
    """What a watcher saw of the service: resident megabytes at most, and the seconds that /healthz took."""

    most: float = 0.0
    waits: list[float] = field(default_factory=lambda: [0.0])


@contextmanager
def watched(service: Service) -> Iterator[Seen]:
    """Ask /healthz again and again meanwhile."""
    seen, is_over = Seen(), threading.Event()

    def watch() -> None:
        with httpx.Client() as client:
            while not is_over.is_set():
                before = time.monotonic()
                assert client.get(f"{service.url}/healthz", timeout=SECONDS).status_code == 200
                seen.waits.append(time.monotonic() - before)
                seen.most = max(seen.most, memory_of(service.process.pid))
                is_over.wait(0.01)

    with ThreadPoolExecutor(1) as pool:
        watcher = pool.submit(watch)
        try:
            yield seen
        finally:
            is_over.set()
        watcher.result()


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)
def test_an_attack_is_refused_in_time_and_within_memory(service: Service, attack: Attack) -> None:
    attack.send(service.port)  # the body is made, and what the question needs is loaded
    with watched(service) as seen:
        before = time.monotonic()
        statuses = attack.send(service.port)
        took = time.monotonic() - before
    assert set(statuses) <= attack.allowed, statuses
    assert took < SECONDS / 2
    assert seen.most < GIVEN + MORE
    assert max(seen.waits) < 1.0  # 0.1 on a quiet machine: `benchmarks soak` says it


def test_all_attacks_at_once_leave_it_standing(service: Service) -> None:
    with watched(service) as seen, ThreadPoolExecutor(8) as clients:
        answers = list(clients.map(lambda attack: attack.send(service.port), ATTACKS * 2))
    for attack, statuses in zip(ATTACKS * 2, answers):
        assert set(statuses) <= attack.allowed | {503}, (attack.name, statuses)
    assert seen.most < GIVEN + MORE
