"""Bounding boxes and minimal spheres: every support set is tried."""

from __future__ import annotations

from itertools import combinations

from tests.reference.exact import (
    Q,
    Vector,
    add,
    cross,
    dot,
    nearest_double,
    q,
    smallest_double_with_square_at_least,
    solve,
    square,
    sub,
    times,
    vector,
)
from tests.reference.solids import Solid, dimension, rings, rows, value


def minimal_sphere(points: list[Vector]) -> tuple[list[float], float]:
    """Return the nearest double of the exact centre, and the smallest radius about THAT centre holding all points."""
    center = exact_minimal_sphere(points)[0]
    rounded = [nearest_double(x) for x in center]
    farthest = max(square(sub(p, vector(rounded))) for p in points)
    return rounded, smallest_double_with_square_at_least(farthest)


def exact_minimal_sphere(points: list[Vector]) -> tuple[Vector, Q]:
    """Return centre and squared radius of the smallest ball that holds all points."""
    best: tuple[Vector, Q] | None = None
    distinct = sorted(set(points))
    for size in range(1, len(points[0]) + 2):
        for support in combinations(distinct, size):
            ball = _circumscribed(support)
            if ball is not None and (best is None or ball[1] < best[1]):
                if all(square(sub(p, ball[0])) <= ball[1] for p in distinct):
                    best = ball
    assert best is not None
    return best


def _circumscribed(support: tuple[Vector, ...]) -> tuple[Vector, Q] | None:
    """Return the smallest ball with all of `support` on it: its centre is in their affine hull; None if dependent."""
    first, others = support[0], [sub(p, support[0]) for p in support[1:]]
    gram = [tuple(dot(u, v) for v in others) for u in others]
    weights = solve(gram, tuple(square(u) / 2 for u in others)) if others else ()
    if weights is None:
        return None
    center = first
    for weight, u in zip(weights, others, strict=True):
        center = add(center, times(u, weight))
    return center, square(sub(center, first))


def convex_vertices(region: Solid) -> list[Vector] | None:
    """Return the vertices of a convex region, [] when it is empty, None when it is unbounded."""
    planes = rows(region)
    n = dimension(region)
    vertices = set()
    has_full_rank = False
    for chosen in combinations(planes, n):
        point = solve([row[:-1] for row in chosen], tuple(-row[-1] for row in chosen))
        if point is not None:
            has_full_rank = True
            if all(value(row, point) >= 0 for row in planes):
                vertices.add(point)
    if not has_full_rank:
        return None  # holds a line, or is empty: see the test of emptiness by one more axis
    if not vertices:
        return []
    return None if _is_unbounded([row[:-1] for row in planes]) else sorted(vertices)


def _is_unbounded(normals: list[Vector]) -> bool:
    """Tell whether the cone of directions that no plane stops, which holds no line, is more than the origin."""
    if len(normals[0]) == 2:
        rays = [(-n[1], n[0]) for n in normals]
    else:
        rays = [cross(n, m) for n, m in combinations(normals, 2)]
    return any(
        any(x != 0 for x in ray) and all(dot(n, times(ray, Q(way))) >= 0 for n in normals)
        for ray in rays
        for way in (1, -1)
    )


def points_of(solid: Solid) -> list[Vector]:
    """Return the points whose hull the bounds are of."""
    if solid["type"] == "convex":
        found = convex_vertices(solid)
        assert found, "unbounded or empty"
        return found
    if solid["type"] == "aabb":
        low, high = vector(solid["min"]), vector(solid["max"])
        return [tuple((high if i >> k & 1 else low)[k] for k in range(len(low))) for i in range(2 ** len(low))]
    if solid["type"] == "polygon":
        return [p for ring in rings(solid) for p in ring]
    if solid["type"] == "triangle":
        return [vector(p) for p in solid["vertices"]]
    used = {i for face in solid["faces"] for i in face}
    return [vector(p) for i, p in enumerate(solid["vertices"]) if i in used]


def bounding_box(solid: Solid) -> tuple[list[float], list[float]]:
    """Return min and max, each coordinate the nearest double."""
    if solid["type"] == "sphere":
        center, radius = vector(solid["center"]), q(solid["radius"])
        return [nearest_double(x - radius) for x in center], [nearest_double(x + radius) for x in center]
    points = points_of(solid)
    axes = range(len(points[0]))
    return tuple([nearest_double(pick(p[k] for p in points)) for k in axes] for pick in (min, max))  # type: ignore
