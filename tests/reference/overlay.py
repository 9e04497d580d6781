"""Area and structure of a Boolean operation on two even-odd polygons, by exact vertical trapezoids.

Slabs lie between neighbouring x of end points and crossings; within a slab edges do not cross, so the parity of both
polygons is counted upward. Pieces are components of the chosen trapezoids over shared sides of positive length, holes
of a piece are the bounded components of what it leaves.
"""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import Any, NamedTuple

from tests.reference.contact import Segment, crossing_of_lines
from tests.reference.exact import Q, along
from tests.reference.solids import Solid, edges

OPERATIONS = {
    "intersection": lambda a, b: a and b,
    "union": lambda a, b: a or b,
    "difference": lambda a, b: a and not b,
    "symmetric_difference": lambda a, b: a != b,
}


class Trapezoid(NamedTuple):
    """A cell of one slab: the y of its lower and upper edge at the left and right x."""

    slab: int
    left: Q
    right: Q
    low: tuple[Q, Q]
    high: tuple[Q, Q]
    windings: tuple[int, ...]

    @property
    def inside(self) -> tuple[bool, ...]:
        return tuple(winding % 2 == 1 for winding in self.windings)

    @property
    def area(self) -> Q:
        return (self.right - self.left) * (self.high[0] - self.low[0] + self.high[1] - self.low[1]) / 2


def trapezoids(*bodies: list[Segment]) -> list[Trapezoid]:
    """Return the cells of the common subdivision with the winding number of each body, a frame around it included."""
    every = [edge for body in bodies for edge in body if edge[0] != edge[1]]
    if not every:
        return []
    cuts = {p[0] for edge in every for p in edge}
    for one, other in combinations(every, 2):
        point = crossing_of_lines(one, other)
        if point is not None:
            cuts.add(point[0])
    bottom = min(p[1] for edge in every for p in edge) - 1
    top = max(p[1] for edge in every for p in edge) + 1
    found = []
    for slab, (left, right) in enumerate(pairwise([min(cuts) - 1, *sorted(cuts), max(cuts) + 1])):
        lines = []
        for body, part in enumerate(bodies):
            for a, b in part:
                if min(a[0], b[0]) <= left and right <= max(a[0], b[0]) and a[0] != b[0]:
                    ends = tuple(along(a, b, (x - a[0]) / (b[0] - a[0]))[1] for x in (left, right))
                    lines.append((ends[0] + ends[1], ends, body, 1 if a[0] < b[0] else -1))
        lines.sort()
        windings, low = [0] * len(bodies), (bottom, bottom)
        for middle, ends, body, step in [*lines, (2 * top, (top, top), 0, 0)]:
            if middle > low[0] + low[1]:
                found.append(Trapezoid(slab, left, right, low, ends, tuple(windings)))
            low = ends
            windings[body] += step
    return found


def _components(cells: list[Trapezoid]) -> list[list[Trapezoid]]:
    """Return the components over shared sides of positive length."""
    parent = list(range(len(cells)))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    by_slab: dict[int, list[int]] = {}
    for i, cell in enumerate(cells):
        by_slab.setdefault(cell.slab, []).append(i)
    for slab, members in by_slab.items():
        for i, j in pairwise(members):
            if cells[i].high == cells[j].low:
                parent[root(i)] = root(j)
        for i in members:
            for j in by_slab.get(slab + 1, ()):
                if max(cells[i].low[1], cells[j].low[0]) < min(cells[i].high[1], cells[j].high[0]):
                    parent[root(i)] = root(j)
    groups: dict[int, list[Trapezoid]] = {}
    for i, cell in enumerate(cells):
        groups.setdefault(root(i), []).append(cell)
    return list(groups.values())


class Result(NamedTuple):
    """Exact area, and of each piece (area, number of holes), sorted."""

    area: Q
    pieces: list[tuple[Q, int]]


def overlay(subject: Solid, clip: Solid, operation: str) -> Result:
    """Return the exact area and structure of the open interior of the result."""
    cells = trapezoids(edges(subject), edges(clip))
    return structure(cells, [cell for cell in cells if OPERATIONS[operation](*cell.inside)])


def structure(cells: list[Trapezoid], kept: list[Trapezoid]) -> Result:
    """Return the exact area and structure of some of the cells."""
    pieces = []
    for piece in _components(kept):
        members = set(piece)
        rest = _components([cell for cell in cells if cell not in members])
        pieces.append((sum((cell.area for cell in piece), Q(0)), len(rest) - 1))
    return Result(sum((area for area, _ in pieces), Q(0)), sorted(pieces))


def area(solid: Solid) -> Q:
    """Return the exact even-odd area of a polygon."""
    return sum((c.area for c in trapezoids(edges(solid), []) if c.inside[0]), Q(0))


def signed_area(ring: Any) -> Q:
    """Return the exact signed area of a simple ring, counter-clockwise positive."""
    points = [(Q(x), Q(y)) for x, y in ring]
    return sum((a[0] * b[1] - a[1] * b[0] for a, b in pairwise([*points, *points[:1]])), Q(0)) / 2
