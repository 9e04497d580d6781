"""Decodes JSON text into Python values piece by piece, so that no other thread waits long and deadlines hold.

jiter, pydantic's own parser, holds the interpreter's lock while it parses: half a second for 30 MB. A long text is cut
before commas that stand outside strings. A piece is made whole by the brackets that are open before it and after it,
and parsed; what it adds goes into the lists and objects that are open still. So ``{"a":[1,2],"b":[3,4]}``, cut before
its second comma, is read as ``{"a":[1,2]}`` and ``{MARK:0,"b":[3,4]}``.

One name, text or number is never cut, and refused beyond `LONGEST`; so are objects of more than `NAMES` names, and
names of more than `LONGEST_NAME` characters.
"""

from __future__ import annotations

import mmap
import re
import secrets
from collections.abc import Callable
from typing import Any, Final

import jiter
import numpy as np

Body = bytes | bytearray | mmap.mmap

PIECE: Final = 2**16
"""Bytes per piece: a millisecond."""
LONGEST: Final = 2**20
"""Largest number of bytes without a comma outside strings."""

NAMES: Final = 4096
"""Largest number of names in one object: more than a table has columns (PostgreSQL 1,600, SQLite 2,000), few enough for
one millisecond."""
LONGEST_NAME: Final = 1024
"""Largest number of characters of a name: databases take 64 to 128, and each feature of an answer repeats its names."""
_COSTS: Final = {b"{": 800, b"[": 100, b":": 64, b",": 32, b'"': 16}
"""Bytes of an object with its model, a list, an entry of an object, a number; and of a text, per two quotes, besides
its letters."""
_STEP: Final = 2**20
"""Bytes searched per step: some milliseconds."""
_FREED: Final = 2**12
"""Items freed per step: some tenths of a millisecond."""
_FLAT: Final = frozenset({str, int, float, bool, type(None)})
_PLACE: Final = re.compile(r"(.*) at line (\d+) column (\d+)", re.DOTALL)
_MARK: Final = secrets.token_hex(16)
"""Name, within a piece, of a value that an earlier piece began: no body has it by intent."""
_NO_BRACKETS: Final = bytes(set(range(256)) - set(b"[]{}"))


class NotJson(ValueError):
    """The text is not accepted as JSON; says what and where."""


def decode(text: Body, poll: Callable[[], object] = lambda: None) -> Any:
    """Return the value of `text`; a name that occurs twice in an object is an error.

    poll: called between pieces; what it raises ends the work. Raises: NotJson.
    """
    pieces = _Pieces()
    start = 0
    while True:  # bound: each piece takes a byte at least, and the last one all that is left
        stop, brackets = _cut(text, start)
        piece = bytes(memoryview(text)[start:stop])
        if stop == len(text):
            return pieces.last(piece)
        pieces.add(piece, brackets)
        start = stop
        poll()


def cost_of(text: Body) -> int:
    """Return an upper bound on the bytes that decoding needs beyond those counted for each byte.

    Short lists and objects need far more than their text.
    """
    counts = dict.fromkeys(_COSTS, 0)
    for start in range(0, len(text), _STEP):
        part = text[start : start + _STEP]
        for mark in counts:
            counts[mark] += part.count(mark)
    return max(0, sum(cost * counts[mark] for mark, cost in _COSTS.items()) - 2 * len(text))


def free_in_steps(value: Any) -> None:
    """Empty a decoded value in steps: freeing millions of lists or texts at once blocks all other threads."""
    waiting = [value]
    while waiting:  # bound: each container is emptied once
        container = waiting.pop()
        if isinstance(container, dict):
            waiting += filter(_is_deep, container.values())
            container.clear()
        while isinstance(container, list) and container:  # bound: each turn takes an item at least
            waiting += filter(_is_deep, container[-_FREED:])
            del container[-_FREED:]


def _is_deep(value: Any) -> bool:
    """Return whether a value may be too large to be freed in one step."""
    if type(value) is list:
        return len(value) > _FREED or not _FLAT.issuperset(map(type, value))
    return type(value) is dict and not _FLAT.issuperset(map(type, value.values()))


def _cut(text: Body, start: int) -> tuple[int, bytes]:
    """Return a possible end of a piece, before a comma or with the text, and the brackets in it outside strings."""
    size = PIECE
    while start + size < len(text):  # bound: it doubles, up to `LONGEST`
        piece = _without_strings(bytes(memoryview(text)[start : start + size]))
        stop = piece.rfind(b",")
        if stop > 0:
            return start + stop, piece[:stop].translate(None, _NO_BRACKETS)
        size *= 2
        if size > LONGEST:
            raise NotJson(f"a name, text or number is longer than {LONGEST} bytes, or so many spaces, at byte {start}")
    return len(text), b""


def _still_open(brackets: bytes) -> bytes:
    """Return the unclosed brackets; the parser checks that kinds match."""
    codes = np.frombuffer(brackets, np.uint8)
    opens = codes & 2 > 0
    depths = np.cumsum(2 * opens.astype(np.int64) - 1)
    lowest_after = np.minimum.accumulate(depths[::-1])[::-1]
    return codes[opens & (lowest_after >= depths)].tobytes()


