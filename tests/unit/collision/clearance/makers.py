"""Random bodies and poses that are apart as a rule: far, near, parallel, an ulp off, at every exponent."""

from __future__ import annotations

import math
import random
from typing import Any

from engine import Pose
from tests.reference.distance import distance, is_at_least, is_nearest

Json = dict[str, Any]
KINDS = {2: ["aabb", "sphere", "half_space", "triangle", "polygon"],
         3: ["aabb", "sphere", "half_space", "surface", "polyhedron"]}  # fmt: skip
SCALES = [1.0, 1.0, 1.0, 1e6, 1e-6, 1e150, 1e-150, 1e300, 1e-308]


class Scale:
    """Numbers of one size and kind: whole, any, or whole but for a little."""

    def __init__(self, rng: random.Random) -> None:
        self.rng, self.size, self.kind = rng, rng.choice(SCALES), rng.randrange(3)

    def number(self, size: float | None = None) -> float:
        rng, size = self.rng, self.size if size is None else size
        if self.kind == 1:
            return rng.uniform(-3.0, 3.0) * size
        little = rng.choice([0.0, 0.0, 1e-9, -1e-9, 2.0**-50]) if self.kind == 2 else 0.0
        return (float(rng.randint(-3, 3)) + little) * size

    def points(self, n: int, offset: list[float]) -> list[list[float]]:
        return [[self.number() + shift for shift in offset] for _ in range(n)]


def body(rng: random.Random, scale: Scale, kind: str, offset: list[float]) -> Json:
    """Return a body of a few faces."""
    d = len(offset)
    if kind == "half_space":
        normal = [0.0] * d
        while not any(normal):
            normal = [scale.number(1.0) for _ in range(d)]
        return {"type": kind, "normal": normal, "offset": scale.number() - 4.0 * scale.size}
    points = scale.points({"polyhedron": 4, "surface": 4, "polygon": rng.randint(3, 5)}.get(kind, 3), offset)
    if kind == "aabb":
        low, high = points[:2]
        return {"type": kind, "min": list(map(min, low, high)), "max": list(map(max, low, high))}
    if kind == "sphere":
        return {"type": kind, "center": points[0], "radius": abs(scale.number()) / 2}
    if kind == "polygon":
        return {"type": kind, "rings": [points]}
    faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]
    named = {"surface": {"faces": faces[: rng.randint(1, 2)]}, "polyhedron": {"faces": faces}}
    return {"type": kind, "vertices": points, **named.get(kind, {})}


def turn(rng: random.Random, d: int) -> list[list[float]]:
    """Return a rotation."""
    if rng.random() < 0.4:
        return [[float(i == j) for j in range(d)] for i in range(d)]
    if d == 2:
        angle = rng.uniform(0.0, 7.0)
        return [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    w = [rng.gauss(0.0, 1.0) for _ in range(4)]
    a, b, c, e = (x / math.sqrt(sum(y * y for y in w)) for x in w)
    return [
        [a * a + b * b - c * c - e * e, 2 * (b * c - a * e), 2 * (b * e + a * c)],
        [2 * (b * c + a * e), a * a - b * b + c * c - e * e, 2 * (c * e - a * b)],
        [2 * (b * e - a * c), 2 * (c * e + a * b), a * a - b * b - c * c + e * e],
    ]


def pose(rng: random.Random, scale: Scale, d: int) -> Json | None:
    """Return a pose or none."""
    if rng.random() < 0.4:
        return None
    return {"rotation": turn(rng, d), "translation": [2.0 * scale.number() for _ in range(d)]}


def placed(pose: Json | None) -> Pose | None:
    return None if pose is None else Pose(pose["rotation"], pose["translation"])


__all__ = ["KINDS", "Json", "Scale", "body", "distance", "is_at_least", "is_nearest", "placed", "pose", "turn"]
