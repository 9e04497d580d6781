"""Families of questions, cut into chunks that are drawn, run and hashed separately: numbers by their bits in one fixed
layout, whatever type or machine they come from."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Iterable, Iterator
from enum import Enum
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

import engine
from benchmarks.answers.draws import Draw

Question = Callable[..., tuple[int, Any]]
"""Called with `workers`, returns the number of questions and the values to hash."""
Drawn = Callable[[Draw], Iterator[Question]]


class Chunk(NamedTuple):
    """Some questions of a family; they depend on its name only."""

    operation: str
    name: str
    drawn: Drawn

    def asked(self, workers: int | None = None) -> tuple[int, str]:
        """Return how many questions there are and the digest of the answers."""
        n_questions, answers = 0, []
        with np.errstate(over="ignore", invalid="ignore", under="ignore"):
            for question in self.drawn(Draw(f"{self.operation}/{self.name}")):
                n, answer = answered(question, workers)
                n_questions += n
                answers.append(answer)
        return n_questions, digest(answers)

    @property
    def tenth(self) -> int:
        """Which tenth of its operation's chunks this one is in."""
        return (
            sorted(CHUNKS[self.operation], key=lambda name: hashlib.sha256(name.encode()).digest()).index(self.name)
            % 10
        )


CHUNKS: dict[str, dict[str, Chunk]] = {}
"""By operation and name, in the order of the table."""


def answered(question: Question, workers: int | None) -> tuple[int, Any]:
    """Return the answer, or an error's name, place and message."""
    try:
        return question(workers=workers)
    except engine.EngineError as error:
        return 1, [type(error).__name__, error.code, list(error.where), str(error)]


def family(operation: str, name: str, n_chunks: int, drawn: Drawn) -> None:
    """Register a family of questions under its name."""
    for number in range(n_chunks):
        chunk = Chunk(operation, f"{name}/{number}", drawn)
        CHUNKS.setdefault(operation, {})[chunk.name] = chunk


def drawn_by(operation: str, n_chunks: int) -> Callable[[Drawn], Drawn]:
    """Register a family of questions under the name of the function."""

    def enter(drawn: Drawn) -> Drawn:
        family(operation, drawn.__name__, n_chunks, drawn)
        return drawn

    return enter


def asker(ask: Callable[..., Any], names: str = "", accuracy: str = "decisions") -> Callable[..., tuple[int, Any]]:
    """Return a function that runs an operation on many items and returns these columns of answer and report."""

    def asked(items: Any, *rest: Any, workers: int | None = None) -> tuple[int, Any]:
        result, said = ask(items, *rest, workers=workers, report=True)
        columns = [getattr(result, name) for name in names.split()] if names else [result]
        return len(items), columns + [getattr(said, name) for name in accuracy.split()]

    return asked


class OrderMattersError(Exception):
    """The same geometry with faces or vertices in another order has another answer."""


def same(result: Any, expected: Any, what: str) -> Any:
    """Return `result` if it equals `expected`; raise otherwise."""
    if digest(result) != digest(expected):
        raise OrderMattersError(f"{what} in another order: another answer")
    return result


_LAYOUTS = {"b": "<u1", "i": "<i8", "u": "<i8", "f": "<f8"}


def digest(value: Any) -> str:
    """Return 16 hexadecimal digits that stand for `value`."""
    result = hashlib.sha256()
    _feed(result, value)
    return result.hexdigest()[:16]


def joined(digests: Iterable[str]) -> str:
    """Return the SHA-256 over digests in their order."""
    return hashlib.sha256("".join(digests).encode()).hexdigest()


def _feed(result: Any, value: Any) -> None:
    match value:
        case Enum():
            _feed(result, value.value)
        case np.ndarray():
            _feed_array(result, value)
        case None | bool() | np.bool_():
            result.update(b"-" if value is None else b"T" if value else b"F")
        case int() | np.integer() | Fraction():
            result.update(
                f"n{int(value.numerator):x}/{int(value.denominator):x};".encode()
            )  # decimal digits are limited
        case float():
            result.update(b"f" + struct.pack("<d", value if value == value else float("nan")))
        case str() | bytes():
            text = value.encode() if isinstance(value, str) else value
            result.update(f"{type(value).__name__}{len(text)}:".encode() + text)
        case dict():
            _feed(result, sorted(value.items()))
        case list() | tuple():
            result.update(f"l{len(value)}:".encode())
            for item in value:
                _feed(result, item)
        case _:
            raise TypeError(f"no digest of {type(value).__name__}")


def _feed_array(result: Any, array: np.ndarray) -> None:
    fixed = np.ascontiguousarray(array, _LAYOUTS[array.dtype.kind])
    if array.dtype.kind == "f":
        fixed = np.where(np.isnan(fixed), np.float64("nan"), fixed)
    result.update(f"a{array.dtype.kind}{array.shape}".encode() + fixed.tobytes())
