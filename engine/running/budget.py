"""Deadline and cancel switch of a call, and the flag that kernels poll."""

from __future__ import annotations

import heapq
import math
import os
import threading
import time
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np

from engine.errors import CancelledError, DeadlineExceededError, InvalidInputError
from engine.types import FlagArray


class Cancel:
    """A switch that another thread may set: every call with it ends soon with `CancelledError`."""

    __slots__ = ("_flags", "_lock", "is_set")

    def __init__(self) -> None:
        self.is_set = False
        self._flags: list[FlagArray] = []
        self._lock = threading.Lock()

    def set(self) -> None:
        """Set the switch; it stays set."""
        with self._lock:
            self.is_set = True
            for flag in self._flags:
                flag[0] = 1

    def attach(self, flag: FlagArray) -> None:
        """Have `flag` raised when the switch is set.

        Parameters
        ----------
        flag : ndarray of uint8, shape (1,)
            Read by kernels.
        """
        with self._lock:
            self._flags.append(flag)
            if self.is_set:
                flag[0] = 1

    def detach(self, flag: FlagArray) -> None:
        """Forget `flag`.

        Parameters
        ----------
        flag : ndarray of uint8, shape (1,)
            One that `attach` was given.
        """
        with self._lock:
            self._flags = [other for other in self._flags if other is not flag]

    def note(self, text: str) -> None:
        """Take a remark on an argument that was read; a subclass that reports them overrides this. Others warn.

        Parameters
        ----------
        text : str
            What was left out, a sentence.
        """
        warnings.warn(text, stacklevel=2)

    def take(self, n_bytes: int) -> None:
        """Note that an answer is about to allocate memory; a subclass that bounds it overrides this, and raises.

        Parameters
        ----------
        n_bytes : int
            How many more bytes.
        """


@dataclass(order=True, slots=True)
class _Waiting:
    """A flag and the time at which to set it."""

    end: float
    flag: FlagArray | None = field(compare=False)  # None: no longer


class _Clock:
    """Sets flags at their time, all from one thread: starting a thread takes as long as a small call."""

    def __init__(self) -> None:
        self._heap: list[_Waiting] = []
        self._n_dropped = 0
        self._changed = threading.Condition()
        self._runs = False

    def add(self, end: float, flag: FlagArray) -> _Waiting:
        """Schedule `flag` to be set at the time `end` of the monotonic clock."""
        waiting = _Waiting(end, flag)
        with self._changed:
            heapq.heappush(self._heap, waiting)
            if not self._runs:
                self._runs = True
                threading.Thread(target=self._run, name="deadlines", daemon=True).start()
            elif self._heap[0] is waiting:
                self._changed.notify()
        return waiting

    def drop(self, waiting: _Waiting) -> None:
        """Cancel a deadline that `add` scheduled, passed or not; its flag is never touched again."""
        with self._changed:
            waiting.flag = None
            self._n_dropped += 1
            if 2 * self._n_dropped > len(self._heap) + 100:
                self._heap = [other for other in self._heap if other.flag is not None]
                heapq.heapify(self._heap)
                self._n_dropped = 0

    def _run(self) -> None:
        with self._changed:
            while True:  # ends with the process
                now = time.monotonic()
                while self._heap and (self._heap[0].end <= now or self._heap[0].flag is None):
                    flag = heapq.heappop(self._heap).flag
                    if flag is not None:
                        flag[0] = 1
                self._changed.wait(self._heap[0].end - now if self._heap else None)


_clock = _Clock()


def _forget_clock() -> None:
    """Reset the clock in a forked child, which has its object but not its thread."""
    global _clock
    _clock = _Clock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_clock)


_here = threading.local()
_POLL: Final = 0x3FF
Item = TypeVar("Item")


def work_under(budget: Budget) -> None:
    """Make `poll` check, in this thread, a budget that was entered in another."""
    _here.budget = budget


def poll() -> None:
    """Check every `Budget` under which this thread works, if any: for code deep below a call.

    Raises: what `Budget.check` raises.
    """
    budget: Budget | None = getattr(_here, "budget", None)
    while budget is not None:
        budget.check()
        budget = budget.around


def current() -> Budget:
    """Return the budget under which this thread works, `UNLIMITED` without one."""
    return getattr(_here, "budget", None) or UNLIMITED


def reading(deadline: float | None, cancel: Cancel | None) -> Budget:
    """Return the budget under which the arguments of a call are read; `left` is what remains for the rest of it."""
    return UNLIMITED if deadline is None and cancel is None else Budget(deadline, cancel)


def note(text: str) -> None:
    """Pass a remark on an argument to the switch of the call under which this thread works; without one, warn."""
    budget: Budget | None = getattr(_here, "budget", None)
    while budget is not None and budget.cancel is None:
        budget = budget.around
    (_WARNING if budget is None or budget.cancel is None else budget.cancel).note(text)


