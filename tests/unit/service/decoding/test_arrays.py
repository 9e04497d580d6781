"""The decoder of long arrays gives what the plain decoder gives, or nothing; never anything else."""

from __future__ import annotations

import json
import math
import random
import struct
import threading
import time
from typing import Any

import httpx
import numpy as np
import pytest

from service import wire
from service.decoding import arrays, numbers
from service.errors import ServiceError
from tests.unit.service.test_wire import texts


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrays, "LEAST", 8)
    monkeypatch.setattr(numbers, "PIECE", 40)


def plain(value: Any) -> Any:
    """Return `value` with lists of floats in the place of arrays, every number as the bits of its float."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return struct.pack("<d", value + 0.0) if abs(value) <= 2**53 or float(value) == value else value
    return value


def check(body: bytes) -> bool:
    """Assert that both decoders agree on `body`; return whether the fast one took it."""
    found = wire.decode_fast(bytearray(body))
    if found is None:
        return False
    assert plain(found) == plain(wire.decode(body)), body
    return True


def some_array(source: random.Random, depth: int) -> Any:
    """Return a nested list of numbers, mostly of one shape."""
    if depth == 0:
        return source.choice(
            [source.random(), source.random() * 1e300, source.randrange(-9, 9), source.randrange(2**54)]
        )
    lengths = [2, 3, 3, 3, 8] if depth < 3 else [1, 2, 20]
    length = source.choice(lengths)
    if source.random() < 0.9:
        shape = [length, *(source.choice([2, 3, 3]) for _ in range(depth - 1))]
        kind = source.choice([source.random, lambda: source.randrange(100), lambda: some_array(source, 0)])

        def uniform(axes: list[int]) -> Any:
            return kind() if not axes else [uniform(axes[1:]) for _ in range(axes[0])]

        return uniform(shape)
    return [some_array(source, depth - 1) for _ in range(length)]


def some_body(source: random.Random) -> bytes:
    document = {
        "solid": {"type": "x", "vertices": some_array(source, 2), "faces": some_array(source, 2), "name": 'a\\"[,]'},
        "points": some_array(source, source.choice([1, 2, 2, 3, 4])),
        "list": [{"rings": some_array(source, 3)}, 7, {"rings": some_rings(source, source.choice([3, 4]))}],
    }
    separators = source.choice([(",", ":"), (", ", ": "), (" ,\n ", " :\t")])
    return json.dumps(document, separators=separators, indent=source.choice([None, None, 1])).encode()


def test_it_agrees_with_the_plain_decoder() -> None:
    source = random.Random(3)
    taken = sum(check(some_body(source)) for _ in range(900))
    assert taken > 150


def some_rings(source: random.Random, depth: int) -> Any:
    """Return lists of rings, of polygons of rings at depth 4, of several lengths; now and then with a fault."""
    if depth > 2:
        return [some_rings(source, depth - 1) for _ in range(source.randrange(source.random() < 0.98, 6))]
    dimension = 2 if source.random() < 0.99 else 3
    number = source.choice([source.random, lambda: source.randrange(9), lambda: some_array(source, 0)])
    return [[number() for _ in range(dimension)] for _ in range(source.randrange(source.random() < 0.98, 7))]


def test_rings_of_several_lengths_are_those_of_the_plain_decoder(seed: str) -> None:
    source, taken = random.Random(f"rings {seed}"), 0
    for _ in range(3000):
        separators = source.choice([(",", ":"), (", ", ": "), (" ,\n ", " :\t")])
        document = {"rings": some_rings(source, source.choice([3, 3, 4])), "a": "[[[1,2]]]"}
        taken += check(json.dumps(document, separators=separators).encode())
    assert taken > 1500


@pytest.mark.parametrize(
    "text",
    [
        "[[[1,2],[3,4]],[[5,6],[7,8],[9,0]]]",
        "[[[1,2,3]],[[4,5,6],[7,8,9.5]]]",
        "[[[[1,2],[3,4]]],[[[5,6]],[[7,8],[9,1e-3]]]]",
        "[[[[1,2],[3,4]],[[1,2]]]]",
    ],
)
def test_rings_of_several_lengths_are_arrays(text: str) -> None:
    found = wire.decode_fast(f'{{"a":{text}}}'.encode())["a"]
    assert plain(found) == plain(json.loads(text))
    while isinstance(found, list):
        found = found[0]
    assert isinstance(found, np.ndarray)


def test_it_never_takes_what_is_no_json() -> None:
    source, taken = random.Random(4), 0
    for _ in range(2000):
        text = bytearray(some_body(source))
        for _ in range(source.choice([1, 1, 2])):
            at = source.randrange(len(text))
            piece = bytes(source.choice(b'[],{}":0123.-+eE tfn\\') for _ in range(source.randrange(3)))
            text[at : at + source.randrange(3)] = piece
        found = wire.decode_fast(text)
        if found is not None:
            taken += 1
            try:
                assert plain(found) == plain(wire.decode(text))
            except ServiceError:
                pytest.fail(f"took {bytes(text)!r}")
    assert taken > 30


def test_numbers_are_those_of_float() -> None:
    given = texts()
    found = wire.decode_fast(f'{{"a":[{",".join(given)}]}}'.encode())
    assert found["a"].tobytes() == np.array([float(text) for text in given]).tobytes()


@pytest.mark.parametrize(
    "text",
    [
        "[[1,2],[3,9007199254740993],[1.5,2]]",
        "[[1,2],[3,4,5],[6,7],[8]]",
        "[[1,2],[3],[4,5,6]]",
        "[[],[1],[2],[3],[4],[5]]",
        "[[1],[],[2],[3],[4],[5],[6],[7],[8],[9],[10],[11],[],[12,13]]",
        "[[[1],[]],[[2],[3]],[[],[4]]]",
        "[[[],[1]],[[],[]]]",
        "[[[1,2],[3,4]],[[5,6]],[[7,8],[1,1],[2,2]]]",
        "[[1,2],[3,true],[4,5],[4,5]]",
        '[[1,2],[3,"4"],[4,5],[4,5]]',
        "[[1,2],[3,[4]],[4,5],[4,5]]",
        "[[1,2],[[],3,4],[4,5],[4,5]]",
        "[[1,2],[3,4],null,[4,5],[4,5]]",
        "[[1,2],[3,4],[1e400,1],[4,5]]",
        "[[1,2],[3,4],[18446744073709551616,1],[4,5]]",
        "[[1,2],[3,4]]3,[[4,5]]",
        "[[1,2],3[,4],[5,6],[7,8]]",
        "[[1,2],[3,4],[5,6],[7,-1000000000000000001]]",
        "[[1,2],[3,4],[5,6],[7,8]],[9]",
    ],
)
def test_what_does_not_fit_is_left_to_the_other(text: str) -> None:
    try:
        check(f'{{"a":{text}}}'.encode())
        check(f'{{"b": "c", "a":{text},"d":"e"}}'.encode())
    except ServiceError:
        pytest.fail("took what is no JSON")


def test_marks_in_the_text_fool_nobody() -> None:
    mark = str(arrays._MARK - 1)
    for text in (
        f'{{"b":{mark},"a":[1,2,3,4,5,6]}}',
        f'{{"a":[1,2,3,4,5,6],"b":[{mark}]}}',
        f'{{"b":"\\":[1,2,3,4,5,6],\\"{mark}"}}',
    ):
        assert not check(text.encode()) or wire.decode_fast(text.encode())["b"] == json.loads(text)["b"]


def test_other_threads_are_not_held_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers, "PIECE", 2**17)
    body = wire.encode({"points": np.random.default_rng(0).random((300_000, 3))})
    assert any(is_shared(body) for _ in range(10))  # a busy machine may keep the watcher waiting by itself


def is_shared(body: bytes) -> bool:
    """Tell whether another thread had its turns while a body was decoded."""
    gaps: list[float] = []
    done = threading.Event()

    def watch() -> None:
        last = time.perf_counter()
        while not done.is_set():
            time.sleep(0.0005)
            gaps.append(time.perf_counter() - last)
            last = time.perf_counter()

    watcher = threading.Thread(target=watch)
    watcher.start()
    before = time.perf_counter()
    wire.decode_fast(body)
    took = time.perf_counter() - before
    done.set()
    watcher.join()
    return len(gaps) > 5 and sorted(gaps)[len(gaps) // 2] < took / 4


def _round(n: int, at: float, size: float) -> list[list[float]]:
    return [[at + size * math.cos(math.tau * i / n), size * math.sin(math.tau * i / n)] for i in range(n)]


RINGS = [_round(3 + i % 7, i, 0.4) for i in range(60)]
NESTED = [_round(60, 0, 4), _round(40, 0, 3), _round(20, 0, 2)]
POLYGON = {"type": "polygon", "rings": NESTED}
FEATURES = {
    "type": "FeatureCollection",
    "features": [
        {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": NESTED}},
        {
            "type": "Feature",
            "properties": {},
            "geometry": {"type": "MultiPolygon", "coordinates": [[r] for r in RINGS]},
        },
    ],
}
BOX = {"type": "aabb", "min": [0, 0], "max": [30, 1]}


@pytest.mark.parametrize(
    ("path", "question"),
    [
        ("clip/polygons", {"region": BOX, "polygons": [[ring] for ring in RINGS]}),
        ("clip/polygons", {"region": BOX, "polygons": [[ring] for ring in RINGS] + [[[[1, 2, 3]]]]}),
        ("clip/polygons", {"region": BOX, "polygons": [RINGS, [[[1e400, 2]]]]}),
        ("clip/polygons", {"region": BOX, "polygons": [RINGS, [[[2**53 + 1, 2]]]]}),
        ("clip/lines", {"region": BOX, "lines": RINGS}),
        ("clip/lines", {"region": BOX, "lines": [*RINGS, [[1, 1]]]}),
        ("contains", {"solid": {**POLYGON, "rings": NESTED[:1]}, "points": [[1, 1]]}),
        ("contains", {"solid": POLYGON, "points": [[1, 1], [0, 2.5]]}),
        ("contains", {"solid": {"type": "polyhedron", "vertices": NESTED, "faces": RINGS}, "points": [[1, 1, 1]]}),
        ("overlay", {"subject": POLYGON, "clip": BOX, "operation": "union"}),
        ("overlay", {"subject": POLYGON, "clip": {**POLYGON, "rings": RINGS}, "operation": "union"}),
        ("layers/overlay", {"subject": FEATURES, "clip": FEATURES, "operation": "intersection"}),
        ("layers/dissolve", {"layer": FEATURES}),
    ],
)
async def test_answers_are_those_to_short_texts(
    client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch, path: str, question: dict[str, Any]
) -> None:
    text = json.dumps(question).replace("Infinity", "1e400")
    headers = {"Content-Type": "application/json"}
    taken = await client.post(f"/v1/{path}", content=text, headers=headers)
    monkeypatch.setattr(arrays, "LEAST", 2**30)
    plainly = await client.post(f"/v1/{path}", content=text, headers=headers)
    answers = [{**answer.json(), "request_id": "", "instance": ""} for answer in (taken, plainly)]
    assert answers[0] == answers[1]
    assert taken.status_code == plainly.status_code != 500


def test_what_is_held_beside_arrays_is_counted() -> None:
    numbers_ = ",".join(["0"] * 40)
    small = ",".join(f'{{"{k}": []}}' for k in range(1000))
    taken: list[int] = []
    assert wire.decode_fast(f'{{"a": [{numbers_}], "b": [{small}]}}'.encode(), taken.append) is not None
    assert sum(taken) > 1000 * (800 + 100)
    taken.clear()
    assert wire.decode_fast(f'{{"a": [{numbers_}], "b": [{small}, nil]}}'.encode(), taken.append) is None
    assert sum(taken) == 0
    assert len(taken) > 0


def test_rows_without_numbers_are_no_array() -> None:
    """Twenty million of them, in 60 MB, became as many arrays."""
    for item in ("[]", "[[]]", "[[],[]]"):
        assert wire.decode_fast(f'{{"a": [{",".join([item] * 100)}]}}'.encode()) is None


def test_the_deadline_is_seen_between_pieces() -> None:
    body = f'{{"a": [{",".join(["[1,2]"] * 1000)}]}}'.encode()
    polled: list[int] = []
    wire.decode_fast(body, poll=lambda: polled.append(1))
    assert len(polled) > 50


@pytest.mark.parametrize("opening", [b"[", b"[ ", b"[[0],"])
def test_what_is_nested_too_deeply_ends_at_once(opening: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each level was searched through to its end, a thousand of them: 13 s for 200 kB, or RecursionError."""
    monkeypatch.setattr(numbers, "PIECE", 2**16)
    for n in (34_000, 100_000):
        body = b'{"points":' + opening * n + b"]" * n + b"}"
        before = time.monotonic()
        assert wire.decode_fast(body) is None
        with pytest.raises(ServiceError, match=r"recursion limit|longer than"):
            wire.decode(body)
        assert time.monotonic() - before < 1.0
