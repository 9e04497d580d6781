"""Measures cold starts: the cost of an empty kernel cache, each time in a fresh process.

    python -m benchmarks cold_start             # some ten minutes: also until all is warm, with one process and two
    python -m benchmarks cold_start --quick     # one operation

Seconds of wall and CPU, and compilations, until the first answer of each operation; seconds until all is warm, bytes of
cached machine code, and all again from a seed of the CPU family.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from benchmarks import machine, table
from benchmarks.contest import Task
from benchmarks.fields import Figure

CUBE = """engine.Polyhedron([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)],
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])"""
TRIANGLE = "engine.Polygon([[[{0}, {0}], [{1}, {0}], [{0}, {1}]]])"
OPERATIONS = {
    "locate, sphere": "engine.locate(np.zeros((4, 3)), engine.Sphere([0, 0, 0], 1))",
    "locate, polyhedron": f"engine.locate(np.linspace(-0.5, 1.5, 36).reshape(-1, 3), {CUBE})",
    "locate, polygon": f"engine.locate(np.linspace(-0.5, 1.5, 24).reshape(-1, 2), {TRIANGLE.format(0, 4)})",
    "clip segments": "engine.clip_segments(np.linspace(-1, 2, 24).reshape(4, 2, 3), engine.Aabb([0] * 3, [1] * 3))",
    "clip polygons": "engine.clip_polygons(np.random.default_rng(0).random((4, 5, 2)), engine.Aabb([0, 0], [0.5, 1]))",
    "collide": f"engine.collide({CUBE}, engine.Polyhedron({CUBE}.vertices + 0.5, {CUBE}.triangles))",
    "overlay": f"engine.overlay({TRIANGLE.format(0, 4)}, {TRIANGLE.format(1, 5)})",
    "all warm, 1 process": "engine.warm()",
    "all warm, 2 processes": "engine.warm(processes=2)",
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


def ask(name: str, code: str, cache: Path, **variables: str) -> Figure:
    """Return the time of a fresh process for `code`, import included; compilations of children are not counted."""
    environment = {**os.environ, "ENGINE_CACHE_DIR": str(cache), **variables}
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    words = [sys.executable, "-c", COUNTING.format(code)]
    done = subprocess.run(words, cwd=machine.ROOT, env=environment, capture_output=True, text=True, check=True)
    seconds, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    code_bytes = sum(file.stat().st_size for file in cache.rglob("*") if file.is_file())
    raw = {"cpu": cpu, "compilations": int(done.stdout), "bytes": code_bytes}
    note = f"CPU {cpu:.1f} s, {raw['compilations']} compilations, {code_bytes / 2**20:.1f} MB of machine code"
    return Figure(name, "s", [seconds], note=note, raw=raw)


def seeded(name: str, code: str, folder: Path) -> Figure:
    """Return the same with a seed, which is made at its first use."""
    if not (folder / "seed").exists():
        words = [sys.executable, "-m", "engine", "warm", "-q", "--into", str(folder / "seed"), "--cpu", "x86-64-v3"]
        subprocess.run(words, cwd=machine.ROOT, check=True)
    return ask(name, code, folder / name, ENGINE_CACHE_SEED=str(folder / "seed"))


def main(words: list[str] | None = None) -> int:
    """Print and store all rows."""
    given = table.options(words, __doc__ or "")
    with tempfile.TemporaryDirectory() as text:
        folder, queried = Path(text), dict(list(OPERATIONS.items())[: 1 if given.quick else None])
        rows = [Task(name, partial(ask, name, code, folder / name)) for name, code in queried.items()]
        rows += [Task(f"{name}, seed", partial(seeded, f"{name}, seed", code, folder))
                 for name, code in queried.items() if not given.quick]  # fmt: skip
        return table.run("cold_start", rows, given)
