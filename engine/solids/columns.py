"""What results in columns have in common: equality by value, a short repr, and their rows in other forms."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar, Final, cast

import numpy as np

_LONGEST: Final = 120
_SHOWN: Final = 10
"""Rows that a notebook shows."""


class ByValue:
    """Base of frozen dataclasses that may hold arrays: equal where their public fields are."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return all(are_equal(value, getattr(other, name)) for name, value in self._columns().items())

    def __hash__(self) -> int:
        return hash((type(self), *map(key_of, self._columns().values())))

    def _columns(self) -> dict[str, Any]:
        """Return the public fields by name."""
        names = (each.name for each in fields(cast(Any, self)))
        return {name: getattr(self, name) for name in names if not name.startswith("_")}


class Columns(ByValue):
    """Base of dataclasses whose fields are arrays, or None: what a batch of questions is answered with."""

    __slots__ = ()

    _rows: ClassVar[str] = "rows"
    """What `len` counts."""
    _not_rows: ClassVar[tuple[str, ...]] = ()
    """Fields that are not by row, whatever their lengths."""

    def __len__(self) -> int:
        return len(next(iter(self._columns().values())))

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self):,} {self._rows if len(self) != 1 else self._rows[:-1]}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the columns as lists, by name.

        Returns
        -------
        dict of str to list
            None for a column that was not asked for.
        """
        items = self._columns().items()
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in items}

    def to_pandas(self) -> Any:
        """Return the rows as a DataFrame; a column of several numbers a row becomes several, `start_0` and so on.

        Returns
        -------
        pandas.DataFrame
            A row each; arrays that are not by row are left out. pandas must be installed.
        """
        import pandas

        return pandas.DataFrame(self._by_row())

    def _repr_html_(self) -> str:
        """Return the table that notebooks show: the first rows."""
        from html import escape

        columns = {name: list(column[:_SHOWN]) for name, column in self._by_row().items()}
        rows = [[*columns], *zip(*columns.values())] if columns else []
        cells = ("".join(f"<td>{escape(str(cell))}</td>" for cell in row) for row in rows)
        more = f"<p>{escape(repr(self)[1:-1])}</p>"
        return f"<table>{''.join(f'<tr>{each}</tr>' for each in cells)}</table>{more}"

    def _by_row(self) -> dict[str, Any]:
        """Return the columns that have a number, or several, a row."""
        columns: dict[str, Any] = {}
        for name, value in self._columns().items():
            if name in self._not_rows or name in getattr(self, "_levels", ()):
                continue
            if isinstance(value, np.ndarray) and value.ndim == 2 and len(value) == len(self):
                columns |= {f"{name}_{k}": value[:, k] for k in range(value.shape[1])}
            elif value is not None and len(value) == len(self):
                columns[name] = value
        return columns


def brief(text: str) -> str:
    """Return a repr in at most 120 characters."""
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]}...)"


def are_equal(first: Any, second: Any) -> bool:
    """Compare two fields, of which arrays are equal where their shapes and all values are."""
    if first is second:
        return True
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and np.array_equal(first, second)
    if isinstance(first, (tuple, list)):
        return len(first) == len(second) and all(map(are_equal, first, second))
    return bool(first == second)


def key_of(value: Any) -> Any:
    """Return what equal fields hash alike by."""
    if isinstance(value, np.ndarray):
        return (value + 0.0 if value.dtype.kind == "f" else value).tobytes()  # of -0.0: 0.0
    if isinstance(value, (tuple, list)):
        return tuple(map(key_of, value))
    try:
        hash(value)
    except TypeError:  # of a class that compares, but does not hash
        return type(value).__name__
    return value
