"""What a figure depends on: processor, versions, commit. No names of hosts or people."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import subprocess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = (
    "numpy", "numba", "llvmlite", "open3d", "shapely", "trimesh", "embreex", "libigl", "vtk", "matplotlib", "coal",
    "python-fcl", "cgal", "manifold3d", "pyclipper", "numba-celltree",
)  # fmt: skip


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def processor() -> str:
    """Return the name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    found = re.search(r"model name\s*:\s*(.*)", text)
    return found[1].strip() if found else platform.machine()


def name() -> str:
    """Return the folder of results for machines like this one."""
    return f"{re.sub(r'[^a-z0-9]+', '-', processor().lower()).strip('-')}-{cores()}-cores"


def commit() -> str:
    """Return the commit, with a plus sign where files differ from it."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()

    try:
        changed = git("status", "--porcelain", "--", "engine", "benchmarks/*.py", "benchmarks/contenders")
        return git("rev-parse", "--short=12", "HEAD") + ("+" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def versions() -> dict[str, str]:
    """Return the versions of what is installed of `PACKAGES`, and "not installed"."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def load() -> float | None:
    """Return the load of the last minute, None where the system does not say."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def facts(seed: int, threads: int) -> dict[str, Any]:
    """Return everything a table of figures names."""
    return {
        "processor": processor(),
        "cores": cores(),
        "threads": threads,
        "seed": seed,
        "commit": commit(),
        "load_before": load(),
        "versions": versions(),
    }
