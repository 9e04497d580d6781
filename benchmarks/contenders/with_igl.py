"""libigl: fast winding numbers, distances by its tree of boxes, and meshes that meet by its copyleft CGAL part."""

from __future__ import annotations

import igl
import numpy as np

from benchmarks.contenders import Couple, Prepared, meshes_of
from benchmarks.workloads import Mesh

PACKAGE = "libigl"
NAMES = {"": "libigl", "points": "libigl winding number", "point distances": "libigl AABB tree"}

READERS = dict.fromkeys((".stl", ".obj", ".off", ".ply"), lambda path: igl.read_triangle_mesh(path)[:2])


def _points(mesh: Mesh, threads: int) -> Prepared:
    return Prepared(lambda points: igl.fast_winding_number(mesh.vertices, mesh.faces, points) > 0.5)


def _pair(pair: Couple, threads: int) -> Prepared:
    from igl.copyleft import cgal

    a, b = meshes_of(pair)
    return Prepared(
        lambda _: len(cgal.intersect_other(a.vertices, a.faces, b.vertices, b.faces, first_only=True)[0]) > 0
    )


def _distances(mesh: Mesh, threads: int) -> Prepared:
    tree = igl.AABB()
    tree.init(mesh.vertices, mesh.faces)
    return Prepared(lambda points: np.sqrt(tree.squared_distance(mesh.vertices, mesh.faces, points)[0]))


def _signed_distances(mesh: Mesh, threads: int) -> Prepared:
    return Prepared(lambda points: igl.signed_distance(points, mesh.vertices, mesh.faces)[0])


def _all_hits(mesh: Mesh, threads: int) -> Prepared:
    """One call a segment, as its users must."""

    def ask(segments: np.ndarray) -> list[tuple[int, float]]:
        found = (igl.ray_mesh_intersect(start, end - start, mesh.vertices, mesh.faces) for start, end in segments)
        return [(i, float(hit[1])) for i, hits in enumerate(found) for hit in hits or () if hit[1] <= 1.0]

    return Prepared(ask)


def _within(asked: tuple[Mesh, float], threads: int) -> Prepared:
    prepared = _distances(asked[0], threads)
    return Prepared(prepared.ask, answer=lambda result: result <= asked[1])


MAKERS = {"points": _points, "pair": _pair, "point distances": _distances, "points within": _within,
          "signed distances": _signed_distances, "all hits": _all_hits}  # fmt: skip
