"""Fills an empty kernel cache by several processes: the compiler works in one thread of a process only."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from numba import config as numba_config

from engine.jit import COMPLETE, cache_folder, source_digest

try:
    import fcntl
except ImportError:  # no such locks on this system: processes that start together compile the same
    fcntl = None  # type: ignore[assignment]

_POLL = 0.05  # seconds
_COMPILE = """
import importlib, os, sys, threading
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(1)), daemon=True).start()  # ends with its parent
sys.path[:] = sys.argv[3:]
importlib.import_module(sys.argv[1]).STEPS[int(sys.argv[2])]()
os._exit(0)
"""


def fill_cache(module: str, steps: int, processes: int) -> None:
    """Call the `steps` functions in ``STEPS`` of the engine's `module`, each in a process of its own.

    `processes` run at a time. Returns at once where the cache is known to hold everything, or where none can be
    written. Other processes that ask meanwhile wait for the one that compiles. What a step failed to leave in the
    cache (it was killed, the disk is full) is compiled by whoever calls it.
    """
    folder = cache_folder()
    if folder is None or numba_config.DISABLE_JIT or processes < 2 or not sys.executable:
        return
    complete = _sign(folder, module)
    with contextlib.suppress(OSError):
        if complete.exists():
            return
        complete.parent.mkdir(parents=True, exist_ok=True)
        with _alone(complete.with_name("lock")):
            if not complete.exists() and _run(module, steps, processes):
                note_full(module)


def note_full(module: str) -> None:
    """Note that the cache holds all that the steps of `module` compile: every one of them was called."""
    folder = cache_folder()
    if folder is not None and not numba_config.DISABLE_JIT:
        with contextlib.suppress(OSError):
            _sign(folder, module).parent.mkdir(parents=True, exist_ok=True)
            _sign(folder, module).touch()


def _sign(folder: Path, module: str) -> Path:
    return folder / source_digest(module) / COMPLETE


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    with path.open("w") as file:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX)  # given back when the process ends, however it ends
        yield


def _run(module: str, steps: int, processes: int) -> bool:
    """Return whether every step ended well."""
    waiting, done = list(range(steps)), True
    running: list[subprocess.Popen[bytes]] = []
    theirs, ours = os.pipe()  # nothing is ever written: it ends with this process
    try:
        while waiting or running:
            while waiting and len(running) < processes:
                running.append(_start(module, waiting.pop(0), theirs))
            time.sleep(_POLL)
            states = [process.poll() for process in running]  # once: one that ends in between is looked at next time
            done &= not any(states)
            running = [process for process, state in zip(running, states, strict=True) if state is None]
    finally:
        os.close(theirs)
        os.close(ours)
    return done


def _start(module: str, step: int, lifeline: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-c", _COMPILE, module, str(step), *sys.path]
    return subprocess.Popen(command, stdin=lifeline, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
