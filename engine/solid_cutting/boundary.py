"""The boundary of a polyhedron: the triangles that its even-odd solid has on one side and not on the other, facing out.

Two things are done to the triangles as given. Parts of faces that lie on each other cancel, an even number of them, or
count once (`conforming.py`), so that triangles have edges and corners in common and nothing else. Then the solid is on
one side of each, and which one is told from neighbours: around an edge, sorted by angle, solid and air alternate. So
only one triangle of those that hang together by edges has to be looked at: by the sign of the volume if all do, else
from a point on it along an axis, by the parity of the faces beyond (`exact_regions.py`).

Neither the order of faces nor the way they are turned matters. Faces that pass through each other are refused.

Source: E. A. F. Muecke, Shapes and implementations in three-dimensional geometry, 1993: faces sorted about an edge.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from fractions import Fraction
from functools import cmp_to_key
from typing import Any, NamedTuple

import numpy as np

from engine.collision.meshes.exact_body import ExactBody
from engine.collision.meshes.exact_regions import points_within, sides_over
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.errors import InvalidInputError
from engine.predicates.rational import cross, dot, largest_axis, sign_of
from engine.running.budget import Budget
from engine.solid_cutting.conforming import Contacts, conformed, contacts_of
from engine.solid_cutting.faults import Edges, are_flat, edges_of, shells_of, sign_of_volume
from engine.solid_cutting.plane_cut import Place, Points, are_different, plane_through
from engine.solids.convexity import convexity, star_side
from engine.solids.mesh import Mesh, Polyhedron
from engine.types import BoolArray, IntArray, read_only


class Boundary(NamedTuple):
    """The boundary of a polyhedron.

    | field | shape | meaning |
    |---|---|---|
    | points | | the vertices as given, then where edges of faces that lie on each other cross; not to be changed |
    | triangles | (m, 3) | of points, counter-clockwise seen from outside |
    | of | (m,) | the triangle of the solid that each is a part of |
    | wholes | (m, 3) | the corners of that triangle, in the same direction |
    | are_whole | (m,) | whether it is all of that triangle |
    | touches | | whether triangles as given have points in common besides their corners and edges |
    """

    points: Points
    triangles: IntArray
    of: IntArray
    wholes: IntArray
    are_whole: BoolArray
    touches: bool


def boundary(solid: Polyhedron, budget: Budget) -> Boundary:
    """Return the boundary of a polyhedron, cached with it. Raises: InvalidInputError for faces that pass through each
    other, naming two."""
    return solid.prepared("boundary", lambda: _boundary_of(solid, budget), budget.check)


def surface(solid: Polyhedron, budget: Budget) -> tuple[Points, IntArray]:
    """Return points and triangles that make up the boundary of a polyhedron, turned either way; cached with it. Faces
    may pass through each other unless some lie on each other too. Raises: InvalidInputError."""

    def build() -> tuple[Points, IntArray]:
        is_star = convexity(solid) is not None or star_side(solid) != 0
        contacts = None if is_star else _contacts(solid, budget)
        if contacts is None or (contacts.crossing is not None and not len(contacts.flush)):
            return points_of(solid), solid.triangles
        made = boundary(solid, budget)
        return made.points, made.triangles

    return solid.prepared("surface", build, budget.check)


def points_of(solid: Mesh) -> Points:
    """Return the vertices of a mesh as points, cached with it and not to be changed."""
    return solid.prepared("points", lambda: Points(solid.vertices))


def _contacts(solid: Polyhedron, budget: Budget) -> Contacts:
    def build() -> Contacts:
        flat = are_flat(solid.vertices, solid.triangles, budget)
        return contacts_of(solid.vertices, solid.triangles, flat, budget)

    return solid.prepared("face_contacts", build, budget.check)


def _boundary_of(solid: Polyhedron, budget: Budget) -> Boundary:
    points, triangles = points_of(solid), solid.triangles
    of = np.arange(len(triangles))
    certificate = convexity(solid)
    side = -star_side(solid) if certificate is None else 1 if certificate.is_outward else -1
    if side:
        triangles = triangles if side > 0 else read_only(triangles[:, ::-1])
        return Boundary(points, triangles, of, triangles, read_only(np.ones(len(of), np.bool_)), False)
    budget.check()
    contacts = _contacts(solid, budget)
    if contacts.crossing is not None:
        raise _crossing(solid, *contacts.crossing)
    budget.check()
    of = np.flatnonzero(are_different(triangles))
    triangles = triangles[of]
    edges, is_flat = edges_of(triangles), contacts.is_flat[of]
    if len(contacts.flush) or len(contacts.along) or (is_flat.any() and (edges.uses > 2).any()):
        points = points.copy()
        budget.check()
        triangles, of = conformed(points, solid.triangles, contacts, budget)
        budget.check()
        edges, is_flat = edges_of(triangles), np.zeros(len(triangles), np.bool_)
    wholes = solid.triangles[of]
    if len(triangles):
        turns = _looks(solid, points, triangles, edges, is_flat, wholes, budget)[:, None]
        triangles, wholes = (np.where(turns, rows[:, ::-1], rows) for rows in (triangles, wholes))
    are_whole = read_only((triangles == wholes).all(axis=1))
    return Boundary(points, read_only(triangles), read_only(of), read_only(wholes), are_whole, contacts.touches)


def _crossing(solid: Polyhedron, *pair: int) -> InvalidInputError:
    first, second = (int(solid.triangle_faces[triangle]) for triangle in pair)
    return InvalidInputError(
        f"faces[{first}] and faces[{second}] meet besides their common corners and edges: they pass through each "
        "other, so which side of them is inside is not one for each; inspect names all such pairs; unite the parts in "
        "the program that made them",
        ("solid", "faces", first),
    )


def _looks(
    solid: Polyhedron, points: Points, triangles: IntArray, edges: Edges, is_flat: BoolArray, wholes: IntArray,
    budget: Budget,
) -> BoolArray:  # fmt: skip
    """Return (m,): which triangles have to be turned to face out. edges: theirs; wholes: as of a `Boundary`."""
    is_plain = (edges.uses == 2) & (edges.net == 0)
    sheets = shells_of(edges.parted(~is_plain), budget)
    sheet_of = np.empty(len(triangles), np.int64)
    for number, sheet in enumerate(sheets):
        sheet_of[sheet] = number
    neighbours: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for one, other, are_alike in _pairs_at_edges(points, triangles, edges, ~is_plain, budget):
        a, b = int(sheet_of[one]), int(sheet_of[other])
        neighbours[a].append((b, are_alike))
        neighbours[b].append((a, are_alike))
    turned = np.full(len(sheets), -1)
    bodies: list[list[int]] = []
    for first in range(len(sheets)):
        if turned[first] < 0:
            turned[first], body = 0, [first]
            for known in body:  # it grows: each sheet enters once
                for other, are_alike in neighbours[known]:
                    if turned[other] < 0:
                        turned[other] = turned[known] ^ (not are_alike)
                        body.append(other)
            bodies.append(body)
    is_turned = turned[sheet_of] > 0
    if len(bodies) == 1 and len(points) == points.n_given:
        looking = np.where(is_turned[:, None], triangles[:, ::-1], triangles)
        return is_turned ^ (sign_of_volume(points.vertices, looking, budget) < 0)
    mesh = mesh_body_of(solid)
    exact = ExactBody(mesh, None, mesh.shift)
    for body in bodies:
        budget.check()
        rows = [row for sheet in body for row in sheets[sheet].tolist() if not is_flat[row]]
        looks = ((row, _looks_out(points, exact, triangles[row], wholes[row])) for row in rows)
        row, is_out = next(((row, is_out) for row, is_out in looks if is_out is not None), (0, not is_turned[0]))
        if is_out == is_turned[row]:
            own = np.concatenate([sheets[sheet] for sheet in body])
            is_turned[own] = ~is_turned[own]
    return is_turned


def _looks_out(points: Points, body: ExactBody, triangle: IntArray, whole: IntArray) -> bool | None:
    """Return whether a triangle of the boundary is counter-clockwise seen from outside; None where points on it happen
    to be on edges of others."""
    plane = plane_through(points.vertices[whole]).integers
    axis = largest_axis(plane[:3])
    corners: Any = [[Fraction(x, place[3]) for x in place[:3]] for place in map(points.exact, triangle.tolist())]
    for *place, w in points_within(corners):
        sides = sides_over(body, body.at([Fraction(x) / w for x in place]), axis, plane)
        if sides is not None and sides.above != sides.below:
            return sides.above != (plane[axis] > 0)
    return None


def _pairs_at_edges(
    points: Points, triangles: IntArray, edges: Edges, is_asked: BoolArray, budget: Budget
) -> Iterator[tuple[int, int, bool]]:
    """Yield pairs of triangles that are neighbours about an edge, for the edges where is_asked, and whether they run
    along it in opposite directions, so that both face out or both in."""
    order = np.argsort(edges.of.ravel(), kind="stable")
    starts = np.searchsorted(edges.of.ravel()[order], np.arange(len(edges.ends) + 1))
    for edge in np.flatnonzero(is_asked).tolist():
        budget.check()
        corners = order[starts[edge] : starts[edge + 1]]
        ring = corners.tolist() if len(corners) < 3 else _by_angle(points, triangles, edges.ends[edge], corners)
        is_up = [triangles[corner // 3, corner % 3] == edges.ends[edge][0] for corner in ring]
        for k in range(1, len(ring)):
            yield ring[k - 1] // 3, ring[k] // 3, bool(is_up[k - 1] != is_up[k])


def _by_angle(points: Points, triangles: IntArray, ends: IntArray, corners: IntArray) -> list[int]:
    """Return sides of triangles that share an edge, side k of triangle i as 3 i + k, sorted by angle about it. ends: of
    the edge."""
    start, end, *apexes = map(points.exact, [*ends.tolist(), *triangles[corners // 3, (corners + 2) % 3].tolist()])
    axis, *arms = (_from(start, place) for place in (end, *apexes))
    normal = cross(axis, arms[0])
    rays = []
    for corner, arm in zip(corners.tolist(), arms):
        rise, run = sign_of(dot(normal, arm)), sign_of(dot(normal, cross(axis, arm)))
        rays.append((0 if rise > 0 or (rise == 0 and run > 0) else 1, arm, corner))

    def compare(one: Any, other: Any) -> int:
        return int(one[0] - other[0]) or -sign_of(dot(axis, cross(one[1], other[1])))

    return [corner for *_, corner in sorted(rays, key=cmp_to_key(compare))]


def _from(start: Place, end: Place) -> tuple[int, ...]:
    """Return the difference of two places, times a positive factor."""
    return tuple(x * start[3] - o * end[3] for o, x in zip(start[:3], end[:3]))
