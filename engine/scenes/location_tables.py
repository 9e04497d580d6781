"""Location tables: the bodies of a scene in flat arrays, with array operations over all bodies of a kind.

A solid shared by many bodies has one row in the table of its kind; that row is the slot of each.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.aabb import place_boxes
from engine.compiling.jit import merged
from engine.containment.cells.locate import side_in_cell
from engine.containment.methods.filters import (
    Frames,
    frames_of,
    in_space,
    location_in_ball,
    side_of_box,
    side_of_rows,
    to_frame,
)
from engine.containment.methods.polygon_ray_parity import locate_in_runs
from engine.containment.methods.polyhedron_ray_parity import locate_in_tree
from engine.containment.posed_locators import posed_locator
from engine.containment.prepared import closed_rings, tree_at, tree_row
from engine.errors import EngineError
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.pose import Pose
from engine.solids.primitives import rows_in_space, rows_of
from engine.solids.ragged import summed
from engine.solids.registry import BodyKind, row_of
from engine.types import UNDECIDED, BoolArray, FlagArray, FloatArray, Int8Array, Int32Array, IntArray, Point3, read_only

_MOST_EDGES: Final = 128
"""Most edges of a polygon of which all are tested; for more, the index of the solid is faster."""
_CHECK_EVERY: Final = 256


class LocateTables(NamedTuple):
    """Input of location kernels: the n bodies and the m moved ones (n + m,), then the data of their solids by kind."""

    kinds: Int8Array
    """`BodyKind` of each body; OTHER: only the body's own locator decides."""
    slots: Int32Array
    """Row of each body's solid in the arrays of its kind."""
    frames: Int32Array
    """Row of each body's pose in the next three, -1 for none."""
    inverses: FloatArray
    """``(n_poses, 3, 3)``: R^-1 rounded (methods/filters.py); the plane's in the upper left."""
    translations: FloatArray
    is_turn: BoolArray
    centers: FloatArray
    """``(n_balls, 3)``: centres in the world; the slot of a ball counts bodies, not solids."""
    balls: FloatArray
    """``(n_balls, 2)``: radius, and a bound on the error of each coordinate of the centre."""
    box_lows: FloatArray
    """``(n_boxes, 3)``: low corners in the box's own frame."""
    box_highs: FloatArray
    row_offsets: IntArray
    """Offsets into `rows`, by half-space or convex."""
    rows: FloatArray
    """``(n, 4)``: normal and offset of planes; planar ones have 0 in the third column."""
    polygon_offsets: IntArray
    """Offsets into `rings`, by polygon."""
    rings: Int32Array
    xs: FloatArray
    """The vertices of all rings, each ended by its first one."""
    ys: FloatArray
    """x and y of the vertices of all rings, each ring ended by its first vertex."""
    cell_frames: FloatArray
    cell_places: IntArray
    """cell_frames ``(n, 6)`` and cell_places ``(n, 4)``: the cells (`Sides`) of a polyhedron, 0 where there are none.
    """
    addresses: IntArray
    sizes: IntArray
    places: FloatArray
    """addresses, sizes and places: `tree_row` of a polyhedron, 0 where there is no tree."""


@merged
def locate_in_body(
    tables: LocateTables, body: int, is_flat: bool, p: tuple[float, ...], stack: Int32Array, flag: FlagArray
) -> tuple[int, bool]:
    """Return the location of point p in a body by the tables (1 inside, 0 boundary, -1 outside, UNDECIDED), and whether
    it took more than a filter. body: its number; is_flat: 2D; stack: (STACK,), scratch."""
    kind, slot = tables.kinds[body], tables.slots[body]
    q, blur = to_frame(tables, tables.frames[body], p)
    if kind == BodyKind.RINGS:
        first, last = tables.polygon_offsets[slot], tables.polygon_offsets[slot + 1]
        return locate_in_runs(tables.xs, tables.ys, tables.rings, first, last, q[0], q[1], blur)
    location = UNDECIDED
    if kind == BodyKind.MESH:
        if tables.cell_places[slot, 0] != 0:
            location = side_in_cell(tables.cell_frames, tables.cell_places, slot, q, blur)
        if location == UNDECIDED and tables.addresses[slot, 0] != 0:
            location, _ = locate_in_tree(tree_at(tables, slot), Point3(q[0], q[1], q[2]), blur, stack, flag)
    elif kind == BodyKind.BOX:
        location = side_of_box(in_space(tables.box_lows, slot), in_space(tables.box_highs, slot), is_flat, q, blur)
    elif kind == BodyKind.BALL:
        c, radius, blur = in_space(tables.centers, slot), tables.balls[slot, 0], tables.balls[slot, 1]
        square, reach = radius * radius, radius + 2.0 * blur
        location = int(location_in_ball(p[0] - c[0], p[1] - c[1], p[2] - c[2], square, reach, blur))
    elif kind == BodyKind.ROWS:
        location = side_of_rows(tables.rows, tables.row_offsets[slot], tables.row_offsets[slot + 1], q, blur)
    return location, False


