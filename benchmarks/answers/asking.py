"""Families of questions, cut into chunks that are drawn, asked and hashed each by itself: numbers by their bits in one
fixed layout, whatever type or machine they come from."""

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
"""Asked with `workers`, a number of them, returns how many questions it was and what goes into the hash."""
Drawn = Callable[[Draw], Iterator[Question]]


class Chunk(NamedTuple):
    """Some questions of a family; its name is all that they depend on."""

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
    """Return the answer, an error's name, place and message if it is refused."""
    try:
        return question(workers=workers)
    except engine.EngineError as error:
        return 1, [type(error).__name__, error.code, list(error.where), str(error)]


def family(operation: str, name: str, n_chunks: int, drawn: Drawn) -> None:
    """Enter a family of questions under its name."""
    for number in range(n_chunks):
        chunk = Chunk(operation, f"{name}/{number}", drawn)
        CHUNKS.setdefault(operation, {})[chunk.name] = chunk


def drawn_by(operation: str, n_chunks: int) -> Callable[[Drawn], Drawn]:
    """Enter a family of questions; its name is that of the function."""

    def enter(drawn: Drawn) -> Drawn:
        family(operation, drawn.__name__, n_chunks, drawn)
        return drawn

    return enter


def asker(ask: Callable[..., Any], names: str = "", accuracy: str = "decisions") -> Callable[..., tuple[int, Any]]:
    """Return what asks an operation about many items: these columns of its answer and of what it says of itself."""

    def asked(items: Any, *rest: Any, workers: int | None = None) -> tuple[int, Any]:
        found, said = ask(items, *rest, workers=workers, report=True)
        columns = [getattr(found, name) for name in names.split()] if names else [found]
        return len(items), columns + [getattr(said, name) for name in accuracy.split()]

    return asked


class OrderMattersError(Exception):
    """The same geometry, its faces or vertices named in another order, has another answer."""


def same(found: Any, expected: Any, what: str) -> Any:
    """Return `found` if it is as expected."""
    if digest(found) != digest(expected):
        raise OrderMattersError(f"{what} in another order: another answer")
    return found


_LAYOUTS = {"b": "<u1", "i": "<i8", "u": "<i8", "f": "<f8"}


def digest(value: Any) -> str:
    """Return 16 hexadecimal digits that stand for `value`."""
    found = hashlib.sha256()
    _feed(found, value)
    return found.hexdigest()[:16]


def joined(digests: Iterable[str]) -> str:
    """Return the SHA-256 over digests in their order."""
    return hashlib.sha256("".join(digests).encode()).hexdigest()


def _feed(found: Any, value: Any) -> None:
    match value:
        case Enum():
            _feed(found, value.value)
        case np.ndarray():
            _feed_array(found, value)
        case None | bool() | np.bool_():
            found.update(b"-" if value is None else b"T" if value else b"F")
        case int() | np.integer() | Fraction():
            found.update(
                f"n{int(value.numerator):x}/{int(value.denominator):x};".encode()
            )  # decimal digits are limited
        case float():
            found.update(b"f" + struct.pack("<d", value if value == value else float("nan")))
        case str() | bytes():
            text = value.encode() if isinstance(value, str) else value
            found.update(f"{type(value).__name__}{len(text)}:".encode() + text)
        case dict():
            _feed(found, sorted(value.items()))
        case list() | tuple():
            found.update(f"l{len(value)}:".encode())
            for item in value:
                _feed(found, item)
        case _:
            raise TypeError(f"no digest of {type(value).__name__}")


def _feed_array(found: Any, array: np.ndarray) -> None:
    fixed = np.ascontiguousarray(array, _LAYOUTS[array.dtype.kind])
    if array.dtype.kind == "f":
        fixed = np.where(np.isnan(fixed), np.float64("nan"), fixed)
    found.update(f"a{array.dtype.kind}{array.shape}".encode() + fixed.tobytes())
