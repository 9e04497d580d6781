"""Work off the event loop: a bounded queue before a few threads, and what one call carries with it.

A request is one job: decode, convert, compute, encode, all in one thread, so there is one hand-over. Long engine calls
cut themselves into chunks of 1-3 ms over the engine's own pool, so short requests slip between the chunks of long ones.
"""

from __future__ import annotations

import asyncio
import ctypes
import gc
import os
import threading
import time
from collections.abc import Callable, Sized
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated, Any, Final, TypeVar

from fastapi import Depends

import engine
from engine import Accuracy, Cancel, CancelledError, DeadlineExceededError, EngineError
from service.errors import ServiceError
from service.metrics import Metrics
from service.settings import Settings
from service.store import Store

T = TypeVar("T")
Where = tuple[str | int, ...]
FOOTPRINT: Final = 4
"""Bytes held for each byte of a body, at most: itself, its numbers, a solid of them, the answer."""
SMALL: Final = 2**16
"""Bytes that a request is given whatever others hold: there are no more requests than fit into the queue."""
_KEPT: Final = 16
"""Of what requests may hold, one part in so many may have been freed before the system gets it back."""
_LEAST: Final = 2**12
"""Bytes that a request is taken to free at least."""
_LATER: Final = 0.05
"""Seconds after which what an answer was made of is gone."""
_FEW: Final = 2**20
"""Bytes held by requests under way up to which their objects are gone through in a few milliseconds."""
_libc: Final = ctypes.CDLL(None) if os.name == "posix" else None
_trim = getattr(_libc, "malloc_trim", None)
"""glibc keeps what was freed in arenas of each thread, some hundred MB after a large request."""
_OF_MALLOC: Final = {-8: 2, -1: 2**20, -3: 2**20}
"""M_ARENA_MAX, M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of mallopt(3): glibc raises the last two to 64 and 32 MB itself,
and keeps that much at the end of each thread's arena: 256 MB given, 4 to 8 hostile clients took 320 and now 240."""
_INSTEAD: Final = {
    "locate_scene": "ask for fewer points or bodies at once",
    "collide_scene": "split the scene, or name the pairs to look at in `only`",
    "collide_poses": "ask for fewer poses at once",
    "clearance_poses": "ask for fewer poses at once",
    "clip_segments": "send fewer segments at once",
    "clip_lines": "send fewer lines at once",
    "clip_polygons": "send fewer polygons at once",
    "overlay_features": "send fewer features at once",
    "locate_features": "send fewer points at once",
    "overlay_batch": "send fewer pairs at once",
    "overlay": "cut both polygons by windows first and overlay window by window",
}
"""What to ask where an answer would be too large."""
PHASES: Final = ("decode", "prepare", "compute", "encode")


def give_back_freed() -> None:
    """Have glibc give back what is freed, in this whole process, before its threads have arenas."""
    mallopt: Any = getattr(_libc, "mallopt", None)
    if mallopt is not None:
        for option, value in _OF_MALLOC.items():
            mallopt(option, value)


class Memory:
    """Bytes that requests under way hold, or may come to hold; safe to share between threads."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self.taken = self.freed = self.leaving = 0
        self.lock = threading.Lock()
        self.has_left = threading.Condition(self.lock)

    def free(self, taken: int, most: int) -> None:
        """Count the end of a request that holds, or held at most, so much: it is free once the system has it back."""
        with self.lock:
            self.freed += max(most, _LEAST)
            is_much = self.freed > self.limit // _KEPT
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
        of them: that held up all threads for up to 0.46 s (app.py turns it off).
        """
        time.sleep(_LATER)
        if self.taken - self.leaving <= _FEW:
            gc.collect()
        engine.release()
        if _trim is not None:
            _trim(0)
        with self.lock:
            self.taken -= taken
            self.leaving -= taken
            self.has_left.notify_all()

    def refusal(self, size: int) -> ServiceError:
        """Return what is said where there is no room for so many bytes more."""
        detail = (
            f"requests under way hold {self.taken} bytes, and {size} more would be too many; try again, send less at "
            "once, or raise GEOMETRY_REQUEST_BYTES"
        )
        return ServiceError("out_of_memory", detail)


