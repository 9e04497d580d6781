r"""Reduction of two large polygons to few edges: runs of blocks that meet nothing are left out, and reinserted
afterwards.

    o--o--o--o--o--o--o--o--o--o--o--o      Rings are cut into blocks. Edges of active blocks stay as they are; of a
        \  active  /     run                 run of other blocks its ends, its extreme vertices and their neighbours
         o--o--o--o - - - - - - o--o--o      stay, joined by edges (RUN) that meet nothing and leave no node.

Everything that the overlay needs of a vertex, it needs where both of its edges are real:

- nodes are on edges of active blocks, and the top of each ring;
- boundary rings turn at every vertex of a run, so all of them are in the result, or none;
- a ring begins at its smallest vertex: that of each run, and its two neighbours, stay too;
- what rounding moves is at nodes, and their neighbours in a boundary ring are two edges from the inside of a run.
"""

from __future__ import annotations

import numpy as np

from engine.compiling.jit import inline, kernel
from engine.polygon_overlay.compiled.clearance import CLEARANCE
from engine.polygon_overlay.compiled.edge_tree import POLL, BoxTree, build_tree
from engine.polygon_overlay.compiled.loading import (
    LEFT_OUT,
    Given,
    Loaded,
    RingArrays,
    common_box,
    end_ring,
    is_before,
    is_empty,
    magnitude,
)
from engine.polygon_overlay.compiled.ring_blocks import (
    EVERYWHERE,
    Blocks,
    activate_blocks_above,
    activate_blocks_near,
    box_of_blocks,
    count_active,
    load_blocks,
    mark_blocks,
)
from engine.polygon_overlay.compiled.workspace import Workspace, workspace_at
from engine.predicates.expansion import LARGEST, is_safe
from engine.types import FlagArray, FloatArray, Int32Array, IntArray


@inline
def _top_of(vertices: FloatArray, blocks: Blocks, begin: int, end: int) -> int:
    """Return the lexicographically largest vertex (x, then y) of the ring that consists of blocks begin .. end - 1."""
    x_max = blocks.boxes[begin, 1]
    for i in range(begin + 1, end):
        x_max = max(x_max, blocks.boxes[i, 1])
    top = -1
    for i in range(begin, end):
        if blocks.boxes[i, 1] == x_max:
            a = blocks.first[i]
            for k in range(a, blocks.last[i]):
                if top < 0 or is_before(vertices, top, k):
                    top = k
    return top


@inline
def _low_of(vertices: FloatArray, blocks: Blocks, begin: int, end: int) -> int:
    """Return the lexicographically smallest vertex (x, then y) of blocks begin .. end - 1; the vertex at which the last
    block ends does not count."""
    x_min = blocks.boxes[begin, 0]
    for i in range(begin + 1, end):
        x_min = min(x_min, blocks.boxes[i, 0])
    low = blocks.first[begin]
    for i in range(begin, end):
        if blocks.boxes[i, 0] == x_min:
            for k in range(blocks.first[i], blocks.last[i]):
                if is_before(vertices, k, low):
                    low = k
    return low


@inline
def _load_run(
    vertices: FloatArray, first: int, last: int, low: int, high: int, base: int, given: Given, runs: Int32Array, n: int,
    n_runs: int,
) -> tuple[int, int, bool]:  # fmt: skip
    """Append to ``given`` the vertices that remain of a run, vertices first .. last: both ends, its smallest and
    largest vertex ``low`` and ``high``, and the neighbours of each. Returns the numbers of vertices and of runs then (n
    and n_runs before), and whether all coordinates are in range. base: added to vertex numbers. runs: filled with the
    edges that replace several."""
    x, y = given.edges.x, given.edges.y
    is_in_range = True
    k = first
    while True:  # bound: the vertices that stay, eleven at most
        px, py = vertices[k, 0] + 0.0, vertices[k, 1] + 0.0
        is_in_range &= is_safe(px) & is_safe(py)
        x[n], y[n], given.origins[n] = px, py, base + k
        n += 1
        if k == last:
            return n, n_runs, is_in_range
        after = last
        for stays in (first + 1, low - 1, low, low + 1, high - 1, high, high + 1, last - 1):
            if k < stays < after:
                after = stays
        if after > k + 1:
            runs[n_runs] = n - 1
            n_runs += 1
        k = after


