"""The calls of the service within somebody else's FastAPI application."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

import engine
import service
from service.settings import Settings
from tests.unit.service.asking import SPHERE, check_problem, resolve

pytestmark = pytest.mark.anyio


def references(node: Any) -> set[str]:
    if isinstance(node, list):
        return set().union(*map(references, node))
    if isinstance(node, dict):
        own = {node["$ref"]} if isinstance(node.get("$ref"), str) else set()
        return own.union(*map(references, node.values()))
    return set()


async def test_a_router_for_an_application(monkeypatch: pytest.MonkeyPatch, anyio_backend: str) -> None:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    app = FastAPI(title="theirs")
    app.state.settings = "theirs"

    @app.get("/hello")
    async def hello() -> dict[str, str]:
        return {"hello": app.state.settings}

    app.include_router(service.router(Settings(max_points=3, deadline_seconds=300)), prefix="/geometry")
    async with app.router.lifespan_context(app):
        transport = httpx.ASGITransport(app=app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            assert (await client.get("/hello")).json() == {"hello": "theirs"}
            stored = (await client.post("/geometry/v1/solids", json=SPHERE)).json()
            body = {"solid": {"type": "stored", "id": stored["id"]}, "points": [[0, 0, 0], [9, 9, 9]]}
            answer = await client.post("/geometry/v1/contains", json=body)
            assert answer.json()["contained"] == [True, False]
            assert "compute" in answer.headers["server-timing"]
            many = {**body, "points": [[0, 0, 0]] * 4}
            check_problem(await client.post("/geometry/v1/contains", json=many), 422, "limit_exceeded")
            assert (await client.get(f"/geometry/v1/solids/{stored['id']}")).status_code == 200
            assert (await client.get("/geometry/healthz")).status_code == 200
            assert "geometry_requests_total" in (await client.get("/geometry/metrics")).text
            document = (await client.get("/openapi.json")).json()
    assert {"/hello", "/geometry/v1/contains"} <= set(document["paths"])
    assert "x-limit" not in json.dumps(document)
    assert document["components"]["schemas"]["ContainsRequest"]["properties"]["points"]["maxItems"] == 3
    for reference in references(document):
        assert resolve(document, reference.removeprefix("#"))
