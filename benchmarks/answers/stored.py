"""Selection of chunks, the stored digests, and the command that compares them."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.answers import (  # noqa: F401 (families)
    clipping,
    collision,
    containment,
    distances,
    overlays,
    refusals,
    wire,
)
from benchmarks.answers.asking import CHUNKS, Chunk, joined

STORED = Path(__file__).resolve().parent / "answers.json"


class Row(NamedTuple):
    """The result of a chunk."""

    operation: str
    name: str
    n_questions: int
    digest: str


def chosen(tenth: int | None = None, only: str = "") -> list[Chunk]:
    """Return the chunks of a tenth, or all, whose operation/family/number contains `only`."""
    result = [chunk for chunks in CHUNKS.values() for chunk in chunks.values()]
    return [
        chunk for chunk in result
        if only in f"{chunk.operation}/{chunk.name}" and (tenth is None or chunk.tenth == tenth)
    ]  # fmt: skip


def asked(chunks: Iterable[Chunk], workers: int | None = None) -> list[Row]:
    """Run chunks one after another."""
    return [Row(chunk.operation, chunk.name, *chunk.asked(workers)) for chunk in chunks]


def load() -> dict[str, Any]:
    """Return the stored table: for each operation the number of questions, the SHA-256, and each chunk's digest."""
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
    """Return a line for each chunk whose digest differs from the stored one."""
    lines = []
    for row in rows:
        expected = table.get(row.operation, {}).get("chunks", {}).get(row.name)
        if row.digest != expected:
            lines.append(f"{row.operation}/{row.name}: {row.digest}, stored is {expected or 'nothing'}")
    return lines


def main(words: list[str]) -> int:
    """Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks answers")
    parser.add_argument("--check", action="store_true", help="compare with what is stored")
    parser.add_argument("--write", action="store_true", help="store (everything must be asked)")
    parser.add_argument("--tenth", type=int, choices=range(10), help="ask a tenth of the chunks of each operation")
    parser.add_argument("--only", default="", help="ask chunks whose operation/family/number contains this")
    parser.add_argument("--workers", type=int, help="threads of each call; the answers must not depend on it")
    options = parser.parse_args(words)
    chunks = chosen(options.tenth, options.only)
    rows: list[Row] = []
    for operation in dict.fromkeys(chunk.operation for chunk in chunks):
        before = time.perf_counter()
        result = asked([chunk for chunk in chunks if chunk.operation == operation], options.workers)
        rows += result
        n_questions, seconds = sum(row.n_questions for row in result), time.perf_counter() - before
        total = joined(row.digest for row in result)
        print(f"{operation:18}{n_questions:>9,} questions {seconds:7.1f} s  {total}", flush=True)
    if options.write:
        if options.tenth is not None or options.only:
            parser.error("--write needs the answers to everything")
        store(rows)
        print(f"stored in {STORED.name}")
    wrong = differences(rows, load()) if options.check else []
    for line in wrong:
        print(line)
    return 1 if wrong else 0
