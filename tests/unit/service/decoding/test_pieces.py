"""Text parsed in pieces stands for what the parser makes of it whole, and is refused where that refuses it."""

from __future__ import annotations

import json
import random
import re
from typing import Any

import jiter
import pytest

from service.decoding import pieces
from service.decoding.pieces import NotJson

WORDS = ["", "a", ",", '"', "\\", '\\",', "[", "]}", "{", "é", "\n", '","', "\\\\", "\x00", "a" * 90]
BYTES = [b",", b'"', b"\\", b"[", b"]", b"{", b"}", b":", b" ", b"\n", b"0", b"\xff", b""]


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "PIECE", 16)
    monkeypatch.setattr(pieces, "LONGEST", 2**10)


def some_value(source: random.Random, depth: int) -> Any:
    if depth == 0 or source.random() < 0.3:
        return source.choice([None, True, 0, -1.5e300, 2**70, source.random(), *WORDS])
    items = [some_value(source, depth - 1) for _ in range(source.randrange(6))]
    return items if source.random() < 0.6 else {source.choice(WORDS) + str(i): item for i, item in enumerate(items)}


def whole(text: bytes) -> Any:
    """Return what the parser makes of the text at once, its refusal as a str's words."""
    try:
        return repr(jiter.from_json(text, catch_duplicate_keys=True))
    except ValueError as error:
        return error


def in_pieces(text: bytes) -> Any:
    try:
        return repr(pieces.decode(text))
    except NotJson as error:
        return error


def texts(source: random.Random, n: int) -> list[bytes]:
    separators = [(",", ":"), (", ", ": "), (" ,\n ", " :\t")]
    return [
        json.dumps(
            some_value(source, source.randrange(1, 7)),
            separators=source.choice(separators),
            ensure_ascii=source.random() < 0.5,
            indent=source.choice([None, None, 1]),
        ).encode()
        for _ in range(n)
    ]


def test_the_value_is_that_of_the_whole_text(seed: str) -> None:
    for text in texts(random.Random(f"pieces {seed}"), 4000):
        assert in_pieces(text) == whole(text), text


def test_what_the_parser_refuses_is_refused(seed: str) -> None:
    source = random.Random(f"refused {seed}")
    n_refused = 0
    for text in texts(source, 6000):
        at = source.randrange(len(text) + 1)
        spoilt = text[:at] + source.choice(BYTES) + text[at + source.randrange(2) :]
        expected, found = whole(spoilt), in_pieces(spoilt)
        assert isinstance(found, NotJson) == isinstance(expected, ValueError), spoilt
        if isinstance(expected, str):
            assert found == expected, spoilt
        n_refused += isinstance(expected, ValueError)
    assert n_refused > 2000


def test_the_place_of_a_mistake_is_that_in_the_whole_text() -> None:
    rows = [b"[1, 2.5]"] * 50
    for i_row, line_break in ((0, b" "), (20, b" "), (49, b" "), (7, b"\n"), (31, b"\n")):
        spoilt = rows.copy()
        spoilt[i_row] = b"[1, nil]"
        text = b'{"points": [' + (b"," + line_break).join(spoilt) + b"]}"
        assert str(in_pieces(text)) == str(whole(text))


@pytest.mark.parametrize(
    "text",
    [
        b"[" + b"1," * 50 + b"]",
        b"[" + b"1," * 50 + b",2]",
        b"[[" + b" " * 30 + b",[1,2,3]]]",
        b"[1,2,3,4,5,6,7,8,9],[1,2,3,4,5,6,7,8,9]",
        b'{"a":[1,2,3,4,5,6,7,8,9],"b":1,"c":2,"a":3}',
        b'{"a":' + b" " * 20 + b',"b":1,"c":[1,2,3]}',
        b"[" * 150 + b"1,2" + b"]" * 150 + b",3",
        b"[" * 250 + b"1,2,3,4,5,6,7" + b"]" * 250,
        b"[1,2,3,4,5,6,7,8,9,10",
        b'["' + b"a," * 30,
    ],
)
def test_no_cut_hides_a_mistake(text: bytes) -> None:
    assert isinstance(whole(text), ValueError)
    assert isinstance(in_pieces(text), NotJson)


