"""Layers whose features are sets of unit cells: every area and every row follows from sets alone."""

from __future__ import annotations

from typing import Any

import numpy as np

Cells = frozenset[tuple[int, int]]


def layer(rng: np.random.Generator, n: int, size: int, apart: bool = False) -> list[Cells | None]:
    """Return features of one to three rectangles that may overlap, some None; apart: no cell is in two of them."""
    taken: set[tuple[int, int]] = set()
    found: list[Cells | None] = []
    for _ in range(n):
        cells = {cell for _ in range(rng.integers(1, 4)) for cell in _rectangle(rng, size)} - taken
        taken |= cells if apart else set()
        found.append(frozenset(cells) if rng.random() < 0.9 else None)
    return found


def _rectangle(rng: np.random.Generator, size: int) -> set[tuple[int, int]]:
    x, y, w, h = *rng.integers(0, size, 2).tolist(), *rng.integers(1, 4, 2).tolist()
    return {(x + i, y + j) for i in range(w) for j in range(h)}


def runs(cells: Cells) -> list[list[list[list[int]]]]:
    """Return a MultiPolygon of the cells: a rectangle for each run of a row and of a column, which overlap."""
    parts = []
    for turned in (False, True):
        left = {(y, x) if turned else (x, y) for x, y in cells}
        while left:
            x, y = min(left)
            stop = x
            while (stop, y) in left:
                left.remove((stop, y))
                stop += 1
            ring = [[x, y], [stop, y], [stop, y + 1], [x, y + 1], [x, y]]
            parts.append([[[b, a] for a, b in ring[::-1]] if turned else ring])
    return parts


def collection(features: list[Cells | None], **members: Any) -> dict[str, Any]:
    """Return a FeatureCollection of the features, numbered."""
    made = []
    for k, cells in enumerate(features):
        geometry = None if cells is None else {"type": "MultiPolygon", "coordinates": runs(cells)}
        made.append({"type": "Feature", "id": f"f{k}", "properties": {"n": k, **members}, "geometry": geometry})
    return {"type": "FeatureCollection", "features": made}


def rows(left: list[Cells | None], right: list[Cells | None], how: str) -> list[tuple[int, int, Cells | None]]:
    """Return the rows of an overlay: numbers of both features, -1 for none, and the cells."""
    none: Cells = frozenset()
    found: list[tuple[int, int, Cells | None]] = []
    if how in ("intersection", "identity", "union"):
        for i, a in enumerate(left):
            found += [(i, j, (a or none) & (b or none)) for j, b in enumerate(right) if (a or none) & (b or none)]
    sides = [(left, right, False)] if how in ("difference", "identity") else []
    sides = [(left, right, False), (right, left, True)] if how in ("union", "symmetric_difference") else sides
    for one, other, turned in sides:
        covered = none.union(*(cells for cells in other if cells))
        for k, cells in enumerate(one):
            if cells is None or cells - covered:
                found.append((-1, k, cells and cells - covered) if turned else (k, -1, cells and cells - covered))
    return found
