"""The one entry of the benchmarks: ``python -m benchmarks NAME [options]``; without a name, what there is."""

from __future__ import annotations

import importlib
import sys

NAMES = {
    "checkouts": "two checkouts of the engine, every row of ours in turns",
    "clipping": "the table of clipping: segments and polygons, against peers",
    "collision": "the table of collision, against peers",
    "collision_cost": "what each way out of the quadratic cost of collision saves: docs/collision_cost.md",
    "compare": "two stored reports, side by side",
    "containment": "the table of containment, against peers",
    "hard_cases": "who gets which hard family wrong: the figures of docs/hard_cases.md",
    "overlay": "the table of overlay, against GEOS and Clipper",
    "report": "every operation, speed against error: docs/speed_and_error.md and the README's table",
    "wire": "what HTTP adds to a kernel, and what overload does",
}
ELSEWHERE = {"filed": "benchmarks.fields.filed"}


def main(words: list[str]) -> int:
    """Run a benchmark by its name."""
    if not words or words[0] not in NAMES:
        print("python -m benchmarks NAME [--help]\n")
        print("\n".join(f"  {name:<15} {about}" for name, about in NAMES.items()))
        return int(bool(words) and words[0] not in ("-h", "--help"))
    name, *rest = words
    sys.argv[0] = f"benchmarks {name}"
    return int(importlib.import_module(ELSEWHERE.get(name, f"benchmarks.{name}")).main(rest) or 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
