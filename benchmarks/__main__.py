"""The one entry of the benchmarks: ``python -m benchmarks NAME [options]``; without a name, what there is."""

from __future__ import annotations

import importlib
import sys

from benchmarks import table

TABLES = {
    "calls": "single calls of 1, 10 and 100 items",
    "clearance": "how far apart, against peers",
    "collision": "poses, pairs, scenes and triangles, against peers",
    "containment": "points in every kind of solid, against peers",
    "ends": "CPU seconds of every operation after its deadline",
    "overlay": "polygons on polygons, against GEOS and Clipper",
    "polygons": "polygons clipped on convex regions, against peers",
    "scenes": "scenes that stay: segments through many bodies, and what moved, against peers",
    "segments": "segments clipped on every region, against peers",
}
NAMES = TABLES | {
    "advice": "what the textbook's advice is worth: docs/textbook_advice.md",
    "answers": "a fixed set of questions: one hash an operation, compared with those stored",
    "checkouts": "two checkouts of the engine, every row of ours in turns",
    "cold_start": "what an empty kernel cache costs: a table of docs/speed_and_error.md",
    "collision_cost": "what each way out of the quadratic cost of collision saves: docs/collision_cost.md",
    "compare": "two stored reports, side by side",
    "filed": "inputs that users of the peers filed, replayed",
    "hard_cases": "who gets which hard family wrong: the figures of docs/hard_cases.md",
    "publish": "the judged inputs and their exact answers as files with their hashes",
    "report": "every operation, speed against error: docs/speed_and_error.md and the README's table",
    "soak": "hostile load for an hour beside small questions: statuses, seconds, memory",
    "wire": "what HTTP adds to a kernel, and what overload does",
}


def main(words: list[str]) -> int:
    """Run a benchmark by its name."""
    if not words or words[0] not in NAMES:
        print("python -m benchmarks NAME [--help]\n")
        print("\n".join(f"  {name:<15} {about}" for name, about in NAMES.items()))
        return int(bool(words) and words[0] not in ("-h", "--help"))
    name, *rest = words
    sys.argv[0] = f"benchmarks {name}"
    if name in TABLES:
        return table.main(rest, name)
    return int(importlib.import_module(f"benchmarks.{name}").main(rest))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
