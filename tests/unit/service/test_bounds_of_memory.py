"""Answers have a budget, bodies may be compressed, and what a request holds is counted from body to answer."""

from __future__ import annotations

import asyncio
import gzip
import json
import tracemalloc
from collections.abc import AsyncIterator, Callable
from typing import Any

import httpx
import numpy as np
import pytest
import zstandard
from fastapi import FastAPI

import engine
from service import wire
from service.schemas.points import ContainsSceneResponse
from service.work import SMALL
from tests.unit.service.asking import SPHERE, check_problem, client_of

pytestmark = pytest.mark.anyio
JSON = {"Content-Type": "application/json"}


def limited(app: FastAPI, **changes: Any) -> FastAPI:
    app.state.settings = app.state.settings.model_copy(update=changes)
    app.state.memory.limit = app.state.settings.request_bytes
    return app


def stripes(n: int) -> dict[str, Any]:
    bars = [[[0, 3 * i], [3 * n, 3 * i], [3 * n, 3 * i + 1], [0, 3 * i + 1]] for i in range(n)]
    across = [[[y, x] for x, y in bar] for bar in bars]
    polygons = [{"type": "polygon", "rings": rings} for rings in (bars, across)]
    return {"subject": polygons[0], "clip": polygons[1], "operation": "intersection"}


def zigzag(n: int) -> dict[str, Any]:
    ring = [[i, (i % 2) * 1000] for i in range(n)] + [[n, -1], [0, -1]]
    return {"region": {"type": "polygon", "rings": [ring]}, "segments": [[[-1, 24.2], [n + 1, 24.3]]] * n}


BODIES: dict[str, dict[str, Any]] = {
    "contains/scene": {"bodies": [{"solid": SPHERE}] * 200, "points": [[0, 0, 0]] * 500},
    "collide/scene": {"bodies": [{"solid": {"type": "aabb", "min": [0, 0], "max": [1, 1]}}] * 400},
    "overlay": stripes(60),
    "clip/segments": zigzag(150),
}
"""Each has an answer of a few hundred kB at least, from a body of a few kB."""


@pytest.mark.parametrize("path", BODIES)
@pytest.mark.parametrize("limit", ["max_answer_bytes", "request_bytes"])
async def test_large_answers_are_refused_before_they_are_there(
    app: FastAPI, anyio_backend: str, path: str, limit: str
) -> None:
    body = json.dumps(BODIES[path]).encode()
    async with client_of(app) as client:
        whole = await client.post(f"/v1/{path}", content=body, headers=JSON)
        assert whole.status_code == 200
        assert len(whole.content) > 200_000
    engine.release()
    least = 8 * len(body) + SMALL + 300_000 + wire.cost_of(body)
    async with client_of(limited(app, **{limit: least if limit == "request_bytes" else 150_000})) as client:
        answer = await client.post(f"/v1/{path}", content=body, headers=JSON)
        detail = check_problem(answer, 422, "answer_too_large")["detail"]
        assert f"GEOMETRY_{limit.upper()}" in detail
        assert any(word in detail for word in ("fewer", "split", "window"))
        with app.state.memory.lock:
            assert app.state.memory.taken == app.state.memory.leaving


class Ledger(engine.Cancel):
    """Hears what a call is about to hold."""

    taken = 0

    def take(self, n_bytes: int) -> None:
        self.taken += n_bytes


def peak_of(ask: Callable[[Ledger], object]) -> tuple[int, int]:
    """Return how many bytes a call used at most, and how many it counted."""
    ask(Ledger())  # compiled, prepared
    ledger = Ledger()
    tracemalloc.start()
    try:
        ask(ledger)
        return tracemalloc.get_traced_memory()[1], ledger.taken
    finally:
        tracemalloc.stop()


def test_what_the_engine_holds_for_a_question_is_counted() -> None:
    """Pairs that are named, vertices in a smallest sphere and points in many bodies are copied several times."""
    ball, turns = engine.Sphere([0, 0, 0], 1), np.linspace(0, 6, 50_000)
    pairs = np.array([[0, 1]] * 200_000)
    rings = iter([engine.Polygon([np.stack([np.cos(turns), np.sin(turns)], axis=1)]) for _ in range(2)])
    for ask in (
        lambda ledger: engine.collide_scene([ball] * 3, only=pairs, workers=1, cancel=ledger),
        lambda ledger: engine.collide_scene([ball] * 3, skip=pairs, workers=1, cancel=ledger),
        lambda ledger: engine.bounds(next(rings), cancel=ledger),
        lambda ledger: engine.locate_scene(np.zeros((2_000, 3)), [ball] * 100, workers=1, cancel=ledger),
    ):
        held, counted = peak_of(ask)
        assert 10**6 < held < 1.1 * counted, (held, counted)


