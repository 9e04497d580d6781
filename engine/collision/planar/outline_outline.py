"""Two planar bodies: polygons, triangles, boxes. One exact arrangement of both answers everything.

Its faces say whether the open interiors meet, its nodes and edges whether the boundaries do, and where the boundaries
do not meet, the face at any edge of one body says whether that part of it lies in the other.
"""

from __future__ import annotations

import numpy as np

from engine.arrangement.arrange import Arrangement
from engine.arrangement.subdivision import label_faces, subdivide
from engine.collision.planar.outline import Outline, Point, arrange_outlines, outline_of, single_points
from engine.collision.result import Collision, Kind, Witness, Work
from engine.containment.rational_locate import rational_location
from engine.parallel import Budget
from engine.predicates.rational import orient2d_rational
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Location, Relation

FIRST, SECOND, BOTH = 1, 2, 3


def collide_outline_outline(
    first: Solid, second: Solid, first_pose: Pose | None, second_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of two bodies of the plane, each a polygon, a triangle or a box; exact.

    Bodies are closed sets under even-odd; an edge that cancels is boundary still, but no interior lies beside it. Where
    nothing is left of the interior (zero area, doubled rings) a body never overlaps.
    """
    a, b = outline_of(first, first_pose, work.budget), outline_of(second, second_pose, work.budget)
    if (a.low.min(0) > b.high.max(0)).any() or (b.low.min(0) > a.high.max(0)).any():
        return Collision(Relation.DISJOINT)
    arrangement, _ = arrange_outlines([a, b], work.budget)
    subdivision = subdivide(arrangement, work.budget)
    labels = label_faces(subdivision)
    beside = [(labels[f], labels[g]) for f, g in zip(subdivision.faces[0::2], subdivision.faces[1::2])]
    first_points = [rational_location(a.points[k], second, second_pose, work.budget.check) for k in single_points(a)]
    second_points = [rational_location(b.points[k], first, first_pose, work.budget.check) for k in single_points(b)]
    meets = boundaries_meet(arrangement) or Location.BOUNDARY in (*first_points, *second_points)
    # Edges of one body, not of the other, with the other's open interior on both sides.
    first_parts = [bool(left & right & SECOND) for c, (left, right) in zip(arrangement.cover, beside) if c == FIRST]
    second_parts = [bool(left & right & FIRST) for c, (left, right) in zip(arrangement.cover, beside) if c == SECOND]
    first_parts += [location == Location.INSIDE for location in first_points]
    second_parts += [location == Location.INSIDE for location in second_points]
    if not meets:
        if not any(first_parts) and not any(second_parts):
            return Collision(Relation.DISJOINT)
        if all(first_parts) and not any(second_parts):
            return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
        if all(second_parts) and not any(first_parts):
            return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    overlapping = BOTH in labels
    pierces = not overlapping and (any(first_parts) or any(second_parts))
    witness = None
    if work.witness:
        witness = _witness(a, b, pierces, "second" if any(first_parts) else "first", work.budget)
    return Collision(Relation.OVERLAPPING if overlapping else Relation.TOUCHING, witness)


def boundaries_meet(arrangement: Arrangement) -> bool:
    """Tell whether some edge belongs to both bodies, or some node has edges of both."""
    if BOTH in arrangement.cover:
        return True
    at_node = [0] * len(arrangement.nodes.points)
    for tail, head, cover in zip(arrangement.tails, arrangement.heads, arrangement.cover):
        at_node[tail] |= cover
        at_node[head] |= cover
    return BOTH in at_node


def _witness(a: Outline, b: Outline, pierces: bool, containing: str, budget: Budget) -> Witness:
    """Return the first pair of edges, by their numbers, that meet; a containment where no two edges do."""
    for i in range(a.n_edges):
        budget.check()
        near = (b.low <= a.high[i]).all(axis=1) & (b.high >= a.low[i]).all(axis=1)
        for j in np.flatnonzero(near).tolist():
            kind = _meeting(*a.edge(i), *b.edge(j))
            if kind is not None:
                return Witness(kind, i, j, piercing=pierces)
    return Witness("containment", containing="second" if containing == "second" else "first", piercing=pierces)


def _meeting(p: Point, q: Point, r: Point, s: Point) -> Kind | None:
    """Return how the closed segments p q and r s meet, None if they do not."""
    if p in (r, s) or q in (r, s):
        return "vertex_vertex"
    if _is_on(r, p, q) or _is_on(s, p, q) or _is_on(p, r, s) or _is_on(q, r, s):
        return "vertex_edge"
    apart = orient2d_rational(p, q, r) * orient2d_rational(p, q, s) >= 0
    if apart or orient2d_rational(r, s, p) * orient2d_rational(r, s, q) >= 0:
        return None
    return "edge_edge"


def _is_on(point: Point, a: Point, b: Point) -> bool:
    """Tell whether `point` lies on the closed segment a b."""
    within = all(min(a[k], b[k]) <= point[k] <= max(a[k], b[k]) for k in range(2))
    return within and orient2d_rational(a, b, point) == 0
