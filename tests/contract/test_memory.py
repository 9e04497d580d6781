"""Hostile bodies of at most 2 MB, many at once: memory stays within what requests are given, and /healthz answers."""

from __future__ import annotations

import gzip
import json
import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
import zstandard

from benchmarks.load import watched
from benchmarks.measure import memory_of
from tests.contract.test_deadlines import MANY_SIDES, ZIGZAG, across, comb, features, stripes
from tests.unit.service.asking import SHEET, SPHERE, examples, of_scene
from tests.unit.service.test_live import Service, running

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="memory of processes is read from /proc")
MB = 2**20
GIVEN, STORED = 512 * MB, 16 * MB
BOX = {"solid": {"type": "aabb", "min": [0, 0], "max": [1, 1]}}
SQUARE = [[0, 0], [2, 0], [2, 2], [0, 2]]
SCENE = {"bodies": [BOX] * 2_000}
ACROSS = [[[-1, 0.5], [2, 0.5]]]
POSE = {"rotation": [[1, 0], [0, 1]], "translation": [0, 0]}


def polygon(rings: Any) -> dict[str, Any]:
    return {"type": "polygon", "rings": rings}


def layer(n: int, bars: Any = stripes) -> dict[str, Any]:
    return features([[bar] for bar in bars(n)])


def bodies() -> Iterator[tuple[str, bytes, dict[str, str]]]:
    """Yield path, body and headers of what wants far more memory than it sends."""
    bars = stripes(4_000)
    made: list[tuple[str, Any]] = [
        ("contains/scene", {"bodies": [{"solid": SPHERE}] * 1_000, "points": [[0, 0, 0]] * 50_000}),
        ("collide/scene", {"bodies": [BOX] * 10_000}),
        ("collide", {"first": BOX["solid"], "second": BOX["solid"], "poses": [POSE] * 25_000}),
        ("overlay", {"subject": polygon(bars), "clip": polygon(across(4_000)), "operation": "intersection"}),
        (
            "overlay/batch",
            {"subjects": [polygon(bars)] * 4, "clips": [polygon(across(4_000))] * 4, "operation": "union"},
        ),
        ("overlay/batch", {"subjects": [polygon([])] * 30_000, "clips": [polygon([])] * 30_000, "operation": "union"}),
        ("overlay", {"subject": polygon([ZIGZAG * 5]), "clip": polygon([ZIGZAG]), "operation": "union"}),
        ("clip/segments", {"region": polygon([comb(20_000)]), "segments": [[[-1, 0.5], [30_000, 0.5]]] * 40_000}),
        ("clip/segments", {"region": polygon([comb(20_000)]), "segments": [[[-1, 0], [30_000, 0]]] * 40_000}),
        ("clip/lines", {"region": polygon([comb(20_000)]), "lines": [[[-1, 0.5], [30_000, 0.5]] * 10] * 4_000}),
        ("layers/overlay", {"left": layer(5_000), "right": layer(5_000, across), "operation": "union"}),
        ("layers/union", {"layer": layer(10_000)}),
        ("layers/contains", {"points": features([[1, 1]] * 9_000, "Point"), "polygons": features([[SQUARE]] * 9_000)}),
        ("clip/polygons", {"region": MANY_SIDES, "polygons": [[ZIGZAG]] * 4}),
        ("clip/polygons", {"region": BOX["solid"], "polygons": [[[[0, 0]]]] * 100_000}),
        ("contains", {"solid": polygon([[[0, 0], [1, 0], [0, 1]]] * 60_000), "points": []}),
        ("contains", {"x" * 2_000_000: 1}),
        ("scenes", {"bodies": [BOX] * 10_000}),
        ("clip/segments/scene", {"bodies": [BOX] * 2_000, "segments": ACROSS * 40_000}),
        ("clip/segments/scene", {"bodies": [BOX] * 10_000, "segments": ACROSS * 20_000, "keep": "first"}),
        ("scenes/{scene}/contains", {"points": [[0.5, 0.5]] * 150_000}),
        ("scenes/{scene}/collide", {}),
        ("scenes/{scene}/clip/segments", {"segments": ACROSS * 80_000}),
        ("scenes/{scene}/clip/segments", {"segments": ACROSS * 80_000, "keep": "any"}),
    ]
    for path, body in made:
        yield path, json.dumps(body, separators=(",", ":")).encode(), {}
    for text in (b"[],", b"{},", b'{"a":[{"b":0}]},', b"0,"):
        yield "contains", b"[" + text * (2_000_000 // len(text)) + b"0]", {}
    yield "contains", gzip.compress(b" " * 2**28), {"Content-Encoding": "gzip"}
    yield "contains", zstandard.compress(b" " * 2**30), {"Content-Encoding": "zstd"}


@pytest.fixture
def service() -> Iterator[Service]:
    with running(deadline_seconds=2, request_bytes=GIVEN, store_bytes=STORED, access_log=False) as service:
        service.wait_until_ready()
        yield service


def ask(service: Service, path: str, body: bytes, headers: dict[str, str]) -> int:
    assert len(body) <= 2 * MB, (path, len(body))
    headers = {"Content-Type": "application/json", "Accept-Encoding": "identity", **headers}
    return httpx.post(f"{service.url}/v1/{path}", content=body, headers=headers, timeout=300).status_code


def never_read(service: Service) -> None:
    """Ask for an answer of megabytes, and leave it."""
    body = json.dumps({"bodies": [{"solid": SPHERE}] * 100, "points": [[0, 0, 0]] * 20_000}).encode()
    lines = ["POST /v1/contains/scene HTTP/1.1", "Host: x", "Content-Type: application/json"]
    head = "\r\n".join([*lines, f"Content-Length: {len(body)}", "", ""]).encode()
    with socket.create_connection(("127.0.0.1", service.port)) as connection, suppress(OSError):
        connection.sendall(head + body)
        time.sleep(3)


def hold_within(service: Service, n_clients: int, turns: int) -> float:
    """Send all bodies, some at once; return how long /healthz took at most."""
    messages = [*bodies()] * turns
    sheet = httpx.post(f"{service.url}/v1/scenes", json=SHEET).json()["id"]
    for path, example in examples(httpx.get(f"{service.url}/openapi.json").json()):
        url = service.url + of_scene(path, sheet)
        statuses = [httpx.post(url, json=example, timeout=300).status_code for _ in range(3)]
        assert statuses[-1] in (200, 201), (path, statuses)  # the first may compile past its deadline
    stored = httpx.post(f"{service.url}/v1/scenes", json=SCENE).json()["id"]
    messages = [(path.replace("{scene}", stored), body, headers) for path, body, headers in messages]
    base = memory_of(service.process.pid)
    with watched(service.port, service.process.pid, 5.0) as seen, ThreadPoolExecutor(n_clients + 8) as clients:
        idle = [clients.submit(never_read, service) for _ in range(8)]
        statuses = set(clients.map(lambda message: ask(service, *message), messages))
        for one in idle:
            one.result()
    assert statuses <= {200, 201, 400, 404, 413, 422, 503, 504, 507}
    assert seen.memory - base < (1.1 * GIVEN + STORED) / MB, (base, seen.memory)
    return seen.wait


@pytest.mark.full
def test_memory_stays_within_what_requests_are_given(service: Service) -> None:
    hold_within(service, 4, 1)


@pytest.mark.full
def test_it_does_so_for_long_and_small_questions_are_answered(service: Service) -> None:
    assert hold_within(service, 8, 10) < 0.1