def _without_strings(piece: bytes) -> bytes:
    """Return a piece that begins outside of strings, with blanks for the content of strings."""
    if b'"' not in piece:
        return piece
    codes = np.frombuffer(piece.replace(rb"\\", b"__").replace(rb"\"", b"__"), np.uint8)
    inside = np.add.accumulate(codes == ord('"'), dtype=np.uint8) & 1  # 256 quotes are as even as none
    return (codes * (1 - inside)).tobytes()


def _may_have_long_name(piece: bytes) -> bool:
    """Return whether more than `LONGEST_NAME` bytes follow each other without a quote; False only if no name is longer.

    An escaped quote is none; nor is one after an escaped backslash, which makes this True more often.
    """
    if len(piece) <= LONGEST_NAME or b'"' not in piece:
        return False
    if b"\\" in piece:
        piece = piece.replace(rb"\"", b"__")
    start = 0
    while start + LONGEST_NAME < len(piece):  # bound: each turn goes on by a byte at least
        quote = piece.rfind(b'"', start, start + LONGEST_NAME + 1)
        if quote < 0:
            return True
        start = quote + 1
    return False


class _Pieces:
    """The value of the pieces so far, and the lists and objects open at their end."""

    def __init__(self) -> None:
        self._open: list[Any] = []  # lists and objects, from the outermost in
        self._brackets = b""  # theirs
        self._line, self._column = 1, 0  # of the text so far: which line it ends in, and after how many bytes of it

    def add(self, piece: bytes, brackets: bytes) -> None:
        """Add a piece that is not the last; brackets: those in it outside strings."""
        opened = _still_open(self._brackets + brackets)
        if not opened:
            piece += b","  # case: the text goes on after its value, which the parser refuses
        elif piece.rstrip()[-1:] in (b"[", b"{"):
            raise self._wrong(f"expected value at line 1 column {len(piece) + 1}", piece, 0)
        value = self._parsed(piece, bytes(bracket + 2 for bracket in reversed(opened)))
        root = self._joined(value, piece)
        self._open = [root]
        for _ in opened[1:]:
            inmost = self._open[-1]
            self._open.append(inmost[-1] if isinstance(inmost, list) else next(reversed(inmost.values())))
        self._brackets = opened
        self._go_past(piece)

    def last(self, piece: bytes) -> Any:
        """Return the value of the text that ends with `piece`."""
        return self._joined(self._parsed(piece, b""), piece)

    def _parsed(self, piece: bytes, closing: bytes) -> Any:
        begun = b"".join(b"[" if bracket == ord("[") else b'{"%b":' % _MARK.encode() for bracket in self._brackets)
        begun += b"0" if begun else b""
        try:
            value = jiter.from_json(begun + piece + closing, cache_mode="keys", catch_duplicate_keys=True)
        except ValueError as error:
            raise self._wrong(str(error), piece, len(begun)) from None
        if piece.count(b":") > NAMES or _may_have_long_name(piece):
            self._check_names([value], piece)
        return value

    def _check_names(self, value: Any, piece: bytes) -> None:
        """Raise if an object within a piece has too many names, or one that is too long; depth: at most 200."""
        if isinstance(value, dict):
            if len(value) > NAMES:
                raise self._wrong(f"an object has more than {NAMES} names at line 1 column 1", piece, 0)
            for name in value:
                if len(name) > LONGEST_NAME:
                    message = f"the name {name:.20}... has more than {LONGEST_NAME} letters at line 1 column 1"
                    raise self._wrong(message, piece, 0)
            value = value.values()
        for item in value:
            if isinstance(item, (dict, list)):
                self._check_names(item, piece)

    def _joined(self, value: Any, piece: bytes) -> Any:
        """Merge the value of a piece into the open lists and objects, and return the outermost."""
        if not self._open:
            return value
        part = value
        for container in self._open:
            if isinstance(container, list):
                inner = part[0]
                del part[0]
                container += part
            else:
                inner = part.pop(_MARK)
                if twice := container.keys() & part.keys():
                    message = f"Detected duplicate key {min(twice)!r:.100} at line 1 column 1"
                    raise self._wrong(message, piece, 0)
                container |= part
                if len(container) > NAMES:
                    raise self._wrong(f"an object has more than {NAMES} names at line 1 column 1", piece, 0)
            part = inner
        return self._open[0]

    def _wrong(self, message: str, piece: bytes, n_before: int) -> NotJson:
        """Return the error for the parser's `message` about a piece, before which `n_before` bytes were put."""
        place = _PLACE.fullmatch(message)
        if place is None:
            return NotJson(message)
        what, line, column = place[1], int(place[2]), int(place[3])
        if line == 1:
            column = max(0, min(column - n_before, len(piece) + 1)) + self._column
        return NotJson(f"{what} at line {self._line + line - 1} column {column}")

    def _go_past(self, piece: bytes) -> None:
        n_lines = piece.count(b"\n")
        self._line += n_lines
        self._column = len(piece) - piece.rfind(b"\n") - 1 if n_lines else self._column + len(piece)
