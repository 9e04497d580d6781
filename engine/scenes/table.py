"""What the kernels for segments read of the bodies of a scene (`BodyTable`): of each, when it is asked for first."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray
from engine.containment.prepared import tree_of
from engine.containment.rational_locate import exact_inverse, to_world_frame
from engine.containment.scene.trees import tree_line
from engine.predicates.expansion import LARGEST, SMALLEST
from engine.scenes.posed_mesh import WANTS_TREE, Lines
from engine.scenes.through import BALL, MESH, OTHER, ROWS, UNREADY, BodyTable
from engine.segment_clipping.prepared_boundary import boundary_of
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.bounds import own_box
from engine.solids.convex import Convex, rows_in_space, rows_of
from engine.solids.half_space import HalfSpace
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface

_MESH_SIZES: Final = 5, 3, 11
_TREE_SIZES: Final = 5, 3, 10
"""Addresses, sizes and places in a line."""


class Table:
    """The bodies of a scene for the kernels; `of_kernels` is filled body by body, its kinds last.

    like: the table of bodies that these are some of, which share what stands there of solids.
    """

    def __init__(self, solids: Sequence[Solid], poses: Sequence[Pose | None], like: Table | None = None) -> None:
        self._solids, self._poses = solids, poses
        n = len(solids)
        self._slots: dict[int, int] = {} if like is None else like._slots
        self._rows: dict[int, int] = {} if like is None else like._rows
        self.are_streamed = np.array([isinstance(solid, Polyhedron) for solid in solids], np.bool_)
        """(n,): polyhedra without a pose."""
        begins, n_rows, n_balls, n_posed = np.zeros(n, np.int64), 0, 0, 0
        frames = np.full(n, -1, np.int64)
        for body, solid in enumerate(solids):
            if isinstance(solid, Sphere):
                begins[body], n_balls = n_balls, n_balls + 1
                continue
            if poses[body] is not None:
                self.are_streamed[body] = False
                frames[body], n_posed = n_posed, n_posed + 1
            if isinstance(solid, (Polyhedron, Surface)):
                begins[body] = self._slots.setdefault(id(solid), len(self._slots))
            elif isinstance(solid, (HalfSpace, Aabb, Convex)):
                if id(solid) not in self._rows:
                    self._rows[id(solid)], n_rows = n_rows, n_rows + len(rows_of(solid))
                begins[body] = self._rows[id(solid)]
        n_slots = len(self._slots)
        of_solids = (np.zeros((n_rows, 4)), _lines(n_slots, *_MESH_SIZES), _lines(n_slots, *_TREE_SIZES))
        rows, meshes, trees = of_solids if like is None else like.of_solids
        self.of_solids: tuple[FloatArray, Lines, Lines] = rows, meshes, trees
        self.of_kernels = BodyTable(
            np.full(n, UNREADY, np.int8), begins, begins.copy(), frames, np.zeros((n_posed, 3, 3, 2)),
            np.zeros((n_posed, 3)), rows, np.zeros((n_balls, 3, 2)), np.zeros(n_balls), meshes, trees,
        )  # fmt: skip

    def prepare(self, body: int, wanted: int) -> None:
        """Make ready what kernels want of a body. Caller holds the lock of the bodies."""
        solid, table = self._solids[body], self.of_kernels
        if wanted == WANTS_TREE:
            assert isinstance(solid, Polyhedron)
            _put_line(table.trees, int(table.begins[body]), *tree_line(tree_of(solid)))
        elif table.kinds[body] == UNREADY:
            table.kinds[body] = self._fill(body, solid, self._poses[body])

    def _fill(self, body: int, solid: Solid, pose: Pose | None) -> int:
        """Fill the rows of a body; return its kind, OTHER where no kernel takes its type, or its numbers."""
        table, place = self.of_kernels, int(self.of_kernels.begins[body])
        if isinstance(solid, Sphere):
            if not _are_safe([*solid.center, solid.radius, *(() if pose is None else pose.translation)]):
                return OTHER
            center = solid.center.tolist() if pose is None else to_world_frame(solid.center.tolist(), pose)
            doubles = [_double(*Fraction(x).as_integer_ratio()) for x in center]
            table.centers[place, : len(center)], table.radii[place] = doubles, solid.radius
            return BALL if _are_safe([head for head, _ in doubles]) else OTHER
        frame = int(table.frames[body])
        if pose is not None and pose.is_identity:
            table.frames[body] = -1
        elif pose is not None and not _put_frame(table, frame, pose):
            return OTHER
        if isinstance(solid, (HalfSpace, Aabb, Convex)):
            planes = rows_of(solid)
            table.ends[body] = place + len(planes)
            table.rows[place : place + len(planes)] = rows_in_space(planes)
            return ROWS if _are_safe(planes.ravel().tolist()) else OTHER
        if isinstance(solid, (Polyhedron, Surface)):
            table.ends[body] = isinstance(solid, Polyhedron)
            if table.meshes.addresses[place, 0]:
                return MESH
            mesh: Any = boundary_of(solid)
            low, high, _ = own_box(solid)
            numbers = *mesh.origin, mesh.inverse, mesh.are_safe, *low, *high
            arrays = mesh.elements, mesh.faces, mesh.boxes, mesh.child, mesh.corners
            addresses = tuple(array.ctypes.data for array in arrays)
            _put_line(table.meshes, place, addresses, (len(mesh.elements), len(mesh.child), mesh.n_inner), numbers)
            return MESH
        return OTHER


def unready(n: int) -> BodyTable:
    """Return what says of n bodies that none is prepared."""
    return _NOTHING._replace(kinds=np.full(n, UNREADY, np.int8)) if n else _NOTHING


def _lines(n: int, n_addresses: int, n_sizes: int, n_places: int) -> Lines:
    return Lines(np.zeros((n, n_addresses), np.int64), np.zeros((n, n_sizes), np.int64), np.zeros((n, n_places)))


def _put_line(lines: Lines, row: int, addresses: Any, sizes: Any, places: Any) -> None:
    """Fill a row, its addresses last: kernels of other threads look at these."""
    lines.sizes[row], lines.places[row] = sizes, places
    lines.addresses[row] = addresses


def _put_frame(table: BodyTable, frame: int, pose: Pose) -> bool:
    """Fill the frame of a pose; tell whether kernels take its numbers."""
    entries, below = exact_inverse(pose)
    n, inverse = pose.dimension, [[_double(entry, below) for entry in row] for row in entries]
    table.inverses[frame, 2, 2, 0] = 1.0
    table.inverses[frame, :n, :n], table.shifts[frame, :n] = inverse, pose.translation
    return _are_safe([head for row in inverse for head, _ in row]) and _are_safe(pose.translation.tolist())


def _double(above: int, below: int) -> tuple[float, float]:
    """Return a quotient as a double-double; division of integers rounds to nearest. below: positive."""
    head = above / below
    n, d = head.as_integer_ratio()
    return head, (above * d - n * below) / (below * d)


def _are_safe(numbers: Iterable[float]) -> bool:
    return all(x == 0.0 or SMALLEST <= abs(x) <= LARGEST for x in numbers)


_NOTHING: Final = Table((), ()).of_kernels
