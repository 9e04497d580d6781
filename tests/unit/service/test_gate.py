"""Keys, names of requests, headers of safety, log lines, CORS."""

from __future__ import annotations

import json
import logging
import sys
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

import engine
from service.__main__ import JsonFormatter
from service.app import create_app
from service.gate import Gate
from service.settings import Settings
from tests.unit.service.asking import SPHERE, check_problem, client_of

pytestmark = pytest.mark.anyio


def guarded(monkeypatch: pytest.MonkeyPatch, **settings: Any) -> FastAPI:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    return create_app(Settings(deadline_seconds=300, **settings))


async def test_without_keys_anyone_may_call(client: httpx.AsyncClient) -> None:
    assert (await client.post("/v1/solids", json=SPHERE)).status_code == 201


async def test_a_key_is_asked_for(monkeypatch: pytest.MonkeyPatch, anyio_backend: str) -> None:
    monkeypatch.setenv("GEOMETRY_API_KEYS", "first, second")
    async with client_of(guarded(monkeypatch)) as client:
        for path in ("/healthz", "/readyz", "/", "/docs", "/redoc", "/openapi.json", "/playground/main.js"):
            assert (await client.get(path)).status_code == 200
        for path in ("/metrics", "/nothing", "/docs/x", "/v1/solids/1"):
            check_problem(await client.get(path), 401, "missing_key")
        answer = await client.post("/v1/solids", json=SPHERE)
        check_problem(answer, 401, "missing_key")
        assert answer.headers["www-authenticate"] == "Bearer"
        assert "x-request-id" in answer.headers
        for headers in ({"Authorization": "Bearer wrong"}, {"X-API-Key": "firstsecond"}, {"X-API-Key": "first,second"}):
            check_problem(await client.post("/v1/solids", json=SPHERE, headers=headers), 403, "wrong_key")
        check_problem(await client.get("/metrics", headers={"Authorization": "Basic first"}), 401, "missing_key")
        for headers in ({"Authorization": "Bearer first"}, {"Authorization": "bearer second"}, {"X-API-Key": "second"}):
            assert (await client.post("/v1/solids", json=SPHERE, headers=headers)).status_code in (200, 201)
    assert "first" not in repr(Settings())


async def test_a_request_has_a_name(client: httpx.AsyncClient) -> None:
    given = await client.get("/healthz", headers={"X-Request-ID": "a-1.B_2"})
    assert given.headers["x-request-id"] == "a-1.B_2"
    names = {
        (await client.get("/healthz", headers={"X-Request-ID": odd})).headers["x-request-id"]
        for odd in ("", "a b", "x" * 65)
    }
    assert len(names) == 3
    assert all(len(name) == 16 for name in names)


async def test_every_answer_has_headers_of_safety(client: httpx.AsyncClient) -> None:
    for path in ("/healthz", "/docs", "/nothing", "/openapi.json", "/v1/contains"):
        headers = (await client.get(path)).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert len(headers.get_list("content-security-policy")) == 1
        assert "frame-ancestors 'none'" in headers["content-security-policy"]


async def test_a_log_line_for_each_request(client: httpx.AsyncClient, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "service.access"):
        answer = await client.get("/nothing?secret=1")
    (record,) = caplog.records
    line = json.loads(JsonFormatter().format(record))
    assert (line["path"], line["status"], line["method"], line["level"]) == ("/nothing", 404, "GET", "info")
    assert line["request_id"] == answer.headers["x-request-id"]
    assert line["milliseconds"] > 0
    assert "secret" not in json.dumps(line)
    try:
        raise ValueError("told")
    except ValueError:
        odd = logging.LogRecord("a", logging.ERROR, "", 0, "x%s", ("\ny",), sys.exc_info())
    line = json.loads(JsonFormatter().format(odd))
    assert (line["message"], "ValueError: told" in line["exception"]) == ("x\ny", True)


async def test_origins_that_are_set_may_call(monkeypatch: pytest.MonkeyPatch, anyio_backend: str) -> None:
    app = guarded(monkeypatch, cors_origins="https://a.example", api_keys="key")
    async with client_of(app) as client:
        asked = {
            "Origin": "https://a.example",
            "Access-Control-Request-Method": "POST",
            "Access-Control-Request-Headers": "x-api-key, content-type",
        }
        answer = await client.options("/v1/contains", headers=asked)
        assert (answer.status_code, answer.headers["access-control-allow-origin"]) == (200, "https://a.example")
        answer = await client.get("/healthz", headers={"Origin": "https://a.example"})
        assert "X-Request-ID" in answer.headers["access-control-expose-headers"]
        other = await client.get("/healthz", headers={"Origin": "https://b.example"})
        assert "access-control-allow-origin" not in other.headers


async def test_the_gate_knows_every_question(app: FastAPI, client: httpx.AsyncClient) -> None:
    """Whatever is asked by POST, and has no parameter in its path, is answered without the framework's search."""
    (gate,) = [item for item in app.user_middleware if item.cls is Gate]
    document = (await client.get("/openapi.json")).json()
    paths = {path for path, item in document["paths"].items() if "post" in item and "{" not in path}
    assert set(gate.kwargs["posts"]) == paths  # type: ignore[arg-type]
    assert (await client.put("/v1/contains", json={})).status_code == 405


async def test_behind_a_proxy_with_a_path_of_its_own(monkeypatch: pytest.MonkeyPatch, anyio_backend: str) -> None:
    """Whether the proxy takes its path off or not."""
    async with client_of(guarded(monkeypatch, root_path="/geometry")) as client:
        for prefix in ("", "/geometry"):
            stored = await client.post(f"{prefix}/v1/solids", json=SPHERE)
            place = stored.headers["location"]
            assert place.startswith("/geometry/v1/solids/")
            assert (await client.get(place)).status_code == 200
            assert (await client.get(place.removeprefix("/geometry"))).status_code == 200
            for page in ("/", "/docs", "/playground/main.js", "/healthz"):
                assert (await client.get(prefix + page)).status_code == 200, page
