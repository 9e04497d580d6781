"""Segment tables: what the kernels for segments (`Cut`) read of the bodies of a scene, filled per body on demand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final

import numpy as np

from engine.containment.methods.rational_locate import exact_inverse, to_world_frame
from engine.containment.prepared import tree_of, tree_row
from engine.predicates.expansion import LARGEST, SMALLEST
from engine.predicates.rational import nearest_pair
from engine.scenes.posed_cut import MESH_WORDS, PLACES, TREE, TREE_PLACES, WANTS_TREE
from engine.segment_clipping.on_boundary.prepared_boundary import boundary_of
from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.pose import Pose
from engine.solids.primitives import rows_in_space, rows_of
from engine.solids.registry import BodyKind, own_box, row_of
from engine.types import FloatArray, IntArray, read_only

_FRAMES: Final = 1 << 12
"""Poses of which the frame is cached."""


class Table:
    """Segment table of a scene: `rows` (n, 4) int64, filled body by body on demand, the kind last.

    | column | meaning |
    |---|---|
    | kind | `BodyKind` |
    | number | planes: how many; mesh: whether it is closed |
    | address | planes: (k, 4); ball: (7,) centre in the world as double-doubles, radius; mesh: `MESH_WORDS` |
    | frame | address of `frame_of`, 0 for none |

    like: the table of bodies of which these are a subset; both share the data of solids.
    """

    def __init__(self, solids: Sequence[Solid], poses: Sequence[Pose | None], like: Table | None = None) -> None:
        self._solids, self._poses = solids, poses
        self.rows: IntArray = unready(len(solids))
        self._cached: dict[int, Any] = {} if like is None else like._cached
        """By the id of a solid what rows name by its address."""
        self._own: list[Any] = []
        """The same, of one body."""

    def prepare(self, body: int, wanted: int) -> None:
        """Fill the row of a body (wanted is WANTS_BODY), or the location tree of its solid (WANTS_TREE). Caller holds
        the bodies' lock."""
        solid = self._solids[body]
        if wanted == WANTS_TREE:
            assert isinstance(solid, Polyhedron)
            addresses, sizes, places = tree_row(tree_of(solid))
            words = self._cached[id(solid)]
            words[TREE + 5 : TREE + 8], words.view(np.float64)[TREE_PLACES:] = sizes, places
            words[TREE + 1 : TREE + 5] = addresses[1:]
            words[TREE] = addresses[0]  # order: last, kernels of other threads read it
        elif self.rows[body, 0] == BodyKind.UNREADY:
            self.rows[body, 0] = self._fill(self.rows[body], solid, self._poses[body])

    def _fill(self, row: IntArray, solid: Any, pose: Pose | None) -> int:
        """Fill a body's row (4,) except its kind; return the kind, OTHER if kernels cannot take the body."""
        kind = row_of(solid).kind
        if kind == BodyKind.BALL:
            if not _are_safe([*solid.center, solid.radius, *(() if pose is None else pose.translation)]):
                return BodyKind.OTHER
            center = solid.center.tolist() if pose is None else to_world_frame(solid.center.tolist(), pose)
            doubles = [nearest_pair(*Fraction(x).as_integer_ratio()) for x in center]
            ball = np.zeros(7)
            ball[: 2 * len(center)], ball[6] = np.ravel(doubles), solid.radius
            self._own.append(ball)
            row[2] = ball.ctypes.data
            return BodyKind.BALL if _are_safe([head for head, _ in doubles]) else BodyKind.OTHER
        if pose is not None and not pose.is_identity:
            frame = frame_of(pose)
            if frame is None:
                return BodyKind.OTHER
            self._own.append(frame)
            row[3] = frame.ctypes.data
        if kind in (BodyKind.ROWS, BodyKind.BOX):
            planes = self._cached.setdefault(id(solid), rows_in_space(rows_of(solid)))
            row[1], row[2] = len(planes), planes.ctypes.data
            return BodyKind.ROWS if _are_safe(planes.ravel().tolist()) else BodyKind.OTHER
        if kind == BodyKind.MESH:
            words = self._cached.get(id(solid))
            words = self._cached.setdefault(id(solid), _words_of(solid)) if words is None else words
            row[1], row[2] = isinstance(solid, Polyhedron), words.ctypes.data
            return BodyKind.MESH
        return BodyKind.OTHER


def unready(n: int) -> IntArray:
    """Return the rows (n, 4) of n bodies of which none is prepared."""
    rows = np.zeros((n, 4), np.int64)
    rows[:, 0] = BodyKind.UNREADY
    return rows


def _words_of(solid: Any) -> IntArray:
    """Return the MESH_WORDS numbers of a mesh, without its location tree."""
    mesh: Any = boundary_of(solid)
    low, high, _ = own_box(solid)
    words = np.zeros(MESH_WORDS, np.int64)
    words[:5] = [array.ctypes.data for array in (mesh.elements, mesh.faces, mesh.boxes, mesh.child, mesh.corners)]
    words[5:TREE] = len(mesh.elements), len(mesh.child), mesh.n_inner
    words.view(np.float64)[PLACES:TREE_PLACES] = *mesh.origin, *mesh.inverse, mesh.are_safe, *low, *high
    return words


@lru_cache(_FRAMES)
def frame_of(pose: Pose) -> FloatArray | None:
    """Return the frame of a pose (3, 7): by axis a row of R^-1 as double-doubles, then the translation; planar poses
    fix z. None if numbers are out of the kernels' range."""
    entries, below = exact_inverse(pose)
    n, frame = pose.dimension, np.zeros((3, 7))
    frame[2, 4] = 1.0
    frame[:n, : 2 * n] = [np.ravel([nearest_pair(entry, below) for entry in row]) for row in entries]
    frame[:n, 6] = pose.translation
    return read_only(frame) if _are_safe(frame[:, ::2].ravel().tolist()) else None


def _are_safe(numbers: Iterable[float]) -> bool:
    """Return whether all numbers are zero or in the range in which kernels compute without underflow or overflow."""
    return all(x == 0.0 or SMALLEST <= abs(x) <= LARGEST for x in numbers)
