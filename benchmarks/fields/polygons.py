"""Polygons on a convex region (Sutherland-Hodgman), judged by the exact area of what remains."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from benchmarks import errors, workloads
from benchmarks.contest import Contest, Goals, Size, Task, field_of
from benchmarks.workloads import SIMPLE, document, generator

RINGS = (3, 4, 10, 30, 100)
SLOW: dict[str, Goals] = {"trimesh": (15.0, 25.0)}
ALONE = ("half-space 2D", "half-space 3D", "convex 2D", "20 planes", "aabb 2D, on the planes", "aabb 3D, on the planes")


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows; of the table with one thread."""
    for is_hard, name in ((False, "random stars"), (True, "along the box")):
        yield Task(name, partial(_stars, size, name, is_hard), True)
    for n_vertices in RINGS:
        for dimension in (2, 3):
            peers = {"shapely": (4.0, 8.0)} if dimension == 2 else SLOW if n_vertices == 3 else {}
            name = f"{n_vertices} vertices, aabb {dimension}D"
            yield Task(name, partial(_row, size, name, n_vertices, peers))
    for region in ALONE:
        yield Task(f"10 vertices, {region}", partial(_row, size, f"10 vertices, {region}", 10, {}))


def _stars(size: Size, name: str, is_hard: bool) -> Contest:
    """Areas of stars on the square from -1 to 1."""
    source, n = generator(f"report polygons {name}", size.seed), size.n(2_000 if is_hard else 8_000, 100)
    angles = np.sort(source.uniform(0, 2 * np.pi, (n, 12)), axis=1)
    rings = source.uniform(-1, 1, (n, 1, 2)) + workloads.ring_around(angles, source.uniform(0.4, 1.6, (n, 12)))
    about = "12 vertices each on the square [-1, 1]^2"
    if is_hard:
        rings = np.round(rings * 2) / 2  # many vertices on the box, edges along it
        off = source.integers(-1, 2, rings.shape) * (source.uniform(size=rings.shape) < 0.3)
        rings += off * np.spacing(np.abs(rings))
        about += ", on a lattice of halves, some an ulp off"
    box = SIMPLE["aabb 2D"]()
    exact = errors.areas_in_region(rings[: size.n(400, 100)], box)
    result = field_of("polygon areas", box, ["textbook", "cpp", "shapely", "manifold3d"])

    def request(item: int) -> tuple[str, dict[str, Any]]:
        return "/v1/clip/polygons", {"region": document(box), "polygons": [[rings[item].tolist()]]}

    return Contest("clipping polygons", name, is_hard, rings, exact, errors.areas, result, about, request=request)


def _row(size: Size, name: str, n_vertices: int, peers: dict[str, Goals]) -> Contest:
    _, of, *on_planes = name.split(", ")
    region = workloads.convex_of(20, size.seed) if of == "20 planes" else SIMPLE[of]()
    rings = workloads.star_rings(n_vertices, region.dimension, size.n(250_000 // n_vertices, 100), size.seed)
    if on_planes:
        rings = np.round(rings * 2.0) / 2.0
    exact = (lambda rows: errors.are_kept(rings[rows], region)) if peers else None
    return Contest("polygons", name, bool(on_planes), rings, exact, errors.same,
                   field_of("kept polygons", region, peers, 1), n_sample=100, most=100)  # fmt: skip
