"""Work off the event loop: a bounded queue before a few threads, and what one call carries with it.

A request is one job: decode, convert, compute, encode, all in one thread, so there is one hand-over. Long engine calls
cut themselves into chunks of 1-3 ms over the engine's own pool, so short requests slip between the chunks of long ones.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated, Any, Final, TypeVar

from fastapi import Depends

from engine import Accuracy, Cancel, DeadlineExceededError, EngineError
from service.errors import ServiceError
from service.settings import Settings
from service.store import Store

T = TypeVar("T")
Where = tuple[str | int, ...]
FOOTPRINT: Final = 4
"""Bytes held for each byte of a body, at most: itself, its numbers, a solid of them, the answer."""
PHASES: Final = ("decode", "prepare", "compute", "encode")


class Memory:
    """Bytes of bodies under way, each counted with what is made of it; touched on the event loop only."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self.taken = 0

    def take(self, size: int) -> None:
        """Count `size` more bytes (fewer if negative); `out_of_memory` beyond the limit, with nothing counted."""
        if size > 0 and FOOTPRINT * (self.taken + size) > self._limit:
            raise ServiceError(
                "out_of_memory",
                f"{self.taken} bytes of bodies are under way, and {size} more would need too much memory; try again, "
                "send less at once, or raise GEOMETRY_REQUEST_BYTES",
            )
        self.taken += size


class _Phase:
    """Adds the time from entering to leaving; a generator as context manager takes three times as long."""

    __slots__ = ("_before", "_name", "_seconds")

    def __init__(self, seconds: dict[str, float], name: str) -> None:
        self._seconds, self._name = seconds, name

    def __enter__(self) -> None:
        self._before = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds[self._name] += time.perf_counter() - self._before


class Call:
    """One request under way: its limits, the store, its deadline and cancel switch, the time each phase took."""

    __slots__ = (
        "_memory", "_taken", "cancel", "end", "headers", "is_light", "media_type", "seconds", "settings", "status",
        "store",
    )  # fmt: skip

    def __init__(self, settings: Settings, store: Store, memory: Memory) -> None:
        self.settings = settings
        self.store = store
        self._memory = memory
        self._taken = 0
        self.media_type = "application/json"
        self.cancel = Cancel()
        self.is_light = False  # then it ends before a deadline's timer could be started
        self.end = time.monotonic() + settings.deadline_seconds
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self.status: int | None = None
        self.headers: dict[str, str] = {}

    def phase(self, name: str) -> _Phase:
        """Count the time spent inside under `name`."""
        return _Phase(self.seconds, name)

    def take(self, size: int) -> None:
        """Account for so many more bytes of a body; `out_of_memory` if there are too many under way."""
        self._memory.take(size)
        self._taken += size

    def free(self) -> None:
        """Account for the end of the request."""
        self._memory.take(-self._taken)
        self._taken = 0

    def remaining(self) -> float:
        """Return the seconds left; `deadline_exceeded` if there are none."""
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
        where: Callable[[Where], Where] | None = None,
        **options: Any,
    ) -> tuple[Any, Accuracy]:
        """Call an engine function within the time left; return its result and the report of its accuracy.

        where: turns the path of an engine error, which starts with the argument's name, into one in the request.
        """
        if not self.is_light:
            options.update(deadline=self.remaining(), cancel=self.cancel)
        with self.phase("compute"):
            try:
                result, accuracy = function(*arguments, report=True, **options)
            except DeadlineExceededError:
                raise self._too_late() from None
            except EngineError as error:
                if where is not None:
                    error.where = where(error.where)
                raise
        return result, accuracy

    def timing(self) -> str:
        """Return the value of the header Server-Timing, in milliseconds."""
        return ", ".join(f"{name};dur={1e3 * seconds:.3f}" for name, seconds in self.seconds.items())


def _no_call() -> None:
    """The route class passes the call itself; this only keeps the parameter out of the OpenAPI document."""


CallOf = Annotated[Call, Depends(_no_call)]


class Pool:
    """A few threads behind a queue of bounded length."""

    def __init__(self, settings: Settings) -> None:
        self._executor = ThreadPoolExecutor(settings.concurrency, thread_name_prefix="request")
        self._room = settings.concurrency + settings.queue_length
        self._under_way: set[Call] = set()
        self._lock = threading.Lock()

    def check_room(self) -> None:
        """Raise `queue_full` if another job would not be taken now."""
        count = len(self._under_way)
        if count >= self._room:
            raise ServiceError("queue_full", f"{count} requests are under way, the most that are taken; try again")

    async def run(self, call: Call, job: Callable[[], T]) -> T:
        """Run `job` in a thread; if this coroutine is cancelled, the call's switch is thrown."""
        with self._lock:
            self.check_room()
            self._under_way.add(call)
        try:
            future = self._executor.submit(job)
        except RuntimeError:  # closed between two steps of this request
            self._forget(call)
            raise ServiceError("queue_full", "the service is shutting down; try again") from None
        future.add_done_callback(lambda _: self._forget(call))
        try:
            return await asyncio.wrap_future(future)
        except asyncio.CancelledError:
            call.cancel.set()
            raise

    def close(self) -> None:
        """Cancel what still runs and let the threads end."""
        with self._lock:
            for call in self._under_way:
                call.cancel.set()
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _forget(self, call: Call) -> None:
        with self._lock:
            self._under_way.discard(call)