async def test_what_others_hold_is_not_given_twice(app: FastAPI, anyio_backend: str) -> None:
    async with client_of(limited(app, request_bytes=2**22)) as client:
        app.state.memory.taken = 2**22 - 2**17
        large = {"solid": SPHERE, "points": [[0, 0, 0]] * 10_000}
        answer = await client.post("/v1/contains", json=large)
        check_problem(answer, 503, "out_of_memory")
        assert answer.headers["retry-after"] == "1"
        small = await client.post("/v1/contains", json={"solid": SPHERE, "points": [[0, 0, 0]]})
        assert small.status_code == 200


async def test_who_asks_again_waits_for_what_was_held(app: FastAPI, anyio_backend: str) -> None:
    """One that needs more than half of all is not refused for the sake of the one before it."""
    body = json.dumps({"solid": SPHERE, "points": [[0.125, 0.25, 0.5]] * 30_000}).encode()
    async with client_of(limited(app, request_bytes=6 * len(body))) as client:
        for _ in range(5):
            answer = await client.post("/v1/contains", content=body, headers=JSON)
            assert answer.status_code == 200, answer.text
            assert app.state.memory.leaving > 0


async def test_who_asks_again_waits_for_what_was_computed_with(app: FastAPI, anyio_backend: str) -> None:
    """The same of a body of a few kB whose answer takes more than half of all."""
    async with client_of(app) as client:
        for power in range(16, 31):  # the least of these that suffices is less than two of them need
            limited(app, request_bytes=2**power)
            answer = await client.post("/v1/overlay", json=stripes(60))
            if answer.status_code == 200:
                break
        for _ in range(5):
            answer = await client.post("/v1/overlay", json=stripes(60))
            assert answer.status_code == 200, answer.text


async def test_a_body_may_not_decode_to_far_more_than_its_text(app: FastAPI, anyio_backend: str) -> None:
    async with client_of(limited(app, request_bytes=2**22)) as client:
        answer = await client.post("/v1/contains", content=b"[" + b"[]," * 50_000 + b"[]]", headers=JSON)
        check_problem(answer, 413, "body_too_large")


@pytest.mark.parametrize("pack", [gzip.compress, zstandard.compress], ids=["gzip", "zstd"])
async def test_bodies_may_be_compressed(client: httpx.AsyncClient, pack: Any) -> None:
    headers = {**JSON, "Content-Encoding": "gzip" if pack is gzip.compress else "zstd"}

    async def ask(content: bytes) -> httpx.Response:
        return await client.post("/v1/contains", content=content, headers=headers)

    body = json.dumps({"solid": SPHERE, "points": [[0, 0, 0]]}).encode()
    assert (await ask(pack(body))).json()["contained"] == [True]
    check_problem(await ask(pack(body)[:-5]), 400, "bad_request")
    check_problem(await ask(pack(body) + b"junk"), 400, "bad_request")
    check_problem(await ask(body), 400, "bad_request")
    check_problem(await ask(b""), 400, "bad_request")
    check_problem(await ask(pack(b" " * 2**26)), 413, "body_too_large")
    stored = (await client.post("/v1/solids", json=SPHERE)).headers["location"]
    octets = {"Content-Encoding": headers["Content-Encoding"]}
    answer = await client.post(f"{stored}/contains", content=pack(np.zeros((5, 3)).tobytes()), headers=octets)
    assert answer.content == b"\1" * 5


