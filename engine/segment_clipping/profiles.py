"""Exact fallback of segment clipping: which part of a segment is in a posed solid, for every type of solid and any
pose.

A profile splits [0, 1] at nodes: it has the location of each node, and of the open span after it. The inverse pose maps
the segment to the solid's frame, where parameters are the same; a ball stays in the world, since it has the same
radius. Profiles of a CSG tree are combined span by span like locations: max, min, min(A, -B). Pieces are the spans that
are not outside.

Source: span classification after S. Roth, Ray casting for modeling solids, 1982. Changed: exact arithmetic.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cmp_to_key
from typing import Any, Final, NamedTuple

import numpy as np

from engine.containment.methods.rational_locate import (
    combine,
    fold_csg_tree,
    prism_walls,
    rational_location,
    to_body_frame,
    to_world_frame,
)
from engine.errors import UnsupportedSolidError
from engine.predicates.rational import Number, common_integers, nearest_with_root
from engine.running.budget import Budget
from engine.segment_clipping.exact_pieces import (
    ONE,
    ZERO,
    Contact,
    Parameter,
    compare,
    contacts_of,
    nodes_with_locations,
    parameter,
)
from engine.segment_clipping.on_boundary.contacts import Bit
from engine.segment_clipping.on_boundary.mesh_contacts import contacts_with
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline, boundary_of
from engine.segment_clipping.pieces import Piece, Pieces, as_pieces
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.mesh import Surface
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle, rows_of
from engine.solids.registry import refused, row_of
from engine.types import FloatArray, IntArray

OUTSIDE, BOUNDARY, INSIDE = -1, 0, 1
_BYTES: Final = 1000
"""Memory counted for a piece as a Python object."""
LARGEST: Final = float(np.finfo(np.float64).max)
_FAR: Final = 2.0**1000
"""Size from which all boxes are compared with a segment that is rounded: its bounds could overflow."""
Point = Sequence[Number]


class Node(NamedTuple):
    """A node of a profile. t: its parameter; at: the location there; entered, left: the faces entered and left there,
    -1 for none; after: the location of the open span after it. A face that contains an end of the segment is named if
    no other is."""

    t: Parameter
    at: int
    entered: int
    left: int
    after: int


def clip_exactly(
    segments: FloatArray, items: IntArray, solid: Solid, pose: Pose | None, budget: Budget, locations: Any = None
) -> Pieces:
    """Return the pieces of segments `items` of (n, 2, dim) in a posed solid, by exact arithmetic. locations: (-1, 0, 1)
    of both ends of each of them, None if unknown. Raises: UnsupportedSolidError, DeadlineExceededError, CancelledError.
    """
    sources: list[int] = []
    pieces: list[Piece] = []
    for place, item in enumerate(items.tolist()):
        budget.check()
        p, q = segments[item].tolist()
        known = None if locations is None else locations[place]
        of_item = [piece.rounded(p, q) for piece in exact_pieces(p, q, solid, pose, budget, known)]
        budget.take(_BYTES * len(of_item))
        pieces += of_item
        sources += [item] * len(of_item)
    return as_pieces(sources, pieces, segments.shape[2])


def exact_pieces(
    p: list[float], q: list[float], solid: Solid, pose: Pose | None, budget: Budget, locations: Any = None
) -> list[ExactPiece]:
    """Return the pieces of segment p q in a posed solid, in order; locations: of p and q, None if unknown."""
    if p == q:
        is_in = (located(p, solid, pose, budget) if locations is None else locations[0]) >= 0
        return [ExactPiece(ZERO, ONE, (-1, -1))] if is_in else []
    pieces, first = [], None
    for node in profile_of(p, q, solid, pose, budget, locations):
        if first is None and node.at >= 0:
            first = node
        if first is not None and node.after < 0:
            entered = -1 if first.t.near == 0.0 and compare(first.t, ZERO) == 0 else first.entered
            left = -1 if node.t.near == 1.0 and compare(node.t, ONE) == 0 else node.left
            pieces.append(ExactPiece(first.t, node.t, (entered, left)))
            first = None
    return pieces


class Line(NamedTuple):
    """A segment p q with a solid's pose; start and end are p and q in the solid's own frame."""

    p: Point
    q: Point
    start: Point
    """p in the solid's own frame."""
    end: Point
    pose: Pose | None
    budget: Budget
    locations: Any
    """Locations of p and q in the solid, None if unknown."""


