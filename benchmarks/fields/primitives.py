"""The sign of a determinant on nearly degenerate points: what all other decisions rest on."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import numpy as np

from benchmarks.contenders import Prepared
from benchmarks.contest import Contender, Contest, contender
from benchmarks.errors import same
from benchmarks.workloads import generator
from engine.jit import kernel
from engine.predicates.orientation import orient2d, orient3d
from engine.types import Point2, Point3


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of orientation signs."""
    source = generator("report primitives", seed)
    n_items = int(100_000 * scale)
    for dimension in (2, 3):
        size = dimension + 1
        easy = source.uniform(-1, 1, (n_items, size, dimension))
        weights = source.uniform(-1, 1, (n_items // 5, size - 1, 1))
        weights /= weights.sum(axis=1, keepdims=True)
        hard = easy[: n_items // 5].copy()
        hard[:, -1] = (weights * hard[:, :-1]).sum(axis=1)  # in the flat of the others, up to rounding
        hard[:, -1] += source.integers(-1, 2, (len(hard), dimension)) * np.spacing(np.abs(hard[:, -1]))
        for name, items in (("random", easy), ("nearly degenerate", hard)):
            exact = np.array([_sign(rows) for rows in items[: int(2000 * min(1, 4 * scale))].tolist()])
            yield Contest(
                f"orientation {dimension}D", name, items is hard, items, exact, same, _contenders(dimension),
                "the last point in the flat of the others, within an ulp" if items is hard else "",
            )  # fmt: skip


def _contenders(dimension: int) -> list[Contender]:
    return [
        Contender("ours", lambda: _ours(dimension)),
        contender("numpy determinant", "numpy", "determinant", dimension),
        contender("numpy.linalg.det", "numpy", "linalg", dimension),
        Contender("fractions", lambda: Prepared(lambda items: np.array([_sign(rows) for rows in items.tolist()]))),
    ]


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
