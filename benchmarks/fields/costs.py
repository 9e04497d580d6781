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

import numpy as np

from benchmarks import cores as many_cores
from benchmarks import machine
from benchmarks.contest import Size, Task
from benchmarks.fields import Figure
from benchmarks.web_page import OURS
from benchmarks.workloads import bumpy_sphere, points_in_box

_FEW_CORES = 4
CALLS = {
    "exact-geometry": "import engine; engine.locate(points, engine.Polyhedron(vertices, faces), workers=1)",
    "Open3D": """import open3d
scene = open3d.t.geometry.RaycastingScene(nthreads=1)
tensor = open3d.core.Tensor
scene.add_triangles(tensor(vertices.astype(numpy.float32)), tensor(faces.astype(numpy.uint32)))
scene.compute_occupancy(tensor(points.astype(numpy.float32)), nthreads=1)""",
    "trimesh + embreex": "import trimesh; trimesh.Trimesh(vertices, faces, process=False).contains(points)",
    "libigl": "import igl; igl.fast_winding_number(vertices, faces, points)",
}
ASKING = """
import json, time
import numpy
vertices, faces, points = numpy.load({path!r}).values()
def size(name): return int(next(row for row in open("/proc/self/status") if row.startswith(name)).split()[1])
before = size("VmRSS")
began = time.perf_counter()
{call}
print(json.dumps([time.perf_counter() - began, (size("VmHWM") - before) / 1024]))
"""


def tasks(size: Size) -> Iterator[Task]:
    """Yield the figures."""
    yield Task("first answer", partial(_first, size), True, True)
    yield Task("memory", partial(_memory, size), True, True)
    yield Task("many cores", _cores, True, True)


def asked(name: str, times: int, n_points: int, **variables: str) -> tuple[float, float] | None:
    """Return seconds from import to answer, and the growth of the resident set in MB; None if it is not installed."""
    mesh = bumpy_sphere("costs", 1, times)
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        np.savez(file, vertices=mesh.vertices, faces=mesh.faces, points=points_in_box(mesh, n_points, 0))
        file.flush()
        words = [sys.executable, "-c", ASKING.format(path=file.name, call=CALLS[name])]
        done = subprocess.run(words, cwd=machine.ROOT, env=os.environ | variables, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else None


def _figure(name: str, unit: str, rows: dict[str, float], note: str) -> Figure:
    return Figure(name, unit, list(rows.values())[:1], note=note, raw={"rows": rows})


def _first(size: Size) -> Figure:
    """With kernels: the median of three fresh processes; without: one."""
    rows: dict[str, float] = {}
    for name in CALLS:
        found = sorted(each[0] for _ in range(size.of(3, 1)) if (each := asked(name, size.of(4, 2), 100)))
        if found:
            rows[name + (", kernels in the wheel" if name == OURS else "")] = found[len(found) // 2]
    if not size.is_quick:
        with tempfile.TemporaryDirectory() as folder:
            compiled = asked(OURS, 4, 100, ENGINE_CACHE_DIR=folder)
            assert compiled is not None
            rows[f"{OURS}, kernels compiled at the first question"] = compiled[0]
    return _figure(
        "first answer of a fresh process",
        "s",
        rows,
        "import, tree of 5,120 faces, 100 points; a filled cache stands for the kernels of a wheel",
    )


def _memory(size: Size) -> Figure:
    rows = {name: found[1] for name in CALLS if (found := asked(name, size.of(6, 3), size.n(100_000)))}
    return _figure("memory", "MB", rows, "growth to the highest point: package, tree of 81,920 faces, 100,000 points")


def _cores() -> Figure:
    """From stored results of the machine with most cores; this one measures its own first, if it has more than four."""
    if machine.cores() > _FEW_CORES and not machine.results("cores").exists():
        many_cores.main([])
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