class ExactPiece(NamedTuple):
    """A piece of a segment: exact parameters, and the faces crossed at both ends (-1: the segment's own end)."""

    first: Parameter
    last: Parameter
    faces: tuple[int, int]

    def rounded(self, p: list[float], q: list[float]) -> Piece:
        """Return the piece of segment p q with all numbers rounded to the nearest double."""
        numbers, scale = common_integers([*p, *q])
        moves = [(x, y - x) for x, y in zip(numbers[: len(p)], numbers[len(p) :])]

        def at(t: Parameter) -> list[float]:
            return [nearest_with_root(x * t.z + t.u * d, t.v * d, t.w, t.z * scale) for x, d in moves]

        return Piece((self.first.near, self.last.near), at(self.first), at(self.last), self.faces)


def located(p: Point, solid: Solid, pose: Pose | None, budget: Budget) -> int:
    """Return the location (-1, 0, 1) of a point in a posed solid; on a surface, BOUNDARY."""
    if isinstance(solid, Surface):
        own = p if pose is None else to_body_frame(p, pose)
        return BOUNDARY if list(_contacts(own, own, solid, pose, budget)) else OUTSIDE
    return rational_location(p, solid, pose, budget.check)


def profile_of(
    p: list[float], q: list[float], solid: Solid, pose: Pose | None, budget: Budget, locations: Any = None
) -> list[Node]:
    """Return the profile of segment p q (p and q differ) in a posed solid: its nodes from t = 0 to t = 1. locations:
    (-1, 0, 1) of p and q, None if unknown."""
    start, end = (p, q) if pose is None else (to_body_frame(p, pose), to_body_frame(q, pose))
    line = Line(p, q, start, end, pose, budget, locations)

    def of_leaf(leaf: Solid) -> list[Node]:
        budget.check()
        profile = row_of(leaf).profile
        if profile is None:
            raise unsupported(leaf)
        nodes: list[Node] = profile(line, leaf)
        return nodes

    if not isinstance(solid, Csg):
        return of_leaf(solid)
    offsets = solid.prepared("face_offsets", lambda: _face_offsets(solid))

    def of_operand(leaf: Solid) -> list[Node]:
        offset = offsets[id(leaf)]
        return [
            node._replace(
                entered=node.entered + offset * (node.entered >= 0), left=node.left + offset * (node.left >= 0)
            )
            for node in of_leaf(leaf)
        ]

    located_nodes: list[Node] = fold_csg_tree(solid, of_operand, _combined)
    return located_nodes


def unsupported(solid: Solid) -> UnsupportedSolidError:
    """Return the error for a solid to which segments cannot be clipped."""
    error: UnsupportedSolidError = refused(
        solid, "no segment is cut on", lambda row: row.profile, ", or a csg of these"
    )
    return error


def check_cut(solids: Sequence[Solid]) -> bool:
    """Return True if segments can be clipped to all solids, leaves of CSG trees included; else raise
    UnsupportedSolidError."""
    for body, solid in enumerate(solids):
        waiting = [solid]
        while waiting:  # bound: a tree has so many leaves at most
            node = waiting.pop()
            if isinstance(node, Csg):
                waiting += node.operands
            elif row_of(node).profile is None:
                raise UnsupportedSolidError(f"solids[{body}]: {unsupported(node).message}", ("solids", body))
    return True


def _face_offsets(solid: Csg) -> dict[int, int]:
    """Return, by the id of each node of a CSG tree, the number of faces of the leaves before it."""
    offsets: dict[int, int] = {}
    total = 0
    waiting: list[Solid] = [solid]
    while waiting:  # bound: each distinct node enters once for each operand that names it
        node = waiting.pop()
        if id(node) in offsets:
            continue
        offsets[id(node)] = total
        if isinstance(node, Csg):
            waiting += node.operands[::-1]
        else:
            total += row_of(node).n_faces(node)
    return offsets


def _combined(operation: str, profiles: list[list[Node]]) -> list[Node]:
    """Return the profile of a Boolean operation ("union", "intersection", "difference") from those of its operands. The
    face at a parameter is the lowest of the operands' faces there."""
    nodes = sorted((node.t for profile in profiles for node in profile), key=cmp_to_key(compare))
    parameters = [t for i, t in enumerate(nodes) if i == 0 or compare(nodes[i - 1], t) != 0]
    combined, places = [], [0] * len(profiles)
    for t in parameters:
        at, after, faces = [], [], []
        for i, profile in enumerate(profiles):
            if places[i] < len(profile) and compare(profile[places[i]].t, t) == 0:
                node = profile[places[i]]
                places[i] += 1
                at.append(node.at)
                faces += [face for face in (node.entered, node.left) if face >= 0]
            else:
                at.append(profile[places[i] - 1].after)
            after.append(profile[places[i] - 1].after)
        face = min(faces, default=-1)
        combined.append(Node(t, int(combine(operation, at)), face, face, int(combine(operation, after))))
    return combined


