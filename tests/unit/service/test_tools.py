"""POST /mcp, called by the client of the protocol's own library."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterator
from typing import Any

import anyio
import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from service import tools, wire
from service.app import create_app
from service.convert.summaries import summary
from service.errors import ServiceError
from service.schemas.base import Schema
from service.schemas.clipping import LayersResponse
from service.settings import Settings
from service.wire import Raw, Series
from tests.unit.service.asking import SPHERE, check_problem, client_of, examples
from tests.unit.service.test_live import Service, running

needs_mcp = pytest.mark.skipif(importlib.util.find_spec("mcp") is None, reason="the extra `mcp` is not installed")


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    with running(access_log=False, api_keys="secret") as service:
        service.wait_until_ready()
        yield service


def talk(url: str, *calls: tuple[str, dict[str, Any]]) -> tuple[list[Any], list[tuple[bool, str]]]:
    """Return the tools, and for each call whether it failed and the text it came back with."""
    import httpx2
    from mcp import Client
    from mcp.client.streamable_http import streamable_http_client

    async def ask() -> tuple[list[Any], list[tuple[bool, str]]]:
        http = httpx2.AsyncClient(headers={"Authorization": "Bearer secret"})
        async with http, Client(streamable_http_client(f"{url}/mcp", http_client=http)) as client:
            listed = (await client.list_tools()).tools
            found = [await client.call_tool(name, arguments) for name, arguments in calls]
            return listed, [(bool(each.is_error), each.content[0].text) for each in found]

    return anyio.run(ask)


@needs_mcp
def test_a_model_asks_about_a_stored_solid(service: Service) -> None:
    _, ((failed, text),) = talk(service.url, ("put_solid", {"solid": SPHERE}))
    assert not failed, text
    stored = {"type": "stored", "id": json.loads(text)["id"]}
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0]] * 100
    _, answers = talk(
        service.url,
        ("contains", {"solid": stored, "points": points}),
        ("contains", {"solid": stored, "points": points, "show": 2, "start": 1}),
        ("collide", {"first": stored, "second": {**SPHERE, "center": [2, 0, 0]}}),
        ("contains", {"solid": stored, "points": [[0, 0]]}),
        ("contains", {"solid": stored}),
        ("contains", {"solid": stored, "points": [], "show": -1}),
        ("nothing", {}),
    )
    assert [failed for failed, _ in answers] == [False, False, False, True, True, True, True]
    first, second, third = (json.loads(text) for _, text in answers[:3])
    assert first["contained"] == {"count": 300, "true": 200, "items": [True, True, False] * 3 + [True]}
    assert first["boundary"]["count"] == 100
    assert second["contained"]["items"] == [True, False]
    assert third["collisions"]["items"][0]["relation"] == "touching"
    assert answers[3][1].startswith("wrong_dimension: ")
    assert "/points" in answers[4][1]
    assert "contains" in answers[6][1]


@needs_mcp
def test_a_model_asks_about_a_stored_scene(service: Service) -> None:
    bodies = [{"solid": SPHERE}, {"solid": {**SPHERE, "center": [2, 0, 0]}}]
    _, ((failed, text),) = talk(service.url, ("put_scene", {"bodies": bodies}))
    assert not failed, text
    scene, points = json.loads(text)["id"], {"points": [[1, 0, 0], [9, 0, 0]]}
    _, answers = talk(
        service.url,
        ("contains_stored_scene", {"scene_id": scene, **points}),
        ("collide_stored_scene", {"scene_id": scene}),
        *(("contains_stored_scene", {**wrong, **points}) for wrong in ({}, {"scene_id": ""}, {"scene_id": 7})),
        ("contains_stored_scene", {"scene_id": "../solids", **points}),
        ("contains_stored_scene", {"scene_id": "0" * 64, **points}),
    )
    assert [failed for failed, _ in answers] == [False] * 2 + [True] * 5
    held, met = (json.loads(text) for _, text in answers[:2])
    assert held["bodies"]["items"] == [[0, 1], []]
    assert met["pairs"]["items"] == [{"first": 0, "second": 1, "relation": "touching"}]
    assert all(text.startswith("scene_id is missing") for _, text in answers[2:5])
    assert all(text.startswith("unknown_scene: ") for _, text in answers[5:])


@needs_mcp
@pytest.mark.anyio
async def test_tools_that_cannot_be_made_hold_nobody(client: httpx.AsyncClient, app: FastAPI) -> None:
    """Everybody who waits is answered, and the next one tries again."""
    head = {"Accept": "application/json", "Content-Type": "application/json", "Host": "localhost"}
    question = {"jsonrpc": "2.0", "id": 1, "method": "tools/list"}
    made = app.state.tools._made
    app.state.tools._made = lambda: {}["no such thing"]
    answers: list[httpx.Response] = []

    async def ask() -> None:
        answers.append(await client.post("/mcp", json=question, headers=head))

    with anyio.fail_after(60):
        async with anyio.create_task_group() as group:
            for _ in range(3):
                group.start_soon(ask)
        app.state.tools._made = made
        await ask()
    for answer in answers[:3]:
        check_problem(answer, 500, "internal")
    assert {tool["name"] for tool in answers[3].json()["result"]["tools"]} >= {"contains", "put_scene"}


@needs_mcp
def test_every_question_is_a_tool_with_a_small_schema(service: Service) -> None:
    document = create_app(Settings(concurrency=1)).openapi()
    paths = {path: item["post"]["operationId"] for path, item in document["paths"].items() if "post" in item}
    asked = [
        (paths[path], {"solid": example} if path == "/v1/solids" else example)
        for path, example in examples(document)
        if "{" not in path
    ]
    listed, answers = talk(service.url, *asked)
    assert {name for name, _ in asked} <= {tool.name for tool in listed}
    for (name, _), (failed, text) in zip(asked, answers):
        assert not failed, (name, text)
        assert len(text) < 4000, name
    for tool in listed:
        assert len(tool.description) < 200
        most = 8000 if tool.name == "put_solid" else 3000
        assert len(tool.model_dump_json()) < most, (tool.name, len(tool.model_dump_json()))
        assert tool.input_schema["type"] == "object"
        assert not {"oneOf", "anyOf"} & set(tool.input_schema)
        for reference in tools._names(tool.input_schema):
            assert reference in tool.input_schema["$defs"]


@needs_mcp
def test_a_key_is_asked_for(service: Service) -> None:
    check_problem(httpx.post(f"{service.url}/mcp", json={}), 401, "missing_key")


@pytest.mark.anyio
async def test_where_the_library_is_absent(client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tools, "find_spec", lambda name: None)
    check_problem(await client.post("/mcp", json={}), 501, "not_installed")
    assert (await client.get("/mcp")).status_code == 405


LIST = {"jsonrpc": "2.0", "id": 1, "method": "tools/list"}
HEAD = {"Accept": "application/json", "Content-Type": "application/json", "Host": "localhost"}


@pytest.mark.parametrize(
    ("settings", "host", "origin", "may"),
    [
        ({}, "localhost:8000", None, True),
        ({}, "127.0.0.1:8000", None, True),
        ({}, "127.0.0.2", None, True),
        ({}, "[::1]:8000", "http://[::1]:8000", True),
        ({}, "LOCALHOST:8000", "http://localhost:8000", True),
        ({}, "evil.example:8000", None, False),  # a name that was led to this machine
        ({}, "evil.example:8000", "http://evil.example:8000", False),
        ({}, "127.0.0.1.evil.example", None, False),
        ({}, "localhost@evil.example", None, False),
        ({}, "evil.example:bad", None, False),
        ({}, "", None, False),
        ({}, "localhost:8000", "http://evil.example", False),
        ({}, "localhost:8000", "http://localhost:3000", False),
        ({}, "localhost:8000", "null", False),
        ({"cors_origins": ("https://maps.example",)}, "localhost:8000", "https://maps.example", True),
        ({"cors_origins": ("https://maps.example",)}, "maps.example", "https://maps.example", True),
        ({"cors_origins": ("https://maps.example",)}, "evil.example", None, False),
        ({"host": "0.0.0.0"}, "geometry.example", None, True),  # open on purpose, under whatever name
        ({"host": "0.0.0.0"}, "geometry.example", "https://evil.example", False),
        ({"api_keys": ("k",)}, "geometry.example", None, True),
    ],
)
def test_a_page_of_another_site_may_not_ask(settings: dict[str, Any], host: str, origin: str | None, may: bool) -> None:
    headers = {b"host": host.encode(), **({} if origin is None else {b"origin": origin.encode()})}
    if may:
        tools.check_origin(headers, Settings(**settings))
    else:
        with pytest.raises(ServiceError) as caught:
            tools.check_origin(headers, Settings(**settings))
        assert caught.value.code == "wrong_origin"


@needs_mcp
@pytest.mark.anyio
async def test_origin_and_host_of_a_request_are_looked_at(client: httpx.AsyncClient) -> None:
    for more, status in (({}, 200), ({"Host": "evil.example"}, 403), ({"Origin": "https://evil.example"}, 403)):
        answer = await client.post("/mcp", json=LIST, headers={**HEAD, **more})
        assert answer.status_code == status, more


@needs_mcp
@pytest.mark.anyio
async def test_requests_are_read_as_bodies_are(client: httpx.AsyncClient) -> None:
    sphere = json.dumps(SPHERE)

    async def ask(arguments: str, more: str = "") -> httpx.Response:
        call = f'"params": {{"name": "contains", "arguments": {arguments}}}'
        text = f'{{"jsonrpc": "2.0", "id": 1, "method": "tools/call", {call}{more}}}'
        return await client.post("/mcp", content=text, headers=HEAD)

    right = await ask(f'{{"solid": {sphere}, "points": [[0, 0, 0]]}}')
    assert json.loads(right.json()["result"]["content"][0]["text"])["contained"]["items"] == [True]
    twice = await ask(f'{{"solid": {sphere}, "points": [[0, 0, 0]], "points": []}}')
    assert "duplicate" in check_problem(twice, 400, "not_json")["detail"]
    names = ",".join(f'"{k}": 0' for k in range(5000))
    check_problem(await ask(f"{{{names}}}"), 400, "not_json")
    check_problem(await ask("{}", f', "x": {json.dumps(["y" * 90_000])}'), 413, "body_too_large")
    check_problem(await ask(json.dumps(["y" * 2**21])), 413, "body_too_large")
    (text,) = (await ask('{"solid": {"type": "x"}, "points": []}')).json()["result"]["content"]
    assert text["text"].startswith("unknown_type: ")
    for odd in ("[]", "7", "null"):
        assert "jsonrpc" in (await ask(odd)).json()


@needs_mcp
@pytest.mark.anyio
async def test_who_asks_too_much_of_a_tool_is_told_in_time(app: FastAPI, anyio_backend: str) -> None:
    async with client_of(app) as client:
        app.state.tools._settings = app.state.settings.model_copy(update={"deadline_seconds": 1e-6})
        answer = await client.post("/mcp", json=LIST, headers=HEAD)
        check_problem(answer, 504, "deadline_exceeded")
        with app.state.memory.lock:
            assert app.state.memory.taken == app.state.memory.leaving


def test_no_more_of_an_answer_is_made_than_is_shown() -> None:
    made: list[int] = []

    def rows(start: int, stop: int) -> list[Any]:
        made.extend(range(start, stop))
        return [Raw(b'{"n":%d,"t":"%b"}' % (k, b"x" * 5000)) for k in range(start, stop)]

    class Nested(Schema):
        inner: Any

    answer = LayersResponse.made(
        crs=None,
        features=Series(10**9, rows),
        collapsed=np.arange(10**6) % 2 == 0,
        accuracy=Nested.made(inner=Series(10**7, lambda start, stop: np.arange(start, stop))),
    )
    found = summary(answer, 4, 10**8)
    assert made == [*range(10**8, 10**8 + 4)]
    text = {"count": 5000, "first": "x" * 1000}
    assert found["features"] == {"count": 10**9, "items": [{"n": k, "t": text} for k in made]}
    assert found["collapsed"] == {"count": 10**6, "true": 500_000, "items": []}
    assert found["accuracy"] == {"inner": {"count": 10**7, "first": [0, 1, 2, 3]}}
    assert "crs" not in found
    names = {f"n{k}": "x" * 900 for k in range(2000)}
    with pytest.raises(ServiceError, match="show fewer"):
        summary({"features": [names]}, 1, 0)


def test_long_lists_are_cut_at_every_depth() -> None:
    rings = [[[float(i), 0.0] for i in range(100)]]
    found = summary({"pieces": [{"shell": rings[0], "holes": []}] * 7, "area": 1.0}, 2, 5)
    assert found["pieces"]["count"] == 7
    assert len(found["pieces"]["items"]) == 2
    assert found["pieces"]["items"][0]["shell"] == {"count": 100, "first": rings[0][:3]}
    assert found["area"] == 1.0


def test_whole_numbers_of_any_size_are_shown() -> None:
    feature = b'{"properties":{"a":%d,"b":[%d,1.5,true]}}' % (2**70, -(2**63) - 1)
    answer = LayersResponse.made(type="FeatureCollection", features=Series(1, lambda i, j: [Raw(feature)][i:j]))
    shown = json.loads(wire.encode(summary(answer, 10, 0)))
    assert shown["features"]["items"] == [json.loads(feature)]
