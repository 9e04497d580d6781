"""Lays out the wheel: all code within `exact_geometry/`, with compiled kernels if `EXACT_GEOMETRY_KERNELS` says which.

| value | the wheel |
|---|---|
| unset | has no kernels: py3-none-any |
| `x86-64-v3`, `generic`, ... | has those of this Python and its numba for such CPUs: cp312-none-PLATFORM |
| folders, `:` between (`;` on Windows) | has those that `python -m engine warm --into FOLDER` made, a Python each |
"""

from __future__ import annotations

import os
import re
import runpy
import shutil
import subprocess
import sys
import sysconfig
from hashlib import sha256
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class WheelLayout(BuildHookInterface):  # type: ignore[type-arg, misc, unused-ignore]
    """Moves the packages below `exact_geometry`, rewrites their imports, and adds kernels."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the files of the wheel; an editable install reads the checkout as it is."""
        if version == "editable":
            return
        root, room = Path(self.root), Path(mkdtemp())
        self.room = room
        renamed = runpy.run_path(str(root / "exact_geometry" / "_renaming.py"))["renamed"]
        for name in ("engine", "service", "benchmarks", "exact_geometry"):
            shutil.copytree(root / name, room / name, ignore=_left_out)
            for file in (room / name).rglob("*.py"):
                file.write_text(renamed(file.read_text("utf-8")), "utf-8")
        (room / "names.pth").write_text("import _exact_geometry_names\n")
        build_data["force_include"] |= {
            str(room / "engine"): "exact_geometry/engine",
            str(room / "service"): "exact_geometry/service",
            str(room / "benchmarks"): "exact_geometry/benchmarks",
            str(room / "exact_geometry"): "exact_geometry",
            str(room / "exact_geometry" / "_names.py"): "_exact_geometry_names.py",
            str(room / "names.pth"): "_exact_geometry_names.pth",
        }
        if wanted := os.environ.get("EXACT_GEOMETRY_KERNELS"):
            seeds = [Path(each).resolve() for each in wanted.split(os.pathsep)]
            if not all(seed.is_dir() for seed in seeds):
                seeds = [_compiled(root, wanted, room / "kernels")]
            made_by = [(seed / "MADE_BY").read_text("utf-8") for seed in seeds]
            for seed, tools in zip(seeds, made_by):
                build_data["force_include"][str(seed)] = f"exact_geometry/engine/kernels/{_name(tools)}"
            build_data["pure_python"] = False
            build_data["tag"] = f"{'.'.join(sorted({_python(tools) for tools in made_by}))}-none-{_platform()}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary folder."""
        shutil.rmtree(getattr(self, "room", "no such folder"), ignore_errors=True)


def _left_out(folder: str, names: list[str]) -> set[str]:
    """Return what of a folder is not for the wheel: of `benchmarks` all that `audit` does not need, which compares
    checkouts, makes the report or loads a service."""
    left_out = shutil.ignore_patterns("__pycache__", "*.pyc", "kernels", "results", "filed", "*.md")(folder, names)
    if Path(folder).name == "answers":
        return set(names) - {"__init__.py", "draws.py", "shapes.py"}
    if Path(folder).name == "benchmarks":
        of_checkouts = ("__main__", "checkouts", "cliffs", "cores", "load", "report", "soak", "wire")
        left_out |= {f"{name}.py" for name in of_checkouts}
    return left_out


def _compiled(root: Path, cpu: str, folder: Path) -> Path:
    """Compile all kernels for a family of CPUs."""
    words = [sys.executable, "-P", "-m", "exact_geometry", "warm", "--into", str(folder), "--cpu", cpu]
    subprocess.run(words, cwd=root, env={**os.environ, "PYTHONPATH": str(root)}, check=True)
    return folder


def _name(tools: str) -> str:
    """Return the name of a seed's folder: Python, numba, llvmlite, and a hash of those with all options."""
    numba, llvmlite, python = re.findall(r"numba ([\w.+]+), llvmlite ([\w.+]+), (\S+)", tools)[0]
    return f"{python}-numba{numba}-llvmlite{llvmlite}-{sha256(tools.encode()).hexdigest()[:8]}"


def _python(tools: str) -> str:
    """Return the tag of the Python that a seed is for."""
    return "cp" + re.findall(r"cpython-(\w+)", tools)[0]


def _platform() -> str:
    """Return the tag of this platform; kernels call no C library by its version."""
    name = re.sub(r"[-.]", "_", sysconfig.get_platform())
    return re.sub(r"^linux_", "manylinux_2_17_", name)
