"""Calls compiled kernels without asking each argument for its type, which takes up to 3 us."""

from __future__ import annotations

from types import FunctionType
from typing import Any

import numpy as np

_entries: dict[Any, Any] = {}


def entry_of(kernel: Any, n_names: int = 0) -> Any:
    """Return what calls a kernel directly.

    n_names: where it is compiled for tuples of several lengths as its last argument, the length of this one.

    Caller guarantees that arguments are of the types that the kernel is compiled for: arrays from `as_*` or of a solid,
    and its own. The kernel itself where it is not called yet, or compiled for others as well; uncompiled it is kept
    from warning of what overflows: filters look at that.
    """
    key = (kernel, n_names) if n_names else kernel
    entry = _entries.get(key)
    if entry is None:
        if isinstance(kernel, FunctionType):
            entry = np.errstate(all="ignore")(kernel)
        else:
            made = kernel.dispatcher.overloads.items()
            fitting = [found for types, found in made if n_names in (0, getattr(types[-1], "count", 0))]
            if len(fitting) != 1:
                return kernel
            entry = fitting[0].entry_point
        _entries[key] = entry
    return entry
