"""Accounts for the memory of running requests: bodies as they arrive, documents, copies, answers until they are sent.

Code that allocates memory for a request counts it first, by `Call.take` (work.py). What belongs to no request yet, or
not any more, is bounded for each connection and not counted: headers, trailers, requests sent ahead (protocol.py).
"""

from __future__ import annotations

import ctypes
import gc
import os
import threading
import time
from typing import Any, Final

import engine

FOOTPRINT: Final = 4
"""Upper bound on the memory for each byte of a body: itself, its numbers, a solid of them, the answer."""
PART: Final = 64
"""Memory for each part in which a body arrives, however short."""
SMALL: Final = 2**16
"""Bytes that a request gets whatever others use: there are no more requests than fit into the queue."""
LATER: Final = 0.05
"""Seconds after which the values of an answer are freed."""
_UNRETURNED: Final = 16
"""One part in so many of the limit may be freed but not yet returned to the system."""
_LEAST: Final = 2**12
"""Bytes that a request counts as freeing at least."""
_FEW: Final = 2**20
"""Bytes of running requests up to which their objects are collected in a few milliseconds."""
_libc: Final = ctypes.CDLL(None) if os.name == "posix" else None
_trim = getattr(_libc, "malloc_trim", None)
"""glibc retains freed memory in arenas of each thread, some hundred MB after a large request."""
_NEVER: Final = 2**31 - 1
"""Collections of younger objects until the oldest are collected."""
_OF_MALLOC: Final = {-8: 2, -1: 2**20, -3: 2**20}
"""M_ARENA_MAX, M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of mallopt(3): glibc raises the last two to 64 and 32 MB itself,
and keeps that much at the end of each thread's arena: 256 MB given, 4 to 8 hostile clients took 320 and now 240."""


def configure_malloc() -> None:
    """Configure glibc's malloc to return freed memory, before threads have arenas."""
    mallopt: Any = getattr(_libc, "mallopt", None)
    if mallopt is not None:
        for option, value in _OF_MALLOC.items():
            mallopt(option, value)


def freeze() -> None:
    """Exclude long-lived objects from later collections; `Memory` collects when there are few others."""
    gc.freeze()  # half a million objects of modules and compiler
    gc.set_threshold(*gc.get_threshold()[:2], _NEVER)


class Memory:
    """Bytes that running requests use or may use; thread-safe.

    collects: whether the process has disabled Python's own collection of old objects (`freeze`).
    """

    def __init__(self, limit: int, collects: bool = False) -> None:
        self.limit = limit
        self.taken = self.freed = self.leaving = 0
        self.lock = threading.Lock()
        self.has_left = threading.Condition(self.lock)
        self._collects = collects

    def free(self, taken: int, most: int) -> None:
        """Count the end of a request that uses, or used at most, so much: it is free once the system has it back."""
        with self.lock:
            self.freed += max(most, _LEAST)
            is_much = self.freed > self.limit // _UNRETURNED
            if is_much:
                self.freed = 0
                self.leaving += taken
            else:
                self.taken -= taken
        if is_much:
            threading.Thread(target=self._give_back, args=(taken,), daemon=True).start()

    def _give_back(self, taken: int) -> None:
        """Return freed memory to the system, and collect cycles while there are few objects.

        Python would collect cycles by itself, over all objects again and again while a large body becomes more of them:
        that blocked all threads for up to 0.46 s. Embedded in another process it still does so.
        """
        time.sleep(LATER)
        if self._collects and self.taken - self.leaving <= _FEW:
            gc.collect()
        engine.release()
        if _trim is not None:
            _trim(0)
        with self.lock:
            self.taken -= taken
            self.leaving -= taken
            self.has_left.notify_all()
