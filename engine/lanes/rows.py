"""Rows of eight numbers as boxes: the least of two rows is the box around two boxes.

A row is (low x, y, z, 0, -high x, -y, -z, 0), so one comparison of eight lanes joins two boxes.
"""

from __future__ import annotations

from engine.lanes.lanes import lesser, load, store
from engine.lanes.tracing import Number, Rows, traced


@traced
def fill(rows: Rows, row: int, value: Number) -> None:
    """Set all numbers of a row to one."""
    store(rows, row, value)


@traced
def join(boxes: Rows, box: int, others: Rows, other: int) -> None:
    """Set a row to the least of itself and a row of another array, number by number."""
    store(boxes, box, lesser(load(boxes, box), load(others, other)))


@traced
def exchange(rows: Rows, i: int, j: int) -> None:
    """Exchange two rows."""
    first, second = load(rows, i), load(rows, j)
    store(rows, i, second)
    store(rows, j, first)
