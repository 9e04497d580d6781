"""The nearest points of two bodies from double-doubles, where they are sure: one pair of features, and no tie.

**Proof.** All candidates that are left name the same two features, vertex, edge or triangle. The nearest points of
their lines or planes have weights, quotients of differences of products of two scalar products. Vectors are off by e =
2^-97 in each coordinate (none is above 2); with L the longest coordinate of edges, M that of the vector between their
starts, a scalar product is off by 3 e (L + L) or 3 e (L + M), and a difference of products by 72 e L^2 (L + M), below
2^-90 L^2 (L + M); on one edge a scalar product itself by 2^-90 (L + M). `ends_of` counts in these: it tells by how much
all weights times their denominators are above 0, so that the exact points lie within both features, and what an error
of the weights brings to a point, times the lengths of the edges over the denominator (`steepness`): `error`, with room
for the errors of denominators and for sums of three. Where all other corners of both triangles lie strictly beyond the
planes across the exact connection, no other points of the triangles are as near. A direction off by 2 `error` brings a
height, of lengths below 4, off by less than 16 of it.
"""

from __future__ import annotations

from typing import Any, Final

from engine.collision.clearance.boxes import Search, View
from engine.collision.clearance.refined import corners_of, ends_of, height_above, named, shift_of
from engine.collision.clearance.wide import Wide, Wide3, dot3, less3, over, plus, root, times
from engine.collision.meshes.triangle_triangle import Facet, corner
from engine.jit import called, inline
from engine.predicates.double_double import surely_rounded

_SLACK: Final = 2.0**-86


@inline
def _is_beyond(view: View, triangle: int, known: tuple[int, int, int], t: Facet, n: Wide3, base: Wide3,
               slack: float) -> bool:  # fmt: skip
    """Tell whether the corners of a triangle that are none of a feature lie strictly beyond the plane across n."""
    for k in range(3):
        if view.mesh.triangles[triangle, k] in known:
            continue
        if not height_above(n, corner(t, k), base).h < -slack:
            return False
    return True


@inline
def _write(view: View, known: tuple[int, int, int], p: Wide3, n: Wide3, radius: float, start: Any, error: float,
           point: Any) -> bool:  # fmt: skip
    """Write the point (d,) at a radius from p along n, from the origin of space; tell whether it is sure."""
    size, is_sure, v = root(dot3(n, n)), True, view.mesh.vertices
    bound = error + 4.0 * radius * (error / size.h + 2.0**-98)
    is_given = radius == 0.0 and not view.place.is_posed
    for k, at, way in ((0, p.x, n.x), (1, p.y, n.y), (2, p.z, n.z)):
        if k >= point.shape[0]:
            continue
        x, y, z = v[known[0], k], v[max(known[1], 0), k], v[max(known[2], 0), k]
        if is_given and (known[1] < 0 or x == y) and (known[2] < 0 or x == z):
            point[k] = x  # of the whole feature
            continue
        end = plus(plus(at, times(over(way, size), Wide(radius, 0.0))), Wide(start[k] * view.unit, 0.0))
        point[k] = end.h / view.unit
        is_sure = is_sure and surely_rounded(end.h, end.low, bound) and 2.0**-1000 < abs(point[k]) < 2.0**1000
    return is_sure


@called
def certify(s: Search, start: Any, other: Any, radii: Any, n: int, points: Any) -> bool:
    """Fill points (2, d) with the nearest points of two bodies and put the candidate they are on first, of equal ones
    that of the smallest faces; False where n candidates leave them open. Other arguments as for `refine`.
    """
    pairs, best = s.room.found.pairs, 0
    faces, their_faces = s.a.mesh.faces, s.b.mesh.faces
    here, there = named(s.a, pairs[0, 0], pairs[0, 2]), named(s.b, pairs[0, 1], pairs[0, 3])
    for k in range(n):
        if named(s.a, pairs[k, 0], pairs[k, 2]) != here or named(s.b, pairs[k, 1], pairs[k, 3]) != there:
            return False
        own, least = faces[pairs[k, 0]], faces[pairs[best, 0]]
        if own < least or (own == least and their_faces[pairs[k, 1]] < their_faces[pairs[best, 1]]):
            best = k
    for column in range(4):
        pairs[0, column] = pairs[best, column]
    none = Wide(0.0, 0.0)
    t = corners_of(s.a, pairs[0, 0], Wide3(none, none, none))
    u = corners_of(s.b, pairs[0, 1], shift_of(s, start, other))
    p, q, inside, steepness = ends_of(t, u, pairs[0, 2], pairs[0, 3])
    error = _SLACK * steepness + 2.0**-92
    slack, way, back = _SLACK + 16.0 * error, less3(q, p), less3(p, q)
    if not (inside > _SLACK and way.x.h * way.x.h + way.y.h * way.y.h + way.z.h * way.z.h > 2.0**-300):
        return False
    if not (
        _is_beyond(s.a, pairs[0, 0], here, t, way, p, slack) and _is_beyond(s.b, pairs[0, 1], there, u, back, q, slack)
    ):
        return False
    is_sure = _write(s.a, here, p, way, radii[0], start, error, points[0])
    return _write(s.b, there, q, back, radii[1], start, error, points[1]) and is_sure
