"""Large arrays joined, gathered and summed by several threads, which touch the memory of the result first."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any, Final

import numpy as np

from engine.running.budget import Budget
from engine.running.parallel import run_chunks

_FEW_BYTES: Final = 1 << 22
"""Size of arrays up to which one thread copies them."""
SECONDS_OF_BYTE: Final = 3e-10
"""Time in which a byte of fresh memory is written."""


def join_columns(
    parts: Sequence[Sequence[Any]], budget: Budget, workers: int | None, axes: Sequence[int] | None = None
) -> list[Any]:
    """Return arrays of parts, at least one, concatenated column by column along ``axes``, by default the first.

    Large ones are copied by several threads, which touch the memory of the result first. Raises: as `Budget.check`.
    """
    if len(parts) == 1:
        return list(parts[0])
    columns = list(zip(*parts))
    axes = axes or [0] * len(columns)
    if sum(array.nbytes for column in columns for array in column) < _FEW_BYTES:
        return [np.concatenate(column, axis) for column, axis in zip(columns, axes)]
    ends = [np.cumsum([array.shape[axis] for array in column]) for column, axis in zip(columns, axes)]
    joined, moved = [], []
    for column, axis, each in zip(columns, axes, ends):
        shape = list(column[0].shape)
        shape[axis] = int(each[-1])
        joined.append(np.empty(shape, column[0].dtype))
        moved.append(np.moveaxis(joined[-1], axis, 0))

    def copy(first: int, last: int) -> None:
        for part in range(first, last):
            budget.check()
            for column, axis, into, each in zip(columns, axes, moved, ends):
                n = column[part].shape[axis]
                into[each[part] - n : each[part]] = np.moveaxis(column[part], axis, 0)

    pace = SECONDS_OF_BYTE * sum(array.nbytes for array in joined) / len(parts)
    run_chunks(copy, len(parts), budget=budget, first_chunk=1, workers=workers, pace=pace)
    return joined


def take_rows(arrays: Sequence[Any], rows: Any, budget: Budget, workers: int | None) -> list[Any]:
    """Return the rows of arrays, all of one length, at places ``rows``; many by several threads, as `join_columns`."""
    if not len(rows) or sum(len(rows) * array[:1].nbytes for array in arrays) < _FEW_BYTES:
        return [array[rows] for array in arrays]
    taken = [np.empty((len(rows), *array.shape[1:]), array.dtype) for array in arrays]

    def take(first: int, last: int) -> None:
        for array, into in zip(arrays, taken):
            np.take(array, rows[first:last], axis=0, out=into[first:last], mode="clip")  # others copy once more

    run_chunks(take, len(rows), budget=budget, first_chunk=1 << 14, workers=workers)
    return taken


def join_sizes(parts: Sequence[Any], budget: Budget, workers: int | None) -> Any:
    """Return offsets (n + 1,) int64 from 0 of items whose sizes are the concatenated parts, as `join_columns`."""
    starts = [0, *accumulate(map(len, parts))]
    offsets = np.empty(starts[-1] + 1, np.int64)
    offsets[0] = 0
    if offsets.nbytes < _FEW_BYTES:
        np.cumsum(np.concatenate([np.zeros(0, np.int64), *parts]), out=offsets[1:])
        return offsets
    before = [0, *accumulate(int(part.sum()) for part in parts)]

    def fill(first: int, last: int) -> None:
        for part in range(first, last):
            some = offsets[starts[part] + 1 : starts[part + 1] + 1]
            np.add(np.cumsum(parts[part], out=some), before[part], out=some)

    pace = SECONDS_OF_BYTE * offsets.nbytes / len(parts)
    run_chunks(fill, len(parts), budget=budget, first_chunk=1, workers=workers, pace=pace)
    return offsets
