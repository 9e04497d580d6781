"""The text of a value is the one that `json` writes, made in short steps; equal values have equal keys."""

from __future__ import annotations

import json
import random
from typing import Any

import numpy as np
import pytest

from engine.errors import CancelledError
from engine.layers import json_text
from engine.layers.json_text import NotJsonError, key_of, text_of
from engine.running.budget import Budget, Cancel

SCALARS = [None, True, 0, 1, -1.5e300, 2**70, 0.1, "", "é", 'a"b\n', 3.0]


def some_value(source: random.Random, depth: int) -> Any:
    if depth == 0 or source.random() < 0.3:
        return source.choice(SCALARS)
    items = [some_value(source, depth - 1) for _ in range(source.choice([0, 1, 2, 3, 8]))]
    return items if source.random() < 0.5 else {f"n{i}é": item for i, item in enumerate(items)}


@pytest.mark.parametrize("few", [1, 2, 3, 10, 256])
def test_the_text_is_that_of_json(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(json_text, "_FEW", few)
    source = random.Random(few)
    for _ in range(1000):
        value = some_value(source, 5)
        assert text_of(value) == json.dumps(value, separators=(",", ":"), ensure_ascii=False).encode()
    assert text_of({"a": np.arange(3), "b": np.float64(0.5)}) == b'{"a":[0,1,2],"b":0.5}'
    for array in (np.arange(1000), np.arange(1000.0).reshape(2, 500), np.arange(600).reshape(300, 2), np.array(2.5)):
        assert json.loads(text_of({"a": array})) == {"a": array.tolist()}
        assert key_of({"a": array}) == key_of({"a": array.tolist()}) != key_of({"a": [array.tolist()]})
    assert text_of("\ud800") == b'"\\ud800"'
    for value in ("x" * 300_000, ["é" * 300_000, 1], {"x" * 300_000: "y" * 300_000}):
        assert text_of(value) == json.dumps(value, separators=(",", ":"), ensure_ascii=False).encode()


@pytest.mark.parametrize("few", [1, 3, 256])
def test_what_json_cannot_hold_is_found(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(json_text, "_FEW", few)
    source = random.Random(few)
    n_found = 0
    for _ in range(1000):
        value = inner = [some_value(source, 5)]
        path: list[Any] = []
        while isinstance(inner, (list, dict)) and inner:
            path.append(source.choice(list(inner) if isinstance(inner, dict) else range(len(inner))))
            inner, outer = inner[path[-1]], inner
        outer[path[-1]] = wrong = source.choice([float("nan"), float("-inf"), {1}])
        with pytest.raises(NotJsonError) as caught:
            text_of(value)
        assert caught.value.path == tuple(path)
        assert caught.value.is_number == isinstance(wrong, float)
        n_found += 1
    assert n_found == 1000
    with pytest.raises(NotJsonError) as caught:
        text_of([np.zeros(3), np.where(np.arange(1200) == 700, np.inf, 0.0).reshape(2, 600)])
    assert caught.value.path == (1, 1, 100)


def test_what_has_no_end_is_refused() -> None:
    endless: list[Any] = []
    endless.append(endless)
    for value in (endless, [1, {"a": endless}], 10**5000):
        with pytest.raises(NotJsonError):
            text_of(value)


def test_a_long_value_ends_with_its_budget() -> None:
    cancel = Cancel()
    cancel.set()
    with Budget(None, cancel), pytest.raises(CancelledError):
        text_of({"a": [[1, {"b": 2}]] * 1000})


def test_numbers_are_compared_by_their_exact_value() -> None:
    alike = [
        (1, 1.0), (0.0, -0.0), (2**70, float(2**70)), (1e300, int(1e300)), ([1], (1.0,)), (np.arange(2), [0, 1]),
        ({"a": 1, "b": [2.0]}, {"b": [2], "a": 1.0}), (np.float64(0.5), 0.5), (np.True_, True),
    ]  # fmt: skip
    for one, other in alike:
        assert key_of(one) == key_of(other)
    others = [
        1,
        True,
        "1",
        [1],
        [[1]],
        {"1": 1},
        None,
        "null",
        [],
        {},
        "",
        2**70,
        2**70 + 1,
        0.1,
        [1, 2],
        [2, 1],
        False,
        0,
    ]
    assert len({key_of(value) for value in others}) == len(others)
    for value in ({1: 2}, {1}, b"x"):
        with pytest.raises(TypeError):
            key_of(value)
