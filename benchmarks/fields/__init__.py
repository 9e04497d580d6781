"""The contests, one file an operation.

``contests(seed, scale)`` yields those of the report; scale: 1.0 for the record, less for a quick run with fewer items.
``table(size)`` yields those of the tables as (name, what makes it), so that none is made in vain; ``figures(size)``
likewise what is no contest.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from benchmarks.contest import Contest

TABLES = ("containment", "collision", "segments", "polygons", "overlay", "calls")


@dataclass(frozen=True, slots=True)
class Size:
    """How large the workloads are."""

    seed: int
    is_quick: bool

    def of(self, full: int, quick: int) -> int:
        """Return one of two sizes."""
        return quick if self.is_quick else full


@dataclass(slots=True)
class Figure:
    """A single figure that is no contest: seconds, bytes, a count."""

    name: str
    unit: str
    values: list[float]
    must: float | None = None
    aim: float | None = None
    note: str = ""
    ours: str = ""
    peer: str = ""
    error: str = ""
    raw: dict[str, Any] = field(default_factory=dict)


Task = tuple[str, Callable[[], Contest | Figure]]


def tasks(size: Size, names: tuple[str, ...] = TABLES, has_figures: bool = True) -> Iterator[Task]:
    """Yield the rows of tables."""
    for name in names:
        module = importlib.import_module(f"benchmarks.fields.{name}")
        for row, make in (
            *module.table(size),
            *(module.figures(size) if has_figures and hasattr(module, "figures") else ()),
        ):
            yield f"{name}: {row}", make
