"""Overlaps of many pairs by kernels: convex bodies as flat arrays; polygons of the plane, by the overlay where kernels
leave one open.

Source: I. E. Sutherland, G. W. Hodgman, 1974; S. Gottschalk, 1996: see `convex_pairs.py`; H. Edelsbrunner,
E. P. Muecke, 1990; G. Green, 1828: see `convex_rings.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.collide import posed
from engine.collision.meshes.mesh_arrays import BOX_TRIANGLES
from engine.compiling.jit import entry_of
from engine.errors import (
    NotRepresentableError,
    RingTooShortError,
    UnsupportedPairError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.polygon_overlay.batch import overlay_batch, twice_areas
from engine.polygon_overlay.overlay import overlay
from engine.polygon_overlay.pair_arrays import PolygonSelection, arrays_of
from engine.predicates.rational import nearest_float, nearest_pair
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.solid_cutting.convex_bodies import PLACED, PLANE
from engine.solid_cutting.convex_edges import SPOT
from engine.solid_cutting.convex_pairs import CORNER, Scratch, overlap_bodies
from engine.solid_cutting.convex_rings import MOST_CORNERS, overlap_rings, turn_boxes
from engine.solid_cutting.exact_measures import faces_of_half_spaces
from engine.solids.base import Solid
from engine.solids.checks import as_floats
from engine.solids.convexity import convexity
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Convex, Triangle
from engine.types import FloatArray, IntArray, read_only

_ENDS: Final = 3 * (np.arange(8)[:, None] >> np.arange(3) & 1) + np.arange(3)
"""Of the six ends of a box those that each corner has: corner k is at the high end of axis a if bit a of k is set."""
_LARGEST: Final = 1 << 16
"""Faces times corners of a pair up to which tables are made of it."""
_FEW: Final = 64
"""Pairs up to which they are not divided."""


class Body(NamedTuple):
    """A convex body: corners (n, 6), high parts and low parts; faces, one after another, by these; where each begins,
    and the last ends; and for each corner of a face the face beyond the edge that begins there."""

    points: FloatArray
    corners: IntArray
    rings: IntArray
    twins: IntArray


def _body_with(points: FloatArray, faces: list[IntArray]) -> Body:
    corners, sizes = np.concatenate(faces), [*map(len, faces)]
    ends = np.concatenate([np.roll(ring, -1) for ring in faces])
    twins = np.empty_like(corners)
    twins[np.lexsort((corners, ends))] = np.repeat(np.arange(len(faces)), sizes)[np.lexsort((ends, corners))]
    return Body(points, corners, np.cumsum([0, *sizes]), twins)


_BOX: Final = _body_with(np.zeros((8, 6)), list(BOX_TRIANGLES.reshape(6, 6)[:, [0, 1, 2, 5]]))


def of_bodies(
    pairs: Sequence[tuple[Any, Any]], poses: Sequence[Any], is_ratio: bool, workers: int | None, budget: Budget
) -> FloatArray:
    """Return the common volumes, or ratios, of those pairs of solids that are convex bodies of space, proven to be the
    nearest doubles, NaN of others. poses: of all first, and of all second ones, or lists of one a pair."""
    values = np.full(len(pairs), np.nan)
    unique = {id(solid): solid for pair in pairs for solid in pair if getattr(solid, "dimension", 0) == 3}
    boxes = [(key, solid) for key, solid in unique.items() if isinstance(solid, Aabb)]
    forms, keys = [_BOX] if boxes else [], [key for key, _ in boxes]
    for number, (key, solid) in enumerate(unique.items()):
        if isinstance(solid, (Convex, Polyhedron)):
            if number % _FEW == 0:
                budget.check()
            body = solid.prepared("overlap_body", partial(_body_of, solid, budget), budget.check)
            if body is not None:
                keys.append(key)
                forms.append(body)
    numbers = {key: number for number, key in enumerate(keys)}
    places = [(numbers.get(id(one), -1), numbers.get(id(other), -1)) for one, other in pairs]
    rows = [row for row, place in enumerate(places) if min(place) >= 0]
    if not rows:
        return values
    bodies, at = [(8 * k, 0, 8, 6, 0) for k in range(len(boxes))], [8 * len(boxes), 7, 24] if boxes else [0, 0, 0]
    for body in forms[1:] if boxes else forms:
        bodies.append((at[0], at[1], len(body.points), len(body.rings) - 1, at[2]))
        at = [at[0] + len(body.points), at[1] + len(body.rings), at[2] + len(body.corners)]
    most, most_sides, most_faces, _ = (max(map(len, arrays)) for arrays in zip(*forms))
    if most * most_faces > _LARGEST:
        return values
    moves: list[list[float]] = []
    which = [[places[row][k] for row in rows] for k in range(2)]
    for k, pose in enumerate(poses):
        chosen = rows if isinstance(pose, list) else rows[:1]
        which.append([len(moves) + (row if len(chosen) > 1 else 0) for row in range(len(rows))])
        moves += [_numbers_of(pose, pairs[row][k], k, row) for row in chosen]
    points = np.zeros((at[0], 6))
    if boxes:  # which have one table of faces
        ends = np.array([(box.min, box.max) for _, box in boxes]).reshape(-1, 6)
        points[: 8 * len(boxes), :3] = np.take(ends, _ENDS, axis=1).reshape(-1, 3)
    if len(boxes) < len(keys):
        np.concatenate([body.points for body in forms[len(boxes) > 0 :]], out=points[8 * len(boxes) :])
    faces = (arrays[0] if len(forms) == 1 else np.concatenate(arrays) for arrays in [*zip(*forms)][1:])
    tables = [read_only(each) for each in (points, *faces, np.array(bodies))]
    some, turns, made = np.array(which).T.copy(), np.array(moves), np.full(len(rows), np.nan)
    shapes = ((2, most, PLACED), (2, most_faces, PLANE), (2, most, most_faces), (2, most + most_faces + 8, CORNER),
              (2 * (most + most_sides), SPOT), (2, most_faces, 3))  # fmt: skip

    def fill(start: int, stop: int) -> None:
        scratch: Any = (*map(np.empty, shapes), np.empty((most_faces, most_faces, 2), np.int64))
        entry_of(overlap_bodies)(
            *tables, read_only(some[start:stop]), turns, is_ratio, Scratch(*scratch), made[start:stop], budget.flag
        )

    if len(rows) <= _FEW:
        fill(0, len(rows))
        budget.check()
    else:
        run_chunks(fill, len(rows), budget=budget, workers=workers, first_chunk=_FEW)
    values[rows] = made
    return values


def pose_of(poses: Any, solid: Solid, k: int, number: int) -> Pose | None:
    """Return the pose of a pair. poses: of the first solids of all, k = 0, or of the second, or a list."""
    name = ("first_pose", "second_pose")[k]
    return posed(poses[number], solid, name, number) if isinstance(poses, list) else posed(poses, solid, name)


def _numbers_of(poses: Any, solid: Solid, k: int, number: int) -> list[float]:
    """Return (13,): rotation by rows, translation, and 1.0, of pose k of a solid; zeros for none."""
    move = pose_of(poses, solid, k, number)
    return [0.0] * 13 if move is None else [*move.rotation.ravel().tolist(), *move.translation.tolist(), 1.0]


def _body_of(solid: Convex | Polyhedron, budget: Budget) -> Body | None:
    """Return a solid as a convex body; None if it is not convex, not bounded, or flat."""
    if isinstance(solid, Polyhedron):
        certificate = convexity(solid)
        if certificate is None:
            return None
        used, faces = np.unique(solid.triangles, return_inverse=True)
        faces = faces.reshape(-1, 3) if certificate.is_outward else faces.reshape(-1, 3)[:, ::-1]
        points = np.concatenate([solid.vertices[used], np.zeros((len(used), 3))], axis=1)
        return _body_with(points, list(faces))
    try:
        made = faces_of_half_spaces(solid.planes.tolist(), budget)
    except UnsupportedSolidError:  # it is not bounded
        return None
    if made is None:
        return None
    mesh, fans = made
    rounded = np.array([[nearest_pair(x, mesh.w) for x in point] for point in mesh.points])
    rings = [np.array([fan[0][0], fan[0][1], *(triangle[2] for triangle in fan)]) for fan in fans]
    return _body_with(np.concatenate([rounded[:, :, 0], rounded[:, :, 1]], axis=1), rings)


_BOX_NUMBERS: Final = 5
_LARGE: Final = 2.0**1000
_COMFORTABLE: Final = 128
"""Exponents of coordinates up to which areas are far from the least and the largest double."""
_MOST: Final = np.finfo(np.float64).max


def check_same_length(first: Any, second: Any) -> None:
    if len(first) != len(second):
        raise UnsupportedPairError(f"{len(first)} solids and {len(second)}; give as many of each", ("second",))


def overlaps_of_arrays(
    first: Any, second: Any, is_ratio: bool, workers: int | None, budget: Budget
) -> tuple[FloatArray, int]:
    """Return areas, or their ratios, of arrays (n, k, 2) of polygons or (n, 5) of boxes, and how many took overlays."""
    sides = [_checked(each, name) for name, each in (("first", first), ("second", second))]
    check_same_length(*sides)
    values = np.full(len(sides[0]), np.nan)
    if all(side.shape[1] <= MOST_CORNERS for side in sides):

        def fill(start: int, stop: int) -> None:
            some = [_as_corners(side[start:stop]) for side in sides]
            scratch = np.empty((4, MOST_CORNERS), np.int64)
            entry_of(overlap_rings)(*some, is_ratio, scratch, values[start:stop], budget.flag)

        run_chunks(fill, len(values), budget=budget, workers=workers)
    rows = np.flatnonzero(np.isnan(values))
    if not len(rows):
        return values, 0
    one, other = (_as_corners(side[rows]) for side in sides)
    if is_ratio:
        one, other = _scaled(one, other)
        pairs = (one, other), (one, _around(one)), (other, _around(other))
        values[rows] = _ratios([(_selection(p), _selection(q)) for p, q in pairs], workers, budget)
        return values, len(rows)
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel, "workers": workers}
    made: Any = overlay_batch(_selection(one), _selection(other), **limits)
    values[rows] = made.areas
    if len(beyond := np.flatnonzero(np.isinf(values))):
        pair = int(beyond[0])
        raise NotRepresentableError(
            f"the area of pair {pair} is beyond the largest float64; scale the input down", ("first", pair)
        )
    return values, len(rows)


def _as_corners(side: FloatArray) -> FloatArray:
    """Return polygons (n, k, 2), or boxes (n, 5), as corners."""
    if side.ndim == 3:
        return side
    corners = np.empty((len(side), 4, 2))
    entry_of(turn_boxes)(side, np.cos(side[:, 4]), np.sin(side[:, 4]), corners)
    return read_only(corners)


def _checked(each: Any, name: str) -> FloatArray:
    """Return an array of polygons (n, k, 2), or of boxes (n, 5) whose corners are finite."""
    if each.ndim == 2 and each.shape[1] == _BOX_NUMBERS:
        boxes = as_floats(each, 2, (name,))
        if boxes.min(initial=0.0) > -_LARGE and boxes.max(initial=0.0) < _LARGE:
            return boxes
        each = _as_corners(boxes)
    corners = as_floats(each, 3, (name,))
    if corners.shape[2] != 2:
        raise WrongDimensionError(f"{name} must hold positions of 2 numbers each, got {corners.shape[2]}", (name,))
    if corners.shape[1] < 3:
        raise RingTooShortError(f"{name} has polygons of {corners.shape[1]} corners; give 3 or more", (name,))
    return read_only(corners)


def overlap_of_polygons(first: Solid, second: Solid, moves: tuple[Any, Any], is_ratio: bool, budget: Budget) -> float:
    """Return the common area of two polygons, or its ratio to that of their union (is_ratio), as the nearest double.
    moves: their poses, which must be None."""
    if moves != (None, None):
        raise UnsupportedPairError("polygons take no pose here; move their vertices", ("first_pose",))
    sides = [_as_polygon(each) for each in (first, second)]
    if not is_ratio:
        return overlay(sides[0], sides[1], deadline=budget.left(), cancel=budget.cancel).area
    if not all(len(each.vertices) for each in sides):
        return 0.0
    places = _scaled(*(each.vertices[None] for each in sides))
    one, other = ([Polygon.of_arrays(read_only(at[0]), each.ring_offsets)] for at, each in zip(places, sides))
    boxes = [[Polygon([_around(at)[0]])] for at in places]
    return float(_ratios([(one, other), (one, boxes[0]), (other, boxes[1])], 1, budget)[0])


def _ratios(pairs: Sequence[tuple[Any, Any]], workers: int | None, budget: Budget) -> FloatArray:
    """Return the nearest doubles of the ratios of common area to area of the union, by pair. pairs: three batches of
    polygons: the pairs, and each side with boxes around it, whose overlap is the side's own area."""
    limits: Any = {"deadline": budget.left(), "cancel": budget.cancel, "workers": workers}
    made: list[Any] = [overlay_batch(*pair, **limits) for pair in pairs]
    sums, values = np.stack([twice_areas(each) for each in made], axis=1), np.empty(len(made[0]))
    for row, parts in enumerate(sums.tolist()):
        budget.check()
        areas: list[list[Fraction]] = []
        if np.isfinite(sums[row]).all():
            middles = [Fraction(h) + Fraction(low) for h, low, _ in parts]
            areas = [[mid + way * Fraction(part[2]) for mid, part in zip(middles, parts)] for way in (-1, 1)]
        ends = [ratio_of(some) for some in extremes(*areas)] if areas else [0.0, 1.0]
        if ends[0] != ends[1]:
            ends = [ratio_of([each[row].area_exact for each in made])]
        values[row] = ends[0]
    return values


