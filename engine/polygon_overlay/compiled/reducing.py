"""Two large polygons as few edges: what meets nothing is left out, for the compiled overlay to put in place again.

    o--o--o--o--o--o--o--o--o--o--o--o      Rings are cut into blocks. Edges of those that are near another one stay
        \\ active  /     run                 as they are; of a run of other blocks only its ends and two more vertices
         o--o--o--o - - - - - - o--o--o      stay, and edges that stand for what is between: a RUN edge meets nothing,
                                             and leaves no node.

Everything that the overlay asks of a vertex, it asks where both of its edges are real:

- nodes are on edges of active blocks, and the top of each ring;
- boundary rings turn at every vertex of a run, so all of them are in the result, or none;
- a ring begins at its leftmost vertex: that of each run, and the two beside it, stay too;
- what rounding moves is at nodes, and their neighbours in a boundary ring are two edges from the inside of a run.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import bare_kernel, inline, merged
from engine.polygon_overlay.compiled.block_tree import count_active, wake_above, wake_near
from engine.polygon_overlay.compiled.clearance import CLEARANCE
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import POLL
from engine.polygon_overlay.compiled.edge_tree import build_tree
from engine.polygon_overlay.compiled.loading import magnitude
from engine.polygon_overlay.compiled.ring_blocks import (
    CHORD,
    EVERYWHERE,
    Blocks,
    box_of_blocks,
    cut_beyond,
    load_blocks,
    mark_blocks,
)
from engine.polygon_overlay.compiled.workspace import Buffers, rows_of
from engine.predicates.ranges import LARGEST, is_safe


@merged
def _is_lower(vertices: Any, i: int, j: int) -> bool:
    """Tell whether vertex i is further left than j, or as far and lower."""
    return vertices[i, 0] < vertices[j, 0] or (vertices[i, 0] == vertices[j, 0] and vertices[i, 1] < vertices[j, 1])


@inline
def _top_of(vertices: Any, blocks: Blocks, begin: int, end: int) -> int:
    """Return the rightmost vertex, the highest of such, of the blocks of a ring."""
    x_max = blocks.boxes[begin, 1]
    for i in range(begin + 1, end):
        x_max = max(x_max, blocks.boxes[i, 1])
    top = -1
    for i in range(begin, end):
        if blocks.boxes[i, 1] == x_max:
            a = blocks.first[i]
            for k in range(a, a + 1 if blocks.marks[i] & CHORD else blocks.last[i]):
                if top < 0 or _is_lower(vertices, top, k):
                    top = k
    return top


@inline
def _low_of(vertices: Any, blocks: Blocks, begin: int, end: int) -> int:
    """Return the leftmost vertex, the lowest of such, of a run of blocks; any one if the end of the last is lower."""
    x_min = blocks.boxes[begin, 0]
    for i in range(begin + 1, end):
        x_min = min(x_min, blocks.boxes[i, 0])
    low = blocks.first[begin]
    for i in range(begin, end):
        if blocks.boxes[i, 0] == x_min:
            for k in range(blocks.first[i], blocks.last[i]):
                if _is_lower(vertices, k, low):
                    low = k
    return low


@inline
def _load_ring(
    vertices: Any, blocks: Blocks, begin: int, end: int, top: int, base: int, edges: Edges, origins: Any, runs: Any,
    n: int, n_runs: int, stop: Any,
) -> tuple[int, int, bool]:  # fmt: skip
    """Append what stays of the blocks of a ring; return the numbers of vertices and runs, and whether all are in range.

    runs: filled with the edges that stand for more than one.
    """
    x, y = edges.x, edges.y
    start = n
    safe = True
    i = begin
    while i < end:  # bound: each turn passes one block at least
        if stop[0]:
            return n, n_runs, False
        a = blocks.first[i]
        if blocks.is_active[i]:
            for k in range(a, a + 1 if blocks.marks[i] & CHORD else blocks.last[i]):
                px, py = vertices[k, 0], vertices[k, 1]
                safe &= is_safe(px) & is_safe(py)
                if n > start and x[n - 1] == px and y[n - 1] == py:
                    origins[n - 1] = base + k  # case: a chord that ends where it begins; the next edge begins here
                    continue
                x[n], y[n], origins[n] = px, py, base + k
                n += 1
            i += 1
            continue
        j = i + 1
        while j < end and not blocks.is_active[j]:  # bound: the blocks
            j += 1
        b = blocks.last[j - 1] - 1
        low = np.int64(_low_of(vertices, blocks, i, j))  # of one type with those below
        high = top if a <= top <= b else a
        k = a
        while True:  # bound: the vertices that stay, eleven at most
            px, py = vertices[k, 0] + 0.0, vertices[k, 1] + 0.0
            safe &= is_safe(px) & is_safe(py)
            x[n], y[n], origins[n] = px, py, base + k
            n += 1
            if k == b:
                break
            after = b
            for stays in (a + 1, low - 1, low, low + 1, high - 1, high, high + 1, b - 1):
                if k < stays < after:
                    after = stays
            if after > k + 1:
                runs[n_runs] = n - 1
                n_runs += 1
            k = after
        i = j
    while n > start + 1 and x[n - 1] == x[start] and y[n - 1] == y[start]:
        n -= 1
    return n, n_runs, safe


@inline
def _load_polygon(
    vertices: Any, n_polygon_rings: int, blocks: Blocks, ring: int, mask: int, base: int, edges: Edges, origins: Any,
    tops: Any, masks: Any, highest: Any, runs: Any, n: int, n_rings: int, n_runs: int, stop: Any,
) -> tuple[int, int, int, bool]:  # fmt: skip
    """Append what stays of a polygon; return the numbers of vertices, rings and runs, and whether all are in range."""
    x, y = edges.x, edges.y
    safe = True
    for i_ring in range(ring, ring + n_polygon_rings):
        start = n
        begin, end = blocks.firsts[i_ring], blocks.firsts[i_ring + 1]
        n, n_runs, is_ring_safe = _load_ring(
            vertices, blocks, begin, end, highest[i_ring], base, edges, origins, runs, n, n_runs, stop
        )  # fmt: skip
        safe &= is_ring_safe
        if n - start < 3:  # a point, or an edge there and back
            n = start
            continue
        top = start
        for k in range(start, n):
            if k & POLL == 0 and stop[0]:
                return 0, 0, 0, False
            edges.after[k], edges.before[k], edges.ring[k] = k + 1, k - 1, n_rings
            if x[k] > x[top] or (x[k] == x[top] and y[k] > y[top]):
                top = k
        edges.after[n - 1], edges.before[start] = start, n - 1
        tops[n_rings], masks[n_rings] = top, mask
        n_rings += 1
    return n, n_rings, n_runs, safe


@bare_kernel
def reduce_pair(
    subjects: Any,
    subject_rings: Any,
    clips: Any,
    clip_rings: Any,
    size: int,
    n_most: int,
    kept: Any,
    stop: Any,
    buffers: Buffers,
) -> tuple[int, int, int, float]:
    """Load the edges of two polygons into the scratch of overlay_pairs, those that meet nothing as runs.

    subjects, clips: (n, 2) float64 vertices; subject_rings, clip_rings: where each ring begins, and the last one's end.
    size: edges of a block. n_most: edges that are too many to be looked at one by one. kept: as of
    overlay_pairs. There is scratch for a thousand contacts at least.
    Returns the numbers of vertices, rings and runs, and the largest coordinate; no vertices if it is not worth while.
    """
    w = rows_of(buffers)
    edges = w.edges
    n_subject, n_clip = subject_rings.shape[0] - 1, clip_rings.shape[0] - 1
    n_rings = n_subject + n_clip
    blocks = Blocks(w.points, w.node_of, w.chain_at, w.boxes, w.moved, w.found.meets, w.starts)
    end_subject = load_blocks(subjects, subject_rings, n_subject, size, blocks, 0, 0, stop)
    end = load_blocks(clips, clip_rings, n_clip, size, blocks, end_subject, n_subject, stop)
    if stop[0]:
        return 0, 0, 0, 0.0
    x0, x1, y0, y1 = box_of_blocks(blocks.boxes, 0, end_subject)
    u0, u1, v0, v1 = box_of_blocks(blocks.boxes, end_subject, end)
    largest = max(magnitude(x0, x1, y0, y1), magnitude(u0, u1, v0, v1))
    common = max(x0, u0), min(x1, u1), max(y0, v0), min(y1, v1)
    if largest > LARGEST or common[0] > common[1] or common[2] > common[3]:
        return 0, 0, 0, largest
    begin, whole = end_subject, (-np.inf, np.inf, -np.inf, np.inf)
    end_subject = cut_beyond(
        subjects, subject_rings, n_subject, whole if kept[1] else common, blocks, 0, 0, 0
    )  # fmt: skip
    end = cut_beyond(
        clips, clip_rings, n_clip, whole if kept[2] else common, blocks, n_subject, begin, end_subject
    )  # fmt: skip
    margin = CLEARANCE * largest
    mark_blocks(subjects, subject_rings, n_subject, margin, blocks, 0, w.x, w.y, stop)
    mark_blocks(clips, clip_rings, n_clip, margin, blocks, n_subject, w.x, w.y, stop)
    if stop[0] or count_active(blocks, end) >= n_most:
        return 0, 0, 0, largest
    for i in range(end):
        w.marks[i] = blocks.marks[i]
    for ring in range(n_rings):
        if blocks.firsts[ring + 1] > blocks.firsts[ring]:
            w.marks[blocks.firsts[ring + 1] - 1] = EVERYWHERE  # what follows is another ring's
    build_tree(blocks.boxes, w.marks, end, w.tree, w.tree_marks, w.places, stop)
    if stop[0] or not wake_near(
        blocks, end, 2.0 * margin, w.tree, w.tree_marks, w.places, w.stack, n_most, stop
    ):  # fmt: skip
        return 0, 0, 0, largest
    for ring in range(n_rings):
        vertices = subjects if ring < n_subject else clips
        if blocks.firsts[ring + 1] > blocks.firsts[ring]:
            top = _top_of(vertices, blocks, blocks.firsts[ring], blocks.firsts[ring + 1])
            w.highest[ring] = top
            wake_above(blocks, end, vertices[top, 0], vertices[top, 1], w.tree, w.places, w.stack)
        if stop[0]:
            return 0, 0, 0, largest
    # order: the tree is not asked any more, so its places serve for the runs
    n, n_out_rings, n_runs, safe = _load_polygon(
        subjects, n_subject, blocks, 0, 1, 0, edges, w.origins, w.tops, w.masks, w.highest, w.places, 0, 0, 0, stop
    )  # fmt: skip
    n, n_out_rings, n_runs, also_safe = _load_polygon(
        clips, n_clip, blocks, n_subject, 2, subjects.shape[0], edges, w.origins, w.tops, w.masks, w.highest, w.places,
        n, n_out_rings, n_runs, stop,
    )  # fmt: skip
    if stop[0] or not (safe and also_safe):
        return 0, 0, 0, largest
    return n, n_out_rings, n_runs, largest
