"""The decoder of long arrays gives what the plain decoder gives, or nothing; never anything else."""

from __future__ import annotations

import json
import random
import struct
import threading
import time
from typing import Any

import numpy as np
import pytest

from service import json_arrays, wire
from service.errors import ServiceError
from tests.unit.service.test_wire import texts


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(json_arrays, "LEAST", 8)
    monkeypatch.setattr(json_arrays, "PIECE", 40)


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
        "list": [{"rings": some_array(source, 3)}, 7, None],
    }
    separators = source.choice([(",", ":"), (", ", ": "), (" ,\n ", " :\t")])
    return json.dumps(document, separators=separators, indent=source.choice([None, None, 1])).encode()


def test_it_agrees_with_the_plain_decoder() -> None:
    source = random.Random(3)
    taken = sum(check(some_body(source)) for _ in range(600))
    assert taken > 150


def test_it_never_takes_what_is_no_json() -> None:
    source, taken = random.Random(4), 0
    for _ in range(6000):
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
    assert taken > 100


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
    mark = str(json_arrays._MARK - 1)
    for text in (
        f'{{"b":{mark},"a":[1,2,3,4,5,6]}}',
        f'{{"a":[1,2,3,4,5,6],"b":[{mark}]}}',
        f'{{"b":"\\":[1,2,3,4,5,6],\\"{mark}"}}',
    ):
        assert not check(text.encode()) or wire.decode_fast(text.encode())["b"] == json.loads(text)["b"]


def test_other_threads_are_not_held_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(json_arrays, "PIECE", 2**17)
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