class Tables:
    """Location tables of distinct solids, by kind, each solid in its own frame."""

    def __init__(self, solids: Sequence[Solid], owners: IntArray, poses: Sequence[Pose | None], budget: Budget) -> None:
        n, self.dimension = len(solids), solids[0].dimension
        self.kinds, self.slots = np.full(n, BodyKind.OTHER, np.int8), np.zeros(n, np.int32)
        self._solids = solids
        of_kind: dict[BodyKind, list[int]] = {kind: [] for kind in BodyKind}
        for index, solid in enumerate(solids):
            row = row_of(solid)
            is_in = row.locator is not None and (row.kind != BodyKind.RINGS or self.dimension == 2)
            of_kind[row.kind if is_in else BodyKind.OTHER].append(index)
        rings = self._rings(of_kind[BodyKind.RINGS])
        budget.check()
        boxes, balls = (self._chosen(of_kind[kind], kind) for kind in (BodyKind.BOX, BodyKind.BALL))
        self._radii, self._centers = np.array([ball.radius for ball in balls]), self._vectors([b.center for b in balls])
        rows = self._rows(of_kind[BodyKind.ROWS])
        self.meshes: list[Polyhedron] = self._chosen(of_kind[BodyKind.MESH], BodyKind.MESH)
        others = np.zeros(n, np.bool_)
        others[of_kind[BodyKind.OTHER]] = True
        for turn, body in enumerate(np.flatnonzero(others[owners]).tolist()):
            if turn % _CHECK_EVERY == 0:
                budget.check()
            try:
                posed_locator(solids[owners[body]], poses[body])
            except EngineError as error:
                error.where = ("solids", body)
                raise
        lows, highs = (self._vectors([getattr(box, side) for box in boxes]) for side in ("min", "max"))
        self._fixed = lows, highs, *rows, *rings, *_meshes(self.meshes)

    def _chosen(self, indices: list[int], kind: int) -> list[Any]:
        """Return the solids with the given indices, and record in the tables their kind (`BodyKind`) and, in this
        order, their slots: rows in the arrays of that kind."""
        self.kinds[indices], self.slots[indices] = kind, np.arange(len(indices))
        return [self._solids[index] for index in indices]

    def _vectors(self, values: list[FloatArray]) -> FloatArray:
        """Return vectors as an array (n, 3); planar ones have 0 as third coordinate."""
        vectors = np.zeros((len(values), 3))
        if values:
            vectors[:, : self.dimension] = values
        return vectors

    def _rings(self, indices: list[int]) -> tuple[Any, ...]:
        """Return the arrays polygon_offsets, rings, xs, ys (`LocateTables`) of the polygons with the given indices."""
        solids = self._chosen(indices, BodyKind.RINGS)
        offsets = [solid.ring_offsets for solid in solids]
        polygon_offsets = summed([len(each) - 1 for each in offsets])
        ends = np.concatenate([np.zeros(0, np.int64), *offsets])  # each begins with 0
        sizes = np.delete(np.diff(ends, prepend=0), polygon_offsets[:-1] + np.arange(len(offsets)))
        vertices = read_only(np.concatenate([np.empty((0, 2)), *(solid.vertices for solid in solids)]))
        xs, ys, rings, _ = closed_rings(vertices, summed(sizes))
        n_edges = rings[polygon_offsets[1:] - 1, 1] - rings[polygon_offsets[:-1], 0]
        self.kinds[np.array(indices, np.int64)[n_edges > _MOST_EDGES]] = BodyKind.OTHER
        return polygon_offsets, rings, xs, ys

    def _rows(self, indices: list[int]) -> tuple[Any, ...]:
        """Return the arrays row_offsets, rows (`LocateTables`) of the half-spaces and convexes with given indices."""
        planes = [rows_of(solid) for solid in self._chosen(indices, BodyKind.ROWS)]
        rows = np.concatenate([np.zeros((0, self.dimension + 1)), *planes])
        return summed([len(each) for each in planes]), rows_in_space(rows)

    def placed(self, owners: IntArray, poses: Sequence[Pose | None]) -> LocateTables:
        """Return the tables of bodies, body i being solid owners[i] under poses[i]."""
        frames, kinds, slots = frames_of(poses, self.dimension), self.kinds[owners], self.slots[owners]
        bodies = np.flatnonzero(kinds == BodyKind.BALL)
        low, high = moved_boxes(*(self._centers[slots[bodies]],) * 2, frames, frames.rows[bodies])
        with np.errstate(over="ignore", invalid="ignore"):
            centers = low * 0.5 + high * 0.5
            centers[(low == high).all(axis=1)] = low[(low == high).all(axis=1)]  # halves of subnormals may round
            blurs = (high - low).max(axis=1, initial=0.0)
        balls = np.stack([self._radii[slots[bodies]], blurs], axis=1)
        slots[bodies] = np.arange(len(bodies))
        return LocateTables(
            kinds, slots, frames.rows, frames.inverses, frames.translations, frames.is_turn, centers, balls,
            *self._fixed,
        )  # fmt: skip


