"""Segments clipped to boxes, convex solids, spheres, polygons and meshes: whether any is left, and where."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks import errors, workloads
from benchmarks.contest import RUNG, Contest, Goals, Size, Task, field_of, two_threads
from benchmarks.fields.containment import shifted
from benchmarks.workloads import SIMPLE, document

HARD = {
    "random": "ends in twice the cube", "corner": "through corners of the box, as near as doubles come",
    "edge": "through edges of the box, as near as doubles come", "ulp": "ends on the planes and up to 4 ulps off",
    "tangent": "tangents, as near as doubles come", "planes": "through the common line of two of 20 planes",
}  # fmt: skip
Peers = Mapping[str, Goals | None]
PAGE: dict[str, tuple[str, str, Peers]] = {
    "box 2D, random": ("aabb 2D", "random", {"textbook": None, "shapely": (10.0, 20.0), "celltree": (0.7, 1.0)}),
    "box 2D, corners": ("aabb 2D", "corner", {"textbook": None, "shapely": None, "celltree": None}),
    "box 3D, random": ("aabb 3D", "random", {"textbook": None}),
    "box 3D, corners": ("aabb 3D", "corner", {"textbook": None}),
    "20 planes, edges": ("20 planes", "planes", {"textbook:by planes": None}),
    "sphere, tangents": ("sphere 3D", "tangent", {"textbook:quadratic": None}),
}
"""On the page: the region, the kind of segments, the textbook's method and others."""
TABLE: dict[str, tuple[str, str, Peers]] = {
    **{f"box {side}D, {kind}": (f"aabb {side}D", kind, {}) for side in (3, 2) for kind in ("edge", "ulp")},
    "20 planes": ("20 planes", "random", {"textbook:by planes": None}),
    "sphere 3D": ("sphere 3D", "random", {"textbook:quadratic": None}),
    **{name: (name, "random", {}) for name in ("sphere 2D", "half-space 2D", "half-space 3D", "convex 2D")},
    **{f"{name}, {kind}": (name, kind, {}) for name in ("polygon of 10", "polygon of 1,000")
       for kind in ("random", "ulp")},
    **{f"{name}, two threads": (name, "random", {"ours": None}) for name in ("aabb 3D", "20 planes")},
}  # fmt: skip


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows; of the table with one thread, unless a row says otherwise."""
    for name in PAGE | TABLE:
        yield Task(name, partial(_row, size, name), name in PAGE)
    for faces in ("1k", "86k")[: size.of(2, 1)]:
        yield Task(f"{faces} faces", partial(_mesh, size, faces, False))
    yield Task("first 100, 1k faces", partial(_mesh, size, "1k", True))
    for step in (0.05, 0.3, 1.0)[: size.of(3, 2)]:
        yield Task(f"lines of 10, steps of {step}", partial(_lines, size, step))


def _lines(size: Size, step: float) -> Contest:
    """Walks of 10 positions about a polygon of 1,000, from a point in its box, steps normal of that deviation."""
    region, draw = _region("polygon of 1,000", size.seed), workloads.generator(f"lines/{step}", size.seed)
    walks = draw.normal(size=(size.n(100_000), 10, 2)) * step
    walks[:, 0] = draw.uniform(region.vertices.min(axis=0), region.vertices.max(axis=0), (len(walks), 2))
    result, name = field_of("lines", region, {"shapely": (5.0, 10.0)}, 1), f"lines of 10, steps of {step}"
    return Contest("lines", name, False, walks.cumsum(axis=1), None, errors.same, result)


def _region(name: str, seed: int) -> Any:
    if name.startswith("polygon"):
        return engine.Polygon(workloads.star_polygon(int(name.split()[-1].replace(",", "")), seed).rings)
    return workloads.convex_of(20, seed) if name == "20 planes" else SIMPLE[name]()


def _segments(kind: str, region: Any, n: int, seed: int) -> np.ndarray:
    if kind == "planes":
        return workloads.segments_through_edges(region, n, seed)
    return workloads.segments_of(kind, region.dimension, n, seed)


def _row(size: Size, name: str) -> Contest:
    """On the page judged on the first segments, else where contenders differ; with two threads, against one."""
    of, kind, peers = (PAGE | TABLE)[name]
    region, is_page, is_hard = _region(of, size.seed), name in PAGE, kind != "random"
    n = (4_000 if is_hard else 200_000) if is_page else 1_000_000 // (20 if of.startswith("polygon") else 1)
    segments = _segments(kind, region, size.n(n, 500 if is_page else 20), size.seed)
    exact: Any = None
    if is_page:
        exact = errors.first_pieces(segments[: size.n(1000 if len(peers) > 2 else 500, 200)], region)
    elif peers and "ours" not in peers:
        exact = partial(_settle, segments, region)
    result = two_threads("segments", region) if "ours" in peers else field_of("segments", region, peers, 1)

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        other = shifted(segments[:RUNG], 2.0, step)
        return other, errors.first_pieces(other, region)

    return Contest("clipping segments", name, is_hard, segments, exact, errors.coordinates, result, HARD[kind],
                   n_sample=100, request=partial(request, region, segments),
                   moved=moved if is_page and is_hard else None)  # fmt: skip


def request(region: Any, segments: np.ndarray, item: int) -> tuple[str, dict[str, Any]]:
    """Return path and body that ask about one segment."""
    return "/v1/clip/segments", {"region": document(region), "segments": [segments[item].tolist()]}


def hit_request(
    mesh: workloads.Mesh, segments: np.ndarray, item: int, keep: str = "first"
) -> tuple[str, dict[str, Any]]:
    """Return path and body that ask where one segment meets a mesh."""
    surface = document(mesh) | {"type": "surface"}
    return "/v1/hits", {"surface": surface, "segments": [segments[item].tolist()], "keep": keep}


def _settle(segments: np.ndarray, region: Any, rows: np.ndarray) -> np.ndarray:
    return errors.first_pieces(segments[rows], region)


def _mesh(size: Size, faces: str, is_new: bool) -> Contest:
    """Segments between two random points of the mesh's box, of about its size: do they meet a face?"""
    mesh = workloads.mesh_of_size(faces, size.seed)
    n_segments = 100 if is_new else size.n(100_000)
    segments = np.ascontiguousarray(workloads.points_in_box(mesh, 2 * n_segments, size.seed).reshape(-1, 2, 3))
    result = field_of("hits", mesh, {"trimesh": (3.0, 10.0)}, 1, is_new=is_new)
    name = f"first 100, {faces} faces" if is_new else f"{faces} faces"
    return Contest("segments", name, False, segments, None, errors.same, result, count=n_segments)
