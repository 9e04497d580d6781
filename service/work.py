"""Thread pool of the service: a bounded queue before a few threads, and the context of one call.

A request is one job: decode, convert, compute, encode, all in one thread, so there is one hand-over. Long engine calls
run in chunks of 2-20 ms over the engine's own pool, so short requests slip between the chunks of long ones.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Sized
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Final, TypeVar

from fastapi import Depends

from engine import Accuracy, Cancel, CancelledError, DeadlineExceededError, EngineError
from service.errors import ServiceError, forget_frames
from service.memory import LATER, SMALL, Memory
from service.metrics import Metrics
from service.settings import Settings
from service.store import Store

T = TypeVar("T")
Where = tuple[str | int, ...]
_INSTEAD: Final = {
    "locate_scene": "ask for fewer points or bodies at once",
    "collide_scene": "split the scene, or name the pairs to look at in `only`",
    "collide_poses": "ask for fewer poses at once",
    "clearance_poses": "ask for fewer poses at once",
    "clip_segments": "send fewer segments at once",
    "hits": "send fewer segments at once, or ask for the first hits",
    "clip_lines": "send fewer lines at once",
    "clip_polygons": "send fewer polygons at once",
    "overlay_features": "send fewer features at once",
    "locate_features": "send fewer points at once",
    "overlay_batch": "send fewer pairs at once",
    "overlay": "cut both polygons by windows first and overlay window by window",
}
"""Advice for requests whose answer would be too large."""
PHASES: Final = ("decode", "prepare", "compute", "encode")


THREADS: Final = "geometry-"
"""Prefix of the names of threads that answer requests."""
_LATE: Final = "late"
GRACE: Final = 0.2
"""Seconds that a request has after its deadline to report by itself."""


class _Phase:
    """Adds the time from entering to leaving; a generator as context manager takes three times as long."""

    __slots__ = ("_before", "_name", "_seconds")

    def __init__(self, seconds: dict[str, float], name: str) -> None:
        self._seconds, self._name = seconds, name

    def __enter__(self) -> None:
        self._before = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds[self._name] += time.perf_counter() - self._before


@dataclass(frozen=True, slots=True)
class Noted(Accuracy):
    """A report with what was left out of the question."""

    notes: list[str]


class Call(Cancel):
    """One running request: its limits, the store, its deadline, the time of each phase, and its memory.

    It is the engine's `Cancel` of the request: it ends the engine's call, and is notified before an answer grows.
    """

    __slots__ = (
        "_answer", "_is_over", "_is_running", "_memory", "_most", "_taken", "coding", "end", "file", "headers",
        "instead", "is_light", "may_wait", "media_type", "notes", "path", "seconds", "settings", "status", "store",
    )  # fmt: skip

    def __init__(self, settings: Settings, store: Store, memory: Memory) -> None:
        super().__init__()
        self.settings = settings
        self.store = store
        self._memory = memory
        self._taken = self._answer = self._most = 0
        self._is_running = self._is_over = False
        self.media_type = "application/json"
        self.coding: str | None = None
        """How the answer is compressed."""
        self.file: str | None = None
        """The media type of a mesh file in place of JSON, where the answer may be one."""
        self.instead: str | None = None
        """Advice if the answer would be too large."""
        self.is_light = False  # then it ends before a deadline's timer could be started
        self.may_wait = False  # on the event loop it would hold up everybody
        self.start_clock()
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self.path = ""  # where the request asks
        self.notes: list[str] = []
        """What the report says of parts of the question that were left out."""
        self.status: int | None = None
        self.headers: dict[str, str] = {}

    def start_clock(self) -> None:
        """Start the time to the deadline."""
        self.end = time.monotonic() + self.settings.deadline_seconds

    def phase(self, name: str) -> _Phase:
        """Count the time spent inside under `name`."""
        return _Phase(self.seconds, name)

    def note(self, text: str) -> None:
        """Have the report of the answer say a sentence, once."""
        if text not in self.notes:
            self.notes.append(text)

    def take(self, n_bytes: int) -> None:
        """Account for n_bytes more (fewer if negative): of the body, of its values, of the answer.

        Raises, with nothing counted: `body_too_large` or `answer_too_large` if this request alone would need more than
        all may, `out_of_memory` if others use what it needs; next to nothing is always granted. Off the event loop it
        waits for others that are about to return theirs.
        """
        memory = self._memory
        with memory.lock:
            while self.may_wait and memory.leaving and memory.taken + n_bytes > memory.limit:  # bound: remaining()
                memory.has_left.wait(self.remaining())
            self._check(n_bytes)
            memory.taken += n_bytes
            self._taken += n_bytes
            self._most = max(self._most, self._taken)

    async def wait_for(self, n_bytes: int) -> None:
        """Raise as `take` would, without taking; wait while others are about to return what is missing."""
        memory = self._memory
        while memory.leaving and memory.taken + n_bytes > memory.limit:  # bound: until they have
            await asyncio.sleep(LATER / 10)
        self._check(n_bytes)

    def _check(self, n_bytes: int) -> None:
        if n_bytes > 0 and self._taken + n_bytes > SMALL:
            if self._taken + n_bytes > self._memory.limit:
                raise self._too_large(self._memory.limit, "GEOMETRY_REQUEST_BYTES")
            if self._memory.taken + n_bytes > self._memory.limit:
                raise ServiceError(
                    "out_of_memory",
                    f"requests under way hold {self._memory.taken} bytes, and {n_bytes} more would be too many; try "
                    "again, send less at once, or raise GEOMETRY_REQUEST_BYTES",
                )

    def take_part(self, part: Sized) -> None:
        """Account for a part of the answer; `answer_too_large` beyond its limit."""
        self.remaining()
        self._check_answer(len(part))
        self._answer += len(part)
        self.take(len(part))

    def check_answer(self, n_bytes: int) -> None:
        """Raise immediately what `take_part` would if an answer gets at least so long."""
        self._check_answer(n_bytes)
        self.take(n_bytes)
        self.take(-n_bytes)

    def _check_answer(self, n_bytes: int) -> None:
        if self._answer + n_bytes > self.settings.max_answer_bytes:
            raise self._too_large(self.settings.max_answer_bytes, "GEOMETRY_MAX_ANSWER_BYTES")

    def _too_large(self, limit: int, setting: str) -> ServiceError:
        what = "this body" if self.instead is None else "the answer"
        detail = f"{what} would need more than {limit} bytes; {self.instead or 'send less at once'}, or raise {setting}"
        return ServiceError("body_too_large" if self.instead is None else "answer_too_large", detail)

    def run(self, job: Callable[[], T]) -> T:
        """Return the result of `job`, in a thread: its memory counts until it ends, even if nobody waits."""
        self.may_wait = self._is_running = True
        try:
            return job()
        except BaseException as error:
            if self._is_over:  # nobody asks what was wrong: what it holds goes before it is counted as free
                forget_frames(error)
            raise
        finally:
            with self._memory.lock:
                self._is_running = False
            if self._is_over:
                self.free()

    def free(self) -> None:
        """Account for the end of the request, once no thread works on it."""
        with self._memory.lock:
            self._is_over = True
            if self._is_running:
                return
            taken, most = self._taken, self._most
            self._taken = self._most = 0
        self._memory.free(taken, most)

    def remaining(self) -> float:
        """Return the seconds left; raise `deadline_exceeded` if there are none, `cancelled` if nobody waits any
        more."""
        if self.is_set:
            raise CancelledError("the request was cancelled; send it again")
        left = self.end - time.monotonic()
        if left <= 0:
            raise self.too_late()
        return left

    def too_late(self) -> DeadlineExceededError:
        """Return the error for a passed deadline."""
        seconds = self.settings.deadline_seconds
        return DeadlineExceededError(
            f"the deadline of {seconds} s passed before the answer was there; ask for less at once, or raise "
            "GEOMETRY_DEADLINE_SECONDS"
        )

    def compute(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        rewrite_error: Callable[[EngineError], None] | None = None,
        **options: Any,
    ) -> tuple[Any, Accuracy]:
        """Call an engine function within the time left; return its result and the report of its accuracy.

        rewrite_error: rewrites the argument paths of an engine error to request paths.
        """
        if not self.is_light:
            self.instead = _INSTEAD.get(function.__name__, "ask for less at once")
            options.update(deadline=self.remaining(), cancel=self)
        with self.phase("compute"):
            try:
                result, accuracy = function(*arguments, report=True, **options)
            except DeadlineExceededError:
                raise self.too_late() from None
            except EngineError as error:
                if rewrite_error is not None:
                    rewrite_error(error)
                raise
        return result, accuracy if not self.notes else Noted(**asdict(accuracy), notes=self.notes)

    def timing(self) -> str:
        """Return the value of the header Server-Timing, in milliseconds."""
        return ", ".join(f"{name};dur={1e3 * seconds:.3f}" for name, seconds in self.seconds.items())


CallOf = Annotated[Call, Depends(lambda: None)]
"""The route class passes the call itself; this only keeps the parameter out of the OpenAPI document."""


class _Lane:
    """A few threads behind a queue of bounded length."""

    def __init__(self, settings: Settings, name: str) -> None:
        self.n_threads = settings.concurrency
        self.executor = ThreadPoolExecutor(self.n_threads, thread_name_prefix=THREADS + name)
        self.room = settings.concurrency + settings.queue_length
        self.under_way: set[Call] = set()

    def check_room(self) -> None:
        count = len(self.under_way)
        if count >= self.room:
            raise ServiceError("queue_full", f"{count} requests are under way, the most that are taken; try again")


class Pool:
    """Two lanes of threads, so that small questions need not wait behind large ones."""

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self._metrics = metrics
        self._lanes = {False: _Lane(settings, "request"), True: _Lane(settings, "small")}
        self._lock = threading.Lock()

    def check_room(self) -> None:
        """Raise `queue_full` if another large question would not be accepted now."""
        self._lanes[False].check_room()

    def is_stuck(self) -> bool:
        """Return whether every thread for large questions works on one whose deadline has passed."""
        lane, late = self._lanes[False], time.monotonic() - 2 * GRACE
        with self._lock:
            return sum(call.end < late for call in lane.under_way) >= lane.n_threads

    async def run(self, call: Call, job: Callable[[], T], is_small: bool) -> T:
        """Run `job` in a thread. If it does not end in time, or this coroutine is cancelled, set the call's switch.

        A job that has not begun yet never does, and leaves its place in the queue immediately.
        """
        lane = self._lanes[is_small]
        with self._lock:
            lane.check_room()
            lane.under_way.add(call)
        metrics, before, waiting = self._metrics, time.perf_counter(), [job]

        def begin() -> T:
            metrics.queued.dec()
            metrics.waited.observe(time.perf_counter() - before)
            return call.run(waiting.pop())

        metrics.queued.inc()
        try:
            future = lane.executor.submit(begin)
        except RuntimeError:  # closed between two steps of this request
            self._forget(lane, call, never_began=True)
            raise ServiceError("queue_full", "the service is shutting down; try again") from None
        future.add_done_callback(lambda done: self._forget(lane, call, done.cancelled()))
        result = asyncio.wrap_future(future)
        left = max(0.0, call.end - time.monotonic()) + GRACE
        timer = asyncio.get_running_loop().call_later(left, result.cancel, _LATE)
        try:
            return await result
        except asyncio.CancelledError as cancelled:
            call.set()
            if future.cancel():
                waiting.clear()  # the executor lets go of it only when a thread comes to it
            if cancelled.args == (_LATE,):
                raise call.too_late() from None
            raise
        finally:
            timer.cancel()

    def close(self, seconds: float = 0.0) -> None:
        """Cancel running jobs, accept no more, and wait some time for their end."""
        with self._lock:
            for call in [call for lane in self._lanes.values() for call in lane.under_way]:
                call.set()
        for lane in self._lanes.values():
            lane.executor.shutdown(wait=False, cancel_futures=True)
        end = time.monotonic() + seconds
        while any(lane.under_way for lane in self._lanes.values()) and time.monotonic() < end:
            time.sleep(0.01)

    def _forget(self, lane: _Lane, call: Call, never_began: bool) -> None:
        with self._lock:
            lane.under_way.discard(call)
        if never_began:
            self._metrics.queued.dec()
