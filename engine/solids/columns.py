"""What results in columns have in common: equality by value, a short repr, and their rows in other forms."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar, cast

import numpy as np


class Columns:
    """Base of dataclasses whose fields are arrays, or None: what a batch of questions is answered with."""

    __slots__ = ()

    _rows: ClassVar[str] = "rows"
    """What `len` counts."""

    def __len__(self) -> int:
        return len(next(iter(self._columns().values())))

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self):,} {self._rows if len(self) != 1 else self._rows[:-1]}>"

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

        columns: dict[str, Any] = {}
        for name, value in self._columns().items():
            if isinstance(value, np.ndarray) and value.ndim == 2 and len(value) == len(self):
                columns |= {f"{name}_{k}": value[:, k] for k in range(value.shape[1])}
            elif value is not None and len(value) == len(self):
                columns[name] = value
        return pandas.DataFrame(columns)


def are_equal(first: Any, second: Any) -> bool:
    """Compare two fields, of which arrays are equal where their shapes and all values are."""
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        return np.array_equal(first, second)
    return type(first) is type(second) and bool(first == second)


def key_of(value: Any) -> Any:
    """Return what equal fields hash alike by."""
    return value.tobytes() if isinstance(value, np.ndarray) else value
