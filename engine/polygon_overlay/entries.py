"""Kernels entered without their dispatcher."""

from __future__ import annotations

from types import FunctionType
from typing import Any

_entries: dict[Any, Any] = {}


def entry_of(kernel: Any) -> Any:
    """Return what calls a kernel without asking each argument for its type, which takes 3 us for as many as here.

    Caller guarantees that arguments are of the types that the kernel is compiled for: read-only arrays of polygons, and
    scratch.
    The kernel itself where it is not called yet, or compiled for others as well, or not compiled.
    """
    entry = _entries.get(kernel)
    if entry is None:
        if isinstance(kernel, FunctionType) or len(kernel.signatures) != 1:
            return kernel
        (compiled,) = kernel.dispatcher.overloads.values()
        entry = _entries[kernel] = compiled.entry_point
    return entry
