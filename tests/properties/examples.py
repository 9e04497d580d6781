"""How many examples a property gets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hypothesis import settings

FACTOR = 1.0


def examples(n: int) -> Callable[[Any], Any]:
    """Return the decorator that asks for n examples: fewer in the short tier, many more with --full."""
    return settings(max_examples=int(n * FACTOR))
