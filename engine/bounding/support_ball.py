"""The smallest ball of a handful of points in whole numbers: every support set is tried.

A support set lies on the sphere and has the centre in its convex hull. With q_i = p_i - p_0 the centre p_0 + sum
lambda_i q_i is equally far from all of them when ``2 G lambda = diag G``, G the matrix of ``q_i . q_j``; it lies in the
hull when no lambda_i is negative and they add up to at most 1. Cramer's rule keeps everything in integers.

Source: E. Welzl, "Smallest enclosing disks (balls and ellipsoids)", 1991; K. Fischer, B. Gaertner, "The smallest
enclosing ball of balls", 2004, section on support sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from engine.predicates.rational import determinant

IntPoint = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class IntBall:
    """A ball with centre ``center / scale`` and squared radius ``square / scale**2``; scale > 0."""

    center: IntPoint
    square: int
    scale: int
    support: tuple[int, ...]  # positions in the sequence it was made from

    def holds(self, point: IntPoint) -> bool:
        """Tell whether the closed ball holds an integer point."""
        return sum((self.scale * p - c) ** 2 for p, c in zip(point, self.center)) <= self.square


def smallest_ball(points: Sequence[IntPoint], through: int) -> IntBall:
    """Return the smallest ball of points, of which ``points[through]`` is known to lie on its surface.

    Support sets are tried from the smallest up, at most dimension + 1 points each; the smallest ball is unique and has
    one, so that the first ball that holds all points is it. For at most dimension + 2 points: 15 sets.
    """
    others = [index for index in range(len(points)) if index != through]
    for size in range(min(len(others), len(points[0])) + 1):
        for chosen in combinations(others, size):
            ball = _ball_through(points, (through, *chosen))
            if ball is not None and all(ball.holds(points[index]) for index in others if index not in chosen):
                return ball
    raise AssertionError("no ball goes through the point that was to lie on its surface")


def _ball_through(points: Sequence[IntPoint], support: tuple[int, ...]) -> IntBall | None:
    """Return the smallest ball with all of `support` on it if its centre is in their hull, else None."""
    first, *others = (points[index] for index in support)
    steps = [tuple(x - x0 for x, x0 in zip(point, first)) for point in others]
    gram = [[sum(a * b for a, b in zip(u, v)) for v in steps] for u in steps]
    squares, volume = [gram[i][i] for i in range(len(steps))], determinant(gram)
    if volume == 0:
        return None  # affinely dependent: a smaller set has the same ball
    scale = 2 * volume  # > 0: a Gram determinant
    weights = [
        determinant([[*row[:i], squares[j], *row[i + 1 :]] for j, row in enumerate(gram)]) for i in range(len(steps))
    ]
    if any(weight < 0 for weight in weights) or sum(weights) > scale:
        return None
    offset = [sum(weight * step[axis] for weight, step in zip(weights, steps)) for axis in range(len(first))]
    center = tuple(scale * x0 + x for x0, x in zip(first, offset))
    return IntBall(center, sum(x * x for x in offset), scale, support)
