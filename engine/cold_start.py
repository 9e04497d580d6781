"""Fills an empty kernel cache by several processes: the compiler works in one thread of a process only."""

from __future__ import annotations

import contextlib
import logging
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from numba import config as numba_config

from engine.jit import complete_signs
from engine.kernel_cache import cache_folder, seed, source_digest

try:
    import fcntl
except ImportError:  # no such locks on this system: processes that start together compile the same
    fcntl = None  # type: ignore[assignment]

log = logging.getLogger(__name__)

_COMPILE = """
import importlib, os, queue, sys, threading
steps = queue.SimpleQueue()

def hear():
    for line in sys.stdin:
        steps.put(int(line))
    os._exit(1)  # ends with its parent

threading.Thread(target=hear, daemon=True).start()
sys.path[:] = sys.argv[2:]
work = importlib.import_module(sys.argv[1]).STEPS
while True:
    work[steps.get()]()
    os.write(1, b"done\\n")
"""


def fill_cache(
    module: str, shares: Sequence[int], processes: int, progress: Callable[[int], object] | None = None
) -> Sequence[int]:
    """Call the functions in ``STEPS`` of the engine's `module`, one at a time in each of so many `processes`.

    Returns the indices of those that ended well: none where the cache is known to hold everything, or where it cannot
    be written. Other processes that ask meanwhile wait for the one that compiles. What a step failed to leave in the
    cache (it was killed, the disk is full) is compiled by whoever calls it.
    shares: how long each step takes, to any scale.
    progress: called with the share of each step that ended, by one of several threads.
    """
    folder = cache_folder()
    if folder is None or numba_config.DISABLE_JIT or processes < 2 or not sys.executable or _is_full(folder, module):
        return ()
    with contextlib.suppress(OSError):
        own = folder / source_digest(module)
        own.mkdir(parents=True, exist_ok=True)
        with _alone(own / "lock"):
            if not _is_full(folder, module):
                done = _Work(shares, progress).run(module, processes)
                if len(done) == len(shares):
                    note_full(module)
                return done
    return ()


def note_full(module: str) -> None:
    """Note that the cache holds all that the steps of `module` compile: every one of them was called."""
    folder = cache_folder()
    if folder is not None and not numba_config.DISABLE_JIT and not _is_full(folder, module):
        with contextlib.suppress(OSError):
            own = folder / source_digest(module)
            own.mkdir(parents=True, exist_ok=True)
            for sign in complete_signs()[:1]:
                (own / sign).touch()


def _is_full(folder: Path, module: str) -> bool:
    """Tell whether nothing is left to compile for a CPU whose kernels can be run here."""
    names = [f"{source_digest(module)}/{sign}" for sign in complete_signs()]
    found = seed()
    return any((folder / name).exists() or (found is not None and found.holds(name)) for name in names)


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    with path.open("w") as file:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX)  # given back when the process ends, however it ends
        yield


class _Work:
    """Steps that wait for a process, and how far all are."""

    def __init__(self, shares: Sequence[int], progress: Callable[[int], object] | None) -> None:
        self._shares, self._progress = shares, progress
        self._waiting = deque(range(len(shares)))
        self._running: list[subprocess.Popen[bytes]] = []
        self._done: list[int] = []
        self._begin = time.perf_counter()

    def run(self, module: str, processes: int) -> list[int]:
        """Return the steps that ended well."""
        log.info("compiling all kernels, once for these sources: %d parts, %d processes", len(self._shares), processes)
        servers = [
            threading.Thread(target=self._serve, args=(module,), daemon=True)  # a program may end before they do
            for _ in range(min(processes, len(self._shares)))
        ]
        try:
            for server in servers:
                server.start()
            for server in servers:
                server.join()
        except BaseException:
            self._waiting.clear()
            for process in self._running:
                process.kill()
            raise
        return self._done

    def _serve(self, module: str) -> None:
        """Hand one step after the other to a process, which knows inner functions from the steps before."""
        process = None
        while self._waiting:
            with contextlib.suppress(IndexError, OSError):  # another thread was faster; the process is gone
                step = self._waiting.popleft()
                process = process or self._start(module)
                assert process.stdin
                assert process.stdout
                process.stdin.write(b"%d\n" % step)
                process.stdin.flush()
                if process.stdout.readline():
                    self._note(step)
                    continue
            self._end(process)
            process = None
        self._end(process)

    def _start(self, module: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-c", _COMPILE, module, *sys.path]
        pipe = subprocess.PIPE
        self._running.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL))
        return self._running[-1]

    def _end(self, process: subprocess.Popen[bytes] | None) -> None:
        if process is not None:
            with contextlib.suppress(OSError):
                process.communicate()

    def _note(self, step: int) -> None:
        self._done.append(step)
        now, all_of_it = sum(self._shares[done] for done in self._done), sum(self._shares)
        seconds = time.perf_counter() - self._begin
        left = seconds * (all_of_it - now) / now
        log.info("compiled %d %% of all kernels in %.0f s; some %.0f s are left", 100 * now // all_of_it, seconds, left)
        if self._progress is not None:
            self._progress(self._shares[step])
