"""Exact areas of all Boolean operations on two even-odd polygons at once, quick enough for a hundred thousand pairs.

Every edge is split where it meets others. The area bounded by a directed part of the edge a + t d is
(t1 - t0) cross(a, d) / 2, so only parameters are needed, no crossing points. The labels on either side of a part come
from a ray upward from its middle. `test_fast.py` holds this against tests/reference/overlay.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from gmpy2 import mpq

from tests.reference.fast_clipping import bits_below_one, integer

Edge = tuple[int, int, int, int, int]
"""ax, ay, dx, dy, body."""


class Areas(NamedTuple):
    """Exact areas of what lies in the subject alone, in the clip alone, in both."""

    subject: mpq
    clip: mpq
    both: mpq

    def of(self, operation: str) -> mpq:
        either = self.subject + self.clip
        answers = {"intersection": self.both, "union": either + self.both, "difference": self.subject}
        return either if operation == "symmetric_difference" else answers[operation]


def edges_of(bodies: Sequence[list[Any]]) -> tuple[list[Edge], int]:
    """Return the edges of bodies, each a list of rings of (x, y) floats, as integers, and by how many bits scaled."""
    bits = bits_below_one([x for rings in bodies for ring in rings for point in ring for x in point])
    edges: list[Edge] = []
    for body, rings in enumerate(bodies):
        for ring in rings:
            points = [(integer(x, bits), integer(y, bits)) for x, y in ring]
            for (ax, ay), (bx, by) in pairwise([*points, points[0]]):
                if (ax, ay) != (bx, by):
                    edges.append((ax, ay, bx - ax, by - ay, body))
    return edges, bits


def areas(subject: list[Any], clip: list[Any]) -> Areas:
    """Return the areas for two lists of rings of (x, y) floats."""
    edges, bits = edges_of([subject, clip])
    totals = [mpq(0)] * 4  # by label: 1 in the subject, 2 in the clip
    for part, beside in parts(edges, labels_beside):
        totals[beside[0]] += part
        totals[beside[1]] -= part
    return Areas(*(totals[label] / (2 << 2 * bits) for label in (1, 2, 3)))


def area_where(bodies: Sequence[list[Any]], is_inside: Callable[[tuple[int, ...]], bool]) -> mpq:
    """Return the area of where the winding numbers of all bodies are inside."""
    edges, bits = edges_of(bodies)
    total = mpq(0)
    for part, beside in parts(edges, lambda *edge: windings_beside(len(bodies), *edge)):
        total += part * (is_inside(beside[0]) - is_inside(beside[1]))
    return total / (2 << 2 * bits)


def parts(edges: list[Edge], beside: Callable[[list[Edge], int, mpq], Any]) -> Iterator[tuple[mpq, Any]]:
    """Yield twice the signed area that each part of an edge bounds, and what is left and right of it, if it differs."""
    for i_edge, (edge, cuts) in enumerate(zip(edges, parameters(edges))):
        ax, ay, dx, dy, _ = edge
        moment = ax * dy - ay * dx
        for t0, t1 in pairwise(sorted(cuts)):
            labels = beside(edges, i_edge, (t0 + t1) / 2)
            if labels is not None and labels[0] != labels[1]:
                yield (t1 - t0) * moment, labels


def parameters(edges: list[Edge]) -> list[set[mpq]]:
    """Return for each edge where it begins, ends, and meets others."""
    found = [{mpq(0), mpq(1)} for _ in edges]
    boxes = [(min(x, x + u), max(x, x + u), min(y, y + v), max(y, y + v)) for x, y, u, v, _ in edges]
    for i, (ax, ay, ux, uy, _) in enumerate(edges):
        left, right, bottom, top = boxes[i]
        for j in range(i):
            box = boxes[j]
            if box[0] > right or box[1] < left or box[2] > top or box[3] < bottom:
                continue
            bx, by, vx, vy, _ = edges[j]
            wx, wy = bx - ax, by - ay
            across = ux * vy - uy * vx
            on_i, on_j = wx * vy - wy * vx, wx * uy - wy * ux  # times across: where on i, where on j
            if across < 0:
                across, on_i, on_j = -across, -on_i, -on_j
            if across:
                if 0 <= on_i <= across and 0 <= on_j <= across:
                    if 0 < on_i < across:
                        found[i].add(mpq(on_i, across))
                    if 0 < on_j < across:
                        found[j].add(mpq(on_j, across))
            elif on_j == 0:
                for k, (px, py), (qx, qy, dx, dy, _) in (
                    (i, (bx, by), edges[i]),
                    (i, (bx + vx, by + vy), edges[i]),
                    (j, (ax, ay), edges[j]),
                    (j, (ax + ux, ay + uy), edges[j]),
                ):
                    t = mpq(px - qx, dx) if dx else mpq(py - qy, dy)
                    if 0 < t < 1:
                        found[k].add(t)
    return found


def labels_beside(edges: list[Edge], i_edge: int, t: mpq) -> tuple[int, int] | None:
    """Return the labels left and right of an edge at t, None where an earlier edge runs through the same point.

    The ray upward starts just to the right, so an edge counts where ax <= x < bx; edges through the point itself are
    what parts the upper (or right) side from the lower (or left).
    """
    ax, ay, dx, dy, _ = edges[i_edge]
    top, w = int(t.numerator), int(t.denominator)
    x, y = ax * w + dx * top, ay * w + dy * top
    above = through = 0
    for j, (bx, by, vx, vy, body) in enumerate(edges):
        if vx == 0:
            is_through = dx == 0 and bx == ax and (by * w <= y) != ((by + vy) * w <= y)
        elif (bx * w <= x) == ((bx + vx) * w <= x):
            continue
        else:
            side = vx * (y - by * w) - vy * (x - bx * w)
            is_through = side == 0
            if not is_through and (side < 0) == (vx > 0):
                above ^= 1 << body
        if is_through:
            if j < i_edge:
                return None
            through ^= 1 << body
    is_upper_left = dx > 0 or (dx == 0 and dy < 0)  # of a vertical edge "upper" means right
    return (above, above ^ through) if is_upper_left else (above ^ through, above)


def windings_beside(
    n_bodies: int, edges: list[Edge], i_edge: int, t: mpq
) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
    """Return as `labels_beside` does, of each body the winding number."""
    ax, ay, dx, dy, _ = edges[i_edge]
    top, w = int(t.numerator), int(t.denominator)
    x, y = ax * w + dx * top, ay * w + dy * top
    above, through = [0] * n_bodies, [0] * n_bodies
    for j, (bx, by, vx, vy, body) in enumerate(edges):
        if vx == 0:
            is_through = dx == 0 and bx == ax and (by * w <= y) != ((by + vy) * w <= y)
        elif (bx * w <= x) == ((bx + vx) * w <= x):
            continue
        else:
            side = vx * (y - by * w) - vy * (x - bx * w)
            is_through = side == 0
            if not is_through and (side < 0) == (vx > 0):
                above[body] += 1 if vx < 0 else -1
        if is_through:
            if j < i_edge:
                return None
            through[body] += (1 if vy > 0 else -1) if vx == 0 else (1 if vx < 0 else -1)
    upper, lower = tuple(above), tuple(a + b for a, b in zip(above, through))
    is_upper_left = dx > 0 or (dx == 0 and dy < 0)  # of a vertical edge "upper" means right
    return (upper, lower) if is_upper_left else (lower, upper)
