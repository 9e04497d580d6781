"""The contests, one file an operation.

``tasks(size)`` yields the rows as (name, what makes it), so that none is made in vain; those that stand on the page of
the report say so. What is no contest is a `Figure`.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from benchmarks.contest import Size, Task

FIELDS = (
    "containment", "collision", "clearance", "distances", "segments", "hits", "scenes", "polygons", "overlay", "layers",
    "cuts", "costs", "calls",
)  # fmt: skip


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


def tasks(
    size: Size, names: tuple[str, ...] = FIELDS, is_page: bool = False, has_figures: bool = True
) -> Iterator[Task]:
    """Yield the rows of tables, or those of the page only."""
    for name in names:
        for row in importlib.import_module(f"{__name__}.{name}").tasks(size):
            if (row.is_on_page or not is_page) and (has_figures or not row.is_figure):
                yield row._replace(name=f"{name}: {row.name}")
