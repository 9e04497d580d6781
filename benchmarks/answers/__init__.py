"""The answers to a fixed set of questions, as one SHA-256 an operation: the same bytes on every machine.

    python -m benchmarks answers            # asks everything, prints the table
    python -m benchmarks answers --check    # and compares with answers.json: exit code 1 and the chunks that differ
    python -m benchmarks answers --write    # and stores
    python -m benchmarks answers --tenth 3  # a tenth of the chunks of every operation; --only WORD: chunks so named

Questions are drawn with nothing but raw random bits and + - * / sqrt, no libm and no BLAS, so they too are the same
everywhere. An operation's questions are cut into chunks, each drawn from its own name, with new solids. Times,
counters and names of methods are left out: whoever restructures the engine may change them, an answer never.
"""

from __future__ import annotations


def main(words: list[str]) -> int:
    """Ask; return the exit code."""
    from benchmarks.answers import stored

    return stored.main(words)
