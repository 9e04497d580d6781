"""``python -m engine warm``, and the progress bar of all commands."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from engine.compiling.cold_start import PLAIN_ERRORS
from engine.compiling.kernel_cache import cache_folder, check_owner, seal, seed
from engine.running.parallel import Progress
from engine.warm_groups import GROUPS, call_group
from engine.warmup import warm

Options = argparse.Namespace


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