@pytest.mark.parametrize("pack", [gzip.compress, zstandard.compress], ids=["gzip", "zstd"])
async def test_a_body_may_have_several_members_or_frames(client: httpx.AsyncClient, pack: Any) -> None:
    """RFC 1952, 2.2, RFC 8878, 3.1: as `cat a.gz b.gz` makes them, and tools that compress in blocks."""
    headers = {**JSON, "Content-Encoding": "gzip" if pack is gzip.compress else "zstd"}
    body = json.dumps({"solid": SPHERE, "points": [[0, 0, 0]] * 20_000}).encode()
    members = [pack(body[start : start + 50_000]) for start in range(0, len(body), 50_000)]
    members[1:1] = [pack(b"")] * 5_000
    members += [pack(bytes([byte])) for byte in b" " * 5_000]
    whole = b"".join(members)
    answer = await client.post("/v1/contains", content=whole, headers=headers)
    assert answer.json()["contained"] == [True] * 20_000
    for wrong in (whole[:-5], whole + b"junk", whole + b"\x1f", whole + pack(b"some text")[:12]):
        check_problem(await client.post("/v1/contains", content=wrong, headers=headers), 400, "bad_request")
    bomb = pack(b" " * 2**18) * 2**6
    check_problem(await client.post("/v1/contains", content=bomb, headers=headers), 413, "body_too_large")


async def test_what_is_declared_is_not_taken(app: FastAPI, anyio_backend: str) -> None:
    """Bodies are counted as they arrive, and refused before where they could never fit."""
    arrived, large = asyncio.Event(), {"solid": SPHERE, "points": [[0, 0, 0]] * 10_000}

    async def first_byte() -> AsyncIterator[bytes]:
        yield b"{"
        await arrived.wait()
        yield b" " * (2**20 - 1)

    headers = {**JSON, "Content-Length": str(2**20)}
    async with client_of(limited(app, request_bytes=2**22 + 2**16)) as client:
        waiting = [
            asyncio.create_task(client.post("/v1/contains", content=first_byte(), headers=headers)) for _ in "abcd"
        ]
        await asyncio.sleep(0.2)
        assert (await client.post("/v1/contains", json=large)).status_code == 200
        arrived.set()
        statuses = sorted([(await answer).status_code for answer in waiting])
        assert set(statuses) == {400, 503}  # not all of them at once, since now they are there
        limited(app, request_bytes=2**21)
        answer = await client.post("/v1/contains", content=first_byte(), headers=headers)
        check_problem(answer, 413, "body_too_large")


async def test_other_codings_are_refused(client: httpx.AsyncClient) -> None:
    answer = await client.post("/v1/contains", content=b"x", headers={**JSON, "Content-Encoding": "br"})
    check_problem(answer, 415, "unsupported_media_type")
    assert answer.headers["accept-encoding"] == "gzip, zstd"


@pytest.mark.parametrize(
    ("wanted", "coding"),
    [("gzip", "gzip"), ("gzip, zstd", "zstd"), ("br;q=1.0, gzip;q=0.5", "gzip"), ("zstd;q=0", None), ("", None)],
)
async def test_answers_are_compressed_when_asked(client: httpx.AsyncClient, wanted: str, coding: str | None) -> None:
    body = {"solid": SPHERE, "points": [[0, 0, 0]] * 5_000}
    async with client.stream("POST", "/v1/contains", json=body, headers={"Accept-Encoding": wanted}) as answer:
        raw = b"".join([part async for part in answer.aiter_raw()])
        assert answer.headers.get("content-encoding") == coding
        assert answer.headers["vary"] == "Accept-Encoding"
        assert int(answer.headers["content-length"]) == len(raw)
    text = {"gzip": gzip.decompress, "zstd": zstandard.ZstdDecompressor().decompressobj().decompress, None: bytes}
    assert json.loads(text[coding](raw))["contained"] == [True] * 5_000
    small = await client.post("/v1/contains", json={**body, "points": []}, headers={"Accept-Encoding": wanted})
    assert "content-encoding" not in small.headers


def test_a_series_is_made_in_parts_that_hold_few_numbers() -> None:
    counts = np.random.default_rng(0).integers(0, 3_000, 500)
    counts[:40] = 0
    offsets = np.concatenate([[0], np.cumsum(counts)])
    rows = [list(range(count)) for count in counts.tolist()]
    seen: list[int] = []

    def make(start: int, stop: int) -> list[Any]:
        seen.append(int(counts[start:stop].sum()))
        return rows[start:stop]

    answer = ContainsSceneResponse.made(bodies=wire.Series(500, make, offsets=offsets), boundary=[], accuracy=None)
    assert json.loads(wire.encode(answer)) == {"bodies": rows, "boundary": []}
    assert max(seen) <= wire.PART
    assert sum(seen) == offsets[-1]
