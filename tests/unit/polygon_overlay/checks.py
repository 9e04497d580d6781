"""Slow, exact checks of an overlay's output: validity, orientation, structure, area."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from engine.arrangement.nodes import float_nodes
from engine.arrangement.rings import ExactRings
from engine.polygon_overlay.result import Overlay
from tests.reference.exact import Q
from tests.reference.overlay import overlay as reference_overlay

OPERATIONS = ("intersection", "union", "difference", "symmetric_difference")
IntPoint = tuple[int, int, int]


def turn(a: IntPoint, b: IntPoint, c: IntPoint) -> int:
    value = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return (value > 0) - (value < 0)


def within(a: IntPoint, b: IntPoint, p: IntPoint) -> bool:
    """Tell whether `p`, on the line ab, lies on the closed segment."""
    return all(min(a[k], b[k]) <= p[k] <= max(a[k], b[k]) for k in (0, 1))


def assert_valid(result: Overlay) -> None:
    """Edges meet in vertices they share only, rings are simple and turn as they should, holes lie in their shells."""
    if not result.n_pieces:
        return
    nodes, numbers = float_nodes(result.vertices)
    points = [nodes.points[number] for number in numbers]
    shells = set(result.piece_offsets.tolist())
    edges: list[tuple[int, int]] = []
    for ring, (start, stop) in enumerate(pairwise(result.ring_offsets.tolist())):
        own = [*range(start, stop)]
        assert len({numbers[k] for k in own}) == len(own) >= 3, "a ring passes a vertex twice"
        ring_edges = list(pairwise([*own, start]))
        area = sum(points[i][0] * points[j][1] - points[j][0] * points[i][1] for i, j in ring_edges)
        assert area > 0 if ring in shells else area < 0, "a shell runs clockwise or a hole does not"
        edges += ring_edges
    ends = result.vertices[np.array(edges)]
    low, high = ends.min(axis=1), ends.max(axis=1)
    for k, (i, j) in enumerate(edges):
        a, b = points[i], points[j]
        near = np.flatnonzero(((low[k + 1 :] <= high[k]) & (low[k] <= high[k + 1 :])).all(axis=1)) + k + 1
        for other in near.tolist():
            c, d = points[edges[other][0]], points[edges[other][1]]
            assert {a, b} != {c, d}, "two edges coincide"
            sides = turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)
            assert not (sides[0] * sides[1] < 0 and sides[2] * sides[3] < 0), "two edges cross"
            for side, ab, p in zip(sides, ((a, b), (a, b), (c, d), (c, d)), (c, d, a, b), strict=True):
                assert side or not within(*ab, p) or p in ab, "a vertex lies inside an edge"
    assert_nested(result)


def assert_nested(result: Overlay) -> None:
    """Each hole lies in its own shell, no two holes of a piece in each other; edges are known not to cross."""
    for shell, holes in result.pieces:
        for k, hole in enumerate(holes):
            assert location(shell, middle(hole)) > 0
            for other in holes[:k]:
                if (hole.min(axis=0) > other.max(axis=0)).any() or (hole.max(axis=0) < other.min(axis=0)).any():
                    continue
                assert location(other, middle(hole)) < 0
                assert location(hole, middle(other)) < 0


def middle(ring: np.ndarray) -> tuple[Fraction, Fraction]:
    """Return the middle of a ring's first edge: no vertex of any other ring, nor on another's edge."""
    (ax, ay), (bx, by) = ring[:2].tolist()
    return (Fraction(ax) + Fraction(bx)) / 2, (Fraction(ay) + Fraction(by)) / 2


def location(ring: np.ndarray, point: tuple[Fraction, Fraction]) -> int:
    """1 inside, 0 on, -1 outside a simple ring, in fractions."""
    x, y = point
    inside = -1
    for a, b in pairwise([*ring.tolist(), ring[0].tolist()]):
        if (a[0] > x and b[0] > x) or (a[0] < x and b[0] < x):
            continue
        (ax, ay), (bx, by) = map(Fraction, a), map(Fraction, b)
        side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        if side == 0 and min(ay, by) <= y <= max(ay, by):
            return 0
        if (ax <= x) != (bx <= x) and (side > 0) == (bx > ax):
            inside = -inside
    return inside


def structure(result: Overlay) -> list[tuple[Fraction, int]]:
    """Return (area, number of holes) of each piece of the exact result, sorted, as the reference does."""
    pieces: list[list[Fraction]] = []
    for ring in result.exact.exact_rings().rings:
        area = ExactRings((ring,), result.exact.exact_rings().exponent).area()
        if area > 0:
            pieces.append([area])
        else:
            pieces[-1].append(area)
    return sorted((sum(areas, Fraction(0)), len(areas) - 1) for areas in pieces)


def assert_counts_add_up(result: Overlay) -> None:
    n_lost = sum(part.kind == "piece" for part in result.collapsed)
    assert result.n_pieces == result.n_pieces_exact - n_lost - result.pieces_joined + result.pieces_parted
    n_lost = len(result.collapsed) - n_lost
    assert result.n_holes == result.n_holes_exact - n_lost - result.holes_joined + result.holes_parted


def assert_area_close(result: Overlay) -> None:
    """What lies between the exact boundary and its image has at most the area that the displacement bound allows."""
    total, length = Fraction(0), 0.0
    for ring in result.rings:
        nodes, numbers = float_nodes(ring)
        total += ExactRings((tuple(nodes.points[number] for number in numbers),), nodes.exponent).area()
    for ring in result.exact.exact_rings().rings:
        scale = 2.0 ** result.exact.exact_rings().exponent
        points = np.array([(x / w * scale, y / w * scale) for x, y, w in ring])
        length += float(np.hypot(*(points - np.roll(points, 1, axis=0)).T).sum()) + 8 * result.largest_displacement
    assert abs(total - result.area_exact) <= Fraction(2 * result.largest_displacement * length)


def area_error(result: Overlay, exact: Fraction) -> tuple[float, float]:
    """Return how far the output's area is from the exact one, and its perimeter, that of lost parts included."""
    if not result.rounds:
        return 0.0, 0.0
    total, length = Fraction(0), 0.0
    for ring in result.rings:
        length += float(np.hypot(*(ring - np.concatenate([ring[-1:], ring[:-1]])).T).sum())
        numbers = [number.as_integer_ratio() for number in ring.ravel().tolist()]
        scale = max(bottom for _, bottom in numbers)
        whole = [top * (scale // bottom) for top, bottom in numbers]
        x, y = whole[::2], whole[1::2]
        total += Fraction(sum(x[k - 1] * y[k] - x[k] * y[k - 1] for k in range(len(x))), 2 * scale * scale)
    error = abs(total - exact)
    if error and result.collapsed:
        scale = Fraction(2) ** result.exact.exact_rings().exponent
        for ring in result.exact.exact_rings().rings:
            for (ax, ay, aw), (bx, by, bw) in pairwise([*ring, ring[0]]):
                sides = [float(Fraction(p * bw - q * aw, aw * bw) * scale) for p, q in ((ax, bx), (ay, by))]
                length += float(np.hypot(*sides))
    return float(error), length


def assert_equals_reference(result: Overlay, subject: list[Any], clip: list[Any], operation: str) -> None:
    expected = reference_overlay({"type": "polygon", "rings": subject}, {"type": "polygon", "rings": clip}, operation)
    assert Q(result.area_exact.numerator, result.area_exact.denominator) == expected.area
    own = [(Q(area.numerator, area.denominator), n_holes) for area, n_holes in structure(result)]
    assert own == expected.pieces
