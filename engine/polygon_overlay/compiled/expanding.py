"""The runs that reducing.py left out, put in place again in the boundary rings."""

from __future__ import annotations

from typing import Any, Final

from engine.jit import bare_kernel, inline
from engine.polygon_overlay.compiled.edge_contacts import POLL

LEFT_OUT: Final = -2
"""Second source of a vertex after which those up to the next one are left out."""


@inline
def count_left_out(sources: Any, first: int, last: int) -> int:
    """Return how many vertices are left out of the ring of sources ``first`` .. ``last - 1``."""
    n = 0
    for k in range(first, last):
        if sources[k, 1] == LEFT_OUT:
            n += abs(sources[k + 1 if k + 1 < last else first, 0] - sources[k, 0]) - 1
    return n


@inline
def _copy(vertices: Any, source: int, base: int, step: int, n: int, made: Any, made_sources: Any, at: int) -> None:
    """Write n vertices, from number ``source`` on, one after another in the order of ``step``."""
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


@bare_kernel
def expand_rings(
    vertices: Any, sources: Any, offsets: Any, subjects: Any, clips: Any, stop: Any, made: Any, made_sources: Any,
    made_offsets: Any,
) -> None:  # fmt: skip
    """Fill ``made``, (m, 2) float64, and ``made_sources``, (m, 2) int32, with rings and all that was left out of them.

    vertices, sources, offsets: as overlay_pairs fills them. subjects, clips: (n, 2) float64 vertices. made_offsets:
    (rings + 1,) int64, filled with where each ring begins in ``made``, and the end of the last.
    A run is made of vertices one after another in the input, there or back.
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
