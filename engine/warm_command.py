"""``python -m engine warm``, and the progress bar of all commands.

Kernels for other machines are compiled in groups, each by one process with a cache of its own: the same bytes whatever
the machine.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from engine.compiling.cold_start import PLAIN_ERRORS
from engine.compiling.kernel_cache import cache_folder, check_owner, seal, seed
from engine.running.parallel import Progress
from engine.solids.checks import as_points
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.primitives import Triangle
from engine.warmup import RELATED, STEPS, regions_of, warm

Options = argparse.Namespace
GROUPS = (RELATED[0] + RELATED[3], RELATED[1] + RELATED[2])
"""Indices of the steps that one process each calls where the same bytes are wanted whatever the machine: their order
decides symbols and inlining. What both compile is that of the first."""


def warm_kernels(options: Options) -> None:
    """Compile all kernels, or some, here or for other machines."""
    if options.cpu or options.into:
        _warm_elsewhere(options)
        return
    with progress_bar(100, "%", options) as progress:
        shown = progress or (_Lines() if not options.quiet else lambda _: None)
        warm(shown, processes=options.processes, operations=options.operations or None)
    if not options.quiet:
        what = f"every kernel of {', '.join(options.operations)}" if options.operations else "every kernel"
        print(f"{what} is in {cache_folder()}{f' or {seed()}' if seed() else ''}", file=sys.stderr)


def _warm_elsewhere(options: Options) -> None:
    """Run `warm` in new processes, since the compiler reads its CPU and cache folder only once."""
    processes = "1" if options.into else str(options.processes)
    command = [sys.executable, "-P", "-m", "exact_geometry", "warm", "--processes", processes]
    paths = os.pathsep.join(filter(None, sys.path))
    surroundings = {**os.environ, **PLAIN_ERRORS, "PYTHONPATH": paths, "PYTHONHASHSEED": "0"}
    if options.cpu:
        surroundings |= {"NUMBA_CPU_NAME": options.cpu, "NUMBA_CPU_FEATURES": ""}
    with TemporaryDirectory() as temporary:
        archive = Path(options.into) if options.into and options.into.endswith(".tar.xz") else None
        folder = Path(options.into) if options.into and archive is None else Path(temporary)
        if options.into:
            (archive.parent if archive else folder).mkdir(mode=0o755, parents=True, exist_ok=True)
            check_owner(folder)
            surroundings |= {"ENGINE_CACHE_DIR": str(folder.resolve()), "ENGINE_CACHE_SEED": ""}
            _compile_groups(folder, surroundings, options)
        if subprocess.run([*command, *["--quiet"] * options.quiet], env=surroundings, check=False).returncode:
            raise ValueError("not every kernel was compiled")
        if options.into and not any(folder.rglob("*.nbc")):
            raise ValueError("no kernel was written: is the compiler disabled?")
        if options.into:
            seal(folder, archive)


def _compile_groups(folder: Path, surroundings: Mapping[str, str], options: Options) -> None:
    """Compile all kernels into a folder by one process a group of steps, each with a cache of its own: what is compiled
    does not depend on who is faster."""
    if not options.quiet:
        print(f"compiling all kernels: a few minutes on {min(options.processes, len(GROUPS))} core(s)", file=sys.stderr)
    code = f"import logging, exact_geometry as e; logging.disable(); from {call_group.__module__} import call_group"
    with TemporaryDirectory() as temporary, ThreadPoolExecutor(options.processes) as pool:
        parts = [Path(temporary) / str(group) for group in range(len(GROUPS))]

        def compile_group(part: Path) -> int:
            command = [sys.executable, "-P", "-c", f"{code}; call_group({part.name})"]
            return subprocess.run(command, env={**surroundings, "ENGINE_CACHE_DIR": str(part)}, check=False).returncode

        if any(pool.map(compile_group, parts)):
            raise ValueError("not every kernel was compiled")
        for part in reversed(parts):
            shutil.copytree(part, folder, dirs_exist_ok=True)


def call_group(index: int) -> None:
    """Call the steps of one of `GROUPS`, and compile what only `compare` asks; on one core, so that no other thread
    compiles: the order in which functions are compiled is part of their names."""
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[index % len(cores)]})
    with suppress(ImportError, AttributeError):  # without it kernels are as right
        from engine.compiling.compilers import forget_paths

        forget_paths()
    for step in GROUPS[index]:
        STEPS[step]()
    if index == len(GROUPS) - 1:
        warm_textbook()


def warm_textbook() -> None:
    """Ask every textbook method that `compare` offers; not a step, since hardly anybody asks more than one."""
    from engine.textbook import methods

    for dimension in (2, 3):
        points = as_points(np.linspace(-0.5, 1.5, 6 * dimension).reshape(-1, dimension), dimension)
        corners = np.eye(3)[:, :dimension]
        terms = Implicit([{"powers": [2] * dimension, "coefficient": 1.0}])
        for solid in (*regions_of(dimension), Triangle(corners), terms, Csg("union", regions_of(dimension)[:3])):
            questions: list[tuple[methods.Methods, tuple[Any, ...]]] = [
                (methods.of_points(solid), (points,)),
                (methods.of_segments(solid), (points.reshape(3, 2, dimension),)),
                (methods.of_polygons(solid), (points.reshape(2, 3, dimension),)),
                (methods.of_pairs(solid, solid), ()),
            ]
            for offered, arguments in questions:
                for ask, _ in offered.values():
                    ask(*arguments)


class _Lines:
    """Progress as printed lines, where there is no bar."""

    def __init__(self) -> None:
        self._done = 0

    def __call__(self, share: int) -> None:
        self._done += share
        print(f"kernels: {self._done} %", file=sys.stderr)


@contextmanager
def progress_bar(n_items: int, unit: str, options: Options) -> Iterator[Progress | None]:
    """Show a progress bar if the standard error is a terminal and tqdm is installed; yields the function that advances
    it."""
    if options.quiet or not sys.stderr.isatty() or find_spec("tqdm") is None:
        yield None
        return
    from tqdm import tqdm

    with tqdm(total=n_items, unit=f" {unit}", unit_scale=True, leave=False) as bar:
        yield bar.update
