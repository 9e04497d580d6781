"""Polygons on a convex region (Sutherland-Hodgman), judged by the exact area of what remains."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.contest import Contender, Contest, contender
from benchmarks.errors import areas, same
from benchmarks.fields import Size, Task
from benchmarks.fields.segments import as_json
from benchmarks.workloads import generator, simple_solids

BOX = np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]])
"""The square [-1, 1]^2 by rows, in the order of an aabb."""


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of polygon clipping."""
    source = generator("report polygons", seed)
    n_polygons, n_exact = int(8_000 * scale), int(400 * min(1, 4 * scale))
    easy = _stars(source, n_polygons, 12)
    hard = np.round(_stars(source, n_polygons // 4, 12) * 2) / 2  # many vertices on the box, edges along it
    hard += source.integers(-1, 2, hard.shape) * np.spacing(np.abs(hard)) * (source.uniform(size=hard.shape) < 0.3)
    for name, rings in (("random stars", easy), ("along the box", hard)):
        exact = _exact(rings[:n_exact])
        is_hard = rings is hard
        about = "12 vertices each on the square [-1, 1]^2" + (
            ", on a lattice of halves, some an ulp off" if is_hard else ""
        )
        yield Contest("clipping polygons", name, is_hard, rings, exact, areas, contenders(), about)


def contenders() -> list[Contender]:
    """Return those that clip on a box of the plane."""
    box = engine.Aabb((-1, -1), (1, 1))
    shown = {
        "ours": "ours", "textbook: Sutherland-Hodgman": "textbook", "shapely clip_by_rect": "shapely",
        "pyclipper": "pyclipper",
    }  # fmt: skip
    return [contender(name, module, "polygon areas", box) for name, module in shown.items()]


def _stars(source: np.random.Generator, n_polygons: int, size: int) -> np.ndarray:
    angles = np.sort(source.uniform(0, 2 * np.pi, (n_polygons, size)), axis=1)
    radii = source.uniform(0.4, 1.6, (n_polygons, size))
    middles = source.uniform(-1, 1, (n_polygons, 1, 2))
    return middles + np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=2)


def _exact(rings: np.ndarray) -> np.ndarray:
    from tests.reference.exact import vector
    from tests.reference.overlay import signed_area
    from tests.reference.sutherland_hodgman import clip_contour

    planes = [vector(row) for row in BOX.tolist()]
    found = [signed_area(clip_contour(ring, planes)) for ring in rings.tolist()]
    scale = [abs(signed_area([vector(p) for p in ring])) for ring in rings.tolist()]
    return np.array(
        [
            [abs(float(Fraction(area))), max(float(Fraction(size)), 1e-300)]
            for area, size in zip(found, scale, strict=True)
        ]
    )


# --- the table --------------------------------------------------------------------------------------------------------

RINGS = (3, 4, 10, 30, 100)
Peers = dict[str, tuple[float, float]]


def table(size: Size) -> Iterator[Task]:
    """Yield the rows of the table; one thread, unless a row says otherwise."""
    solids = simple_solids()
    naive, six_times = (0.5, 0.65), (15.0, 25.0)
    for n_vertices in RINGS:
        for dimension in (2, 3):
            peers: Peers = {"textbook": naive} | ({"shapely": (4.0, 8.0)} if dimension == 2 else {})
            if (n_vertices, dimension) == (3, 3):
                peers |= {"trimesh": six_times, "vtk": six_times}
            name = f"{n_vertices} vertices, aabb {dimension}D"
            yield name, partial(_row, size, name, solids[f"aabb {dimension}D"], n_vertices, peers)
    planes = engine.Convex(workloads.convex_planes(20, size.seed).rows)
    for name in ("half-space 2D", "half-space 3D", "convex 2D", "20 planes"):
        yield f"10 vertices, {name}", partial(_row, size, f"10 vertices, {name}", solids.get(name, planes), 10, {})
    for name in ("aabb 2D", "aabb 3D"):
        shown = f"10 vertices, {name}, on the planes"
        yield shown, partial(_row, size, shown, solids[name], 10, {}, True)


def _row(
    size: Size, name: str, region: engine.Solid, n_vertices: int, peers: Peers, is_rounded: bool = False
) -> Contest:
    n_rings = size.of(250_000, 20_000) // n_vertices
    rings = workloads.star_rings(n_vertices, region.dimension, n_rings, size.seed)
    if is_rounded:
        rings = np.round(rings * 2.0) / 2.0
    shown = {"textbook": "naive", "shapely": "shapely clip_by_rect"}
    contenders = [contender("ours", "ours", "kept polygons", region, 1)]
    for module, goals in peers.items():
        contenders.append(contender(shown.get(module, module), module, "kept polygons", region, 1, goals))
    exact = (lambda rows: _exact_kept(rings[rows], region)) if peers else None
    return Contest("polygons", name, is_rounded, rings, exact, same, contenders, n_sample=100, most=100)


def _exact_kept(rings: np.ndarray, region: engine.Solid) -> np.ndarray:
    from tests.reference.sutherland_hodgman import clip_contour, planes_of

    planes = planes_of(as_json(region))
    return np.array([len(clip_contour(ring, planes)) > 0 for ring in rings.tolist()])
