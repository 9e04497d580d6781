"""Shapely (GEOS): prepared `contains_xy`, and `STRtree.query` for a scene. It has no threads of its own.

It lets go of the interpreter lock, so the points are split over as many threads as we have: what a careful user would
do. `contains_xy` leaves out the boundary, which no timed workload touches; a scene is asked for `intersects`.
"""

from __future__ import annotations

import numpy as np
import shapely

from benchmarks.contenders import Prepared, in_threads
from benchmarks.workloads import Bodies, Rings

NAME, PACKAGE = "shapely", "shapely"


def _made(rings: Rings) -> shapely.Polygon:
    return shapely.Polygon(rings.rings[0], rings.rings[1:])


def _polygon(rings: Rings, threads: int) -> Prepared:
    polygon = _made(rings)
    shapely.prepare(polygon)
    shapely.contains_xy(polygon, *np.mean(rings.rings[0][:64], axis=0).repeat(4).reshape(2, 4))
    # the index is made lazily, at the second question or so: by two threads at once, the process may crash

    def native(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])

    def ask(xy: tuple[np.ndarray, np.ndarray]) -> list[np.ndarray]:
        x, y = xy
        return in_threads(lambda part: shapely.contains_xy(polygon, x[part], y[part]), len(x), threads)

    return Prepared(native, ask, np.concatenate)


def _scene_polygons(bodies: Bodies, threads: int) -> Prepared:
    tree = shapely.STRtree([_made(body) for body in bodies.bodies])
    tree.query(shapely.Point(0, 0))

    def ask(points: np.ndarray) -> list[np.ndarray]:
        def part_of(part: slice) -> np.ndarray:
            found = tree.query(points[part], predicate="intersects")
            found[0] += part.start
            return found

        return in_threads(part_of, len(points), threads)

    def answer(found: list[np.ndarray]) -> np.ndarray:
        owners, indices = np.concatenate(found, axis=1)
        return np.sort(owners * len(bodies.bodies) + indices)

    return Prepared(shapely.points, ask, answer)


MAKERS = {"polygon": _polygon, "scene_polygons": _scene_polygons}
