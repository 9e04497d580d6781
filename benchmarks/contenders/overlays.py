"""Intersections of polygons by ours and by peers, all with the same call: `prepare`, then `run`, then `area`.

Preparing makes each contender's own polygons from float64 rings, and is not timed: `engine.Polygon`, shapely geometries
(made valid where they are not), CrossSections, and for pyclipper lists of integers, on a lattice of 2^50 steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import engine

Rings = list[np.ndarray]


@dataclass(frozen=True, slots=True)
class Prepared:
    """A contender ready for one pair: what is timed, and what reads the area of its answer."""

    run: Callable[[], Any]
    area: Callable[[Any], float]


def shape_of(found: engine.Overlay) -> Any:
    """Return an overlay of ours as shapely geometry."""
    import shapely

    return shapely.MultiPolygon([shapely.Polygon(piece.shell, piece.holes) for piece in found.pieces])


def ours(subject: Rings, clip: Rings) -> Prepared:
    first, second = engine.Polygon(subject), engine.Polygon(clip)
    return Prepared(lambda: engine.overlay(first, second), lambda found: shape_of(found).area)


def shapely(subject: Rings, clip: Rings) -> Prepared:
    import shapely

    first, second = _geometry(subject), _geometry(clip)
    return Prepared(lambda: shapely.intersection(first, second), lambda found: found.area)


def _geometry(rings: Rings) -> Any:
    import shapely

    if len(rings) == 1 and shapely.Polygon(rings[0]).is_valid:
        return shapely.Polygon(rings[0])
    # even-odd over all rings: lines noded, polygons made, those of odd depth kept
    made = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings]
    while len(made) > 1:
        pairs = zip(made[::2], [*made[1::2], shapely.Polygon()][: len(made[::2])], strict=True)
        made = [shapely.symmetric_difference(a, b) for a, b in pairs]
    return made[0]


def manifold(subject: Rings, clip: Rings) -> Prepared:
    from manifold3d import CrossSection, FillRule

    first, second = (CrossSection(rings, FillRule.EvenOdd) for rings in (subject, clip))

    def run() -> Any:
        found = first ^ second
        found.num_vert()  # a CrossSection may put its work off until asked
        return found

    return Prepared(run, lambda found: found.area())


def pyclipper(subject: Rings, clip: Rings) -> Prepared:
    import pyclipper

    scale = 2.0 ** (50 - int(np.ceil(np.log2(max(np.abs(ring).max() for ring in subject + clip)))))
    paths = [[np.rint(ring * scale).astype(np.int64).tolist() for ring in rings] for rings in (subject, clip)]

    def run() -> Any:
        clipper = pyclipper.Pyclipper()
        clipper.AddPaths(paths[0], pyclipper.PT_SUBJECT, True)
        clipper.AddPaths(paths[1], pyclipper.PT_CLIP, True)
        return clipper.Execute(pyclipper.CT_INTERSECTION, pyclipper.PFT_EVENODD, pyclipper.PFT_EVENODD)

    return Prepared(run, lambda found: sum(map(pyclipper.Area, found)) / scale**2)


MAKERS: dict[str, Callable[[Rings, Rings], Prepared]] = {
    "ours": ours,
    "shapely": shapely,
    "manifold3d": manifold,
    "pyclipper": pyclipper,
}
