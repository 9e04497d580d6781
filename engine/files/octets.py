"""The bytes and the text of files, wherever they are; what goes wrong is said in words, with the name of the file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import IO, Any, TypeAlias

from engine.errors import InvalidInputError
from engine.solids.checks import shown

File: TypeAlias = str | os.PathLike[str] | IO[bytes] | bytes
"""A path, a file open for reading bytes, or the bytes."""


def read_octets(file: File) -> tuple[bytes, str]:
    """Return the bytes of a file, and the ending of its name in small letters, empty if it has none."""
    given: Any = file
    if isinstance(given, (bytes, bytearray, memoryview)):
        return bytes(given), ""
    if isinstance(given, (str, os.PathLike)):
        try:
            path = Path(given)
            return path.read_bytes(), path.suffix.lower().removeprefix(".")
        except OSError as error:
            raise InvalidInputError(f"{given}: {in_words(error)}", ("file",)) from None
        except ValueError as error:  # NUL, a lone surrogate
            raise InvalidInputError(f"{shown(str(given))} is no path: {error}", ("file",)) from None
    if not callable(getattr(given, "read", None)):
        raise InvalidInputError(f"file must be a path, open for reading bytes, or bytes, got {shown(given)}", ("file",))
    try:
        octets = given.read()
    except Exception as error:  # whatever a caller's object raises
        raise InvalidInputError(
            f"the file cannot be read: {type(error).__name__}: {error!s:.200}", ("file",)
        ) from error
    if not isinstance(octets, bytes):
        raise InvalidInputError(f"file must be open for reading bytes, it gives {type(octets).__name__}", ("file",))
    name = getattr(given, "name", "")
    return octets, Path(name).suffix.lower().removeprefix(".") if isinstance(name, str) else ""


def as_text(octets: bytes, name: str) -> str:
    """Return the text of bytes in UTF-8, with or without a byte order mark; name: of the file, for errors."""
    try:
        return octets.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInputError(
            f"{name}: byte {error.start} is no text in UTF-8; save the file as UTF-8, or name its format by its ending",
            ("file",),
        ) from None


def read_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a file in UTF-8."""
    return as_text(read_octets(path)[0], str(path))


def in_words(error: OSError) -> str:
    """Return what an operating system's error means, without its number."""
    words = {FileNotFoundError: "there is no such file", IsADirectoryError: "it is a folder, not a file"}
    words[PermissionError] = "it may not be read or written"
    return words.get(type(error), error.strerror or str(error))
