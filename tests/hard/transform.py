"""Moves a case: scaled by a power of two, mirrored, axes permuted, shifted, rings and facets reordered.

A `Motion` maps every coordinate of a case and notes whether it did so exactly. Where it rounded, the case is still a
case, with another answer: the reference computes it. `OutOfRange` says that a coordinate would leave the doubles.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

Dict = dict[str, Any]


class OutOfRange(Exception):
    """The image of a number is no finite double."""


class NoImage(Exception):
    """This kind of solid has no simple image under this motion."""


@dataclass
class Motion:
    """x'[i] = signs[i] 2^exponent x[axes[i]] + shift[i]; `is_exact` turns False when an image had to be rounded."""

    axes: tuple[int, ...]
    signs: tuple[int, ...]
    exponent: int = 0
    shift: tuple[float, ...] = ()
    is_exact: bool = field(default=True, init=False)

    @property
    def flips(self) -> bool:
        """Whether the motion turns left into right."""
        inversions = sum(
            self.axes[i] > self.axes[j] for i in range(len(self.axes)) for j in range(i + 1, len(self.axes))
        )
        return (inversions + sum(s < 0 for s in self.signs)) % 2 == 1

    def number(self, exact: Fraction) -> float:
        """Return the nearest double, noting whether it is exact."""
        try:
            rounded = exact.numerator / exact.denominator
        except OverflowError:
            raise OutOfRange from None
        self.is_exact = self.is_exact and Fraction(rounded) == exact
        return rounded

    def length(self, value: float) -> float:
        return self.number(Fraction(value) * Fraction(2) ** self.exponent)

    def vector(self, v: Sequence[float]) -> list[float]:
        """Return the image of a direction whose length does not matter: no scale and no shift."""
        return [self.signs[i] * v[self.axes[i]] + 0.0 for i in range(len(v))]

    def point(self, p: Sequence[float], is_shifted: bool = True) -> list[float]:
        scale = Fraction(2) ** self.exponent
        shift = self.shift if self.shift and is_shifted else (0.0,) * len(p)
        return [
            self.number(self.signs[i] * scale * Fraction(p[self.axes[i]]) + Fraction(shift[i])) for i in range(len(p))
        ]

    def row(self, row: Sequence[float], is_shifted: bool = True) -> list[float]:
        """Return the image of the plane dot(n, p) + d = 0."""
        normal = self.vector(row[:-1])
        offset = Fraction(row[-1]) * Fraction(2) ** self.exponent
        if self.shift and is_shifted:
            offset -= sum(Fraction(n) * Fraction(s) for n, s in zip(normal, self.shift, strict=True))
        return [*normal, self.number(offset)]

    def solid(self, solid: Dict, is_shifted: bool = True) -> Dict:
        """Return the image of a solid; faces keep looking outward."""
        kind = solid["type"]
        turn = -1 if self.flips else 1
        if kind == "half_space":
            *normal, offset = self.row([*solid["normal"], solid["offset"]], is_shifted)
            return {**solid, "normal": normal, "offset": offset}
        if kind == "sphere":
            center = self.point(solid["center"], is_shifted)
            return {**solid, "center": center, "radius": self.length(solid["radius"])}
        if kind == "aabb":
            ends = [self.point(solid["min"], is_shifted), self.point(solid["max"], is_shifted)]
            return {**solid, "min": [*map(min, *ends)], "max": [*map(max, *ends)]}
        if kind == "convex":
            return {**solid, "planes": [self.row(row, is_shifted) for row in solid["planes"]]}
        if kind == "polygon":
            return {**solid, "rings": [[self.point(p, is_shifted) for p in ring][::turn] for ring in solid["rings"]]}
        if kind == "csg":
            return {**solid, "operands": [self.solid(operand, is_shifted) for operand in solid["operands"]]}
        if kind == "implicit":
            return self._implicit(solid, is_shifted)
        moved = {**solid, "vertices": [self.point(p, is_shifted) for p in solid["vertices"]]}
        if "faces" in solid:
            moved["faces"] = [face[:1] + face[1:][::turn] for face in solid["faces"]]
        return moved

    def _implicit(self, solid: Dict, is_shifted: bool) -> Dict:
        if self.shift and is_shifted:
            raise NoImage
        degree = max(sum(term["powers"]) for term in solid["terms"])
        terms = []
        for term in solid["terms"]:
            powers = [term["powers"][axis] for axis in self.axes]
            sign = math.prod(s**p for s, p in zip(self.signs, powers, strict=True))
            scale = Fraction(2) ** (self.exponent * (degree - sum(powers)))
            terms.append({"powers": powers, "coefficient": self.number(sign * scale * Fraction(term["coefficient"]))})
        return {**solid, "terms": terms}

    def pose(self, pose: Dict) -> Dict:
        """Return the pose that carries the image of a body (not shifted) to the image of the posed body."""
        n = len(self.axes)
        rotation = [
            [self.signs[i] * self.signs[j] * pose["rotation"][self.axes[i]][self.axes[j]] + 0.0 for j in range(n)]
            for i in range(n)
        ]
        return {"rotation": rotation, "translation": self.point(pose["translation"])}

    def case(self, data: Dict) -> Dict:
        """Return the image of a case's input."""
        moved: Dict = {}
        for key, value in data.items():
            if key in ("solid", "region", "subject", "clip"):
                moved[key] = self.solid(value)
            elif key in ("first", "second"):
                moved[key] = self.solid(value, is_shifted=data.get(f"{key}_pose") is None)
            elif key in ("first_pose", "second_pose"):
                moved[key] = None if value is None else self.pose(value)
            elif key == "bodies":
                moved[key] = [self.body(body) for body in value]
            elif key == "points":
                moved[key] = [self.point(p) for p in value]
            elif key in ("segments", "triangles"):
                moved[key] = [[self.point(p) for p in group] for group in value]
            elif key == "polygons":
                moved[key] = [[[self.point(p) for p in ring] for ring in rings] for rings in value]
            else:
                moved[key] = value
        return moved

    def body(self, body: Dict) -> Dict:
        pose = body.get("pose")
        return {"solid": self.solid(body["solid"], pose is None), "pose": None if pose is None else self.pose(pose)}


