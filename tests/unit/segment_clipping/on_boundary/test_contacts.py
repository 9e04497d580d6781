"""Which edges a segment meets, and how: those of all edges asked one by one in exact arithmetic."""

from __future__ import annotations

import numpy as np

from engine.predicates.rational import orient2d_rational
from engine.segment_clipping.on_boundary.contacts import (
    ALONG,
    APART,
    DEGENERATE,
    END,
    NO_ROOM,
    PROPER,
    START,
    find_contacts_2d,
)
from engine.segment_clipping.on_boundary.prepared_boundary import outline_of


def contact(edge: list[list[float]], segment: list[list[float]]) -> int:
    signs = [orient2d_rational(*segment, end) for end in edge], [orient2d_rational(*edge, end) for end in segment]
    if any(pair in ([1, 1], [-1, -1]) for pair in signs):
        return APART
    if all(sorted(pair) == [-1, 1] for pair in signs):
        return PROPER
    (of_a, of_b), (of_p, of_q) = signs
    if of_a == of_b == 0:
        return DEGENERATE if edge[0] == edge[1] else ALONG
    place = START if of_p == 0 else END if of_q == 0 else 0 if of_a == 0 else 1
    return 2 * place + 4 + ((of_a > 0) != (of_b > 0))


def test_contacts_are_those_of_all_edges() -> None:
    rng = np.random.default_rng(1)
    edges, segments = rng.integers(-3, 4, (30, 2, 2)) * 0.5, rng.integers(-3, 4, (20, 2, 2)) * 0.5
    segments[0, 1] = segments[0, 0]
    outline, stop = outline_of(edges, np.arange(30), np.array([0, 30])), np.zeros(1, np.uint8)
    n, met, kinds, offsets = find_contacts_2d(segments, outline, stop, 1000)
    assert n == offsets[-1] > 20
    for i, segment in enumerate(segments.tolist()):
        mine = slice(offsets[i], offsets[i + 1])
        found = dict(zip(met[mine].tolist(), kinds[mine].tolist()))
        surely = {k: contact(edge, segment) for k, edge in enumerate(edges.tolist()) if i > 0}
        # boxes keep apart what only lines that touch, or points on a line, leave open
        assert {k: kind for k, kind in found.items() if kind == PROPER} == {
            k: kind for k, kind in surely.items() if kind == PROPER
        }
        assert found.items() <= surely.items()
    assert find_contacts_2d(segments, outline, stop, 3)[0] == NO_ROOM
