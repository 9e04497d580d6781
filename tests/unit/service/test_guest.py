"""The calls of the service within somebody else's application, of which they change nothing."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Annotated, Any

import httpx
import pytest
from fastapi import Depends, FastAPI, Header, HTTPException, Request, Response

import engine
import service
from service.settings import Settings
from tests.unit.service.asking import SPHERE, check_problem, resolve
from tests.unit.service.test_live import ROOT

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
            lines = [{"operation": "contains", "layer": {"type": "FeatureCollection", "features": []}, "outside": True}]
            lines.append({"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [1, 2]}})
            content, kind = "\n".join(map(json.dumps, lines)), {"content-type": "application/x-ndjson"}
            rows = await client.post("/geometry/v1/layers/stream", content=content, headers=kind)
            assert rows.json()["point"] == {"index": 0}
            assert (await client.get("/geometry/healthz")).status_code == 200
            assert "geometry_requests_total" in (await client.get("/geometry/metrics")).text
            document = (await client.get("/openapi.json")).json()
    assert {"/hello", "/geometry/v1/contains"} <= set(document["paths"])
    assert "x-limit" not in json.dumps(document)
    assert document["components"]["schemas"]["ContainsRequest"]["properties"]["points"]["maxItems"] == 3
    for reference in references(document):
        assert resolve(document, reference.removeprefix("#"))


HOST = """
import asyncio, gc, json, logging, sys
from fastapi import FastAPI
import httpx

def switches():
    flags = logging.logThreads, logging.logProcesses, logging.logMultiprocessing
    return [gc.isenabled(), gc.get_threshold(), gc.get_freeze_count(), sys.getswitchinterval(), flags]

before = switches()
import engine, service
from service.memory import _libc
calls = []
if _libc is not None:
    _libc.mallopt = lambda *arguments: calls.append(arguments)
engine.warm = lambda **_: None
app = FastAPI()
app.include_router(service.router())

async def main():
    async with app.router.lifespan_context(app):
        assert app.state.geometry.warm.wait(60)
        client = httpx.AsyncClient(transport=httpx.ASGITransport(app=app), base_url="http://test")
        body = {"solid": {"type": "sphere", "center": [0, 0], "radius": 1}, "points": [[0, 0]] * 5000}
        assert (await client.post("/v1/contains", json=body)).status_code == 200
        assert switches() == before, (before, switches())
    assert switches() == before, (before, switches())
    assert not calls, calls

