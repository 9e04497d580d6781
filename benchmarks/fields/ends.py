"""How long every operation still computes after its deadline, on inputs that keep it busy for minutes.

The questions are those of the test that holds every operation to its end (tests/contract), which names them all; the
figure is CPU time, so that it is the same on a shared machine. Strict: 0.25 s.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from benchmarks.contest import Size, Task
from benchmarks.fields import Figure

AFTER, AIM = 0.25, 0.05
"""Seconds of CPU after a deadline."""
TRIES = 3


def tasks(size: Size) -> Iterator[Task]:
    """Yield a row for each operation, and one for its first question about a large mesh."""
    try:
        from tests.contract import test_deadlines_in_process as ends
    except ImportError:  # the extra test
        return
    for name, ask in ends.WORK.items():
        yield Task(name, partial(_late, size, name, ask), is_figure=True)
    for name, ask in ends.FIRST.items():
        yield Task(f"{name}, first", partial(_late, size, f"{name}, first", ask, True), is_figure=True)


def _late(size: Size, name: str, ask: Any, is_first: bool = False) -> Figure:
    from tests.contract import test_deadlines_in_process as ends

    ends.prepare()
    seconds = ends.SOON if is_first or name == "Surface" else ends.DEADLINE
    found = []
    for _ in range(size.of(TRIES, 1)):
        again = partial(ask, ends.new(ends.solid("fine"))) if is_first else ask
        found.append(ends.cpu_after(again, seconds, False))
    return Figure(
        name, "s", [max(0.0, *found)], AFTER, AIM, f"CPU after a deadline of {seconds} s, the worst of {len(found)}"
    )