def _interval(a: Node, b: Node, between: int) -> list[Node]:
    """Return the profile of a segment that is not outside from node a to node b, which may be one point, and outside
    elsewhere. between: location of the open span between them."""
    nodes = [] if compare(a.t, ZERO) == 0 else [Node(ZERO, OUTSIDE, -1, -1, OUTSIDE)]
    if compare(a.t, b.t) == 0:
        nodes.append(Node(a.t, min(a.at, b.at), a.entered, b.left, OUTSIDE))
    else:
        nodes += [a._replace(after=between), b]
    return nodes if compare(b.t, ONE) == 0 else [*nodes, Node(ONE, OUTSIDE, -1, -1, OUTSIDE)]


_NOWHERE: Final = [Node(ZERO, OUTSIDE, -1, -1, OUTSIDE), Node(ONE, OUTSIDE, -1, -1, OUTSIDE)]


def on_planes(line: Line, solid: HalfSpace | Aabb | Convex) -> list[Node]:
    """Return the profile of a segment in a half-space, box or convex solid."""
    return _on_rows(line, rows_of(solid).tolist())


def on_triangle(line: Line, solid: Triangle) -> list[Node]:
    """Return the profile of a segment in a planar triangle, or in the prism over a triangle of space."""
    return on_boundary(line, solid) if solid.dimension == 2 else _on_rows(line, prism_walls(solid))


def _on_rows(line: Line, rows: Sequence[Sequence[float]]) -> list[Node]:
    """Return the profile of a segment in the set where all rows (a, b, ..., d) have dot(row, (x, 1)) >= 0."""
    p, q, n = line.start, line.end, len(line.p)
    numbers, scale = common_integers([*p, *q])
    start, end = numbers[:n], numbers[n:]
    a = Node(ZERO, INSIDE, -1, -1, OUTSIDE)
    b = Node(ONE, INSIDE, -1, -1, OUTSIDE)
    between = INSIDE
    for face, row in enumerate(rows):
        (*normal, offset), _ = common_integers(row)
        s_p = sum(x * y for x, y in zip(normal, start)) + offset * scale
        s_q = sum(x * y for x, y in zip(normal, end)) + offset * scale
        if s_p < 0 and s_q < 0:
            return _NOWHERE
        if s_p < 0:
            t = parameter(s_p, 0, 0, s_p - s_q)
            if a.entered < 0 or compare(t, a.t) > 0:
                a = Node(t, BOUNDARY, face, -1, OUTSIDE)
        elif s_q < 0:
            t = parameter(s_p, 0, 0, s_p - s_q)
            if b.left < 0 or compare(t, b.t) < 0:
                b = Node(t, BOUNDARY, -1, face, OUTSIDE)
        elif s_p == s_q == 0:
            between = BOUNDARY
        if s_p == 0 and a.entered < 0 and a.left < 0:
            a = a._replace(at=BOUNDARY, left=face)
        if s_q == 0 and b.left < 0 and b.entered < 0:
            b = b._replace(at=BOUNDARY, entered=face)
    return _NOWHERE if compare(a.t, b.t) > 0 else _interval(a, b, between)


def on_sphere(line: Line, solid: Sphere) -> list[Node]:
    """Return the profile of a segment in a ball, which is where a t^2 + 2 b t + c <= 0; c and a + 2 b + c, its values
    at t = 0 and t = 1, give the locations of the ends."""
    center: Point = solid.center.tolist()
    center, n = center if line.pose is None else to_world_frame(center, line.pose), len(center)
    numbers, _ = common_integers([*line.p, *line.q, *center, solid.radius])
    start, end, middle, r = numbers[:n], numbers[n : 2 * n], numbers[2 * n : 3 * n], numbers[-1]
    d, f = [y - x for x, y in zip(start, end)], [x - c for x, c in zip(start, middle)]
    a, b = sum(x * x for x in d), sum(x * y for x, y in zip(d, f))
    c = sum(x * x for x in f) - r * r
    c_end = a + 2 * b + c
    discriminant = b * b - a * c
    if c > 0 and c_end > 0 and (discriminant < 0 or b >= 0 or a + b <= 0):
        return _NOWHERE
    first = Node(ZERO, INSIDE if c < 0 else BOUNDARY, -1, -1 if c else 0, OUTSIDE)
    if c > 0:
        first = Node(parameter(-b, -1, discriminant, a), BOUNDARY, 0, -1, OUTSIDE)
    last = Node(ONE, INSIDE if c_end < 0 else BOUNDARY, -1 if c_end else 0, -1, OUTSIDE)
    if c_end > 0:
        last = Node(parameter(-b, 1, discriminant, a), BOUNDARY, -1, 0, OUTSIDE)
    return _interval(first, last, INSIDE)