@pytest.mark.parametrize(
    "token", [b'"' + b"a" * 3000 + b'"', b"1" * 3000, b" " * 3000 + b"1", b'{"' + b"a" * 3000 + b'":1}']
)
def test_what_cannot_be_cut_is_refused_beyond_a_length(token: bytes) -> None:
    text = b"[1,2,3,4,5,6,7,8,9," + token + b",1]"
    assert re.search(r"longer than 1024 bytes.*at byte 18$", str(in_pieces(text)))


def test_it_ends_where_it_is_told_to() -> None:
    polled = []

    def poll() -> None:
        polled.append(1)
        if len(polled) == 3:
            raise TimeoutError

    with pytest.raises(TimeoutError):
        pieces.decode(b"[" + b"1," * 1000 + b"1]", poll)


def many(n: int, value: str = "0", first: int = 0) -> str:
    return ",".join(f'"{k}": {value}' for k in range(first, first + n))


@pytest.mark.parametrize("size", [2**4, 2**16])
def test_objects_of_too_many_names_are_refused(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "PIECE", size)
    monkeypatch.setattr(pieces, "LONGEST", 2**20)
    monkeypatch.setattr(pieces, "NAMES", 100)
    few, more = many(100), many(101)
    for text in (f"{{{few}}}", f'[{{{few}}}, {{"a": {{{few}}}}}]', f'{{"x": [{{{few}}}], {many(99, "{}")}}}'):
        assert in_pieces(text.encode()) == whole(text.encode())
    for text in (f"{{{more}}}", f'[1, {{"a": [{{{more}}}]}}]', f'{{"x": {{{few}}}, {many(100, "[1]")}}}'):
        assert re.match(r"an object has more than 100 names at line 1 column \d+", str(in_pieces(text.encode())))


@pytest.mark.parametrize("size", [2**4, 2**16])
@pytest.mark.parametrize("letter", ["a", "é", '\\"', "\\\\", "\\u0041", "😀"])
def test_names_that_are_too_long_are_refused(size: int, letter: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "PIECE", size)
    monkeypatch.setattr(pieces, "LONGEST", 2**20)
    for before in ("", '"x": ["', '"x": "y", '):
        after = '"]' * before.endswith('["')
        before = before.replace('["', '["' + "z" * 3000) + after + ", " * before.endswith('["')
        text = f'[{{{before}"{letter * 1024}": 0}}]'.encode()
        assert in_pieces(text) == whole(text)
        text = f'[{{{before}"{letter * 1025}": [1,2]}}]'.encode()
        assert "has more than 1024 letters at line 1" in str(in_pieces(text))
    text = f'{{"a": "{letter * 5000}", "b": ["{letter * 5000}"]}}'.encode()
    assert in_pieces(text) == whole(text)


def test_a_long_value_is_emptied() -> None:
    inner: dict[str, Any] = {"b": [[1, [{}]]] * 3}
    value: Any = {"a": [inner, [[0, 0]] * 20_000, "text"], "c": 1}
    listed = value["a"]
    pieces.free_in_steps(value)
    assert (value, listed, inner) == ({}, [], {})
    pieces.free_in_steps(None)


def test_brackets_that_stay_open_are_those_that_pairs_leave() -> None:
    source = random.Random(7)
    for _ in range(2000):
        text = opened = "".join(source.choice("[{") for _ in range(source.randrange(30)))
        for _ in range(source.randrange(30)):
            if opened and source.random() < 0.6:
                text, opened = text + {"[": "]", "{": "}"}[opened[-1]], opened[:-1]
            else:
                more = source.choice("[{")
                text, opened = text + more, opened + more
        assert pieces._still_open(text.encode()) == opened.encode()