asyncio.run(main())
"""


def test_a_guest_leaves_the_process_as_it_is() -> None:
    done = subprocess.run([sys.executable, "-c", HOST], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> FastAPI:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    return FastAPI()


def client_of(app: FastAPI) -> httpx.AsyncClient:
    return httpx.AsyncClient(transport=httpx.ASGITransport(app=app), base_url="http://test")


QUESTION = {"solid": SPHERE, "points": [[0, 0, 0], [9, 9, 9]]}


async def test_keys_are_the_hosts_matter_and_it_is_said(
    host: FastAPI, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, anyio_backend: str
) -> None:
    monkeypatch.setenv("GEOMETRY_API_KEYS", "secret")
    host.include_router(service.router())
    (line,) = [record.getMessage() for record in caplog.records if record.name == "service"]
    assert "GEOMETRY_API_KEYS" in line
    assert "dependencies=[Depends(" in line
    assert "secret" not in line
    async with host.router.lifespan_context(host):
        assert (await client_of(host).post("/v1/contains", json=QUESTION)).status_code == 200


async def test_dependencies_of_the_host_guard_every_call(host: FastAPI, anyio_backend: str) -> None:
    def check(x_key: Annotated[str, Header()] = "") -> None:
        if x_key != "right":
            raise HTTPException(401, "no")

    host.include_router(service.router(Settings()), prefix="/geometry", dependencies=[Depends(check)])
    async with host.router.lifespan_context(host):
        client = client_of(host)
        for headers, status in (({}, 401), ({"x-key": "right"}, 200)):
            assert (await client.get("/geometry/healthz", headers=headers)).status_code == status
            answer = await client.post("/geometry/v1/contains", json=QUESTION, headers=headers)
            assert answer.status_code == status
        missing = f"/geometry/v1/solids/{'0' * 64}"
        assert (await client.get(missing)).status_code == 401
        check_problem(await client.get(missing, headers={"x-key": "right"}), 404, "unknown_solid")


async def test_a_dependency_of_the_host_may_read_the_body(host: FastAPI, anyio_backend: str) -> None:
    """One that checks a signature does; the call then waited for a body that had arrived."""

    async def check(request: Request) -> None:
        if b"points" not in await request.body():
            raise HTTPException(401, "no")

    host.include_router(service.router(Settings(body_seconds=1)), dependencies=[Depends(check)])
    async with host.router.lifespan_context(host):
        for n in (1, 3000):
            question = {"solid": SPHERE, "points": [[0, 0, 0]] * n}
            answer = await client_of(host).post("/v1/contains", json=question)
            assert answer.json()["contained"] == [True] * n


@pytest.mark.parametrize("path", ["/v1/contains", "/readyz", "/metrics"])
async def test_a_mounted_application_starts_with_its_first_request(
    host: FastAPI, anyio_backend: str, path: str
) -> None:
    """Starlette runs the lifespan of the outermost application only."""
    below = FastAPI()
    below.include_router(service.router(Settings(max_points=3)))
    host.mount("/geometry", below)
    async with host.router.lifespan_context(host):
        client = client_of(host)
        ask: Any = client.post("/geometry" + path, json=QUESTION) if path[1] == "v" else client.get("/geometry" + path)
        assert (await ask).status_code in (200, 503)
        assert below.state.geometry.warm.wait(60)
        for _ in range(2):
            answer = await client.post("/geometry/v1/contains", json=QUESTION)
            assert answer.json()["contained"] == [True, False]
        assert (await client.get("/geometry/readyz")).status_code == 200
        assert "x-limit" not in json.dumps((await client.get("/geometry/openapi.json")).json())


@pytest.mark.parametrize("how", ["prefix", "mount", "root_path", "prefix of letters"])
async def test_location_is_where_the_host_has_the_calls(host: FastAPI, anyio_backend: str, how: str) -> None:
    """It left out the host's prefix, and what it named was not there."""
    app, before = host, "/geo métrie 日本" if how == "prefix of letters" else "/geo"
    if how == "mount":
        app = FastAPI()
        app.mount("/geo", host)
    elif how == "root_path":  # which a proxy takes off
        host.root_path = "/geo"
    host.include_router(service.router(Settings()), prefix=before if how.startswith("prefix") else "")
    async with app.router.lifespan_context(app):
        client, asked = client_of(app), "" if how == "root_path" else before
        answer = await client.post(f"{asked}/v1/solids", json=SPHERE)
        place = answer.headers["location"]
        assert place.startswith("/geo")
        assert (await client.get(place.removeprefix("/geo" if how == "root_path" else ""))).json() == answer.json()
        scene = await client.post(f"{asked}/v1/scenes", json={"bodies": [{"solid": SPHERE}]})
        assert scene.headers["location"].endswith(f"/v1/scenes/{scene.json()['id']}")


async def test_headers_of_the_hosts_dependencies_are_sent(host: FastAPI, anyio_backend: str) -> None:
    def count(response: Response) -> None:
        response.headers["X-Rate"] = "1"

    host.include_router(service.router(Settings()), dependencies=[Depends(count)])
    async with host.router.lifespan_context(host):
        for body in (QUESTION, {}, {"solid": SPHERE, "points": [[0, 0, 0]] * 3000}):
            answer = await client_of(host).post("/v1/contains", json=body)
            assert answer.headers.get_list("x-rate") == ["1"]
            assert len(answer.headers.get_list("content-length")) == 1


@pytest.mark.parametrize("has_lifespan", [True, False])
async def test_two_routers_in_one_application_are_refused(
    host: FastAPI, anyio_backend: str, has_lifespan: bool
) -> None:
    """The settings of the last counted for both."""
    host.include_router(service.router(Settings(max_points=1)), prefix="/a")
    host.include_router(service.router(Settings()), prefix="/b")
    if has_lifespan:
        with pytest.raises(RuntimeError, match="two service routers"):
            async with host.router.lifespan_context(host):
                pass
    else:
        assert (await client_of(host).post("/a/v1/contains", json=QUESTION)).status_code == 422
        with pytest.raises(RuntimeError, match="two service routers"):
            await client_of(host).post("/b/v1/contains", json=QUESTION)


async def test_one_router_may_stand_in_two_places_and_start_again(host: FastAPI, anyio_backend: str) -> None:
    router = service.router(Settings(max_points=3))
    for prefix in ("/a", "/b"):
        host.include_router(router, prefix=prefix)
    many = {"solid": SPHERE, "points": [[0, 0, 0]] * 3}
    for _ in range(2):
        async with host.router.lifespan_context(host):
            for prefix in ("/a", "/b"):
                answer = await client_of(host).post(f"{prefix}/v1/contains", json=many)
                assert answer.json()["contained"] == [True] * 3
