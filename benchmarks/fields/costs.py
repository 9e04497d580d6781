"""What stands beside speed: the first answer of a fresh process, memory, many cores. Figures, no contests.

Each contender is asked in a process of its own: import, build, points in a mesh. The kernels of ours come with the
wheel, or are compiled at the first question of an empty cache.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks import machine
from benchmarks.contest import Size, Task
from benchmarks.fields import Figure

PEERS = {"ours": "exact-geometry", "open3d": "Open3D", "trimesh": "trimesh + embreex", "igl": "libigl", "vtk": "VTK"}
ASKING = """
import json, resource, sys, time
start = time.perf_counter()
from benchmarks.contenders import make
from benchmarks.workloads import bumpy_sphere, points_in_box
mesh = bumpy_sphere("costs", 1, {times})
points = points_in_box(mesh, {n}, 0)
began = time.perf_counter()
before = int(next(row for row in open("/proc/self/status") if row.startswith("VmRSS")).split()[1])
made = make({module!r}, "points", mesh, 1)
made.answer(made.ask(made.native(points)))
taken, peak = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps([taken, (peak - before) / 1024]))
"""


def tasks(size: Size) -> Iterator[Task]:
    """Yield the figures."""
    yield Task("first answer", partial(_first, size), True, True)
    yield Task("memory", partial(_memory, size), True, True)
    yield Task("many cores", _cores, True, True)


def asked(module: str, times: int, n_points: int, **variables: str) -> tuple[float, float]:
    """Return seconds from import to answer, and the growth of the resident set in MB; import included in both."""
    code = ASKING.format(module=module, times=times, n=n_points)
    done = subprocess.run([sys.executable, "-c", code], cwd=machine.ROOT, env=os.environ | variables,
                          capture_output=True, text=True, check=True)  # fmt: skip
    taken, grown = json.loads(done.stdout.splitlines()[-1])
    return taken, grown


def _tried(module: str, times: int, n_points: int, **variables: str) -> tuple[float, float] | None:
    try:
        return asked(module, times, n_points, **variables)
    except subprocess.CalledProcessError:
        return None  # not installed


def _figure(name: str, unit: str, rows: dict[str, float], note: str) -> Figure:
    return Figure(name, unit, list(rows.values())[:1], note=note, raw={"rows": rows})


def _first(size: Size) -> Figure:
    """With kernels: the median of three fresh processes; without: one."""
    rows: dict[str, float] = {}
    for module, name in PEERS.items():
        found = sorted(each[0] for _ in range(size.of(3, 1)) if (each := _tried(module, size.of(4, 2), 100)))
        if found:
            rows[name + (", kernels in the wheel" if module == "ours" else "")] = found[len(found) // 2]
    if not size.is_quick:
        with tempfile.TemporaryDirectory() as folder:
            rows["exact-geometry, kernels compiled at the first question"] = asked(
                "ours", 4, 100, ENGINE_CACHE_DIR=folder
            )[0]
    return _figure("first answer of a fresh process", "s", rows, "import, tree of 5,120 faces, 100 points")


def _memory(size: Size) -> Figure:
    rows = {
        name: found[1] for module, name in PEERS.items() if (found := _tried(module, size.of(6, 3), size.n(100_000)))
    }
    return _figure("memory", "MB", rows, "growth to the highest point: package, tree of 81,920 faces, 100,000 points")


def _cores() -> Figure:
    """From stored results: this machine may have fewer cores than four."""
    stored: list[tuple[int, dict[str, Any]]] = []
    for path in sorted(Path(machine.RESULTS).glob("*/cores.json")):
        found = json.loads(path.read_text("utf-8"))
        stored.append((found["facts"]["cores"], found))
    if not stored:
        return _figure("many cores", "x", {}, "not measured: four cores or fewer here")
    cores, found = max(stored, key=lambda each: each[0])
    rows = {name: row["speed_up"]["default"] for name, row in found["threads"].items()}
    return _figure(f"{cores} cores against one", "x", rows,
                   f"{found['facts']['processor']}, commit {found['facts']['commit']}, `benchmarks cores`")  # fmt: skip