def extremes(low: Sequence[Fraction], high: Sequence[Fraction]) -> Any:
    """Return the volumes (common, first, second) for which the ratio of common to union is least, and those for which
    it is largest, given bounds `low` and `high` on the three; (1, 1, 1) for the latter if all three may be equal."""
    return (low[0], *high[1:]), (high[0], *low[1:]) if high[0] <= min(low[1:]) else (Fraction(1),) * 3


def ratio_of(volumes: Sequence[Fraction]) -> float:
    """Return common / union, rounded to nearest and clamped to 0 .. 1, from the exact volumes (common, first,
    second)."""
    both, first, second = volumes
    union = first + second - both
    return min(1.0, max(0.0, nearest_float(both / union))) if union > 0 else 0.0


def _selection(corners: FloatArray) -> PolygonSelection:
    """Return polygons given as an array (n, k, 2) as a `PolygonSelection`."""
    n, k = corners.shape[:2]
    arrays = arrays_of(corners.reshape(-1, 2), np.arange(0, n * k + 1, k), np.arange(n + 1))
    return PolygonSelection(arrays, np.arange(n))


def _scaled(*sides: FloatArray) -> list[FloatArray]:
    """Return corners (n, k, 2), each pair multiplied by powers of two by axis, where areas might be too large or too
    small for doubles, and where that is exact."""
    exponents = np.frexp(np.maximum(*(np.abs(each).max(axis=1) for each in sides)))[1]
    exponents[np.abs(exponents) <= _COMFORTABLE] = 0
    if not exponents.any():
        return list(sides)
    up = exponents[:, None]
    made = [np.ldexp(each, -up) for each in sides]
    are_exact = [(np.ldexp(some, up) == each).all(axis=(1, 2)) for some, each in zip(made, sides)]
    return [np.where((are_exact[0] & are_exact[1])[:, None, None], *pair) for pair in zip(made, sides)]


def _around(corners: FloatArray) -> FloatArray:
    """Return a box (n, 4, 2) around each polygon of corners (n, k, 2), which no edge of it touches: the overlap of both
    is the polygon's own area."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    width = (high - low).max(axis=1, keepdims=True) + np.abs(low) + 1e-300
    low, high = np.maximum(low - width, -_MOST), np.minimum(high + width, _MOST)
    return np.stack([low, np.c_[high[:, 0], low[:, 1]], high, np.c_[low[:, 0], high[:, 1]]], axis=1)


def _as_polygon(solid: Any) -> Polygon:
    if isinstance(solid, Aabb):
        (a, b), (c, d) = solid.min.tolist(), solid.max.tolist()
        return Polygon([[(a, b), (c, b), (c, d), (a, d)]])
    if isinstance(solid, Triangle):
        return Polygon([solid.vertices])
    if isinstance(solid, Polygon):
        return solid
    raise UnsupportedPairError(f"overlap of a polygon and a {solid.type} is not there; give polygons", ("second",))
