"""Planar bodies as exact edges: polygons, triangles and boxes of the plane, posed or not, and their exact relation.

Edge k runs from vertex k to the next vertex of its ring, so that an edge's number is that of the vertex it starts from
(aabb: 0..3 = ymin, xmax, ymax, xmin, counter-clockwise from the lower left corner). A body of even-odd rings may have
edges, or all of them, cancelled; single points remain where a ring has one position only.

One exact arrangement of two bodies decides everything: its faces whether the open interiors meet, its nodes and edges
whether the boundaries do, and if not, the face at an edge of one body whether it lies in the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from engine.arrangement.arrange import Arrangement, arrange
from engine.arrangement.nodes import NodeTable, float_nodes, rational_nodes
from engine.arrangement.subdivision import label_faces, subdivide
from engine.collision import outline_batch as batch
from engine.collision import result
from engine.collision.codes import DISJOINT, OVERLAPPING, UNSETTLED
from engine.collision.exact_images import image_point, rounded
from engine.collision.placed_outline import APART, OUT_OF_FIRST, OUT_OF_SECOND
from engine.compiling.jit import entry_of
from engine.containment.methods.rational_locate import rational_location
from engine.predicates.rational import orient2d_rational
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.pose import Pose, motion_of
from engine.types import FloatArray, IntArray, Location, Relation

Point = tuple[Fraction, ...]
_CHECK_EVERY = 64


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """Exact edges of one planar body under its pose; edge k starts at vertex k.

    | field | shape | meaning |
    |---|---|---|
    | points | n_vertices | exact positions of the vertices |
    | ends | (n, 2) | start and end vertex of each edge |
    | low, high | (n, 2) | boxes of the edges, from correctly rounded coordinates: rounding is monotone |
    | floats | (n_vertices, 2) | rounded positions |
    | is_posed | | False if floats are the positions as given |
    """

    points: list[Point]
    ends: IntArray
    low: FloatArray
    high: FloatArray
    floats: FloatArray
    is_posed: bool

    @property
    def n_edges(self) -> int:
        """Number of edges, including those of zero length."""
        return len(self.ends)

    def edge(self, number: int) -> tuple[Point, Point]:
        """Return the exact positions of both ends of an edge."""
        start, end = self.ends[number].tolist()
        return self.points[start], self.points[end]


def outline_of(body: Solid, pose: Pose | None, budget: Budget) -> Outline:
    """Return the edges of a polygon, a triangle or a box of the plane under `pose`."""
    vertices, offsets = batch.rings_of(body)
    ends = np.empty((len(vertices), 2), np.int64)
    ends[:, 0] = np.arange(len(vertices))
    ends[:, 1] = ends[:, 0] + 1
    ends[offsets[1:] - 1, 1] = offsets[:-1]
    points: list[Point] = []
    for vertex, p in enumerate(vertices.tolist()):
        if vertex % _CHECK_EVERY == 0:
            budget.check()
        points.append(image_point(p, pose))
    floats = vertices if pose is None else np.array([[rounded(x), rounded(y)] for x, y in points])
    low, high = np.minimum(floats[ends[:, 0]], floats[ends[:, 1]]), np.maximum(floats[ends[:, 0]], floats[ends[:, 1]])
    return Outline(points, ends, low, high, floats, pose is not None)


def arrange_outlines(outlines: list[Outline], budget: Budget) -> tuple[Arrangement, list[list[int]]]:
    """Return the arrangement of all edges, bit k of an edge's mask being set if outline k has it, and numbers:
    numbers[k][v] is the node of vertex v of outline k."""
    nodes, numbers = _nodes_of(outlines, budget)
    segments: list[tuple[int, int]] = []
    masks: list[int] = []
    for k, (outline, own) in enumerate(zip(outlines, numbers)):
        segments += [(own[start], own[end]) for start, end in outline.ends.tolist()]
        masks += [1 << k] * outline.n_edges
    return arrange(nodes, segments, masks, budget), numbers


def _nodes_of(outlines: list[Outline], budget: Budget) -> tuple[NodeTable, list[list[int]]]:
    """Return the table of distinct points of all outlines, and numbers: numbers[k][v] is the node of vertex v of
    outline k."""
    if any(outline.is_posed for outline in outlines):
        points, down = [point for outline in outlines for point in outline.points], _scale_divisor(outlines)
        nodes, flat = rational_nodes(points if down == 1 else [(x / down, y / down) for x, y in points], budget)
    else:
        nodes, flat = float_nodes(np.concatenate([outline.floats for outline in outlines]), budget)
    numbers, start = [], 0
    for outline in outlines:
        numbers.append(flat[start : start + len(outline.points)])
        start += len(outline.points)
    return nodes, numbers


def _scale_divisor(outlines: list[Outline]) -> int:
    """Return the number by which all coordinates are divided for the arrangement: 4 if a posed coordinate exceeds the
    largest double, else 1."""
    return 1 if all(np.isfinite(outline.floats).all() for outline in outlines) else 4


def live_edges(outline: Outline, budget: Budget) -> list[tuple[Point, Point]]:
    """Return the parts of edges that even-odd does not cancel, each as its exact ends: the interior is on one side of
    them only."""
    arrangement, _ = arrange_outlines([outline], budget)
    live, down = [edge for edge, mask in enumerate(arrangement.masks) if mask], _scale_divisor([outline])

    def exact(node: int) -> Point:
        return tuple(x * down for x in arrangement.nodes.exact(node))

    return [(exact(arrangement.tails[edge]), exact(arrangement.heads[edge])) for edge in live]


def is_clean(outline: Outline, number: int) -> bool:
    """Return whether edge `number` has a length and no other edge overlaps it, so that no part of it cancels."""
    a, b = outline.edge(number)
    if a == b:
        return False
    near = (outline.low <= outline.high[number]).all(axis=1) & (outline.high >= outline.low[number]).all(axis=1)
    near[number] = False
    axis = 0 if a[0] != b[0] else 1
    start, stop = sorted((a[axis], b[axis]))
    for other in np.flatnonzero(near).tolist():
        c, d = outline.edge(other)
        if orient2d_rational(a, b, c) == 0 and orient2d_rational(a, b, d) == 0:
            if max(c[axis], d[axis]) > start and min(c[axis], d[axis]) < stop:
                return False
    return True


def single_points(outline: Outline) -> list[int]:
    """Return one vertex of each ring that consists of one position only."""
    starts = np.flatnonzero(outline.ends[:, 1] != outline.ends[:, 0] + 1)  # the last edge of each ring
    vertices, first = [], 0
    for last in starts.tolist():
        if all(outline.points[k] == outline.points[first] for k in range(first, last + 1)):
            vertices.append(first)
        first = last + 1
    return vertices


def _related(first: Solid, second: Solid, poses: result.Poses, work: result.Work) -> tuple[int, int, int, int, int]:
    """Return what `relate_placed` does of two planar solids under poses."""
    one, other = batch.outline_arrays(first, work.budget), batch.outline_arrays(second, work.budget)
    own, their = motion_of(poses[0], 2), motion_of(poses[1], 2)
    answer: tuple[int, int, int, int, int] = entry_of(batch.relate_two)(
        *one, *own, *other, *their, work.boolean, work.witness, work.budget.flag
    )
    work.budget.check()
    return answer


def collide_outlines(first: Solid, second: Solid, poses: result.Poses, work: result.Work) -> result.Collision:
    """Return the relation of two planar bodies, by the kernel or, where that is undecided, by the exact arrangement."""
    relation, _, i, j, kind = _related(first, second, poses, work)
    if relation == UNSETTLED or (relation >= OVERLAPPING and work.witness and i < 0):
        return collide_outline_outline(first, second, poses, work)
    if relation == DISJOINT or not work.witness:
        return result.UNNAMED[relation]
    return result.Collision(result.RELATIONS[relation], witness_of(relation, i, j, kind))


def witness_of(relation: int, first: int, second: int, kind: int) -> result.Witness | None:
    """Return the witness of a relation that the kernel decided, None if it gave none: of DISJOINT, and of an overlap
    without edges that meet. first, second, kind: as of `relate_placed`."""
    if relation >= OVERLAPPING:
        return result.Witness(batch.KINDS[kind], first, second) if first >= 0 else None
    return _WITHIN[relation]


_WITHIN = (None, result.FIRST_WITHIN.witness, result.SECOND_WITHIN.witness)


def outline_parts(first: Solid, second: Solid, poses: result.Poses, work: result.Work) -> result.Parts:
    """Return which of two overlapping planar bodies has a part outside the other, by the kernel or, where that is
    undecided, by the exact arrangement."""
    relation, bits, _, _, kind = _related(first, second, poses, work)
    if relation == UNSETTLED:
        return parts_by_arrangement(first, second, poses, work)
    return result.Parts(bits & OUT_OF_SECOND != 0, bits & OUT_OF_FIRST != 0, kind != APART)


FIRST, SECOND, BOTH = 1, 2, 3


def collide_outline_outline(first: Solid, second: Solid, poses: result.Poses, work: result.Work) -> result.Collision:
    """Return the exact relation of two planar bodies by their arrangement. Bodies are closed sets under even-odd; an
    edge that cancels is still boundary, without interior next to it. A body without interior (zero area, doubled rings)
    never overlaps."""
    a, b = outline_of(first, poses[0], work.budget), outline_of(second, poses[1], work.budget)
    if (a.low.min(0) > b.high.max(0)).any() or (b.low.min(0) > a.high.max(0)).any():
        return result.NO_CONTACT
    labels, meets, first_parts, second_parts = _mutual_locations(a, b, (first, second), poses, work.budget)
    if not meets:
        if not any(first_parts) and not any(second_parts):
            return result.NO_CONTACT
        if all(first_parts) and not any(second_parts):
            return result.FIRST_WITHIN
        if all(second_parts) and not any(first_parts):
            return result.SECOND_WITHIN
    overlapping = BOTH in labels
    pierces = not overlapping and (any(first_parts) or any(second_parts))
    witness = None
    if work.witness:
        witness = _witness(a, b, pierces, "second" if any(first_parts) else "first", work.budget)
    return result.Collision(Relation.OVERLAPPING if overlapping else Relation.TOUCHING, witness)


class _MutualLocations(NamedTuple):
    """Locations of two planar bodies in each other. labels: by face of their arrangement, bits FIRST and SECOND of the
    bodies that contain it; meet: whether the boundaries have a common point; first, second: by part of an edge that
    only this body has, then by isolated point, whether it lies in the other's open interior."""

    labels: list[int]
    meet: bool
    first: list[bool]
    second: list[bool]


