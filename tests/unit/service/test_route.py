"""What HTTP asks for: media types, sizes, slow and vanished clients, deadlines, a full queue; each row of the table."""

from __future__ import annotations

import asyncio
import json
import re
import threading
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

import anyio
import httpx
import numpy as np
import pytest
from fastapi import FastAPI

import engine
from service.openapi import router_of
from service.schemas.base import Schema
from service.work import CallOf
from tests.unit.service.asking import SPHERE, check_problem, client_of, resolve

pytestmark = pytest.mark.anyio
JSON = {"Content-Type": "application/json"}


class Nap(Schema):
    """How long to sleep."""

    seconds: float


class Broken(Schema):
    """Nothing."""


def add_slow_routes(app: FastAPI) -> list[str]:
    """Add a route that works until it is cancelled, its time is over or `app.state.awake` set, and one that fails;
    return what happened."""
    router, log = router_of(tags=["test"]), []
    app.state.awake, app.state.begun = threading.Event(), threading.Event()

    def work(seconds: float, *, deadline: float, cancel: engine.Cancel, report: bool) -> tuple[None, None]:
        app.state.begun.set()
        end = time.monotonic() + min(seconds, deadline)
        while time.monotonic() < end and not app.state.awake.is_set():
            if cancel.is_set:
                log.append("cancelled")
                raise engine.CancelledError("cancelled")
            time.sleep(0.005)
        if seconds > deadline:
            raise engine.DeadlineExceededError("too late")
        log.append("done")
        return None, None

    @router.post("/nap")
    def nap(question: Nap, call: CallOf) -> Broken:
        call.compute(work, question.seconds)
        return Broken()

    @router.post("/broken")
    def broken(question: Broken, call: CallOf) -> Broken:
        raise ZeroDivisionError("a secret")

    app.include_router(router)
    return log


async def test_answer_has_its_timing(client: httpx.AsyncClient) -> None:
    answer = await client.post("/v1/solids", json=SPHERE)
    assert answer.status_code == 201
    names = [item.partition(";dur=")[0] for item in answer.headers["server-timing"].split(", ")]
    assert names == ["decode", "prepare", "compute", "encode"]
    assert all(float(item.partition(";dur=")[2]) >= 0 for item in answer.headers["server-timing"].split(", "))


@pytest.mark.parametrize("body", [b"", b"{", b'{"type": "sphere", "cen', b"\xff\xfe", b"[" * 10_000, b"nonsense"])
async def test_not_json(client: httpx.AsyncClient, body: bytes) -> None:
    check_problem(await client.post("/v1/solids", content=body, headers=JSON), 400, "not_json")


@pytest.mark.parametrize("kind", [None, "", "text/plain", "application/x-www-form-urlencoded", "json", "a/b/json"])
async def test_wrong_media_type(client: httpx.AsyncClient, kind: str | None) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    answer = await client.post("/v1/solids", content=b"{}", headers=headers)
    check_problem(answer, 415, "unsupported_media_type")
    assert answer.headers["accept-post"] == "application/json"


@pytest.mark.parametrize("kind", ["application/json; charset=utf-8", "APPLICATION/JSON", "application/geo+json"])
async def test_right_media_type(client: httpx.AsyncClient, kind: str) -> None:
    content = b'{"type":"sphere","center":[0,0],"radius":1}'
    answer = await client.post("/v1/solids", content=content, headers={"Content-Type": kind})
    assert answer.status_code == 201


async def test_too_large_whether_or_not_the_length_was_declared(client: httpx.AsyncClient) -> None:
    async def chunks() -> AsyncIterator[bytes]:
        for _ in range(20):
            yield b" " * 2**16

    for content in (b" " * (2**20 + 1), chunks()):
        answer = await client.post("/v1/solids", content=content, headers=JSON)
        problem = check_problem(answer, 413, "body_too_large")
        assert "GEOMETRY_MAX_BODY_BYTES" in problem["detail"]


async def test_largest_body_is_taken(client: httpx.AsyncClient) -> None:
    body = b'{"type":"sphere","center":[0,0],"radius":1}'
    answer = await client.post("/v1/solids", content=body + b" " * (2**20 - len(body)), headers=JSON)
    assert answer.status_code == 201