def on_boundary(line: Line, solid: Any) -> list[Node]:
    """Return the profile of a segment in a polygon, planar triangle or polyhedron, or on a surface."""
    _, _, p, q, pose, budget, locations = line
    contacts = list(_contacts(p, q, solid, pose, budget))
    if isinstance(solid, Surface):
        contacts = [contact._replace(turns=False) for contact in contacts]
        locations = (OUTSIDE, OUTSIDE)
    elif locations is None:
        at_p = rational_location(p, solid, None, budget.check)
        locations = at_p, (rational_location(q, solid, None, budget.check) if at_p == BOUNDARY else OUTSIDE)

    def locate(t: Fraction) -> int:
        point = [Fraction(x) + t * (Fraction(y) - Fraction(x)) for x, y in zip(p, q)]
        return rational_location(point, solid, None, budget.check)

    nodes: list[Node] = []
    for t, met, is_along, is_in in nodes_with_locations(contacts, locations, locate):
        after = BOUNDARY if is_along else INSIDE if is_in else OUTSIDE
        face = min((contact.is_along, contact.face) for contact in met)[1] if met else -1
        at = BOUNDARY if met else locations[0] if t == 0 else nodes[-1].after
        top, bottom = t.as_integer_ratio()
        nodes.append(Node(parameter(top, 0, 0, bottom), at, face, face, after if t < 1 else OUTSIDE))
    return nodes


def _contacts(p: Point, q: Point, solid: Any, pose: Pose | None, budget: Budget) -> Iterator[Contact]:
    """Yield the exact contacts of segment p q, in the solid's own frame, with the solid's edges or triangles."""
    boundary = boundary_of(solid)
    near = _near(boundary, p, q, pose is None, budget)
    n = len(p)
    corners = boundary.elements[near]
    flat, _ = common_integers([*p, *q, *corners.ravel().tolist()])
    points = [flat[i : i + n] for i in range(0, len(flat), n)]
    size = corners.shape[1]
    elements = [
        (face, points[2 + size * i : 2 + size * (i + 1)]) for i, face in enumerate(boundary.faces[near].tolist())
    ]
    return contacts_of(points[0], points[1], elements, budget.check)


def _near(boundary: Outline | Mesh, p: Point, q: Point, are_floats: bool, budget: Budget) -> Any:
    """Return the indices of the elements of a boundary that a segment p q of rationals may meet. are_floats: whether
    all its coordinates are."""
    if are_floats or isinstance(boundary, Mesh):
        rounded = np.array([[[_nearest(x) for x in end] for end in (p, q)]])
        size = float(np.abs(rounded).max())
        if (are_floats or size < _FAR) and (rounded[0, 0] != rounded[0, 1]).any():
            blur = 0.0 if are_floats else 2.0**-52 * size + 2.0**-1000
            near, kinds, _ = contacts_with(rounded, boundary, budget, blur)
            return near[kinds & np.uint8(Bit.CEASES) == 0]  # each element once
    return near_boxes(boundary.elements, p, q)


def _nearest(x: Number) -> float:
    """Return the double nearest to a number, infinity beyond the largest."""
    try:
        return float(x)
    except OverflowError:
        return np.inf


def near_boxes(elements: FloatArray, p: Point, q: Point) -> Any:
    """Return the indices of the elements (k, corners, dim) whose boxes a segment p q of rationals may meet; its box is
    rounded outward."""
    with np.errstate(all="ignore"):  # what is no number, as beyond doubles, keeps an element
        a, b = (np.array([float(x) if -LARGEST <= x <= LARGEST else np.inf for x in point]) for point in (p, q))
        low, high = elements.min(axis=1), elements.max(axis=1)
        size = max(np.abs(a).max(), np.abs(b).max(), np.abs(low).max(), np.abs(high).max())
        slack = 2.0**-40 * size + 2.0**-500
        u, w = 0.5 * b - 0.5 * a, (0.5 * low + 0.5 * high) - (0.5 * a + 0.5 * b)
        half = (0.5 * high - 0.5 * low) + slack
        apart = (np.abs(w) > half + np.abs(u)).any(axis=1)
        for i in range(len(a)):
            for j in range(i):
                reach = half[:, i] * abs(u[j]) + half[:, j] * abs(u[i]) + slack * (half[:, i] + half[:, j])
                apart |= np.abs(u[i] * w[:, j] - u[j] * w[:, i]) > reach
    return np.flatnonzero(~apart)
