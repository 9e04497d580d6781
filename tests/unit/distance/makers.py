"""Random bodies and poses that are apart as a rule: far, near, parallel, an ulp off, at every exponent."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

from engine import Pose
from tests.reference.distance import distance, is_at_least, is_nearest

Json = dict[str, Any]
KINDS = {2: ["aabb", "sphere", "half_space", "triangle", "polygon"],
         3: ["aabb", "sphere", "half_space", "surface", "polyhedron"]}  # fmt: skip
SCALES = [1.0, 1.0, 1.0, 1e6, 1e-6, 1e150, 1e-150, 1e300, 1e-308, 1e-320]
Question = tuple[Json, Json, Json | None, Json | None]
"""Two bodies and their poses."""
CORNERS = [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


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


def _turned(points: list[list[float]], rotation: list[list[float]], size: float) -> list[list[float]]:
    return [[sum(r * x for r, x in zip(row, point)) * size for row in rotation] for point in points]


def _box(points: list[list[float]]) -> Json:
    """Return a body of eight corners, or a ring of four."""
    if len(points) == 4:
        return {"type": "polygon", "rings": [points]}
    return {"type": "polyhedron", "vertices": points, "faces": QUADS}


def _unit(d: int) -> list[list[float]]:
    return CORNERS if d == 3 else [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]


def flush(rng: random.Random, d: int) -> Question:
    """Two boxes turned together, by their corners or by a pose, whose sides are ulps apart, or more."""
    rotation, size = turn(rng, d), rng.choice([1.0, 1.0, 1e6, 2.0**-60, 1e-200, 1e300])
    across = [1.0 + rng.choice([0.0, *[10.0 ** rng.uniform(-17, -3)] * 3])]
    across += [rng.choice([0.0, 0.25, rng.uniform(-1.2, 1.2)]) for _ in range(d - 1)]
    beside = [[x + y for x, y in zip(point, across)] for point in _unit(d)]
    if rng.random() < 0.5:
        return _box(_turned(_unit(d), rotation, size)), _box(_turned(beside, rotation, size)), None, None
    step = [2.0 * rng.uniform(-1.0, 1.0) * size for _ in range(d)]
    shift = _turned([across], rotation, size)[0]
    box = {"type": "aabb", "min": [0.0] * d, "max": [size] * d}
    last = [x + y for x, y in zip(step, shift)]
    return box, box, {"rotation": rotation, "translation": step}, {"rotation": rotation, "translation": last}


def slivers(rng: random.Random, d: int) -> Question:
    """Two needles that cross, or run nearly parallel, with little between them, turned together."""
    rotation, size, thin = turn(rng, d), rng.choice([1.0, 1e6, 1e-150, 1e150]), 10.0 ** rng.uniform(-16, -2)
    slant, apart = 10.0 ** rng.uniform(-16, 0), rng.choice([0.0, 10.0 ** rng.uniform(-16, 0)])
    first = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [rng.uniform(-1.0, 1.0), thin, -thin]]
    second = [[-1.0, -slant, apart], [1.0, slant, apart], [rng.uniform(-1.0, 1.0), thin, apart + thin]]
    if d == 2:
        first = [[x, -y] for x, y, _ in first]
        second = [[x, abs(y) + apart] for x, y, _ in second]
    kind = "surface" if d == 3 else "triangle"
    more = {"faces": [[0, 1, 2]]} if d == 3 else {}
    made = [{"type": kind, "vertices": _turned(points, rotation, size), **more} for points in (first, second)]
    return made[0], made[1], None, None


def pythagorean(rng: random.Random, d: int) -> Question:
    """Two balls whose centres are a whole number apart, that touch, or an ulp of a radius off that, or more."""
    legs, length = rng.choice([([3, 4], 5), ([20, 21], 29)] if d == 2 else [([2, 3, 6], 7), ([12, 15, 16], 25)])
    size = 2.0 ** rng.randint(-900, 900) if rng.random() < 0.3 else 2.0 ** rng.randint(-20, 20)
    radius = rng.randint(0, 4 * length) / 4
    rest = length - radius
    rest = rng.choice([rest, math.nextafter(rest, 0.0), math.nextafter(rest, math.inf), rest / 2])
    center = [rng.choice([-1.0, 1.0]) * leg * size for leg in legs]
    here, there = {"center": [0.0] * d, "radius": radius * size}, {"center": center, "radius": rest * size}
    return {"type": "sphere", **here}, {"type": "sphere", **there}, None, None


def within(rng: random.Random, d: int) -> Question:
    """A small body within the cavity of a box, near its walls or beyond them."""
    size, rotation = rng.choice([1.0, 1e6, 1e-200, 1e200]), turn(rng, d)
    inner = [[0.25 + 0.5 * x for x in point] for point in _unit(d)]
    outer = _turned(_unit(d), rotation, size)
    hollow = _turned(inner, rotation, size)
    if d == 2:
        frame: Json = {"type": "polygon", "rings": [outer, hollow]}
    else:
        faces = QUADS + [[k + 8 for k in quad[::-1]] for quad in QUADS]
        frame = {"type": "polyhedron", "vertices": outer + hollow, "faces": faces}
    wide = rng.choice([0.25, 0.49, 0.5, 0.125])
    low = [0.25 + rng.choice([0.0, 2.0**-50, 10.0 ** rng.uniform(-16, -1), 0.125]) for _ in range(d)]
    kind = rng.randrange(2)
    if kind == 0:
        center = _turned([[x + wide / 2 for x in low]], rotation, size)[0]
        return frame, {"type": "sphere", "center": center, "radius": wide / 2 * size}, None, None
    body = _box(_turned([[x + wide * y for x, y in zip(low, point)] for point in _unit(d)], rotation, size))
    return (frame, body, None, None) if rng.random() < 0.5 else (body, frame, None, None)


Family = Callable[[random.Random, int], Question]
FAMILIES: list[Family] = [flush, slivers, pythagorean, within]


def placed(pose: Json | None) -> Pose | None:
    return None if pose is None else Pose(pose["rotation"], pose["translation"])


__all__ = [
    "FAMILIES",
    "KINDS",
    "Family",
    "Json",
    "Question",
    "Scale",
    "body",
    "distance",
    "is_at_least",
    "is_nearest",
    "placed",
    "pose",
    "turn",
]
