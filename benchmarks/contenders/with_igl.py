"""libigl: fast winding numbers, and meshes that meet by its copyleft CGAL part."""

from __future__ import annotations

import igl

from benchmarks.contenders import Couple, Prepared, meshes_of
from benchmarks.workloads import Mesh

PACKAGE = "libigl"
NAMES = {"": "libigl", "points": "libigl winding number"}


def _points(mesh: Mesh, threads: int) -> Prepared:
    return Prepared(lambda points: igl.fast_winding_number(mesh.vertices, mesh.faces, points) > 0.5)


def _pair(pair: Couple, threads: int) -> Prepared:
    from igl.copyleft import cgal

    a, b = meshes_of(pair)
    return Prepared(
        lambda _: len(cgal.intersect_other(a.vertices, a.faces, b.vertices, b.faces, first_only=True)[0]) > 0
    )


MAKERS = {"points": _points, "pair": _pair}
