"""Which chunks to ask, and the digests that stand in the repository."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.answers import clipping, collision, containment, overlays, refusals, wire  # noqa: F401 (families)
from benchmarks.answers.asking import CHUNKS, Chunk
from benchmarks.answers.digest import joined

STORED = Path(__file__).resolve().parent / "answers.json"


class Row(NamedTuple):
    """A chunk that was asked."""

    operation: str
    name: str
    n_questions: int
    digest: str


def chosen(tenth: int | None = None, only: str = "") -> list[Chunk]:
    """Return the chunks of a tenth, or all, whose operation/family/number contains `only`."""
    found = [chunk for chunks in CHUNKS.values() for chunk in chunks.values()]
    return [
        chunk for chunk in found
        if only in f"{chunk.operation}/{chunk.name}" and (tenth is None or chunk.tenth == tenth)
    ]  # fmt: skip


def asked(chunks: Iterable[Chunk], workers: int | None = None) -> list[Row]:
    """Ask chunks one after another."""
    return [Row(chunk.operation, chunk.name, *chunk.asked(workers)) for chunk in chunks]


def load() -> dict[str, Any]:
    """Return what is stored: for each operation the number of questions, the SHA-256, and each chunk's digest."""
    return json.loads(STORED.read_text("utf-8"))  # type: ignore[no-any-return]


def store(rows: Sequence[Row]) -> None:
    """Write all rows."""
    table: dict[str, Any] = {}
    for operation in CHUNKS:
        of_it = [row for row in rows if row.operation == operation]
        table[operation] = {
            "questions": sum(row.n_questions for row in of_it),
            "sha256": joined(row.digest for row in of_it),
            "chunks": {row.name: row.digest for row in of_it},
        }
    STORED.write_text(json.dumps(table, indent=1) + "\n", "utf-8")


def differences(rows: Iterable[Row], table: dict[str, Any]) -> list[str]:
    """Return a line for each chunk whose answers are not those stored."""
    lines = []
    for row in rows:
        expected = table.get(row.operation, {}).get("chunks", {}).get(row.name)
        if row.digest != expected:
            lines.append(f"{row.operation}/{row.name}: {row.digest}, stored is {expected or 'nothing'}")
    return lines