async def test_unknown_paths_and_methods(client: httpx.AsyncClient) -> None:
    check_problem(await client.get("/nothing"), 404, "not_found")
    check_problem(await client.post("/v1/solids/", json=SPHERE), 404, "not_found")
    answer = await client.get("/v1/solids")
    check_problem(answer, 405, "method_not_allowed")
    assert answer.headers["allow"] == "POST"
    check_problem(await client.delete(f"/v1/solids/{'0' * 64}"), 405, "method_not_allowed")


async def test_a_slow_body_is_given_up(app: FastAPI, anyio_backend: str) -> None:
    async def drip() -> AsyncIterator[bytes]:
        yield b"{"
        await anyio.sleep(30)
        yield b"}"

    app.state.settings = app.state.settings.model_copy(update={"body_seconds": 0.1})
    async with client_of(app) as client:
        check_problem(await client.post("/v1/solids", content=drip(), headers=JSON), 408, "slow_body")


async def test_deadline_passes_in_the_engine_and_in_the_queue(app: FastAPI, anyio_backend: str) -> None:
    add_slow_routes(app)
    changes = {"deadline_seconds": 0.2, "concurrency": 1}
    app.state.settings = app.state.settings.model_copy(update=changes)
    async with client_of(app) as client, anyio.create_task_group() as group:
        for _ in range(2):
            group.start_soon(ask_and_check, client, 30.0, 504, "deadline_exceeded")


async def ask_and_check(client: httpx.AsyncClient, seconds: float, status: int, code: str) -> None:
    check_problem(await client.post("/nap", json={"seconds": seconds}), status, code)


async def test_a_full_queue_answers_at_once(app: FastAPI, anyio_backend: str) -> None:
    add_slow_routes(app)
    app.state.settings = app.state.settings.model_copy(update={"concurrency": 1, "queue_length": 1})
    async with client_of(app) as client, anyio.create_task_group() as group:
        for _ in range(2):
            group.start_soon(nap, client, 100.0)
        await until(lambda: len(under_way(app, True)) == 2)
        answer = await client.post("/nap", json={"seconds": 0.0})
        check_problem(answer, 503, "queue_full")
        assert answer.headers["retry-after"] == "1"
        app.state.awake.set()
    async with client_of(app) as client:
        assert (await client.post("/nap", json={"seconds": 0.0})).status_code == 200


async def until(condition: Callable[[], bool]) -> None:
    with anyio.fail_after(100):
        while not condition():
            await anyio.sleep(0.005)


def under_way(app: FastAPI, is_small: bool) -> set[Any]:
    """Return the calls that are computed, or wait for their turn."""
    return app.state.pool._lanes[is_small].under_way


async def nap(client: httpx.AsyncClient, seconds: float) -> None:
    assert (await client.post("/nap", json={"seconds": seconds})).status_code == 200


async def test_a_vanished_client_cancels_its_call(app: FastAPI, anyio_backend: str) -> None:
    log = add_slow_routes(app)
    messages: list[dict[str, Any]] = [{"type": "http.request", "body": b'{"seconds":100}', "more_body": False}]
    sent = []

    async def receive() -> dict[str, Any]:
        if messages:
            return messages.pop()
        await asyncio.sleep(0.05)
        return {"type": "http.disconnect"}

    async def send(message: Any) -> None:
        sent.append(message)

    scope = {
        "type": "http",
        "method": "POST",
        "path": "/nap",
        "raw_path": b"/nap",
        "query_string": b"",
        "headers": [(b"content-type", b"application/json")],
        "app": app,
    }
    async with client_of(app):
        await app(scope, receive, send)
    assert log == ["cancelled"]


async def test_shutdown_cancels_what_runs(app: FastAPI, anyio_backend: str) -> None:
    log = add_slow_routes(app)
    async with client_of(app) as client, anyio.create_task_group() as group:
        group.start_soon(ask_and_check, client, 100.0, 503, "cancelled")
        await until(app.state.begun.is_set)
        app.state.pool.close()
    assert log == ["cancelled"]


async def test_what_nobody_expected_is_a_problem_too(
    app: FastAPI, anyio_backend: str, caplog: pytest.LogCaptureFixture
) -> None:
    add_slow_routes(app)
    async with client_of(app) as client:
        answer = await client.post("/broken", json={})
    check_problem(answer, 500, "internal")
    assert "secret" not in answer.text
    assert any(record.exc_info for record in caplog.records)
    caplog.clear()


