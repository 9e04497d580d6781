"""Bodies that are broken in random ways get 4xx or an answer, never 5xx, never a hang."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import httpx
import pytest

from service.decoding import arrays
from tests.unit.service.asking import check_problem, examples

pytestmark = pytest.mark.anyio

ODD_VALUES: list[Any] = [
    None, True, False, "", "1.5", "x" * 300, "\x00", 0, -1, 1, 2, 3, -0.0, 0.5, 1e300, -1e300, 1.7976931348623157e308,
    5e-324, 2**53 + 1, 2**63, -(2**63) - 1, 10**400, [], {}, [[]], [[[]]], [{}], {"type": "sphere"}, [0, 0], [0, 0, 0],
    [[0, 0, 0]], [[0, 0], [0, 0, 0]], {"a": {"b": []}}, float("inf"), float("nan"),
]  # fmt: skip


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of everything within `value`."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


def with_odd_value(source: random.Random, body: Any) -> bytes:
    """Put something odd into one or two places of `body`, or take something out."""
    copy = json.loads(json.dumps(body))
    for _ in range(source.choice([1, 1, 2])):
        found = [path for path in places(copy) if path]
        if not found:
            break
        *path, last = source.choice(found)
        parent = copy
        for key in path:
            parent = parent[key]
        if source.random() < 0.15:
            del parent[last]
        elif source.random() < 0.1 and isinstance(parent, dict):
            parent[source.choice(["type", "extra", "a/b", ""])] = deepcopy(source.choice(ODD_VALUES))
        else:
            parent[last] = deepcopy(source.choice(ODD_VALUES))
    return json.dumps(copy).encode()


def with_odd_bytes(source: random.Random, body: Any) -> bytes:
    """Cut the text, or change, repeat or take out some of its bytes."""
    text = bytearray(json.dumps(body).encode())
    at, size = source.randrange(len(text)), source.randrange(1, 8)
    kind = source.randrange(4)
    if kind == 0:
        return bytes(text[:at])
    if kind == 1:
        text[at : at + size] = source.randbytes(size)
    elif kind == 2:
        text[at:at] = text[at : at + size] * source.choice([1, 2, 500])
    else:
        del text[at : at + size]
    return bytes(text)


BREAK: list[Callable[[random.Random, Any], bytes]] = [with_odd_value, with_odd_value, with_odd_bytes]


async def break_bodies(client: httpx.AsyncClient, count: int) -> set[int]:
    """Send `count` broken bodies and return the statuses seen; assert that each is answered as it should be."""
    document = (await client.get("/openapi.json")).json()
    source, seen = random.Random(8), set()
    requests = examples(document)
    for _ in range(count):
        path, example = source.choice(requests)
        body = source.choice(BREAK)(source, example)
        answer = await client.post(path, content=body, headers={"Content-Type": "application/json"})
        seen.add(answer.status_code)
        assert answer.status_code in (200, 201, 400, 404, 422), (path, body, answer.text)
        if answer.status_code >= 400:
            check_problem(answer, answer.status_code, answer.json()["code"])
    return seen


async def test_broken_bodies_are_refused(client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrays, "LEAST", 16)  # the examples are short
    assert await break_bodies(client, 2000) >= {200, 400, 422}


@pytest.mark.full
async def test_many_broken_bodies_are_refused(client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrays, "LEAST", 16)
    await break_bodies(client, 100_000)


async def test_a_query_parameter_that_no_call_has_is_refused_by_name(client: httpx.AsyncClient) -> None:
    body = {"solid": {"type": "aabb", "min": [0, 0], "max": [1, 1]}, "points": [[0.5, 0.5]]}
    for path in ("/v1/contains", "/v1/solids"):
        answer = await client.post(f"{path}?treads=2", json=body if path == "/v1/contains" else body["solid"])
        assert "no query parameter 'treads'" in check_problem(answer, 422, "invalid_request")["detail"]
    answer = await client.post("/v1/contains", json=body)
    assert answer.json()["contained"] == [True]
