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
from benchmarks.workloads import Mesh

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


def _solid(mesh: Mesh) -> Manifold:
    return Manifold(Mesh64(mesh.vertices, mesh.faces.astype(np.uint64)))


def _solids(pair: Couple) -> list[Manifold]:
    return [_solid(mesh) for mesh in meshes_of(pair)]


def _valid(solid: Manifold) -> Manifold:
    if solid.status() != Error.NoError:
        raise ValueError(solid.status())
    return solid


def _pair(pair: Couple, threads: int) -> Prepared:
    if not all(body.is_closed for body in pair):
        raise NotApplicable("solids only")
    first, second = _solids(pair)

    return Prepared(lambda _: not (_valid(first) ^ _valid(second)).is_empty())


def _overlap(pair: Couple, threads: int) -> Prepared:
    first, second = _solids(pair)
    return Prepared(lambda _: (_valid(first) ^ _valid(second)).volume())


def _volume(mesh: Mesh, threads: int) -> Prepared:
    return Prepared(lambda _: _valid(_solid(mesh)).volume())


def _cut_volumes(mesh: Mesh, threads: int) -> Prepared:
    solid = _solid(mesh)

    def volume(row: np.ndarray) -> float:
        part = _valid(solid).trim_by_plane(row[:3].tolist(), float(-row[3] / np.linalg.norm(row[:3])))
        return float(_valid(part).volume())

    return Prepared(each_or_nan(volume))


def _section_areas(mesh: Mesh, threads: int) -> Prepared:
    """Across z alone."""
    solid = _solid(mesh)

    def area(row: np.ndarray) -> float:
        if row[:2].any():
            raise NotApplicable("sections across z only")
        return float(_valid(solid).slice(float(-row[3] / row[2])).area())

    return Prepared(each_or_nan(area))


def _all_hits(mesh: Mesh, threads: int) -> Prepared:
    solid = _solid(mesh)

    def ask(segments: np.ndarray) -> list[Any]:
        if solid.status() == Error.NotManifold:
            raise NotApplicable("closed manifolds only")
        lines = [(tuple(start), tuple(end)) for start, end in segments.tolist()]
        result = [(number, hit) for number, line in enumerate(lines) for hit in solid.ray_cast(*line)]
        ways = segments[:, 1] - segments[:, 0]
        return [
            (i, float((np.array(hit.position) - segments[i, 0]) @ ways[i] / (ways[i] @ ways[i]))) for i, hit in result
        ]

    return Prepared(ask)


MAKERS = {
    "pair": _pair,
    "overlap": _overlap,
    "volume": _volume,
    "all hits": _all_hits,
    "cut volumes": _cut_volumes,
    "section areas": _section_areas,
    "clearance pairs": lambda _, threads: each_alone(_solids, lambda pair: pair[0].min_gap(pair[1], 1e3)),
    "polygon areas": _polygon_areas,
    **overlays(_read, _combined, lambda made, result: result.area()),
}