@inline
def _load_ring(
    vertices: FloatArray, blocks: Blocks, begin: int, end: int, top: int, base: int, given: Given, runs: Int32Array,
    n: int, n_runs: int, stop: FlagArray,
) -> tuple[int, int, bool]:  # fmt: skip
    """Append to ``given`` the ring of blocks begin .. end - 1: the vertices of active blocks, and of the others what
    `_load_run` retains. top: the ring's largest vertex (x, then y). Returns the numbers of vertices and of runs then (n
    and n_runs before), and whether all coordinates are in range. runs: filled with the edges that replace several."""
    x, y, origins = given.edges.x, given.edges.y, given.origins
    start = n
    is_in_range = True
    i = begin
    while i < end:  # bound: each turn passes one block at least
        if stop[0]:
            return n, n_runs, False
        a = blocks.first[i]
        if blocks.is_active[i]:
            for k in range(a, blocks.last[i]):
                px, py = vertices[k, 0], vertices[k, 1]
                is_in_range &= is_safe(px) & is_safe(py)
                if n > start and x[n - 1] == px and y[n - 1] == py:
                    origins[n - 1] = base + k  # the next edge begins here
                    continue
                x[n], y[n], origins[n] = px, py, base + k
                n += 1
            i += 1
            continue
        j = i + 1
        while j < end and not blocks.is_active[j]:  # bound: the blocks
            j += 1
        b = blocks.last[j - 1] - 1
        low = np.int64(_low_of(vertices, blocks, i, j))  # the type of its neighbours
        n, n_runs, is_run_in_range = _load_run(
            vertices, a, b, low, top if a <= top <= b else a, base, given, runs, n, n_runs
        )
        is_in_range &= is_run_in_range
        i = j
    return n, n_runs, is_in_range


@inline
def _load_polygon(
    rings: RingArrays, blocks: Blocks, ring: int, mask: int, base: int, given: Given, highest: IntArray,
    runs: Int32Array, reduced: Loaded, stop: FlagArray,
) -> tuple[Loaded, bool]:  # fmt: skip
    """Append a polygon to ``given``, its inactive blocks replaced by runs; return the counts then (`reduced` before),
    and whether all coordinates are in range. ring: number of its first ring among those of both polygons; mask: bit of
    its source; base: added to vertex numbers; highest: by ring its largest vertex; runs: filled with the edges that
    replace several."""
    n, n_rings, n_runs, largest = reduced
    vertices, is_in_range = rings.vertices, True
    for i_ring in range(ring, ring + rings.offsets.shape[0] - 1):
        start = n
        begin, end = blocks.firsts[i_ring], blocks.firsts[i_ring + 1]
        n, n_runs, is_ring_in_range = _load_ring(
            vertices, blocks, begin, end, highest[i_ring], base, given, runs, n, n_runs, stop
        )  # fmt: skip
        is_in_range &= is_ring_in_range
        n, n_rings = end_ring(given, start, n, n_rings, mask)
    return Loaded(n, n_rings, n_runs, largest), is_in_range


@inline
def _activate_blocks(
    subjects: RingArrays, clips: RingArrays, blocks: Blocks, end: int, margin: float, n_most: int, tree: BoxTree,
    highest: IntArray, stop: FlagArray,
) -> bool:  # fmt: skip
    """Activate the blocks that are near another block or above the top of a ring, among the ``end`` blocks of both
    polygons; return False if n_most edges or more become active, or if stopped. highest: filled by ring with its top,
    the largest vertex (x, then y)."""
    n_subject = subjects.offsets.shape[0] - 1
    n_rings = n_subject + clips.offsets.shape[0] - 1
    for i in range(end):
        tree.marks[i] = blocks.marks[i]
    for ring in range(n_rings):
        if blocks.firsts[ring + 1] > blocks.firsts[ring]:
            tree.marks[blocks.firsts[ring + 1] - 1] = EVERYWHERE  # what follows is another ring's
    build_tree(tree, end, stop)
    if stop[0] or not activate_blocks_near(blocks, end, 2.0 * margin, tree, n_most, stop):
        return False
    for ring in range(n_rings):
        vertices = subjects.vertices if ring < n_subject else clips.vertices
        if blocks.firsts[ring + 1] > blocks.firsts[ring]:
            top = _top_of(vertices, blocks, blocks.firsts[ring], blocks.firsts[ring + 1])
            highest[ring] = top
            activate_blocks_above(blocks, end, vertices[top, 0], vertices[top, 1], tree)
        if stop[0]:
            return False
    return True


@kernel
def reduce_pair(
    subjects: RingArrays, clips: RingArrays, size: int, n_most: int, stop: FlagArray, addresses: IntArray
) -> tuple[int, int, int, float]:
    """Load two polygons into the scratch of `overlay_pairs`, with stretches of edges that meet nothing reduced to runs;
    return the fields of `Loaded`. size: edges of a block. n_most: number of active edges from which a reduction does
    not pay: the result has no vertices then, nor where coordinates are out of range or boxes are disjoint. Caller
    guarantees scratch for a thousand contacts or more."""
    made = _reduced_pair(subjects, clips, size, n_most, stop, workspace_at(addresses))
    return made.n, made.n_rings, made.n_runs, made.largest


