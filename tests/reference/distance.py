"""The distance of two bodies: the least over all choices of corners of a face of either that may carry it.

The nearest points of two triangles are combinations of some corners of either. For each choice the stationary point is
that of a linear system; those whose weights are not negative are points of the triangles, and the least is among them.
Of bodies that are apart, d + 1 corners do, in d dimensions: the way from one flat to another is across both.
"""

from __future__ import annotations

from itertools import combinations, product

from tests.reference.collision import are_disjoint
from tests.reference.exact import Q, Vector, add, dot, nearest_double_with_root, q, square, sub, times
from tests.reference.solids import Solid, dimension, edges, image, rows, triangles, value

Distance = tuple[Q, Q]
"""q and r of sqrt(q) - r."""


def squared_distance(s: tuple[Vector, ...], t: tuple[Vector, ...]) -> Q:
    """Return the squared distance of the hulls of some points."""
    some = [[c for n in range(1, len(hull) + 1) for c in combinations(hull, n)] for hull in (s, t)]
    found = [_stationary(a, b) for a, b in product(*some)]
    return min(distance for distance in found if distance is not None)


def _stationary(a: tuple[Vector, ...], b: tuple[Vector, ...]) -> Q | None:
    """Return the squared distance of the flats through a and b where their nearest points lie in the hulls, in one
    way only."""
    directions = [sub(p, a[0]) for p in a[1:]] + [sub(b[0], p) for p in b[1:]]
    offset = sub(a[0], b[0])
    weights = _solved([[dot(u, v) for v in directions] + [-dot(u, offset)] for u in directions])
    if weights is None:
        return None
    first, second = weights[: len(a) - 1], weights[len(a) - 1 :]
    if any(w < 0 for w in weights) or sum(first) > 1 or sum(second) > 1:
        return None
    gap = offset
    for w, u in zip(weights, directions, strict=True):
        gap = add(gap, times(u, w))
    return square(gap)


def _solved(system: list[list[Q]]) -> list[Q] | None:
    """Return the solution of n equations by elimination, None where there is more than one."""
    n = len(system)
    for k in range(n):
        pivot = next((i for i in range(k, n) if system[i][k] != 0), None)
        if pivot is None:
            return None
        system[k], system[pivot] = system[pivot], system[k]
        for i in range(n):
            if i != k:
                factor = system[i][k] / system[k][k]
                system[i] = [x - factor * y for x, y in zip(system[i], system[k], strict=True)]
    return [system[k][n] / system[k][k] for k in range(n)]


def distance(
    first: Solid, second: Solid, first_pose: Solid | None = None, second_pose: Solid | None = None
) -> Distance | None:
    """Return the distance of two bodies, None where they have a common point."""
    if not are_disjoint(first, second, first_pose, second_pose):
        return None
    if first_pose == second_pose:
        first_pose = second_pose = None
    if second["type"] == "half_space" and first["type"] != "half_space":
        first, second, first_pose, second_pose = second, first, second_pose, first_pose
    if first["type"] == "half_space":
        return _from_half_space(rows(first, first_pose)[0], second, second_pose)
    (s, r), (t, radius) = _hulls(first, first_pose), _hulls(second, second_pose)
    some = [
        {c for hull in hulls for n in range(1, len(hull) + 1) for c in combinations(sorted(hull), n)}
        for hulls in (s, t)
    ]
    few = (_stationary(a, b) for a, b in product(*some) if len(a) + len(b) <= dimension(first) + 1)
    return min(found for found in few if found is not None), r + radius


def _from_half_space(row: Vector, other: Solid, pose: Solid | None) -> Distance:
    normal = square(row[:-1])
    if other["type"] == "half_space":
        their = rows(other, pose)[0]
        axis = next(k for k, x in enumerate(row[:-1]) if x != 0)
        return (row[-1] - their[-1] * row[axis] / their[axis]) ** 2 / normal, q(0)
    hulls, radius = _hulls(other, pose)
    return max(value(row, p) for hull in hulls for p in hull) ** 2 / normal, radius


def _hulls(solid: Solid, pose: Solid | None) -> tuple[list[tuple[Vector, ...]], Q]:
    if solid["type"] == "sphere":
        return [(image(solid["center"], pose),)], q(solid["radius"])
    faces = edges(solid, pose) if dimension(solid) == 2 else triangles(solid, pose)
    return [tuple(dict.fromkeys(face)) for face in faces], q(0)


def is_nearest(number: float, exact: Distance) -> bool:
    """Tell whether a positive double is the nearest to sqrt(q) - r."""
    return number == (nearest_double_with_root(-exact[1], Q(1), exact[0]) or 5e-324)


def is_at_least(least: float, exact: Distance | None) -> bool:
    """Tell whether the distance is so much or more."""
    return least == 0 or (exact is not None and exact[0] >= (exact[1] + q(least)) ** 2)
