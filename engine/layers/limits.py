"""What all parts of one call about layers share: time, threads, the grid, and the sum of accuracy reports."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from engine.bounding.box_grid import BLOCK, pairs_of_boxes
from engine.errors import InvalidInputError
from engine.polygon_overlay.grid import grid_of
from engine.running.budget import Budget, Cancel
from engine.solids.checks import shown
from engine.types import Accuracy, FloatArray, IntArray


class Limits:
    """Remaining time of one public call for the calls of which it consists, and the sum of their accuracy reports;
    grid: the spacing to which areas are snapped, None for no grid; wrap: 180 where polygons are cut at that meridian;
    is_outside: whether a clip returns what is outside."""

    def __init__(
        self, deadline: float | None, cancel: Cancel | None, workers: int | None = None, grid: float | None = None,
        wrap: float | None = None, keep: str = "inside",
    ) -> None:  # fmt: skip
        if grid is not None:
            grid_of(grid)  # checks it
        if wrap is not None and (isinstance(wrap, bool) or not isinstance(wrap, (int, float)) or wrap != 180):
            raise InvalidInputError(f"wrap must be 180, the meridian to cut at, got {shown(wrap)}", ("wrap",))
        if not isinstance(keep, str) or keep not in ("inside", "outside"):
            raise InvalidInputError(f"keep must be inside or outside, got {shown(keep)}", ("keep",))
        self.grid, self.wrap, self.is_outside = grid, wrap is not None, keep == "outside"
        seconds = Budget(deadline, cancel).deadline  # checks both
        self._end = None if seconds is None else time.monotonic() + seconds
        self._cancel, self.workers = cancel, workers
        self._ulps, self._counts = 0.5, [0, 0, 0]

    def options(self) -> dict[str, Any]:
        """Return the keyword arguments deadline, cancel, workers and report for the next call."""
        left = None if self._end is None else self._end - time.monotonic()
        return {"deadline": left, "cancel": self._cancel, "workers": self.workers, "report": True}

    def time(self) -> dict[str, Any]:
        """Return the keyword arguments deadline and cancel for the next call."""
        return {name: value for name, value in self.options().items() if name in ("deadline", "cancel")}

    def budget(self) -> Budget:
        """Return a budget of the remaining time."""
        return Budget(self.options()["deadline"], self._cancel)

    def pairs_of_boxes(
        self, low: FloatArray, high: FloatArray, is_chosen: Any = None, n_left: int | None = None, n_bytes: int = 16
    ) -> IntArray:
        """Return pairs (m, 2), first < second, sorted, of closed boxes low, high (n, d) that intersect.
        is_chosen(pairs): optional, (k,) bool, which of a block to return. n_left: if given, only pairs of one of the
        first n_left boxes and one of the others. n_bytes: memory charged to the budget for a pair."""
        blocks = [np.zeros((0, 2), np.int64)]
        with self.budget() as budget:
            for pairs in pairs_of_boxes(low, high, budget, BLOCK, n_left) if len(low) else ():
                budget.check()
                blocks.append(pairs if is_chosen is None else pairs[is_chosen(pairs)])
                budget.take(n_bytes * len(blocks[-1]))
            budget.check()
        pairs = np.concatenate(blocks)
        return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))] if len(blocks) > 2 else pairs

    def record(self, answer: tuple[Any, Accuracy]) -> Any:
        """Add the accuracy of an answer (result, accuracy) to the sum; return the result."""
        result, accuracy = answer
        self._ulps = max(self._ulps, accuracy.coordinates_ulp or 0.0)
        report = accuracy.n_items, accuracy.n_beyond_filter, accuracy.n_rational
        self._counts = [count + more for count, more in zip(self._counts, report)]
        return result

    @property
    def accuracy(self) -> Accuracy:
        """Accuracy of all calls together; items are edges."""
        n_items, n_beyond, n_rational = self._counts
        return Accuracy("exact", self._ulps, n_items, n_beyond, n_rational, "arrangement")