@inline
def _reduced_pair(
    subjects: RingArrays, clips: RingArrays, size: int, n_most: int, stop: FlagArray, w: Workspace
) -> Loaded:
    n_subject = subjects.offsets.shape[0] - 1
    blocks = Blocks(
        w.unions.points, w.stars.node_of, w.chains.at, w.tree.boxes, w.rounded.moved, w.rings.meets, w.along.starts
    )
    end_subject = load_blocks(subjects, size, blocks, 0, 0, stop)
    end = load_blocks(clips, size, blocks, end_subject, n_subject, stop)
    if stop[0]:
        return Loaded(0, 0, 0, 0.0)
    subject_box, clip_box = box_of_blocks(blocks.boxes, 0, end_subject), box_of_blocks(blocks.boxes, end_subject, end)
    largest = max(magnitude(subject_box), magnitude(clip_box))
    if largest > LARGEST or is_empty(common_box(subject_box, clip_box)):
        return Loaded(0, 0, 0, largest)
    margin = CLEARANCE * largest
    mark_blocks(subjects, margin, blocks, 0, stop)
    mark_blocks(clips, margin, blocks, n_subject, stop)
    if stop[0] or count_active(blocks, end) >= n_most:
        return Loaded(0, 0, 0, largest)
    if not _activate_blocks(subjects, clips, blocks, end, margin, n_most, w.tree, w.components.highest, stop):
        return Loaded(0, 0, 0, largest)
    runs, highest = w.tree.places, w.components.highest  # order: the tree is not used any more
    reduced, is_in_range = _load_polygon(
        subjects, blocks, 0, 1, 0, w.given, highest, runs, Loaded(0, 0, 0, largest), stop
    )
    n = subjects.vertices.shape[0]
    reduced, is_clip_in_range = _load_polygon(clips, blocks, n_subject, 2, n, w.given, highest, runs, reduced, stop)
    return reduced if is_in_range and is_clip_in_range and not stop[0] else Loaded(0, 0, 0, largest)


@inline
def count_left_out(sources: Int32Array, first: int, last: int) -> int:
    """Return how many input vertices are omitted (mark LEFT_OUT) in the ring whose rows of sources are first .. last -
    1."""
    n = 0
    for k in range(first, last):
        if sources[k, 1] == LEFT_OUT:
            n += abs(sources[k + 1 if k + 1 < last else first, 0] - sources[k, 0]) - 1
    return n


@inline
def _copy(
    vertices: FloatArray, source: int, base: int, step: int, n: int, made: FloatArray, made_sources: Int32Array, at: int
) -> None:
    """Write n consecutive input vertices to ``made``, and their sources to ``made_sources``, from row ``at`` on: vertex
    number ``source`` and the next in direction ``step`` (1 or -1). base: number of the first of ``vertices``."""
    part, numbers = made[at : at + n], made_sources[at : at + n]
    if step > 0:
        given = vertices[source - base : source - base + n]
        for k in range(n):
            part[k, 0], part[k, 1] = given[k, 0] + 0.0, given[k, 1] + 0.0
            numbers[k, 0], numbers[k, 1] = source + k, -1
    else:
        given = vertices[source - base - n + 1 : source - base + 1]
        for k in range(n):
            part[k, 0], part[k, 1] = given[n - 1 - k, 0] + 0.0, given[n - 1 - k, 1] + 0.0
            numbers[k, 0], numbers[k, 1] = source - k, -1


@kernel
def expand_rings(
    vertices: FloatArray, sources: Int32Array, offsets: IntArray, subjects: FloatArray, clips: FloatArray,
    stop: FlagArray, made: FloatArray, made_sources: Int32Array, made_offsets: IntArray,
) -> None:  # fmt: skip
    """Copy rings to ``made`` (m, 2) float64 and ``made_sources`` (m, 2) int32, with their omitted vertices inserted.

    vertices, sources, offsets: rings from `overlay_pairs`. subjects, clips: (n, 2) float64 vertices of the input.
    made_offsets: (rings + 1,) int64, filled with the offsets of rings into ``made``. Omitted vertices are consecutive
    in the input, either way round.
    """
    n_subject = subjects.shape[0]
    at = made_offsets[0] = 0
    for ring in range(made_offsets.shape[0] - 1):
        first, last = offsets[ring], offsets[ring + 1]
        for k in range(first, last):
            source, mark = sources[k, 0], sources[k, 1]
            made[at, 0], made[at, 1] = vertices[k, 0], vertices[k, 1]
            made_sources[at, 0], made_sources[at, 1] = source, -1 if mark == LEFT_OUT else mark
            at += 1
            if mark != LEFT_OUT:
                continue
            after = sources[k + 1 if k + 1 < last else first, 0]
            step = 1 if after > source else -1
            for begin in range(0, abs(after - source) - 1, POLL):
                if stop[0]:
                    return
                n = min(POLL, abs(after - source) - 1 - begin)
                given = source + step * (begin + 1)
                if source < n_subject:
                    _copy(subjects, given, 0, step, n, made, made_sources, at)
                else:
                    _copy(clips, given, n_subject, step, n, made, made_sources, at)
                at += n
        made_offsets[ring + 1] = at
