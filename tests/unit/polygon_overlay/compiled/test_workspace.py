"""Scratch: what is in use at one time lies apart, and a thread keeps what suffices."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from engine.polygon_overlay.compiled import workspace


def arrays_of(part: Any) -> list[np.ndarray]:
    return [part] if isinstance(part, np.ndarray) else [array for each in part for array in arrays_of(each)]


def test_rows_in_use_together_lie_apart() -> None:
    scratch = workspace.scratch_for(100, 5, 300, 0, 0)
    w = workspace.rows_of(scratch.words)
    steps = (
        [w.given, w.tree, w.events, w.unions, w.along],
        [w.given, w.tree, w.events, w.unions, w.along.starts, w.along.order, w.chains, w.stars, w.loose],
        [w.given, w.tree, w.events, w.unions, w.along.starts, w.along.order, w.chains, w.stars, w.faces, w.components],
        [w.given, w.tree.marks, w.chains, w.stars, w.faces, w.holders],
        [w.given, w.tree.marks, w.chains, w.stars, w.faces, w.walk, w.found, *w.holders[:3], *w.holders[6:]],
        [w.given, w.events.first, w.events.second, w.found, w.rounded, w.ranking, *w.holders[:3], *w.holders[6:]],
    )
    for step in steps:
        assert not any(itertools.starmap(np.shares_memory, itertools.combinations(arrays_of(step), 2)))


def test_what_suffices_is_kept() -> None:
    workspace.release()
    first = workspace.scratch_for(100, 2, 300, 50, 5)
    workspace.keep(first)
    assert workspace.scratch_for(50, 1, 200, 40, 4) is first
    assert workspace.scratch_for(50, 1, 200, 40, 4) is not first  # it is the caller's until it is kept
    workspace.keep(first)
    wider = workspace.scratch_for(100, 2, 300, 10**7, 5)
    assert wider.buffers is first.buffers
    assert len(wider.output.vertices) >= 10**7
    workspace.keep(wider)  # it is too large
    assert workspace.scratch_for(1, 1, 1, 1, 1) is not wider
    workspace.keep(first)
    workspace.release()
    assert workspace.scratch_for(50, 1, 200, 40, 4) is not first