class _Phase:
    """Adds the time from entering to leaving; a generator as context manager takes three times as long."""

    __slots__ = ("_before", "_name", "_seconds")

    def __init__(self, seconds: dict[str, float], name: str) -> None:
        self._seconds, self._name = seconds, name

    def __enter__(self) -> None:
        self._before = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds[self._name] += time.perf_counter() - self._before


class Call(Cancel):
    """One request under way: its limits, the store, its deadline, the time each phase took, and the memory it holds.

    It is the switch that the engine is given, to end it, and to be told of the size of what it gathers.
    """

    __slots__ = (
        "_answer", "_memory", "_most", "_taken", "coding", "end", "headers", "instead", "is_light", "may_wait",
        "media_type", "seconds", "settings", "status", "store",
    )  # fmt: skip

    def __init__(self, settings: Settings, store: Store, memory: Memory) -> None:
        super().__init__()
        self.settings = settings
        self.store = store
        self._memory = memory
        self._taken = self._answer = self._most = 0
        self.media_type = "application/json"
        self.coding: str | None = None
        """How the answer is compressed."""
        self.instead: str | None = None
        """What to ask for where the answer would be too large, once it is asked for."""
        self.is_light = False  # then it ends before a deadline's timer could be started
        self.may_wait = False  # on the event loop it would hold up everybody
        self.end = time.monotonic() + settings.deadline_seconds
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self.status: int | None = None
        self.headers: dict[str, str] = {}

    def phase(self, name: str) -> _Phase:
        """Count the time spent inside under `name`."""
        return _Phase(self.seconds, name)

    def take(self, n_bytes: int) -> None:
        """Account for so many bytes more (fewer if negative): of the body, of what is made of it, of the answer.

        Raises, with nothing counted: `body_too_large` or `answer_too_large` where this request alone would hold more
        than all may, `out_of_memory` where others hold what it needs; what takes next to nothing is always given. Off
        the event loop it waits for others that are about to give theirs back.
        """
        memory = self._memory
        with memory.lock:
            if n_bytes > 0 and self._taken + n_bytes > SMALL:
                if self._taken + n_bytes > memory.limit:
                    raise self._too_large(memory.limit, "GEOMETRY_REQUEST_BYTES")
                while self.may_wait and memory.leaving and memory.taken + n_bytes > memory.limit:  # bound: remaining()
                    memory.has_left.wait(self.remaining())
                if memory.taken + n_bytes > memory.limit:
                    raise memory.refusal(n_bytes)
            memory.taken += n_bytes
            self._taken += n_bytes
            self._most = max(self._most, self._taken)

    async def wait_for(self, n_bytes: int) -> None:
        """Wait while there is no room for so many bytes only because others are about to give theirs back."""
        memory = self._memory
        while memory.leaving and memory.taken - self._taken + n_bytes > memory.limit:  # bound: until they have
            await asyncio.sleep(_LATER / 10)

    def take_part(self, part: Sized) -> None:
        """Account for a part of the answer; `answer_too_large` beyond its limit."""
        self.remaining()
        self._answer += len(part)
        if self._answer > self.settings.max_answer_bytes:
            raise self._too_large(self.settings.max_answer_bytes, "GEOMETRY_MAX_ANSWER_BYTES")
        self.take(len(part))

    def _too_large(self, limit: int, setting: str) -> ServiceError:
        what = "this body" if self.instead is None else "the answer"
        detail = f"{what} would need more than {limit} bytes; {self.instead or 'send less at once'}, or raise {setting}"
        return ServiceError("body_too_large" if self.instead is None else "answer_too_large", detail)

    def free(self) -> None:
        """Account for the end of the request."""
        taken, self._taken = self._taken, 0
        self._memory.free(taken, self._most)
        self._most = 0

    def remaining(self) -> float:
        """Return the seconds left; `deadline_exceeded` if there are none, `cancelled` if nobody waits any more."""
        if self.is_set:
            raise CancelledError("the request was cancelled; send it again")
        left = self.end - time.monotonic()
        if left <= 0:
            raise self._too_late()
        return left

    def _too_late(self) -> DeadlineExceededError:
        seconds = self.settings.deadline_seconds
        return DeadlineExceededError(
            f"the deadline of {seconds} s passed before the answer was there; ask for less at once, or raise "
            "GEOMETRY_DEADLINE_SECONDS"
        )

    def compute(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        retold: Callable[[EngineError], None] | None = None,
        **options: Any,
    ) -> tuple[Any, Accuracy]:
        """Call an engine function within the time left; return its result and the report of its accuracy.

        retold: makes an engine error, which speaks of the function's arguments, one that speaks of the request.
        """
        if not self.is_light:
            self.instead = _INSTEAD.get(function.__name__, "ask for less at once")
            options.update(deadline=self.remaining(), cancel=self)
        with self.phase("compute"):
            try:
                result, accuracy = function(*arguments, report=True, **options)
            except DeadlineExceededError:
                raise self._too_late() from None
            except EngineError as error:
                if retold is not None:
                    retold(error)
                raise
        return result, accuracy

    def timing(self) -> str:
        """Return the value of the header Server-Timing, in milliseconds."""
        return ", ".join(f"{name};dur={1e3 * seconds:.3f}" for name, seconds in self.seconds.items())


