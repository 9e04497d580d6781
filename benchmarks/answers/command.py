"""python -m benchmarks answers: asks, prints one SHA-256 an operation, compares or stores."""

from __future__ import annotations

import argparse
import time

from benchmarks.answers.digest import joined
from benchmarks.answers.stored import STORED, Row, asked, chosen, differences, load, store


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
        found = asked([chunk for chunk in chunks if chunk.operation == operation], options.workers)
        rows += found
        n_questions, seconds = sum(row.n_questions for row in found), time.perf_counter() - before
        total = joined(row.digest for row in found)
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
