"""Few distinct objects among many: numbered in the order in which they first appear."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import IntArray
from engine.jit import kernel


def numbered(keys: IntArray) -> tuple[IntArray, IntArray]:
    """Return for each of keys (n,) >= 0 the number of its kind, and for each kind where it first appears."""
    kinds, firsts = np.empty(len(keys), np.int64), np.empty(len(keys), np.int64)
    bits = max(4, (2 * len(keys)).bit_length())
    with np.errstate(over="ignore"):  # uncompiled runs only
        n_kinds = _number(keys, np.full(1 << bits, -1, np.int64), kinds, firsts)
    return kinds, firsts[:n_kinds].copy()


@kernel
def _number(keys: Any, table: Any, kinds: Any, firsts: Any) -> int:
    """Fill kinds and firsts; return the number of kinds. table: -1 everywhere, a power of two longer than keys."""
    last, n_kinds = table.shape[0] - 1, 0
    for item in range(keys.shape[0]):
        key = keys[item]
        place = (key >> 4 ^ key >> 16) & last
        while table[place] >= 0 and keys[firsts[table[place]]] != key:  # bound: a place is free
            place = (place + 1) & last
        if table[place] < 0:
            table[place], firsts[n_kinds] = n_kinds, item
            n_kinds += 1
        kinds[item] = table[place]
    return n_kinds
