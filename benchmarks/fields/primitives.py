"""The sign of a determinant on nearly degenerate points: what all other decisions rest on."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from benchmarks.contenders import Prepared
from benchmarks.contest import Contender, Contest, Size, Task, field_of
from benchmarks.errors import same
from benchmarks.workloads import generator
from engine.jit import kernel
from engine.predicates.orientation import orient2d, orient3d
from engine.types import Point2, Point3


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows."""
    for dimension in (2, 3):
        for is_hard in (False, True):
            name = "nearly degenerate" if is_hard else "random"
            yield Task(f"orientation {dimension}D, {name}", partial(_signs, size, dimension, is_hard, name), True)


def _signs(size: Size, dimension: int, is_hard: bool, name: str) -> Contest:
    source = generator(f"report primitives {dimension}", size.seed)
    items = source.uniform(-1, 1, (size.n(20_000 if is_hard else 100_000), dimension + 1, dimension))
    if is_hard:
        weights = source.uniform(-1, 1, (len(items), dimension, 1))
        weights /= weights.sum(axis=1, keepdims=True)
        items[:, -1] = (weights * items[:, :-1]).sum(axis=1)  # in the flat of the others, up to rounding
        items[:, -1] += source.integers(-1, 2, (len(items), dimension)) * np.spacing(np.abs(items[:, -1]))
    exact = np.array([_sign(rows) for rows in items[: size.n(2000, 500)].tolist()])
    fractions = Contender("fractions", lambda: Prepared(lambda rows: np.array([_sign(row) for row in rows.tolist()])))
    _, *numpy = field_of("determinant", dimension, ["numpy", "numpy:linalg"])
    asked = [Contender("ours", lambda: _ours(dimension)), *numpy, fractions]
    about = "the last point in the flat of the others, within an ulp" if is_hard else "anywhere in the unit cube"
    return Contest(f"orientation {dimension}D", name, is_hard, items, exact, same, asked, about)


def _sign(rows: list[list[float]]) -> int:
    """Return the exact sign by rational arithmetic, positive where the engine's is."""
    first, *others = [[Fraction(x) for x in row] for row in rows]
    edges = [[x - y for x, y in zip(row, first, strict=True)] for row in others]
    if len(edges) == 2:
        (a, b), (c, d) = edges
        value = a * d - b * c
    else:
        (a, b, c), (d, e, f), (g, h, i) = edges
        value = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return (value > 0) - (value < 0)


def _ours(dimension: int) -> Prepared:
    signs: Any = _signs_2d if dimension == 2 else _signs_3d

    def ask(items: np.ndarray) -> np.ndarray:
        found = np.empty(len(items), np.int8)
        signs(items, found)
        return found

    return Prepared(ask)


@kernel
def _signs_2d(items, found):
    for i in range(len(items)):
        p = items[i]
        found[i] = orient2d(Point2(p[0, 0], p[0, 1]), Point2(p[1, 0], p[1, 1]), Point2(p[2, 0], p[2, 1]))


@kernel
def _signs_3d(items, found):
    for i in range(len(items)):
        p = items[i]
        a, b = Point3(p[0, 0], p[0, 1], p[0, 2]), Point3(p[1, 0], p[1, 1], p[1, 2])
        found[i] = orient3d(a, b, Point3(p[2, 0], p[2, 1], p[2, 2]), Point3(p[3, 0], p[3, 1], p[3, 2]))