def _no_call() -> None:
    """The route class passes the call itself; this only keeps the parameter out of the OpenAPI document."""


CallOf = Annotated[Call, Depends(_no_call)]


class _Lane:
    """A few threads behind a queue of bounded length."""

    def __init__(self, settings: Settings, name: str) -> None:
        self.executor = ThreadPoolExecutor(settings.concurrency, thread_name_prefix=name)
        self.room = settings.concurrency + settings.queue_length
        self.under_way: set[Call] = set()

    def check_room(self) -> None:
        count = len(self.under_way)
        if count >= self.room:
            raise ServiceError("queue_full", f"{count} requests are under way, the most that are taken; try again")


class Pool:
    """Two lanes, so that small questions need not wait behind large ones."""

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self._metrics = metrics
        self._lanes = {False: _Lane(settings, "request"), True: _Lane(settings, "small")}
        self._lock = threading.Lock()

    def check_room(self) -> None:
        """Raise `queue_full` if another large question would not be taken now."""
        self._lanes[False].check_room()

    async def run(self, call: Call, job: Callable[[], T], is_small: bool) -> T:
        """Run `job` in a thread; if this coroutine is cancelled, the call's switch is thrown."""
        lane = self._lanes[is_small]
        with self._lock:
            lane.check_room()
            lane.under_way.add(call)
        metrics, before = self._metrics, time.perf_counter()
        metrics.queued.inc()

        def begin() -> T:
            metrics.queued.dec()
            metrics.waited.observe(time.perf_counter() - before)
            call.may_wait = True
            return job()

        try:
            future = lane.executor.submit(begin)
        except RuntimeError:  # closed between two steps of this request
            self._forget(lane, call)
            metrics.queued.dec()
            raise ServiceError("queue_full", "the service is shutting down; try again") from None
        future.add_done_callback(lambda done: self._forget(lane, call, done.cancelled()))
        try:
            return await asyncio.wrap_future(future)
        except asyncio.CancelledError:
            call.set()
            raise

    def close(self) -> None:
        """Cancel what still runs and let the threads end."""
        with self._lock:
            for call in [call for lane in self._lanes.values() for call in lane.under_way]:
                call.set()
        for lane in self._lanes.values():
            lane.executor.shutdown(wait=True, cancel_futures=True)

    def _forget(self, lane: _Lane, call: Call, never_began: bool = False) -> None:
        with self._lock:
            lane.under_way.discard(call)
        if never_began:
            self._metrics.queued.dec()
