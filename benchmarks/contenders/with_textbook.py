"""The book's own plain float64 formulas (engine/textbook), compiled like ours: what exactness is worth."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

import engine
from benchmarks.contenders import Couple, NotApplicable, Prepared, each_or_nan, meshes_of, pieces_of
from benchmarks.contenders.with_ours import ring_areas
from benchmarks.errors import REFUSED
from benchmarks.workloads import Mesh, Rings
from engine.solids.primitives import rows_of as planes_of
from engine.textbook import clip_polygons, methods, polyhedra

NAMES = {
    "by planes": "textbook: Cohen-Sutherland by planes", "first hits": "textbook: Moller-Trumbore",
    "point distances": "textbook: nearest point of each triangle", "cross and dot": "textbook: cross and dot",
    "overlay": "textbook: Greiner-Hormann", "pair by edges": "textbook: edges through faces",
    "pair by vertices": "textbook: vertices in the other",
    "pair by volumes": "textbook: volumes first", "planes": "textbook: half-spaces", "points": "textbook: half-line",
    "polygon areas": "textbook: Sutherland-Hodgman", "projection": "textbook: projection",
    "quadratic": "textbook: quadratic", "recast": "textbook: another half-line", "same side": "textbook: same side",
    "segments": "textbook: Cohen-Sutherland", "signed angles": "textbook: signed angles",
    "unsigned angles": "textbook: unsigned angles, 1e-6",
}  # fmt: skip

Maker = Callable[[Any, int], Prepared]


def _plain(subject: Any) -> Any:
    """Return a subject as the textbook's methods read it; nothing is checked or prepared."""
    match subject:
        case Mesh(vertices=vertices, faces=faces):
            return SimpleNamespace(type="polyhedron", vertices=vertices, triangles=faces)
        case Rings(rings=rings):
            offsets = np.cumsum([0, *map(len, rings)])
            return SimpleNamespace(type="polygon", dimension=2, vertices=np.concatenate(rings), ring_offsets=offsets)
    return subject


def _book(of: Callable[..., methods.Methods], name: str) -> Maker:
    """Return the maker of one of the textbook's methods, for those subjects that it is meant for."""

    def make(subject: Any, threads: int) -> Prepared:
        if name not in (result := of(_plain(subject))):
            raise NotApplicable(f"{name}: not for this")
        return Prepared(result[name][0])

    return make


def _pair(name: str) -> Maker:
    def make(pair: Couple, threads: int) -> Prepared:
        ask = methods.of_pairs(*map(_plain, meshes_of(pair)))[name][0]
        return Prepared(lambda _: ask())

    return make


def _recast(mesh: Mesh, threads: int) -> Prepared:
    directions = np.random.default_rng(1).normal(size=(16, 3))

    def ask(points: np.ndarray) -> np.ndarray:
        contained, unfinished = polyhedra.by_other_half_lines(points, mesh.vertices, mesh.faces, directions, 1e-9)
        return np.where(unfinished, REFUSED, contained)

    return Prepared(ask)


def _polygon_areas(region: engine.Aabb, threads: int) -> Prepared:
    rows = planes_of(region)

    def ask(rings: np.ndarray) -> np.ndarray:
        clipped = [next(iter(clip_polygons.on_convex([ring], rows)), np.empty((0, 2))) for ring in rings]
        result, sizes = np.zeros(len(rings)), np.array([len(ring) for ring in clipped])
        remaining = sizes > 0
        result[remaining] = np.abs(ring_areas(np.concatenate(clipped), np.append(0, np.cumsum(sizes[remaining]))))
        return result

    return Prepared(ask)


def _hits_of(answer: Callable[[list[np.ndarray]], Any]) -> Maker:
    """Every triangle for every segment: two cross products, four products, three comparisons (Moller, Trumbore)."""

    def make(mesh: Mesh, threads: int) -> Prepared:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        first, second = b - a, c - a

        def one(segment: np.ndarray) -> np.ndarray:
            way, off = segment[1] - segment[0], segment[0] - a
            p, q = np.cross(way, second), np.cross(off, first)
            scale = (first * p).sum(axis=1)
            u, v, t = (off * p).sum(axis=1) / scale, (q @ way) / scale, (second * q).sum(axis=1) / scale
            return t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)]

        def ask(segments: np.ndarray) -> Any:
            with np.errstate(all="ignore"):
                return answer([one(segment) for segment in segments])

        return Prepared(ask)

    return make


def _first_of(hits: list[np.ndarray]) -> np.ndarray:
    return np.array([np.min(t) if len(t) else np.nan for t in hits])


def _volume(mesh: Mesh, threads: int) -> Prepared:
    """The tetrahedra of the faces and the origin, with their signs."""
    return Prepared(lambda _: np.linalg.det(mesh.vertices[mesh.faces]).sum() / 6)


def _distances(mesh: Mesh, threads: int) -> Prepared:
    """Every triangle for every point: its plane where the foot is within, else the nearest of its sides."""
    corners = [mesh.vertices[mesh.faces[:, k]] for k in range(3)]
    ways = [corners[(k + 1) % 3] - corners[k] for k in range(3)]
    normals = np.cross(ways[0], -ways[2])
    lengths = np.linalg.norm(normals, axis=1)

    def one(point: np.ndarray) -> float:
        off, nearest, is_within = [point - corner for corner in corners], np.full(len(normals), np.inf), True
        for way, from_corner in zip(ways, off):
            t = np.clip((from_corner * way).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)
            nearest = np.fmin(nearest, np.linalg.norm(from_corner - t[:, None] * way, axis=1))
            is_within = is_within & ((np.cross(way, from_corner) * normals).sum(axis=1) >= 0)
        above = np.abs((off[0] * normals).sum(axis=1)) / lengths
        return float(np.fmin(nearest, np.where(is_within, above, np.inf)).min())

    def ask(points: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.array([one(point) for point in points])

    return Prepared(ask)


def _overlay(operation: str, threads: int) -> Prepared:
    if operation != "intersection":
        raise NotApplicable(operation)

    def area(pair: Any) -> float:
        if len(pair[0]) > 1 or len(pair[1]) > 1:
            raise NotApplicable("single rings only")
        result = [ring for ring in clip_polygons.intersection(pair[0][0], pair[1][0]) if len(ring) > 2]
        return sum(abs(float(ring_areas(np.array(ring), np.array([0, len(ring)]))[0])) for ring in result)

    return Prepared(each_or_nan(area))


BOOKS = {
    methods.of_points: {
        "points": "half-line", "signed angles": "signed angles", "unsigned angles": "unsigned angles",
        "same side": "same side", "cross and dot": "cross and dot products", "projection": "projection",
        "planes": "half-spaces",
    },
    methods.of_segments: {
        "segments": "Cohen-Sutherland", "by planes": "Cohen-Sutherland by planes", "quadratic": "quadratic",
    },
}  # fmt: skip
"""Kinds of question and the textbook's method for each."""
MAKERS: dict[str, Maker] = {
    **{kind: _book(of, name) for of, kinds in BOOKS.items() for kind, name in kinds.items()},
    "pieces": pieces_of(_book(methods.of_segments, "Cohen-Sutherland")),
    "recast": _recast,
    "polygon areas": _polygon_areas,
    "overlay": _overlay,
    "first hits": _hits_of(_first_of),
    "all hits": _hits_of(lambda hits: [(i, float(t)) for i, some in enumerate(hits) for t in some]),
    "volume": _volume,
    "point distances": _distances,
    "pair by vertices": _pair("vertices in the other"),
    "pair by edges": _pair("edges through faces"),
    "pair by volumes": _pair("volumes first"),
}
