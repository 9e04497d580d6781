"""Short answers for language models: of each list its length and some of its items."""

from __future__ import annotations

import json
from functools import partial
from typing import Any, Final

import numpy as np
from pydantic import BaseModel

from service.errors import ServiceError
from service.wire import Poll, Raw, Series, encode, no_poll

MOST: Final = 2**20
"""Largest short answer in bytes."""
_LONG: Final = 1000
"""Letters of a text that are shown."""


def summary(answer: Any, show: int, start: int, poll: Poll = no_poll) -> dict[str, Any]:
    """Return an answer with each list as its length and some of its items, of which no others are made.

    >>> summary({"contained": [True, False, True], "accuracy": {"items": 3}}, 1, 0)
    {'contained': {'count': 3, 'true': 2, 'items': [True]}, 'accuracy': {'items': 3}}
    """
    short: dict[str, Any] = {}
    size, most = 0, max(show, 3)
    for name, value in (answer if isinstance(answer, dict) else vars(answer)).items():
        if value is None:
            continue
        if not isinstance(value, (list, np.ndarray, Series)):
            short[name] = _cut(value, most)
            continue
        series = value if isinstance(value, Series) else Series(len(value), partial(_slice, value))
        about: dict[str, Any] = {"count": series.n}
        if series is not value and series.n and _are_bools(value):
            about["true"] = int(np.count_nonzero(np.asarray(value)))
        items: list[Any] = []
        for first, last in series.cuts(start, start + show):
            poll()
            items += [_cut(item, most) for item in series.make(first, last)]
            size += len(encode(items[first - start :]))
            if size > MOST:
                raise ServiceError("answer_too_large", f"the items take more than {MOST} bytes; show fewer")
        short[name] = {**about, "items": items}
    return short


def _slice(items: Any, start: int, stop: int) -> Any:
    return items[start:stop].tolist() if isinstance(items, np.ndarray) else items[start:stop]


def _are_bools(items: Any) -> bool:
    if isinstance(items, np.ndarray):
        return bool(items.dtype == np.bool_)
    return all(isinstance(item, bool) for item in items)


def _cut(value: Any, show: int) -> Any:
    """Return a value of an answer with its own lists and long texts shortened."""
    if isinstance(value, Raw):
        value = json.loads(value.text)
    if isinstance(value, BaseModel):
        value = {name: item for name, item in vars(value).items() if item is not None}
    if isinstance(value, dict):
        return {name: _cut(item, show) for name, item in value.items()}
    if type(value) is int and not -(2**63) <= value < 2**64:
        return Raw(str(value).encode())  # the encoder takes none so large
    if isinstance(value, str):
        return value if len(value) <= _LONG else {"count": len(value), "first": value[:_LONG]}
    if isinstance(value, (list, tuple, np.ndarray)) and not isinstance(value, Series):
        value = Series(len(value), partial(_slice, value))
    if not isinstance(value, Series):
        return value
    items = [_cut(item, show) for item in value.make(0, min(show, value.n))]
    return items if value.n <= show else {"count": value.n, "first": items}
