"""Memory of one build, measured in a process of its own: ``python -m benchmarks.memory CONTENDER SIZE SEED THREADS``.

Prints JSON: growth of the resident set from before the build to its highest point, and what stays afterwards. The
kernels are loaded before, by a small build.
"""

from __future__ import annotations

import gc
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.contenders import make
from benchmarks.workloads import bumpy_sphere, mesh_of_size, uniform_points


def points_that_pay(n_faces: int) -> int:
    """Return how many points are asked so that every structure is built."""
    return 8 * n_faces + (1 << 17)


def _status(field: str) -> int:
    found = re.search(rf"{field}:\s*(\d+) kB", Path("/proc/self/status").read_text())
    return int(found[1]) * 1024 if found else 0


def _measure(contender: str, size: str, seed: int, threads: int) -> dict[str, Any]:
    small = bumpy_sphere("warm", 0, 3)
    warm = make(contender, "points", small, threads)
    for _ in range(3):
        warm.ask(warm.native(uniform_points(small, points_that_pay(len(small.faces)), seed)))
    mesh = mesh_of_size(size, seed)
    points = uniform_points(mesh, points_that_pay(len(mesh.faces)), seed)
    native = warm.native(points)
    gc.collect()
    Path("/proc/self/clear_refs").write_text("5")  # the high-water mark starts anew
    before = _status("VmRSS")
    prepared = make(contender, "points", mesh, threads)
    prepared.ask(native)
    peak = _status("VmHWM") - before
    gc.collect()
    return {
        "peak": peak,
        "kept": _status("VmRSS") - before,
        "says": prepared.memory() if prepared.memory else None,
        "method": prepared.method() if prepared.method else "",
    }


def of_build(contender: str, size: str, seed: int, threads: int) -> dict[str, Any]:
    """Return peak, kept and said bytes of one build in a fresh process."""
    words = [sys.executable, "-m", "benchmarks.memory", contender, size, str(seed), str(threads)]
    root = Path(__file__).resolve().parents[1]
    done = subprocess.run(words, cwd=root, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"error": done.stderr.strip().splitlines()[-1] if done.stderr.strip() else f"exit {done.returncode}"}
    return json.loads(done.stdout.strip().splitlines()[-1])


if __name__ == "__main__":
    print(json.dumps(_measure(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))))
