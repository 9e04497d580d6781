"""pyclipper (Clipper): integers, so coordinates are moved and scaled by a power of two to 50 bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyclipper

import engine
from benchmarks.contenders import Prepared, each_or_nan, overlays, rings_of
from benchmarks.workloads import Rings

PACKAGE = "pyclipper"

OPERATIONS = {
    "intersection": pyclipper.CT_INTERSECTION, "union": pyclipper.CT_UNION, "difference": pyclipper.CT_DIFFERENCE,
    "symmetric_difference": pyclipper.CT_XOR,
}  # fmt: skip
BITS = 50
"""Of a coordinate, unless a contest says otherwise."""
Groups = list[list[np.ndarray]]


def _integers(groups: Groups, bits: float = BITS) -> tuple[list[list[Any]], float, np.ndarray]:
    """Return the groups in integers, the scale, and the point that became the origin."""
    every = np.concatenate([ring for rings in groups for ring in rings])
    middle = np.round((every.min(axis=0) + every.max(axis=0)) / 2)
    scale = 2.0 ** np.floor(bits - np.log2(max(np.abs(every - middle).max(), 1e-300)))
    integers = [[np.rint((ring - middle) * scale).astype(np.int64).tolist() for ring in rings] for rings in groups]
    return integers, scale, middle


def _filled(subject: list[Any], clip: list[Any], are_closed: bool = True) -> Any:
    clipper = pyclipper.Pyclipper()
    clipper.AddPaths(subject, pyclipper.PT_SUBJECT, are_closed)
    clipper.AddPaths(clip, pyclipper.PT_CLIP, True)
    return clipper


def _clipped(subject: list[Any], clip: list[Any], operation: str = "intersection") -> Any:
    fill = pyclipper.PFT_EVENODD
    return _filled(subject, clip).Execute(OPERATIONS[operation], fill, fill)


def _points(subject: Rings, threads: int) -> Prepared:
    def ask(points: np.ndarray) -> np.ndarray:
        (rings, asked), *_ = _integers([subject.rings, [np.array(points, float)]])
        found = np.array([[pyclipper.PointInPolygon(point, ring) for ring in rings] for point in asked[0]])
        return (found < 0).any(axis=1) | ((found > 0).sum(axis=1) % 2 == 1)  # -1 is its boundary

    return Prepared(ask)


def _pieces(region: engine.Solid, threads: int) -> Prepared:
    fill = pyclipper.PFT_EVENODD

    def ask(segments: np.ndarray) -> list[Any]:
        found = []
        for i, segment in enumerate(np.array(segments, float)):
            (clip, line), scale, middle = _integers([rings_of(region), [segment]])
            tree = _filled(line, clip, are_closed=False).Execute2(OPERATIONS["intersection"], fill, fill)
            for path in pyclipper.OpenPathsFromPolyTree(tree):
                found.append((i, *(np.array([path[0], path[-1]]) / scale + middle)))
        return found

    return Prepared(ask)


def _area(pair: Any) -> float:
    made = _integers(list(pair))
    return abs(sum(map(pyclipper.Area, _clipped(*made[0])))) / made[1] ** 2


def _polygon_areas(region: engine.Aabb, threads: int) -> Prepared:
    """Of an array of single rings, made integers at once; of a list of polygons of several."""
    scale = 2.0**40
    box = [np.rint(ring * scale).astype(np.int64).tolist() for ring in rings_of(region)]
    single = each_or_nan(lambda ring: sum(map(pyclipper.Area, _clipped([ring], box))) / scale**2)
    several = each_or_nan(lambda rings: _area((rings, rings_of(region))))
    return Prepared(
        lambda rings: several(rings) if isinstance(rings, list)
        else single(np.rint(rings * scale).astype(np.int64).tolist())
    )  # fmt: skip


MAKERS = {
    "points": _points,
    "pieces": _pieces,
    "polygon areas": _polygon_areas,
    **overlays(
        lambda pair, bits=BITS: _integers(list(pair), bits),
        lambda made, operation: _clipped(*made[0], operation),
        lambda made, found: abs(sum(map(pyclipper.Area, found))) / made[1] ** 2,
    ),
}