def _meshes(solids: list[Polyhedron]) -> tuple[Any, ...]:
    """Return, by polyhedron, the arrays cell_frames, cell_places, addresses, sizes and places of `LocateTables`; rows
    of 0 for cells and trees that are not cached."""
    cells, trees = [solid.cached("sides") for solid in solids], [solid.cached("tree") for solid in solids]
    lines = [((0,) * 5, (0,) * 3, (0.0,) * 12) if tree is None else tree_row(tree) for tree in trees]
    addresses, sizes, places = zip(*lines) if lines else ((), (), ())
    return (
        np.array([np.zeros(6) if each is None else each.frame for each in cells]).reshape(-1, 6),
        np.array([(0, 0, 0, 0) if each is None else each.place for each in cells], np.int64).reshape(-1, 4),
        np.array(addresses, np.int64).reshape(-1, 5), np.array(sizes, np.int64).reshape(-1, 3),
        np.array(places, np.float64).reshape(-1, 12),
    )  # fmt: skip


def concatenated(first: LocateTables, then: LocateTables) -> LocateTables:
    """Return the tables of the bodies of `first`, then those of `then`; both share the same solids."""
    rows, slots = np.where(then.frames < 0, -1, then.frames + len(first.inverses)), then.slots.copy()
    slots[then.kinds == BodyKind.BALL] += len(first.balls)
    then = then._replace(frames=rows.astype(np.int32), slots=slots)
    return first._replace(**{
        name: np.concatenate([getattr(first, name), getattr(then, name)])
        for name in ("kinds", "slots", "frames", "inverses", "translations", "is_turn", "centers", "balls")
    })  # fmt: skip


def moved_boxes(lows: FloatArray, highs: FloatArray, frames: Frames, rows: Int32Array) -> tuple[FloatArray, FloatArray]:
    """Return low and high of boxes around posed finite boxes (n, 2 or 3), rounded outward; rows: of the pose of each in
    frames, -1 for none."""
    low, high, n = np.empty_like(lows), np.empty_like(highs), len(rows)
    boxes, moves = np.stack([lows, highs], axis=1), (frames.rotations, frames.translations)
    with np.errstate(all="ignore"):
        place_boxes(boxes, np.full(n, np.inf), np.zeros(n), np.arange(n), rows.astype(np.int64), *moves, low, high)
    return low, high
