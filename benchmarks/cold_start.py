"""Cold start: what an empty kernel cache costs, each time in a fresh process: ``python -m benchmarks.cold_start``.

Prints JSON: seconds of wall and CPU, and compilations, until the first answer of each operation; seconds until all is
warm with one process and with two, bytes of machine code that are kept, and both again from a seed of the CPU family.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
CUBE = """engine.Polyhedron([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)],
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])"""
ASKED = {
    "sphere": "engine.locate(np.zeros((4, 3)), engine.Sphere([0, 0, 0], 1))",
    "polyhedron": f"engine.locate(np.linspace(-0.5, 1.5, 36).reshape(-1, 3), {CUBE})",
    "segments": "engine.clip_segments(np.linspace(-1, 2, 24).reshape(4, 2, 3), engine.Aabb([0, 0, 0], [1, 1, 1]))",
    "collision": f"engine.collide({CUBE}, engine.Polyhedron({CUBE}.vertices + 0.5, {CUBE}.triangles))",
    "overlay": "engine.overlay(engine.Polygon([[[0, 0], [4, 0], [0, 4]]]), engine.Polygon([[[1, 1], [5, 1], [1, 5]]]))",
    "warm, 1 process": "engine.warm()",
    "warm, 2 processes": "engine.warm(processes=2)",
}
COUNTING = """
from numba.core import event
class Counter(event.Listener):
    n = 0
    def on_start(self, happening): self.n += 1
    def on_end(self, happening): pass
counter = Counter()
event.register("numba:compile", counter)
import numpy as np, engine
{0}
print(counter.n)
"""


def ask(code: str, cache: Path, **variables: str) -> dict[str, Any]:
    """Return what a fresh process takes for `code`, import included; of children, compilations are not counted."""
    environment = {**os.environ, "ENGINE_CACHE_DIR": str(cache), **variables}
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    words = [sys.executable, "-c", COUNTING.format(code)]
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    seconds, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    code_bytes = sum(file.stat().st_size for file in cache.rglob("*.nbc"))
    return {"seconds": seconds, "cpu": cpu, "compilations": int(done.stdout), "bytes": code_bytes}


def main() -> None:
    """Print all rows."""
    rows: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        seed = Path(folder) / "seed"
        for name, code in ASKED.items():
            rows[name] = ask(code, Path(folder) / f"empty {name}")
            print(name, rows[name], file=sys.stderr)
        words = [sys.executable, "-m", "engine", "warm", "-q", "--into", str(seed), "--cpu", "x86-64-v3"]
        subprocess.run(words, cwd=ROOT, check=True)
        for name, code in ASKED.items():
            rows[f"{name}, seed"] = ask(code, Path(folder) / f"seeded {name}", ENGINE_CACHE_SEED=str(seed))
    print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
