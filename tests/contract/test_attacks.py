"""Nothing sent brings the service down: each attack alone, then all of them at once beside small questions."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from benchmarks.load import watched
from tests.contract.attacks import MB, SECONDS, Attack, all_attacks
from tests.unit.service.test_live import Service, running

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
    with running(**settings) as service:
        service.wait_until_ready()
        resource.prlimit(service.process.pid, resource.RLIMIT_AS, (ADDRESS_SPACE, before[1]))
        yield service


@pytest.mark.some(8)
@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)
def test_an_attack_is_refused_in_time_and_within_memory(service: Service, attack: Attack) -> None:
    attack.send(service.port)  # the body is made, and what the question needs is loaded
    with watched(service.port, service.process.pid, SECONDS) as seen:
        before = time.monotonic()
        statuses = attack.send(service.port)
        took = time.monotonic() - before
    assert set(statuses) <= attack.allowed, statuses
    assert took < SECONDS / 2
    assert seen.memory < GIVEN + MORE
    assert seen.wait < 1.0  # 0.1 on a quiet machine: `benchmarks soak` says it


@pytest.mark.full
def test_all_attacks_at_once_leave_it_standing(service: Service) -> None:
    with watched(service.port, service.process.pid, SECONDS) as seen, ThreadPoolExecutor(8) as clients:
        answers = list(clients.map(lambda attack: attack.send(service.port), ATTACKS * 2))
    for attack, statuses in zip(ATTACKS * 2, answers):
        assert set(statuses) <= attack.allowed | {503}, (attack.name, statuses)
    assert seen.memory < GIVEN + MORE
