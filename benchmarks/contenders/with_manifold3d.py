"""manifold3d: Clipper2 inside its `CrossSection`, and solids that meet."""

from __future__ import annotations

from typing import Any

import numpy as np
from manifold3d import CrossSection, Error, FillRule, Manifold, Mesh64

import engine
from benchmarks.contenders import (
    Couple,
    NotApplicable,
    Prepared,
    each_alone,
    each_or_nan,
    meshes_of,
    overlays,
    rings_of,
)

PACKAGE = "manifold3d"
NAMES = {"overlay": "Clipper2 by manifold3d", "overlay of made": "Clipper2 by manifold3d"}


def _combined(pair: Any, operation: str) -> Any:
    first, second = pair
    result = {
        "intersection": lambda: first ^ second,
        "union": lambda: first + second,
        "difference": lambda: first - second,
        "symmetric_difference": lambda: (first - second) + (second - first),
    }[operation]()
    result.num_vert()  # a CrossSection may put its work off until asked
    return result


def _read(pair: Any) -> Any:
    return [CrossSection(list(rings), FillRule.EvenOdd) for rings in pair]


def _polygon_areas(region: engine.Aabb, threads: int) -> Prepared:
    """Of single rings; of polygons of several. What it cannot read ends the process."""
    box = rings_of(region)

    def area(rings: Any) -> float:
        return float(_combined(_read((rings if isinstance(rings, list) else [rings], box)), "intersection").area())

    return Prepared(each_or_nan(area))


def _solids(pair: Couple) -> list[Manifold]:
    return [Manifold(Mesh64(mesh.vertices, mesh.faces.astype(np.uint64))) for mesh in meshes_of(pair)]


def _pair(pair: Couple, threads: int) -> Prepared:
    if not all(body.is_closed for body in pair):
        raise NotApplicable("solids only")
    first, second = _solids(pair)

    def ask(_: object) -> bool:
        for solid in (first, second):
            if solid.status() != Error.NoError:
                raise ValueError(solid.status())
        return not (first ^ second).is_empty()

    return Prepared(ask)


MAKERS = {
    "pair": _pair,
    "clearance pairs": lambda _, threads: each_alone(_solids, lambda pair: pair[0].min_gap(pair[1], 1e3)),
    "polygon areas": _polygon_areas,
    **overlays(_read, _combined, lambda made, result: result.area()),
}
