"""Fills an empty kernel cache by several processes: the compiler works in one thread of a process only."""

from __future__ import annotations

import contextlib
import logging
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from numba import config as numba_config

from engine.compiling.jit import completion_markers
from engine.compiling.kernel_cache import cache_folder, locked, seed, take_turns
from engine.compiling.sources import matches_its_source, source_digest

log = logging.getLogger(__name__)

_COMPILE = """
import contextlib, importlib, os, sys, threading, time

def end_with_parent(process):
    while os.getppid() == process:
        time.sleep(0.5)
    os._exit(1)

threading.Thread(target=end_with_parent, args=[int(sys.argv[1])], daemon=True).start()
sys.path[:] = sys.argv[5:]
importlib.import_module(sys.argv[3]).take_turns(sys.argv[4])
work = importlib.import_module(sys.argv[2]).STEPS
while steps := os.read(0, len(work)):
    for step in steps.rstrip(bytes([255])):
        with contextlib.suppress(Exception):
            work[step]()
            os.write(1, bytes([step]))
"""


PLAIN_ERRORS = {"NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1"}
"""Environment of processes that compile: where colorama is installed, numba colours texts that nobody sees, a thirtieth
of all compiling."""


def fill_cache(
    module: str,
    shares: Sequence[int],
    processes: int,
    progress: Callable[[int], object] | None = None,
    chosen: Sequence[int] | None = None,
    related: Sequence[Sequence[int]] | None = None,
) -> Sequence[int]:
    """Call the functions in ``STEPS`` of the engine's `module`, one at a time in each of so many `processes`.

    Returns the indices of those that succeeded: none if the cache is already complete or cannot be written. Other
    processes that call this meanwhile wait for the one that compiles. What a step failed to store (it was killed, the
    disk is full) is compiled by its first caller. shares: relative duration of each step. progress: called with the
    share of each step that ended. chosen: the indices of the steps to call; all by default. related: indices of steps
    that one process calls; each by itself by default.
    """
    folder, seed_folder = cache_folder(), seed()
    if seed_folder is not None and source_digest(module) is not None and not has_all(seed_folder, module):
        log.warning("the kernel seed %s lacks kernels of this version for this CPU: they are compiled", seed_folder)
    digest = source_digest(module)
    if folder is None or digest is None or numba_config.DISABLE_JIT or processes < 2 or not sys.executable:
        return ()
    if is_full(module):
        return ()
    steps = range(len(shares)) if chosen is None else chosen
    parts = [[step for step in part if step in steps] for part in related or zip(steps)]
    with contextlib.suppress(OSError):
        own = folder / digest
        own.mkdir(mode=0o755, parents=True, exist_ok=True)
        with locked(own / "lock"):
            if not is_full(module):
                done = _run(module, [part for part in parts if part], shares, processes, own / "turns", progress)
                if len(done) == len(shares):
                    note_full(module)
                return done
    return ()


def note_full(module: str) -> None:
    """Mark the cache as complete for the steps of `module`: every one of them was called."""
    folder, digest = cache_folder(), source_digest(module)
    if folder is None or digest is None or numba_config.DISABLE_JIT or is_full(module):
        return
    if matches_its_source(module):
        with contextlib.suppress(OSError):
            own = folder / digest
            own.mkdir(mode=0o755, parents=True, exist_ok=True)
            for marker in completion_markers()[:1]:
                (own / marker).touch()


def is_full(module: str) -> bool:
    """Return whether nothing is left to compile for a CPU whose kernels can run here."""
    return any(folder is not None and has_all(folder, module) for folder in (cache_folder(), seed()))


def has_all(folder: Path, module: str) -> bool:
    """Return whether a folder is marked as complete for the steps of `module`, for a CPU whose kernels can run here."""
    digest = source_digest(module)
    return digest is not None and any((folder / digest / marker).exists() for marker in completion_markers())


def _run(
    module: str,
    parts: Sequence[Sequence[int]],
    shares: Sequence[int],
    processes: int,
    turns: Path,
    progress: Callable[[int], object] | None,
) -> Sequence[int]:
    """Return the steps that succeeded; processes take lists of them, filled up with 255, from one pipe, and report each
    to another. What two need one of them compiles. turns: the file for that."""
    log.info("compiling all kernels, once for these sources: %d parts, %d processes", len(parts), processes)
    done: list[int] = []
    total = sum(shares[step] for part in parts for step in part)
    begin, running = time.perf_counter(), []
    (steps, left), (ended, said) = os.pipe(), os.pipe()
    os.write(left, b"".join(bytes(part).ljust(len(shares), bytes([255])) for part in parts))
    os.close(left)
    try:
        try:
            names = module, take_turns.__module__, str(turns)
            command = [sys.executable, "-c", _COMPILE, str(os.getpid()), *names, *sys.path]
            around, lost = {**os.environ, **PLAIN_ERRORS}, subprocess.DEVNULL
            for _ in range(min(processes, len(parts))):
                running.append(subprocess.Popen(command, stdin=steps, stdout=said, stderr=lost, env=around))
        finally:
            os.close(steps)
            os.close(said)
        while step := os.read(ended, 1):
            done.append(step[0])
            seconds, part = time.perf_counter() - begin, sum(shares[each] for each in done) / total
            rest = seconds * (1 - part) / part
            log.info("compiled %.0f %% of all kernels in %.0f s; some %.0f s are left", 100 * part, seconds, rest)
            if progress is not None:
                progress(shares[step[0]])
    except BaseException:
        for process in running:
            process.kill()
        raise
    finally:
        os.close(ended)
        for process in running:
            process.wait()
    return done