def _mutual_locations(
    a: Outline, b: Outline, solids: tuple[Solid, Solid], poses: result.Poses, budget: Budget
) -> _MutualLocations:
    """Locate two planar bodies in each other by the arrangement of their outlines; solids, poses: the same bodies, in
    which isolated points are located."""
    arrangement, _ = arrange_outlines([a, b], budget)
    subdivision = subdivide(arrangement)
    labels, meet = label_faces(subdivision), _boundaries_meet(arrangement)
    sides = [labels[left] & labels[right] for left, right in zip(subdivision.faces[0::2], subdivision.faces[1::2])]
    parts: list[list[bool]] = []
    for outline, own, other, k in ((a, FIRST, SECOND, 1), (b, SECOND, FIRST, 0)):
        alone = [outline.points[vertex] for vertex in single_points(outline)]
        points = [rational_location(point, solids[k], poses[k], budget.check) for point in alone]
        meet |= Location.BOUNDARY in points
        parts.append([bool(side & other) for cover, side in zip(arrangement.cover, sides) if cover == own])
        parts[-1] += [location == Location.INSIDE for location in points]
    return _MutualLocations(labels, meet, *parts)


def parts_by_arrangement(first: Solid, second: Solid, poses: result.Poses, work: result.Work) -> result.Parts:
    """Return which of two overlapping planar bodies has a part outside the other, by their exact arrangement."""
    outlines = outline_of(first, poses[0], work.budget), outline_of(second, poses[1], work.budget)
    labels, meet, _, _ = _mutual_locations(*outlines, (first, second), poses, work.budget)
    return result.Parts(FIRST in labels, SECOND in labels, meet)


