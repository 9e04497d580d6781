"""The ledger of what requests under way hold: bodies as they arrive, documents, copies, answers until they are sent.

Who holds memory for a request counts it first, by `Call.take` (work.py). What belongs to no request yet, or not any
more, is bounded for each connection and not counted: headers, trailers, requests sent ahead (protocol.py).
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
"""Bytes held for each byte of a body, at most: itself, its numbers, a solid of them, the answer."""
PART: Final = 64
"""Bytes held for each part that a body arrives in, however short."""
SMALL: Final = 2**16
"""Bytes that a request is given whatever others hold: there are no more requests than fit into the queue."""
LATER: Final = 0.05
"""Seconds after which what an answer was made of is gone."""
_UNRETURNED: Final = 16
"""Of what requests may hold, one part in so many may have been freed before the system gets it back."""
_LEAST: Final = 2**12
"""Bytes that a request is taken to free at least."""
_FEW: Final = 2**20
"""Bytes held by requests under way up to which their objects are gone through in a few milliseconds."""
_libc: Final = ctypes.CDLL(None) if os.name == "posix" else None
_trim = getattr(_libc, "malloc_trim", None)
"""glibc keeps what was freed in arenas of each thread, some hundred MB after a large request."""
_NEVER: Final = 2**31 - 1
"""Collections of younger objects until the oldest are looked at."""
_OF_MALLOC: Final = {-8: 2, -1: 2**20, -3: 2**20}
"""M_ARENA_MAX, M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of mallopt(3): glibc raises the last two to 64 and 32 MB itself,
and keeps that much at the end of each thread's arena: 256 MB given, 4 to 8 hostile clients took 320 and now 240."""


def configure_malloc() -> None:
    """Have glibc give back what is freed, in this whole process, before its threads have arenas."""
    mallopt: Any = getattr(_libc, "mallopt", None)
    if mallopt is not None:
        for option, value in _OF_MALLOC.items():
            mallopt(option, value)


def freeze() -> None:
    """Have no later collection walk through what lives long; `Memory` collects when there is little else."""
    if not gc.get_freeze_count():
        gc.freeze()  # half a million objects of modules and compiler
    gc.set_threshold(*gc.get_threshold()[:2], _NEVER)


class Memory:
    """Bytes that requests under way hold, or may come to hold; safe to share between threads.

    collects: whether the process has turned Python's own search of old objects for cycles off (`freeze`).
    """

    def __init__(self, limit: int, collects: bool = False) -> None:
        self.limit = limit
        self.taken = self.freed = self.leaving = 0
        self.lock = threading.Lock()
        self.has_left = threading.Condition(self.lock)
        self._collects = collects

    def free(self, taken: int, most: int) -> None:
        """Count the end of a request that holds, or held at most, so much: it is free once the system has it back."""
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
        """Give freed memory back to the system; and what only cycles hold, while there are few objects to look at.

        Python would look for cycles by itself, at all objects again and again while a large body becomes more and more
        of them: that held up all threads for up to 0.46 s. Within somebody else's process it goes on doing so.
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
