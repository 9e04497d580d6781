"""POST /mcp, asked by the client of the protocol's own library."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterator
from typing import Any

import anyio
import httpx
import pytest
from fastapi import FastAPI

from service import tools
from service.app import create_app
from service.convert.summaries import summary
from service.settings import Settings
from tests.unit.service.asking import SPHERE, check_problem, examples
from tests.unit.service.test_live import Service

needs_mcp = pytest.mark.skipif(importlib.util.find_spec("mcp") is None, reason="the extra `mcp` is not installed")


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    service = Service(access_log=False, api_keys="secret")
    try:
        service.wait_until_ready()
        yield service
        assert service.stop() == 0
        assert "Traceback" not in "".join(service.log)
    finally:
        service.close()


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


def test_long_lists_are_cut_at_every_depth() -> None:
    rings = [[[float(i), 0.0] for i in range(100)]]
    found = summary({"pieces": [{"shell": rings[0], "holes": []}] * 7, "area": 1.0}, 2, 5)
    assert found["pieces"]["count"] == 7
    assert len(found["pieces"]["items"]) == 2
    assert found["pieces"]["items"][0]["shell"] == {"count": 100, "first": rings[0][:3]}
    assert found["area"] == 1.0
