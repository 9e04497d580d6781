"""Pairs loaded into a workspace."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from engine.polygon_overlay.compiled import workspace
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.loading import (
    EVERYTHING,
    Box,
    Given,
    RingArrays,
    box_of,
    common_box,
    is_empty,
    largest_counts,
    load_rings,
)


def loaded(rings: list[list[tuple[float, float]]], box: Box) -> tuple[list[list[int]], list[int], Given]:
    """Return the numbers of the vertices that stay, ring by ring, the tops, and all that was filled."""
    vertices, offsets = np.array([v for ring in rings for v in ring], float), np.cumsum([0, *map(len, rings)])
    n, whole = len(vertices), np.zeros(len(vertices), np.int64)
    edges = Edges(np.zeros(n), np.zeros(n), *(whole.copy() for _ in range(3)), np.zeros(2, np.int64))
    given = Given(edges, *(whole.copy() for _ in range(3)))
    stop = np.zeros(1, np.uint8)
    arrays = RingArrays(vertices, offsets)
    n, n_rings, safe = load_rings(arrays, 0, len(rings), 1, False, 0, box, given, 0, 0, stop)
    assert safe
    found: list[list[int]] = []
    for ring in range(n_rings):
        e = first = int(np.flatnonzero(given.edges.ring[:n] == ring)[0])
        found.append([])
        while not found[-1] or e != first:
            found[-1].append(int(given.origins[e]))
            assert given.edges.before[given.edges.after[e]] == e
            e = int(given.edges.after[e])
    return found, given.origins[given.tops[:n_rings]].tolist(), given


def test_repeats_and_flat_rings_go() -> None:
    triangle: list[tuple[float, float]] = [(0, 0), (0, 0), (4, 0), (4, 3), (4, 3), (0, 0)]
    flat: list[tuple[float, float]] = [(1, 1), (2, 2), (1, 1)]
    assert loaded([triangle, flat, [(9, 9)] * 4, triangle[::-1]], EVERYTHING)[:2] == (
        [[1, 2, 4], [13, 15, 16]],
        [4, 15],
    )


def test_stretches_beyond_a_side_keep_their_ends() -> None:
    ring: list[tuple[float, float]] = [(0, 0), (5, 1), (6, 9), (7, -3), (5, 2), (0, 4)]
    assert loaded([ring], (0.0, 4.0, 0.0, 4.0))[0] == [[0, 1, 4, 5]]
    assert loaded([ring], EVERYTHING)[0] == [[0, 1, 2, 3, 4, 5]]


def test_boxes() -> None:
    vertices = np.array([(1.0, 5.0), (-2.0, 7.0), (0.0, 6.0)])
    assert box_of(vertices, 0, 3) == (-2.0, 1.0, 5.0, 7.0)
    assert common_box((0.0, 4.0, 0.0, 4.0), (1.0, 9.0, -1.0, 2.0)) == (1.0, 4.0, 0.0, 2.0)
    assert is_empty(box_of(vertices, 0, 0))
    assert is_empty(common_box((0.0, 1.0, 0.0, 1.0), (2.0, 3.0, 0.0, 1.0)))


def test_the_largest_of_many_is_found() -> None:
    ring_offsets, polygon_offsets = np.array([0, 3, 7, 10, 14]), np.array([0, 2, 2, 4])
    assert largest_counts(ring_offsets, polygon_offsets) == (7, 2)
    assert largest_counts(ring_offsets[:1], polygon_offsets[:1]) == (0, 0)


# --- Scratch: what is in use at one time lies apart, and a thread keeps what suffices ---


def arrays_of(part: Any) -> list[np.ndarray]:
    return [part] if isinstance(part, np.ndarray) else [array for each in part for array in arrays_of(each)]


def test_rows_in_use_together_lie_apart() -> None:
    scratch = workspace.scratch_for(100, 5, 300, 0, 0)
    w = workspace.workspace_at(scratch.addresses)
    steps = (
        [w.given, w.tree, w.events, w.unions, w.along],
        [w.given, w.tree, w.events, w.unions, w.along.starts, w.along.order, w.chains, w.stars, w.loose],
        [w.given, w.tree, w.events, w.unions, w.along.starts, w.along.order, w.chains, w.stars, w.faces, w.components],
        [w.given, w.tree.marks, w.chains, w.stars, w.faces, w.flood],
        [w.given, w.tree.marks, w.chains, w.stars, w.faces, w.walk, w.rings, *w.flood[:3], *w.flood[6:]],
        [w.given, w.events.first, w.events.second, w.rings, w.rounded, w.ranking, *w.flood[:3], *w.flood[6:]],
    )
    for step in steps:
        assert not any(itertools.starmap(np.shares_memory, itertools.combinations(arrays_of(step), 2)))


def test_what_suffices_is_kept() -> None:
    workspace.release()
    first = workspace.scratch_for(100, 2, 300, 50, 5)
    workspace.return_scratch(first)
    assert workspace.scratch_for(50, 1, 200, 40, 4) is first
    assert workspace.scratch_for(50, 1, 200, 40, 4) is not first  # it is the caller's until it is kept
    workspace.return_scratch(first)
    wider = workspace.scratch_for(100, 2, 300, 10**7, 5)
    assert wider.buffers is first.buffers
    assert len(wider.output.vertices) >= 10**7
    workspace.return_scratch(wider)  # it is too large
    assert workspace.scratch_for(1, 1, 1, 1, 1) is not wider
    workspace.return_scratch(first)
    workspace.release()
    assert workspace.scratch_for(50, 1, 200, 40, 4) is not first