_WARNING: Final = Cancel()


def polled(items: Iterable[Item]) -> Iterator[Item]:
    """Yield items and poll every thousand: for loops of about a microsecond a turn.

    Raises: what `poll` raises.
    """
    if type(items) is list and len(items) <= _POLL:
        poll()
        return iter(items)
    return _polled(items)


def _polled(items: Iterable[Item]) -> Iterator[Item]:
    for count, item in enumerate(items):
        if count & _POLL == 0:
            poll()
        yield item


class Budget:
    """Deadline and cancel switch of one call; as a context manager it is also checked by `poll`.

    deadline: seconds from now, None for no limit. cancel: a switch shared with other threads, or None. workers: threads
    that may prepare what the call needs (`parallel.share`); None: those of the budget around, else as many as pay.
    around: the budget under which this one was entered. `flag` is the one-element uint8 array that kernels poll.
    """

    def __init__(self, deadline: float | None = None, cancel: Cancel | None = None, workers: int | None = None) -> None:
        if deadline is not None and (
            isinstance(deadline, bool) or not isinstance(deadline, (int, float)) or deadline != deadline  # NaN
        ):
            raise InvalidInputError(
                f"deadline must be a number of seconds or None, got {shown(deadline)}", ("deadline",)
            )
        if cancel is not None and not isinstance(cancel, Cancel):
            raise InvalidInputError(f"cancel must be an engine.Cancel or None, got {shown(cancel)}", ("cancel",))
        longest = threading.TIMEOUT_MAX  # of the timer, some centuries: more than that is no limit
        self.deadline = None if deadline is None or deadline > longest else float(max(deadline, -longest))
        self.flag: FlagArray = np.zeros(1, np.uint8)
        self.cancel, self.workers = cancel, workers
        self._end = None if self.deadline is None else time.monotonic() + self.deadline
        self._waiting: _Waiting | None = None
        self.around: Budget | None = None

    def __enter__(self) -> Budget:
        if self.cancel is None and self._end is None and self.workers is None:  # nothing to ask for
            return self
        self.around, _here.budget = getattr(_here, "budget", None), self
        if self.workers is None and self.around is not None:
            self.workers = self.around.workers
        if self.cancel is not None:
            self.cancel.attach(self.flag)
        if self._end is not None:
            self._waiting = _clock.add(self._end, self.flag)
        return self

    def __exit__(self, *_: object) -> None:
        if self.cancel is None and self._end is None and self.workers is None:
            return
        _here.budget = self.around
        if self._waiting is not None:
            _clock.drop(self._waiting)
        if self.cancel is not None:
            self.cancel.detach(self.flag)

    def check(self) -> None:
        """Raise `CancelledError` or `DeadlineExceededError` if the call must end; cheap enough for inner loops.

        A set `flag` suffices: a kernel may have seen it and left its results incomplete.
        """
        if self.cancel is not None and self.cancel.is_set:
            raise CancelledError("the call was cancelled by its caller")
        if self._end is not None and (self.flag[0] or time.monotonic() >= self._end):
            raise DeadlineExceededError(
                f"the deadline of {self._first_to_end().deadline!r} s passed before the call was done; "
                "ask for less in one call or give it more time"
            )
        if self.flag[0]:
            raise CancelledError("another part of the call failed")

    def resume(self) -> None:
        """Lower the flag that was raised because another part failed, unless the call must end. Caller guarantees that
        no part runs any more."""
        self.flag[0] = 0  # order: a clock or switch that raises it from now on stays seen
        if (self.cancel is not None and self.cancel.is_set) or (
            self._end is not None and time.monotonic() >= self._end
        ):
            self.flag[0] = 1

    def _first_to_end(self) -> Budget:
        """Return the budget whose deadline was asked for: that of a call within a call is what was left of it."""
        budget = self
        while (around := budget.around) is not None and (around._end or math.inf) <= (budget._end or math.inf):
            budget = around
        return budget

    def left(self) -> float | None:
        """Return the seconds until the deadline, 0.0 after it, None without one."""
        return None if self._end is None else max(self._end - time.monotonic(), 0.0)

    def take(self, n_bytes: int) -> None:
        """Announce by how many bytes an answer is about to grow, if the arguments do not bound its size."""
        if self.cancel is not None:
            self.cancel.take(n_bytes)


UNLIMITED: Final = Budget()
"""The budget of all calls without a limit and without threads: nothing ever sets its flag."""


def shown(value: object) -> str:
    """Return a number as it is, and the type of any other value: its text could be endless."""
    is_short = isinstance(value, float) or (isinstance(value, int) and abs(value) < 10**20)
    return repr(value) if is_short else f"a value of type {type(value).__name__}"
