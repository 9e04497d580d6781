"""Far more requests than can be answered: no crash, 200 or 503 with Retry-After, in time, and memory stays."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator

import numpy as np
import pytest

from benchmarks import load, measure
from tests.unit.service.asking import SPHERE
from tests.unit.service.test_live import Service, running

DEADLINE = 5.0


@pytest.fixture
def service() -> Iterator[Service]:
    # room for four: on a slow machine sixty clients do not get more than some twenty requests under way at once
    with running(deadline_seconds=DEADLINE, concurrency=2, queue_length=2, access_log=False) as service:
        service.wait_until_ready()
        yield service


def overload(service: Service, seconds: float) -> None:
    points = np.random.default_rng(0).random((10_000, 3)).tolist()
    message = load.request("/v1/contains", json.dumps({"solid": SPHERE, "points": points}).encode())
    assert set(load.many(service.port, message, 1.0, 2).statuses) == {200}  # two at a time are no trouble
    clients = [load.in_process(load.many, service.port, message, seconds / 5, 30) for _ in range(2)]
    for client in clients:
        client()
    before = measure.memory_of(service.process.pid)
    clients = [load.in_process(load.many, service.port, message, seconds, 30) for _ in range(2)]
    seen = [client() for client in clients]
    statuses = sum((one.statuses for one in seen), Counter[int]())
    accepted = [second for one in seen for second in one.seconds]
    assert set(statuses) == {200, 503}, statuses
    assert not any(one.lost for one in seen)
    assert measure.percentile(accepted, 0.99) < DEADLINE
    after = measure.memory_of(service.process.pid)
    assert not after > 1.25 * before + 50, (before, after)


@pytest.mark.full
def test_five_seconds_of_overload(service: Service) -> None:
    overload(service, 5.0)


@pytest.mark.full
def test_a_minute_of_overload(service: Service) -> None:
    overload(service, 60.0)
