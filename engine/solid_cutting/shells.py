"""The shells of a polyhedron, and which way their faces look: outwards of the even-odd solid, or inwards.

A shell is a closed surface: faces joined by their edges. Where more than two faces share an edge they are sorted by
angle about it and matched as parentheses are, a side that runs down with the next one that runs up, so that matched
faces do not pass through each other: a wedge of solid is between them if the shells look outwards. Faces at one
angle are ordered as if every shell were a little smaller, or larger, else by their numbers.

No shell crosses itself or another (that is refused), so each is the boundary of one region, on which the winding
number of the shell is 1 or -1 throughout, and the solid is the sum of regions by the parity of their depth:

    volume of the solid = sum over shells of (-1)^depth |volume of the shell|

depth: the number of other shells around it. A shell is turned if the sign of its volume is not (-1)^depth.

Source: E. A. F. Muecke, Shapes and implementations in three-dimensional geometry, 1993: faces sorted about an edge.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cmp_to_key
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.box_grid import all_pairs_of_boxes
from engine.collision.collide import collide
from engine.containment.locate import locate
from engine.errors import EngineError, InvalidInputError
from engine.predicates.rational import cross, dot, minus, scaled_integers, sign_of
from engine.running.budget import Budget
from engine.solid_cutting.faults import Edges, are_flat, crossings, edges_of, shells_of, sign_of_volume
from engine.solids.convexity import convexity, star_side
from engine.solids.mesh import Polyhedron
from engine.types import FloatArray, Int8Array, IntArray, Rcc8, read_only

_NO_JUNCTIONS: Final = np.zeros((0, 3), np.int64)


class Shells(NamedTuple):
    """Which way the triangles of a polyhedron look.

    sides (m,): 1 for a triangle that is counter-clockwise seen from outside the solid, -1 for one that is clockwise;
    empty where all are as `common` says. common: 1, -1; 0 where they differ. n: number of shells. touches: whether
    faces have points in common besides their corners and edges.
    """

    sides: Int8Array
    common: int
    n: int
    touches: bool


def shells(solid: Polyhedron, budget: Budget) -> Shells:
    """Return which way the triangles of a polyhedron look, cached with it. Raises: InvalidInputError for faces that
    cross, naming two."""
    return solid.prepared("shells", lambda: _shells_of(solid, budget), budget.check)


def outward(solid: Polyhedron, budget: Budget) -> IntArray:
    """Return the triangles of a polyhedron, counter-clockwise seen from outside, without those that name a vertex
    twice; cached with it."""
    looks = shells(solid, budget)

    def build() -> IntArray:
        faces = solid.triangles
        if looks.common <= 0:
            turned = looks.sides < 0 if looks.common == 0 else np.ones(len(faces), np.bool_)
            faces = np.where(turned[:, None], faces[:, ::-1], faces)
        return read_only(faces)

    return solid.prepared("outward", build, budget.check)


def _shells_of(solid: Polyhedron, budget: Budget) -> Shells:
    none = read_only(np.zeros(0, np.int8))
    certificate = convexity(solid)
    if certificate is not None:
        return Shells(none, 1 if certificate.is_outward else -1, 1, False)
    if side := star_side(solid):
        return Shells(none, -side, 1, False)
    points, faces = solid.vertices, solid.triangles
    budget.check()
    edges = edges_of(faces)
    is_solid = ~are_flat(points, faces, budget)
    contacts = crossings(points, faces, np.flatnonzero(is_solid), _NO_JUNCTIONS, budget)
    for way in (1, -1):
        parts = shells_of(_matched(points, faces, edges, way, budget), budget)
        part_of = _numbers_of(parts, len(faces))
        if not len(within := _within(part_of, contacts)):
            break
    else:  # at a common edge, matched faces lie on each other
        parts = shells_of(_separated(edges), budget)
        part_of = _numbers_of(parts, len(faces))
        if len(still := _within(part_of, contacts)) or not _are_closed(edges, part_of, faces):
            raise _crossing(solid, still[0] if len(still) else within[0])
        contacts = np.concatenate([contacts, _neighbours(edges, part_of)])
    number_of = np.cumsum(used := np.array([is_solid[part].any() for part in parts])) - 1  # others bound nothing
    bodies = [_Shell(points, faces, part) for part, is_used in zip(parts, used) if is_used]
    depths = _depths(solid, bodies, number_of[part_of[contacts]], budget, contacts)
    sides = np.ones(len(faces), np.int8)
    for body, depth in zip(bodies, depths):
        volume = sign_of_volume(points, faces[body.part], budget)
        sides[body.part] = 1 if volume == 0 or (volume > 0) == (depth % 2 == 0) else -1
    if (sides == sides[0]).all():
        return Shells(none, int(sides[0]), len(bodies), len(contacts) > 0)
    return Shells(read_only(sides), 0, len(bodies), len(contacts) > 0)


def _numbers_of(parts: list[IntArray], n: int) -> IntArray:
    """Return (n,): for each of n faces the number of the part, of `parts`, that it belongs to."""
    numbers = np.empty(n, np.int64)
    for number, part in enumerate(parts):
        numbers[part] = number
    return numbers


def _within(part_of: IntArray, contacts: IntArray) -> IntArray:
    """Return the rows of contacts (k, 2) whose two faces belong to one part. part_of: by face."""
    return contacts[part_of[contacts[:, 0]] == part_of[contacts[:, 1]]]


def _separated(edges: Edges) -> Edges:
    """Return edges as if faces that share one with more than two were not joined there."""
    of, n = edges.of.copy(), len(edges.ends)
    for corner in np.flatnonzero(edges.uses[of.ravel()] != 2).tolist():
        of[corner // 3, corner % 3], n = n, n + 1
    return Edges(np.zeros((n, 2), np.int64), of, edges.uses, edges.net)


def _are_closed(edges: Edges, part_of: IntArray, faces: IntArray) -> bool:
    """Return whether each part is closed: its faces use every edge as often in one direction as in the other. part_of:
    by face."""
    keys = edges.of * (int(part_of.max()) + 1) + part_of[:, None]
    _, numbers = np.unique(keys, return_inverse=True)
    ways = np.sign(np.roll(faces, -1, axis=1) - faces)
    return not np.bincount(numbers.reshape(-1), ways.ravel()).any()


def _neighbours(edges: Edges, part_of: IntArray) -> IntArray:
    """Return pairs (k, 2) of faces of different parts that share an edge which more than two faces have."""
    corners = np.flatnonzero(edges.uses[edges.of.ravel()] > 2)
    corners = corners[np.argsort(edges.of.ravel()[corners], kind="stable")]
    of = edges.of.ravel()[corners]
    pairs = [np.zeros((0, 2), np.int64)]
    for step in range(1, int(edges.uses.max())):
        same = of[step:] == of[:-step]
        pairs.append(np.stack([corners[:-step][same], corners[step:][same]], axis=1) // 3)
    rows = np.concatenate(pairs)
    return rows[part_of[rows[:, 0]] != part_of[rows[:, 1]]]


def _crossing(solid: Polyhedron, pair: IntArray) -> InvalidInputError:
    first, second = (int(solid.triangle_faces[triangle]) for triangle in pair)
    return InvalidInputError(
        f"faces[{first}] and faces[{second}] meet besides their common corners and edges, so which side of them is "
        "inside is not one for each shell; inspect names all such pairs; unite the parts in the program that made them",
        ("solid", "faces", first),
    )


class _Shell:
    """One shell: the triangles `part` of a mesh; `body` is it as a polyhedron, made at first use."""

    def __init__(self, points: FloatArray, faces: IntArray, part: IntArray) -> None:
        self.points, self.faces, self.part = points, faces[part], part
        self.vertices = np.unique(self.faces)
        self.low, self.high = (pick(points[self.vertices], axis=0) for pick in (np.min, np.max))
        self.is_odd = (self.faces == np.roll(self.faces, 1, axis=1)).any(axis=1)
        """Of triangles that name a vertex twice: they use each edge both ways."""
        self._body: Polyhedron | None = None

    def body(self, budget: Budget) -> Polyhedron:
        if self._body is None:
            faces = self.faces[~self.is_odd]
            self._body = Polyhedron(self.points, faces, deadline=budget.left(), cancel=budget.cancel)
        return self._body


def nesting(
    points: FloatArray, faces: IntArray, parts: list[IntArray], budget: Budget
) -> Iterator[tuple[IntArray, bool]]:
    """Yield each closed shell among `parts`, and whether it must be turned over: its signed volume should be positive
    within an even number of other shells, negative within an odd number. Shells may cross here."""
    closed = []
    for shell in (_Shell(points, faces, part) for part in parts):
        budget.check()
        try:
            closed += [shell] if not shell.is_odd.any() and shell.body(budget) else []
        except EngineError:
            budget.check()
    depths = [0] * len(closed)
    low, high = (np.array([getattr(shell, name) for shell in closed]).reshape(-1, 3) for name in ("low", "high"))
    for i, j in all_pairs_of_boxes(low, high, budget).tolist() if closed else ():
        for one, other in ((i, j), (j, i)):
            lies = _lies_within(closed[one], closed[other], budget)
            if lies == 0:  # all its corners are on the other's faces
                lies = _detail_of(closed[one], closed[other], budget) in (Rcc8.TPP, Rcc8.NTPP)
            depths[one] += lies > 0
    for shell, depth in zip(closed, depths):
        volume = sign_of_volume(points, shell.faces, budget)
        yield shell.part, volume != 0 and (volume > 0) is (depth % 2 == 1)


def _depths(
    solid: Polyhedron, bodies: list[_Shell], shells_in_contact: IntArray, budget: Budget, contacts: IntArray
) -> list[int]:
    """Return how many other shells are around each. contacts (k, 2): pairs of faces of different shells that meet, and
    shells_in_contact (k, 2) these shells. Of two that are the same set the second counts as within the first."""
    depths = [0] * len(bodies)
    if len(bodies) < 2:
        return depths
    touching = {(min(pair), max(pair)): row for row, pair in enumerate(shells_in_contact.tolist())}
    low, high = (np.array([getattr(body, name) for body in bodies]) for name in ("low", "high"))
    for i, j in sorted((min(pair), max(pair)) for pair in all_pairs_of_boxes(low, high, budget).tolist()):
        budget.check()
        if (i, j) not in touching:
            lies = _lies_within(bodies[i], bodies[j], budget), _lies_within(bodies[j], bodies[i], budget)
            if 0 not in lies:
                depths[i] += lies[0] == 1
                depths[j] += lies[1] == 1
                continue
        relation = _detail_of(bodies[i], bodies[j], budget)
        if relation == Rcc8.PO:
            pair = contacts[touching[i, j]] if (i, j) in touching else np.array([bodies[k].part[0] for k in (i, j)])
            raise _crossing(solid, pair)
        depths[i] += relation in (Rcc8.TPP, Rcc8.NTPP)
        depths[j] += relation in (Rcc8.TPPI, Rcc8.NTPPI, Rcc8.EQ)
    return depths


def _detail_of(one: _Shell, other: _Shell, budget: Budget) -> Rcc8 | None:
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel}
    return collide(one.body(budget), other.body(budget), detail=True, **limits).detail


def _lies_within(one: _Shell, other: _Shell, budget: Budget) -> int:
    """Return 1 if a shell that crosses no other lies within another, -1 if not, 0 if all its vertices are on that."""
    if (one.low < other.low).any() or (other.high < one.high).any():
        return -1
    points = one.points[one.vertices]
    for some in (points[:1], points):
        places = locate(some, other.body(budget), deadline=budget.left(), cancel=budget.cancel)
        if places.any():
            return int(places[np.argmax(places != 0)])
    return 0


def _matched(points: FloatArray, faces: IntArray, edges: Edges, way: int, budget: Budget) -> Edges:
    """Return edges that two faces use each: those of more are taken apart by `_matches`."""
    if ((edges.uses == 2) | (edges.uses == 1)).all():
        return edges
    of, n = edges.of.copy(), len(edges.ends)
    layers = _numbers_of(shells_of(_separated(edges), budget), len(faces))
    for corner in np.flatnonzero(edges.uses[of.ravel()] == 0).tolist():  # from a vertex to itself: joins nothing
        of[corner // 3, corner % 3], n = n, n + 1
    order = np.argsort(edges.of.ravel(), kind="stable")
    starts = np.searchsorted(edges.of.ravel()[order], np.arange(len(edges.ends) + 1))
    for edge in np.flatnonzero(edges.uses > 2).tolist():
        budget.check()
        corners = order[starts[edge] : starts[edge + 1]]
        for one, other in _matches(points, faces, edges.ends[edge], corners, way, layers):
            of[one // 3, one % 3] = of[other // 3, other % 3] = n
            n += 1
    return Edges(np.zeros((n, 2), np.int64), of, edges.uses, edges.net)


def _matches(
    points: FloatArray, faces: IntArray, ends: IntArray, corners: IntArray, way: int, layers: IntArray
) -> list[tuple[int, int]]:
    """Return pairs of sides at an edge that several faces share, side k of face i as 3 i + k: neighbours by angle that
    run in opposite directions. ends: of the edge; corners: the sides; way: for faces at equal angles that look away
    from each other, 1 if shells count as slightly smaller, -1 if as larger."""
    apexes = faces[corners // 3, (corners + 2) % 3]
    numbers = scaled_integers(points[np.concatenate([ends, apexes])].ravel().tolist())
    a, b, *others = (tuple(numbers[k : k + 3]) for k in range(0, len(numbers), 3))
    axis = minus(b, a)
    arms = [minus(c, a) for c in others]
    first = next((arm for arm in arms if any(cross(axis, arm))), arms[0])
    normal = cross(axis, first)
    keys = []
    for corner, arm in zip(corners.tolist(), arms):
        across = cross(axis, arm)
        rise, run = sign_of(dot(normal, arm)), sign_of(dot(normal, across))
        half = -1 if not any(across) else 0 if rise > 0 or (rise == 0 and run > 0) else 1
        face, is_up = corner // 3, faces[corner // 3, corner % 3] == ends[0]
        layer = (layers[face], face) if is_up else (-layers[face], -face)
        keys.append((half, arm, (-way if is_up else way, *layer), corner))

    def compare(one: Any, other: Any) -> int:
        turn = sign_of(dot(axis, cross(one[1], other[1]))) if one[0] == other[0] else other[0] - one[0]
        return -turn if turn else -1 if one[2] < other[2] else 1

    ring = [key[3] for key in sorted(keys, key=cmp_to_key(compare))]
    # the solid of a shell that looks outwards begins above a side that runs down
    return matched([(corner, (faces[corner // 3, corner % 3] == ends[0]) == (way < 0)) for corner in ring])


def matched(ring: list[tuple[int, bool]]) -> list[tuple[int, int]]:
    """Return the pairs (opening, closing) of a cyclic list of (item, whether it opens), matched as parentheses are."""
    waiting: list[int] = []
    pairs: dict[int, int] = {}
    for each, opens in ring + ring:
        if opens and each not in pairs and each not in waiting:
            waiting.append(each)
        elif not opens and waiting and each not in pairs.values():
            pairs[waiting.pop()] = each
    return list(pairs.items())