async def test_requests_before_the_kernels_are_warm_are_answered(app: FastAPI, anyio_backend: str) -> None:
    async with client_of(app) as client:
        app.state.warm.clear()
        app.state.warm_hundredths = 50
        answer = await client.get("/readyz")
        check_problem(answer, 503, "not_ready")
        assert re.search(r"50 % after \d+ s, some \d+ s are left", answer.text)
        assert (await client.get("/healthz")).json() == {"status": "ok"}
        assert (await client.post("/v1/solids", json=SPHERE)).status_code == 201
        app.state.warm.set()
        assert (await client.get("/readyz")).json() == {"status": "ok"}


async def test_cors_is_off_unless_set(client: httpx.AsyncClient) -> None:
    answer = await client.get("/healthz", headers={"Origin": "https://example.org"})
    assert "access-control-allow-origin" not in answer.headers


async def test_pointers_lead_into_the_request(client: httpx.AsyncClient) -> None:
    body = {
        "type": "csg",
        "operation": "union",
        "operands": [
            SPHERE,
            {"type": "csg", "operation": "difference", "operands": [SPHERE, {**SPHERE, "radius": "1"}]},
        ],
    }
    (error,) = check_problem(await client.post("/v1/solids", json=body), 422, "invalid_array")["errors"]
    assert error["pointer"] == "/operands/1/operands/1/radius"
    assert resolve(body, error["pointer"]) == "1"


@pytest.fixture
def large(monkeypatch: pytest.MonkeyPatch) -> int:
    """Bytes from which bodies lie in memory of their own, fewer than usual."""
    monkeypatch.setattr("service.body.LARGE", 2**18)
    return 2**18


async def test_large_bodies_are_answered_and_refused_as_small_ones(client: httpx.AsyncClient, large: int) -> None:
    body = b'{"solid": %s, "points": [[0, 0, 0], [2, 0, 0]]%s}' % (json.dumps(SPHERE).encode(), b" " * large)
    answer = await client.post("/v1/contains", content=body, headers=JSON)
    assert answer.json()["contained"] == [True, False]
    wrong = body.replace(b"[2, 0, 0]", b"[2, 0, true]")
    problem = check_problem(await client.post("/v1/contains", content=wrong, headers=JSON), 422, "invalid_array")
    assert problem["errors"][0]["pointer"] == "/points/1/2"
    points = np.full((large // 24 + 1, 3), 0.5)
    points[7] = 1
    stored = (await client.post("/v1/solids", json=SPHERE)).headers["location"]
    octets = {"Content-Type": "application/octet-stream"}
    answer = await client.post(f"{stored}/contains", content=points.tobytes(), headers=octets)
    assert np.flatnonzero(np.frombuffer(answer.content, np.int8) < 0).tolist() == [7]


@pytest.mark.parametrize("declared", [2**18, 2**19])
async def test_a_length_that_is_not_the_bodys_is_not_believed(
    client: httpx.AsyncClient, large: int, declared: int
) -> None:
    """The server holds requests to their length; here nothing does."""
    body = b'{"solid": %s, "points": [[0, 0, 0]]%s}' % (json.dumps(SPHERE).encode(), b" " * 3 * 2**17)
    answer = await client.post("/v1/contains", content=body, headers={**JSON, "Content-Length": str(declared)})
    assert answer.json()["contained"] == [True]


async def test_small_questions_do_not_wait_behind_large_ones(app: FastAPI, anyio_backend: str) -> None:
    add_slow_routes(app)
    app.state.settings = app.state.settings.model_copy(update={"concurrency": 1, "queue_length": 1})
    large = b'{"seconds": 100' + b" " * app.state.settings.inline_bytes + b"}"
    async with client_of(app) as client, anyio.create_task_group() as group:
        for _ in range(2):
            group.start_soon(lambda: client.post("/nap", content=large, headers=JSON))
        await until(lambda: len(under_way(app, False)) == 2)
        check_problem(await client.post("/nap", content=large, headers=JSON), 503, "queue_full")
        light = await client.post("/v1/contains", json={"solid": SPHERE, "points": [[0, 0, 0]]})
        assert light.json()["contained"] == [True]
        await nap(client, 0.0)  # small, and computed in a thread
        assert len(under_way(app, False)) == 2
        app.state.awake.set()
