"""Memory of one build, measured in a process of its own: growth of the resident set to its highest point, and kept."""

from __future__ import annotations

import gc
import re
from pathlib import Path
from typing import Any

from benchmarks.contenders import make
from benchmarks.load import in_process
from benchmarks.workloads import bumpy_sphere, mesh_of_size, points_in_box


def points_that_pay(n_faces: int) -> int:
    """Return how many points are asked so that every structure is built."""
    return 8 * n_faces + (1 << 17)


def _status(field: str) -> int:
    found = re.search(rf"{field}:\s*(\d+) kB", Path("/proc/self/status").read_text())
    return int(found[1]) * 1024 if found else 0


def _measure(contender: str, size: str, seed: int) -> dict[str, Any]:
    """Build small, so that kernels are loaded, and then as large as asked for."""
    try:
        prepared = None
        for mesh in (bumpy_sphere("warm", 0, 3), mesh_of_size(size, seed)):
            points = points_in_box(mesh, points_that_pay(len(mesh.faces)), seed)
            native = (prepared or make(contender, "points", mesh)).native(points)
            gc.collect()
            Path("/proc/self/clear_refs").write_text("5")  # the high-water mark starts anew
            before = _status("VmRSS")
            prepared = make(contender, "points", mesh)
            prepared.ask(native)
            peak = _status("VmHWM") - before
            gc.collect()
        found = {"peak": peak, "kept": _status("VmRSS") - before}
        return found | {"says": prepared.memory() if prepared.memory else None}
    except Exception as error:
        return {"error": f"{type(error).__name__}: {error}"}


def of_build(contender: str, size: str, seed: int) -> dict[str, Any]:
    """Return peak, kept and said bytes of one build in a fresh process."""
    return in_process(_measure, contender, size, seed)()
