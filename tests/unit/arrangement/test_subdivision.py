"""Subdivisions: cells of edges, the edge below a point, components."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

from engine.arrangement.arrange import Arrangement, arrange_rings
from engine.arrangement.subdivision import EdgesBelow, label_faces, subdivide
from engine.arrangement.union_find import UnionFind
from tests.unit.arrangement.segments import arrange_segments, face_points


def n_components(arrangement: Arrangement) -> int:
    sets = UnionFind(len(arrangement.nodes.points))
    for tail, head in zip(arrangement.tails, arrangement.heads, strict=True):
        sets.unite(tail, head)
    return len({sets.find(node) for node in arrangement.tails})


def slow_label(rings: list[np.ndarray], masks: list[int], point: tuple[Fraction, Fraction]) -> int:
    """Parity of the edges straight above, ring by ring; the point lies on no edge."""
    x, y = point
    label = 0
    for ring, mask in zip(rings, masks, strict=True):
        vertices = [(Fraction(p), Fraction(q)) for p, q in ring.tolist()]
        for (ax, ay), (bx, by) in zip(vertices, vertices[1:] + vertices[:1], strict=True):
            if (ax <= x) != (bx <= x) and ay + (by - ay) * (x - ax) / (bx - ax) > y:
                label ^= mask
    return label


def check(rings: list[np.ndarray], masks: list[int]) -> None:
    offsets = np.cumsum([0, *map(len, rings)]).tolist()
    arrangement = arrange_rings(np.concatenate(rings), offsets, masks)
    subdivision = subdivide(arrangement)
    n_nodes = len({*arrangement.tails, *arrangement.heads})
    assert n_nodes - len(arrangement.tails) + subdivision.n_faces == 1 + n_components(arrangement)
    labels = label_faces(subdivision)
    points = face_points(subdivision)
    assert labels == [slow_label(rings, masks, point) for point in points]
    assert len(set(points)) == subdivision.n_faces


def square(x: float, y: float, size: float) -> np.ndarray:
    return np.array([(x, y), (x + size, y), (x + size, y + size), (x, y + size)])


@pytest.mark.parametrize(
    "rings",
    [
        [square(0, 0, 1)],
        [square(0, 0, 9), square(1, 1, 7), square(2, 2, 5), square(3, 3, 1), square(5, 3, 1)],
        [square(0, 0, 9), square(1, 1, 1), square(1, 3, 1), square(3, 1, 1), square(20, 0, 1)],
        [square(0, 0, 2), square(2, 2, 2), square(2, 0, 2)],
        [square(0, 0, 4), square(0, 0, 4)],
        [square(0, 0, 4), square(0, 1, 2)],
        [np.array([(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)])],
        [np.array([(0.0, 0.0), (4.0, 0.0), (9.0, 0.0), (4.0, 0.0), (4.0, 4.0)])],
    ],
    ids=["square", "nested", "siblings", "touching", "twice", "shared edge", "bow tie", "spike"],
)
def test_faces_and_labels(rings: list[np.ndarray]) -> None:
    check(rings, [1 + k % 2 for k in range(len(rings))])
    check(rings, [1 << k for k in range(len(rings))])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("size", [3, 6, 1 << 20])
def test_random_rings_on_a_lattice(seed: int, size: int) -> None:
    random = np.random.default_rng([seed, size])
    check([random.integers(0, size, (n, 2)).astype(float) for n in (7, 5, 4)], [1, 2, 1])


def test_no_edges_leave_one_face() -> None:
    subdivision = subdivide(arrange_segments([((1, 1), (1, 1))]))
    assert subdivision.n_faces == 1
    assert label_faces(subdivision) == [0]
    assert len(face_points(subdivision)) == 1


def test_dangling_segments_part_nothing() -> None:
    fence = [((0, 0), (6, 0)), ((6, 0), (3, 6)), ((3, 6), (0, 0)), ((3, 6), (3, 2)), ((9, 9), (10, 10))]
    subdivision = subdivide(arrange_segments(fence, [1, 1, 1, 0, 0]))
    assert label_faces(subdivision) == [0, 1]
    (x, y) = face_points(subdivision)[1]
    assert x != 3 or y < 2


# --- The stab straight down, against all edges in rational arithmetic ---


def slow_edge_below(arrangement: Arrangement, node: int) -> int:
    """All edges that span x + 0, by height at x, then by slope."""
    x, y = arrangement.nodes.exact(node)
    found: list[tuple[Fraction, Fraction, int]] = []
    for edge, (tail, head) in enumerate(zip(arrangement.tails, arrangement.heads, strict=True)):
        (px, py), (qx, qy) = arrangement.nodes.exact(tail), arrangement.nodes.exact(head)
        if px <= x < qx:
            slope = (qy - py) / (qx - px)
            if (height := py + slope * (x - px)) < y:
                found.append((height, slope, edge))
    return max(found)[2] if found else -1


@pytest.mark.parametrize("seed", range(6))
def test_equals_the_slow_answer(seed: int) -> None:
    random = np.random.default_rng(seed)
    segments = [tuple(map(tuple, segment)) for segment in random.integers(0, 9, (14, 2, 2)).astype(float).tolist()]
    arrangement = arrange_segments(segments)
    below = EdgesBelow(arrangement)
    for node in {*arrangement.tails, *arrangement.heads}:
        assert below.find(node) == slow_edge_below(arrangement, node)


# --- Sets grow together; the root is the smallest member whatever the order of uniting ---


def test_root_is_the_smallest_member() -> None:
    for order in permutations([(4, 2), (2, 5), (1, 5), (3, 0)]):
        sets = UnionFind(6)
        for first, second in order:
            sets.unite(first, second)
        assert [sets.find(member) for member in range(6)] == [0, 1, 1, 0, 1, 1]
