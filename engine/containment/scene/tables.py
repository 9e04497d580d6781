"""Gathers the bodies of a scene into flat tables, with array operations over all bodies of a kind.

A solid that stands for many bodies is gathered once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.budget import Budget
from engine.containment.cells.top import TopCells
from engine.containment.locators import Locator
from engine.containment.posed.frames import frames_of
from engine.containment.posed.locators import posed_locator
from engine.containment.rings import closed_rings
from engine.containment.scene.first_pass import BALL, BOX, CELLS, RINGS, ROWS, SECOND_PASS, SceneTables
from engine.containment.scene.grid import SceneGrid, body_box, build_scene_grid, grown_boxes, moved_boxes
from engine.errors import EngineError
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.bounds import own_box
from engine.solids.convex import Convex, rows_in_space, rows_of
from engine.solids.half_space import HalfSpace
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.ragged import summed
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle

_MOST_EDGES: Final = 128
"""Of a polygon whose edges are all looked at: above it the lists of single solids are better."""
_CHECK_EVERY: Final = 256


@dataclass(frozen=True, slots=True)
class Scene:
    """The bodies as the first pass reads them, and what it takes to ask single ones."""

    tables: SceneTables
    grid: SceneGrid
    unbounded: IntArray
    """Bodies that are asked about every point, ascending."""
    most: int
    """Most candidates that a point can have."""
    solids: list[Solid]
    """The distinct ones."""
    owners: IntArray
    """``(n_bodies,)``: the solid of each body."""
    poses: list[Pose | None]
    locators: dict[int, Locator]
    """Of the bodies that are asked by themselves, made when they are."""

    def locator(self, body: int) -> Locator:
        """Return how points are located in a body."""
        if body not in self.locators:
            self.locators[body] = posed_locator(self.solids[self.owners[body]], self.poses[body])
        return self.locators[body]


def scene_of(solids: Sequence[Solid], poses: Sequence[Pose | None] | None, dimension: int, budget: Budget) -> Scene:
    """Return the scene of bodies that have been checked. Raises: UnsupportedSolidError, what `Budget.check` raises."""
    places: dict[int, int] = {}
    owners = np.array([places.setdefault(id(solid), len(places)) for solid in solids], np.int64)
    distinct = list({id(solid): solid for solid in solids}.values())
    given: list[Pose | None] = [None] * len(solids) if poses is None else list(poses)
    frames = frames_of(given, dimension)
    budget.check()
    kinds = _Kinds(distinct, dimension, budget)
    lows, highs, locators = kinds.lows[owners], kinds.highs[owners], {}
    is_moved = (frames.rows >= 0) & np.isfinite(lows).all(axis=1)
    lows[is_moved], highs[is_moved] = moved_boxes(lows[is_moved], highs[is_moved], frames, frames.rows[is_moved])
    for turn, body in enumerate(np.flatnonzero(kinds.is_other[owners]).tolist()):
        if turn % _CHECK_EVERY == 0:
            budget.check()
        try:
            locators[body] = posed_locator(distinct[owners[body]], given[body])
        except EngineError as error:
            error.where = ("solids", body)
            raise
        lows[body, :dimension], highs[body, :dimension] = body_box(distinct[owners[body]], given[body], budget.check)
    slots = kinds.slots[owners]
    balls = np.flatnonzero(kinds.kinds[owners] == BALL)
    centers, radii = _placed_balls(balls, kinds.radii[slots[balls]], lows, highs)
    slots[balls] = np.arange(len(balls))
    is_bounded = np.isfinite(lows).all(axis=1) & np.isfinite(highs).all(axis=1)
    is_empty = (lows > highs).any(axis=1)
    tables = SceneTables(
        kinds.kinds[owners], slots, lows, highs, frames.rows, frames.inverses, frames.translations, frames.is_turn,
        kinds.boxes[0], kinds.boxes[1], centers, radii, kinds.row_offsets, kinds.rows, kinds.polygon_offsets,
        kinds.rings, kinds.xs, kinds.ys, kinds.cell_frames, kinds.cell_places,
    )  # fmt: skip
    grid = build_scene_grid(np.flatnonzero(is_bounded & ~is_empty), lows, highs)
    unbounded = np.flatnonzero(~is_bounded & ~is_empty)
    most = max(1, int(np.diff(grid.offsets).max()) + len(unbounded))
    return Scene(tables, grid, unbounded, most, distinct, owners, given, locators)


def _placed_balls(balls: IntArray, radii: FloatArray, lows: FloatArray, highs: FloatArray) -> tuple[FloatArray, Any]:
    """Return centres (n, 3), and radius and blur (n, 2); lows and highs of these bodies grow by the radius."""
    low, high = lows[balls], highs[balls]
    with np.errstate(over="ignore", invalid="ignore"):
        centers = low * 0.5 + high * 0.5
        centers[(low == high).all(axis=1)] = low[(low == high).all(axis=1)]  # halves of subnormals may round
        blurs = (high - low).max(axis=1, initial=0.0)
    lows[balls], highs[balls] = grown_boxes(low, radii)[0], grown_boxes(high, radii)[1]
    return centers, np.stack([radii, blurs], axis=1)


class _Kinds:
    """The tables of the distinct solids, by kind, each in its own frame, named as in `SceneTables`.

    lows, highs: (n, 3), infinite where there may be no bounds; of spheres the centre. is_other: solids of other kinds,
    whose bodies are looked at one by one.
    """

    def __init__(self, solids: list[Solid], dimension: int, budget: Budget) -> None:
        n = len(solids)
        self.kinds, self.slots = np.full(n, SECOND_PASS, np.int8), np.zeros(n, np.int32)
        self.lows, self.highs = np.full((n, 3), -np.inf), np.full((n, 3), np.inf)
        if dimension == 2:
            self.lows[:, 2] = self.highs[:, 2] = 0.0
        self._solids, self._dimension = solids, dimension
        by_type: dict[type[Solid], list[int]] = {}
        for index, solid in enumerate(solids):
            by_type.setdefault(type(solid), []).append(index)
        flat = by_type.pop(Triangle, []) if dimension == 2 else []
        self._set_rings(by_type.pop(Polygon, []) + flat)
        budget.check()
        self._set_boxes(by_type.pop(Aabb, []))
        self._set_balls(by_type.pop(Sphere, []))
        self._set_rows(by_type.pop(HalfSpace, []) + by_type.pop(Convex, []))
        self._set_cells(by_type.pop(Polyhedron, []), budget)
        self.is_other = np.zeros(n, np.bool_)
        self.is_other[[index for rest in by_type.values() for index in rest]] = True

    def _chosen(self, indices: list[int], kind: int) -> list[Any]:
        """Return solids that get a kind, their slots in the order given."""
        self.kinds[indices], self.slots[indices] = kind, np.arange(len(indices))
        return [self._solids[index] for index in indices]

    def _vectors(self, values: list[FloatArray]) -> FloatArray:
        """Return vectors as (n, 3); 0 in the third place in the plane."""
        vectors = np.zeros((len(values), 3))
        if values:
            vectors[:, : self._dimension] = values
        return vectors

    def _set_rings(self, indices: list[int]) -> None:
        solids = self._chosen(indices, RINGS)
        offsets = [solid.ring_offsets for solid in solids]
        polygon_offsets = summed([len(each) - 1 for each in offsets])
        ends = np.concatenate([np.zeros(0, np.int64), *offsets])  # each begins with 0
        sizes = np.delete(np.diff(ends, prepend=0), polygon_offsets[:-1] + np.arange(len(offsets)))
        vertices = np.concatenate([np.empty((0, 2)), *(solid.vertices for solid in solids)])
        xs, ys, rings, _ = closed_rings(vertices, summed(sizes))
        firsts = rings[polygon_offsets[:-1], 0]
        for axis, values in enumerate((xs, ys) if solids else ()):
            self.lows[indices, axis] = np.minimum.reduceat(values, firsts)
            self.highs[indices, axis] = np.maximum.reduceat(values, firsts)
        n_edges = rings[polygon_offsets[1:] - 1, 1] - firsts
        self.kinds[np.array(indices, np.int64)[n_edges > _MOST_EDGES]] = SECOND_PASS
        self.polygon_offsets, self.rings, self.xs, self.ys = polygon_offsets, rings, xs, ys

    def _set_boxes(self, indices: list[int]) -> None:
        solids = self._chosen(indices, BOX)
        self.boxes = self._vectors([solid.min for solid in solids]), self._vectors([solid.max for solid in solids])
        self.lows[indices], self.highs[indices] = self.boxes

    def _set_balls(self, indices: list[int]) -> None:
        solids = self._chosen(indices, BALL)
        self.radii = np.array([solid.radius for solid in solids], np.float64)
        self.lows[indices] = self.highs[indices] = self._vectors([solid.center for solid in solids])

    def _set_rows(self, indices: list[int]) -> None:
        solids = self._chosen(indices, ROWS)
        planes = [rows_of(solid) for solid in solids]
        self.row_offsets = summed([len(each) for each in planes])
        self.rows = rows_in_space(np.concatenate([np.zeros((0, self._dimension + 1)), *planes]))

    def _set_cells(self, indices: list[int], budget: Budget) -> None:
        """Take the cells that are there; a polyhedron without waits for the second pass."""
        found: list[tuple[int, TopCells]] = []
        for turn, index in enumerate(indices):
            if turn % _CHECK_EVERY == 0:
                budget.check()
            solid = self._solids[index]
            self.lows[index], self.highs[index], _ = own_box(solid, budget.check)
            cells = solid.kept("top_cells")
            if cells is not None:
                found.append((index, cells))
        self._chosen([index for index, _ in found], CELLS)
        self.cell_frames = np.array([cells.frame for _, cells in found]).reshape(-1, 6)
        self.cell_places = np.array([cells.place for _, cells in found], np.int64).reshape(-1, 4)
