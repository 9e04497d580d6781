"""The one entry of the benchmarks: ``python -m benchmarks NAME [options]``; without a name, what there is."""

from __future__ import annotations

import ast
import importlib
import sys
from pathlib import Path

from benchmarks import table
from benchmarks.fields import FIELDS

NAMES = (
    *FIELDS,
    "answers",
    "checkouts",
    "cliffs",
    "cold_start",
    "cores",
    "filed",
    "hard_cases",
    "report",
    "soak",
    "wire",
)


def about(name: str) -> str:
    """Return the first line of what a benchmark's file says of itself."""
    folder = Path(__file__).with_name("fields") if name in FIELDS else Path(__file__).parent
    path = next(path for path in (folder / f"{name}.py", folder / name / "__init__.py") if path.exists())
    return (ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "").partition("\n")[0]


def main(words: list[str]) -> int:
    """Run a benchmark by its name."""
    if not words or words[0] not in NAMES:
        print("python -m benchmarks NAME [--help]\n")
        print("\n".join(f"  {name:<15} {about(name)}" for name in NAMES))
        return int(bool(words) and words[0] not in ("-h", "--help"))
    name, *rest = words
    sys.argv[0] = f"benchmarks {name}"
    if name in FIELDS:
        return table.main(rest, name)
    return int(importlib.import_module(f"benchmarks.{name}").main(rest))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