def magnitudes(data: Any) -> Iterator[float]:
    """Yield the size of every coordinate of a case that is not zero (an upper set: normals and powers count too)."""
    if isinstance(data, dict):
        for key, value in data.items():
            if key not in ("faces", "normal", "powers", "rotation"):
                yield from magnitudes(value)
    elif isinstance(data, list | tuple):
        for value in data:
            yield from magnitudes(value)
    elif isinstance(data, int | float) and data:
        yield abs(float(data))


def motions(data: Dict, dimension: int) -> Iterator[tuple[str, Motion]]:
    """Yield named motions: every exact kind, shifts exact and not, and scales to both ends of the range."""
    axes, ones = tuple(range(dimension)), (1,) * dimension
    yield "mirrored in x", Motion(axes, (-1, *ones[1:]))
    yield "mirrored in the last axis", Motion(axes, (*ones[1:], -1))
    yield "axes turned", Motion((*axes[1:], 0), ones)
    yield "axes swapped, turned about", Motion((1, 0, *axes[2:]), (-1,) * dimension)
    for name, shift in (
        ("shifted", 2.0**20),
        ("shifted far", -(2.0**40)),
        ("shifted to where it rounds", 1e15 + 0.125),
    ):
        yield name, Motion(axes, ones, 0, tuple(shift * (k + 1) for k in axes))
    sizes = list(magnitudes(data))
    if sizes:
        up = 1022 - math.frexp(max(sizes))[1]
        lowest = min(math.frexp(size)[1] for size in sizes)
        for exponent in (1, -60, 200, -300, up, -1073 - lowest + 53, -1073 - lowest):
            yield f"times 2^{exponent}", Motion(axes, ones, exponent)


def reordered(data: Any, source: random.Random) -> Any:
    """Return the case with rings turned, reversed and shuffled, facets shuffled and turned, vertices renumbered."""
    if isinstance(data, list):
        return [reordered(item, source) for item in data]
    if not isinstance(data, dict):
        return data
    data = {key: reordered(value, source) for key, value in data.items()}
    if data.get("type") == "polygon":
        rings = [_turned(ring, source) for ring in data["rings"]]
        data["rings"] = source.sample([ring[:: source.choice((1, -1))] for ring in rings], len(rings))
    if data.get("type") in ("polyhedron", "surface"):
        order = source.sample(range(len(data["vertices"])), len(data["vertices"]))
        number = {old: new for new, old in enumerate(order)}
        data["vertices"] = [data["vertices"][old] for old in order]
        faces = [[number[i] for i in face] for face in data["faces"]]
        data["faces"] = source.sample([_turned(face, source) if len(face) == 3 else face for face in faces], len(faces))
    return data


def _turned(items: list[Any], source: random.Random) -> list[Any]:
    start = source.randrange(len(items))
    return items[start:] + items[:start]
