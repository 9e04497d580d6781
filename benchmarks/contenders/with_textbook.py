"""The book's own plain float64 formulas (engine/textbook), compiled like ours: what exactness is worth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import engine
from benchmarks.contenders import (
    Couple,
    NotApplicable,
    Prepared,
    each_or_nan,
    in_threads,
    meshes_of,
    naive_clipping,
    rows_of,
)
from benchmarks.contenders.with_ours import ring_areas
from benchmarks.errors import REFUSED
from benchmarks.workloads import Mesh, Rings
from engine.textbook import (
    clip_polygons,
    clip_segments,
    collision,
    greiner_hormann,
    polygons,
    polyhedra,
    solids,
    triangles,
)

NAMES = {
    "by planes": "textbook: Cohen-Sutherland by planes", "cross and dot": "textbook: cross and dot",
    "kept polygons": "naive", "naive segments": "naive", "overlay": "textbook: Greiner-Hormann",
    "pair by edges": "textbook: edges through faces", "pair by vertices": "textbook: vertices in the other",
    "pair by volumes": "textbook: volumes first", "planes": "textbook: half-spaces", "points": "textbook: half-line",
    "polygon areas": "textbook: Sutherland-Hodgman", "projection": "textbook: projection",
    "quadratic": "textbook: quadratic", "recast": "textbook: another half-line", "same side": "textbook: same side",
    "segments": "textbook: Cohen-Sutherland", "signed angles": "textbook: signed angles",
    "unsigned angles": "textbook: unsigned angles, 1e-6",
}  # fmt: skip

OBLIQUE = np.array([0.5773, 0.2113, 0.7886])
"""A direction without zero components for the textbook's half-line."""
Ask = Callable[[np.ndarray], Any]


def box_rows(box: engine.Aabb) -> np.ndarray:
    """Return the half-spaces of a box, axis by axis: lower side, upper side."""
    axes = np.repeat(np.eye(box.dimension), 2, axis=0)
    axes[1::2] *= -1.0
    return np.column_stack([axes, np.stack([-box.min, box.max], axis=1).ravel()])


def _points(subject: Any) -> Ask:
    """A half-line from the point."""
    match subject:
        case Mesh(vertices=vertices, faces=faces):
            return lambda points: polyhedra.by_half_line(points, vertices, faces, OBLIQUE)
        case Rings(rings=[ring]):
            return lambda points: polygons.by_half_line(points, ring, np.array([0, len(ring)]))
    raise NotApplicable("a polyhedron, or a polygon of one ring")


def _recast(mesh: Mesh) -> Ask:
    directions = np.random.default_rng(1).normal(size=(16, 3))

    def ask(points: np.ndarray) -> np.ndarray:
        contained, unfinished = polyhedra.by_other_half_lines(points, mesh.vertices, mesh.faces, directions, 1e-9)
        return np.where(unfinished, REFUSED, contained)

    return ask


def _clipped(kernel: Any, *names: str) -> Callable[[Any], Ask]:
    """Return a maker of questions to a kernel that clips segments on a region with these attributes."""

    def make(region: Any) -> Ask:
        rest = [getattr(region, name) for name in names]
        return lambda segments: _kept(kernel(segments, *rest))

    return make


def _kept(found: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    return rows_of(found[0], found[1] == 1)


def _naive_segments(region: Any, threads: int) -> Prepared:
    """All segments in one compiled pass over the rows (Cyrus and Beck), on threads."""
    match region:
        case engine.Aabb():
            kernel = naive_clipping.clip_on_box_2d if region.dimension == 2 else naive_clipping.clip_on_box_3d
            rest: tuple[Any, ...] = (region.min, region.max)
        case engine.Convex():
            kernel, rest = naive_clipping.clip_on_planes_3d, (region.planes,)
        case _:
            kernel, rest = naive_clipping.clip_on_sphere_3d, (region.center, region.radius)

    def ask(segments: np.ndarray) -> list[Any]:
        return in_threads(lambda part: kernel(segments[part], *rest), len(segments), threads)

    return Prepared(ask, answer=lambda found: np.concatenate([_kept(part) for part in found]))


def _naive_polygons(region: engine.Aabb, threads: int) -> Prepared:
    rows = box_rows(region)

    def native(polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        n, size, dimension = polygons.shape
        return polygons.reshape(-1, dimension), size * np.arange(n + 1)

    def ask(rings: tuple[np.ndarray, np.ndarray]) -> Any:
        return naive_clipping.clip_rings_on_planes(*rings, rows)

    return Prepared(ask, native, lambda found: np.diff(found[1]) > 0)


def _polygon_areas(region: engine.Aabb) -> Ask:
    rows = box_rows(region)

    def ask(rings: np.ndarray) -> np.ndarray:
        clipped = [next(iter(clip_polygons.on_convex([ring], rows)), np.empty((0, 2))) for ring in rings]
        found, sizes = np.zeros(len(rings)), np.array([len(ring) for ring in clipped])
        kept = sizes > 0
        found[kept] = np.abs(ring_areas(np.concatenate(clipped), np.append(0, np.cumsum(sizes[kept]))))
        return found

    return ask


def _overlay(operation: str) -> Ask:
    if operation != "intersection":
        raise NotApplicable(operation)

    def area(pair: Any) -> float:
        if len(pair[0]) > 1 or len(pair[1]) > 1:
            raise NotApplicable("single rings only")
        found = [ring for ring in greiner_hormann.intersection(pair[0][0], pair[1][0]) if len(ring) > 2]
        return sum(abs(float(ring_areas(np.array(ring), np.array([0, len(ring)]))[0])) for ring in found)

    return each_or_nan(area)


def _pair(collide: Callable[..., bool]) -> Callable[[Couple, int], Prepared]:
    def make(pair: Couple, threads: int) -> Prepared:
        a, b = meshes_of(pair)
        return Prepared(lambda _: collide(a.vertices, a.faces, b.vertices, b.faces))

    return make


ASKS: dict[str, Callable[[Any], Ask]] = {
    "points": _points,
    "recast": _recast,
    "signed angles": lambda subject: lambda points: polygons.by_signed_angles(points, subject.rings[0]),
    "unsigned angles": lambda subject: lambda points: polygons.by_unsigned_angles(points, subject.rings[0], 1e-6),
    "same side": lambda subject: lambda points: polygons.by_same_side(points, subject.rings[0]),
    "cross and dot": lambda solid: lambda points: triangles.by_products(points, solid.vertices),
    "projection": lambda solid: lambda points: triangles.by_projection(points, solid.vertices),
    "planes": lambda solid: lambda points: solids.in_convex(points, solid.planes),
    "segments": _clipped(clip_segments.on_box, "min", "max"),
    "by planes": _clipped(clip_segments.on_convex, "planes"),
    "quadratic": _clipped(clip_segments.on_sphere, "center", "radius"),
    "polygon areas": _polygon_areas,
    "overlay": _overlay,
}
MAKERS: dict[str, Callable[[Any, int], Prepared]] = {
    **{kind: lambda subject, threads, make=make: Prepared(make(subject)) for kind, make in ASKS.items()},
    "naive segments": _naive_segments,
    "kept polygons": _naive_polygons,
    "pair by vertices": _pair(collision.by_vertices),
    "pair by edges": _pair(collision.by_edges),
    "pair by volumes": _pair(collision.by_volumes),
}