def _boundaries_meet(arrangement: Arrangement) -> bool:
    """Return whether an edge of the arrangement belongs to both bodies, or a node has edges of both."""
    if BOTH in arrangement.cover:
        return True
    at_node = [0] * len(arrangement.nodes.points)
    for tail, head, cover in zip(arrangement.tails, arrangement.heads, arrangement.cover):
        at_node[tail] |= cover
        at_node[head] |= cover
    return BOTH in at_node


def _witness(a: Outline, b: Outline, pierces: bool, containing: str, budget: Budget) -> result.Witness:
    """Return the first two edges that meet, by number, as witness; if none meet, a containment in the body that
    `containing` names. pierces: the value of `Witness.piercing`."""
    for i in range(a.n_edges):
        budget.check()
        near = (b.low <= a.high[i]).all(axis=1) & (b.high >= a.low[i]).all(axis=1)
        for j in np.flatnonzero(near).tolist():
            kind = _meeting(*a.edge(i), *b.edge(j))
            if kind is not None:
                return result.Witness(kind, i, j, piercing=pierces)
    return result.Witness("containment", containing="second" if containing == "second" else "first", piercing=pierces)


def _meeting(p: Point, q: Point, r: Point, s: Point) -> result.Kind | None:
    """Return the kind of contact of the closed segments p q and r s, None if they are disjoint; exact."""
    if p in (r, s) or q in (r, s):
        return "vertex_vertex"
    if _is_on(r, p, q) or _is_on(s, p, q) or _is_on(p, r, s) or _is_on(q, r, s):
        return "vertex_edge"
    apart = orient2d_rational(p, q, r) * orient2d_rational(p, q, s) >= 0
    return None if apart or orient2d_rational(r, s, p) * orient2d_rational(r, s, q) >= 0 else "edge_edge"


def _is_on(point: Point, a: Point, b: Point) -> bool:
    """Return whether `point` lies on the closed segment a b."""
    within = all(min(a[k], b[k]) <= point[k] <= max(a[k], b[k]) for k in range(2))
    return within and orient2d_rational(a, b, point) == 0
