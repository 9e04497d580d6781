"""Facts on which a figure depends: processor, versions, commit. No names of hosts or people."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import subprocess
from pathlib import Path
from typing import Any

from benchmarks.contenders import packages
from engine.running.parallel import default_workers as cores

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"


def processor() -> str:
    """Return the name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    result = re.search(r"model name\s*:\s*(.*)", text)
    return result[1].strip() if result else platform.machine()


def results(name: str) -> Path:
    """Return the file of results with a name of machines like this one."""
    return RESULTS / f"{re.sub(r'[^a-z0-9]+', '-', processor().lower()).strip('-')}-{cores()}-cores" / f"{name}.json"


def commit() -> str:
    """Return the commit, with a plus sign where files differ from it."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()

    try:
        changed = git("status", "--porcelain", "--", "engine", "benchmarks/*.py", "benchmarks/contenders")
        return git("rev-parse", "--short=12", "HEAD") + ("+" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def version_of(package: str) -> str:
    """Return the version of a distribution, or "not installed"."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def load() -> float | None:
    """Return the load of the last minute, None where the system does not say."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def facts(seed: int, threads: int) -> dict[str, Any]:
    """Return everything a table of figures names."""
    named = dict.fromkeys(("numba", "llvmlite", "embreex", *packages()))
    return {
        "processor": processor(),
        "cores": cores(),
        "threads": threads,
        "seed": seed,
        "commit": commit(),
        "load_before": load(),
        "versions": {"python": platform.python_version()} | {name: version_of(name) for name in named},
    }
