"""Deadlines hold while a request waits for a thread and while a thread does not look at the time."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator

import httpx
import pytest
from fastapi import FastAPI

import engine
from service.app import create_app
from service.openapi import router_of
from service.schemas.base import Schema
from service.settings import Settings
from service.work import CallOf
from tests.unit.service.asking import SPHERE, check_problem, client_of

pytestmark = pytest.mark.anyio
DEADLINE = 0.5
LARGE = b"{}" + b" " * 100_000
JSON = {"Content-Type": "application/json"}


class Stuck(Schema):
    """Nothing."""


@pytest.fixture
async def late(monkeypatch: pytest.MonkeyPatch, anyio_backend: str) -> AsyncIterator[tuple[FastAPI, httpx.AsyncClient]]:
    """An app of two threads with a route that never looks at its deadline, until `app.state.awake` is set."""
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    app = create_app(Settings(concurrency=2, queue_length=4, deadline_seconds=DEADLINE))
    router, app.state.awake, app.state.begun = router_of(tags=["test"]), threading.Event(), []

    @router.post("/stuck")
    def stuck(question: Stuck, call: CallOf) -> Stuck:
        app.state.begun.append(call)
        app.state.awake.wait(60)
        return question

    app.include_router(router)
    async with client_of(app) as client:
        yield app, client
        app.state.awake.set()


async def ask_stuck(client: httpx.AsyncClient) -> float:
    begin = time.monotonic()
    answer = await client.post("/stuck", content=LARGE, headers=JSON, timeout=60)
    check_problem(answer, 504, "deadline_exceeded")
    return time.monotonic() - begin


async def test_who_waits_for_a_thread_gets_an_answer_in_time(late: tuple[FastAPI, httpx.AsyncClient]) -> None:
    app, client = late
    seconds = await asyncio.gather(*(ask_stuck(client) for _ in range(6)))
    assert max(seconds) < DEADLINE + 0.5
    lane = app.state.pool._lanes[False]
    assert len(app.state.begun) == len(lane.under_way) == 2  # those that wait have left their place
    assert 2 * 4 * len(LARGE) <= app.state.memory.taken < 3 * 4 * len(LARGE)  # what runs is counted
    await asyncio.sleep(DEADLINE)
    problem = check_problem(await client.get("/readyz"), 503, "not_ready")
    assert "deadline has passed" in problem["detail"]
    small = {"solid": SPHERE, "points": [[0, 0, 0]]}
    assert (await client.post("/v1/contains", json=small)).status_code == 200
    app.state.awake.set()
    end = time.monotonic() + 30
    while lane.under_way or app.state.memory.taken > app.state.memory.leaving:
        assert time.monotonic() < end
        await asyncio.sleep(0.01)
    assert len(app.state.begun) == 2  # nobody waits for what would have come later
    assert (await client.get("/readyz")).status_code == 200
    answer = await client.post("/v1/contains", json={"solid": SPHERE, "points": [[0, 0, 0]] * 1000})
    assert answer.status_code == 200


async def test_the_deadline_begins_with_the_last_byte(late: tuple[FastAPI, httpx.AsyncClient]) -> None:
    app, client = late
    app.state.awake.set()

    async def slowly() -> AsyncIterator[bytes]:
        yield b"{"
        await asyncio.sleep(1.5 * DEADLINE)
        yield b"}"

    assert (await client.post("/stuck", content=slowly(), headers=JSON)).status_code == 200
