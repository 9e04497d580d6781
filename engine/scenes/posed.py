"""Segments on posed bodies: what the kernels of posed_cut.py want of a body, prepared once, and what they leave."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FlagArray, FloatArray, IntArray
from engine.containment.locators import Locator
from engine.containment.posed.locators import posed_locator
from engine.containment.rational_locate import adjugate, to_world_frame
from engine.parallel import Budget
from engine.predicates.expansion import LARGEST, SMALLEST
from engine.scenes.posed_cut import MOST_MET, Frame, cut_on_posed_ball, cut_on_posed_mesh, cut_on_posed_rows
from engine.segment_clipping.boundary_cut import SETTLED
from engine.segment_clipping.pieces import Pieces, joined, room_for
from engine.segment_clipping.prepared_boundary import Mesh, boundary_of
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.convex import Convex, rows_in_space, rows_of
from engine.solids.half_space import HalfSpace
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.surface import Surface
from engine.types import OPEN

_BYTES: Final = 180


class PosedBody(NamedTuple):
    """What segments on a posed body are cut by: one of rows (k, 4), centre (3, 2) or mesh."""

    frame: Frame | None = None
    rows: FloatArray | None = None
    center: FloatArray | None = None
    mesh: Mesh | None = None
    locator: Locator | None = None


def posed_body(solid: Solid, pose: Pose) -> PosedBody | None:
    """Return what a posed body is cut by, None where no kernel takes it: its type, or its numbers."""
    match solid:
        case Sphere():
            center = _doubles([[x] for x in to_world_frame(solid.center.tolist(), pose)])
            fits = _are_safe(center[:, :1]) and _are_safe(np.array([solid.radius]))
            return PosedBody(center=np.concatenate([center, np.zeros((3 - len(center), 2))])) if fits else None
        case HalfSpace() | Aabb() | Convex():
            rows, frame = rows_in_space(rows_of(solid)), _frame_of(pose)
            return PosedBody(frame, rows=rows) if frame is not None and _are_safe(rows) else None
        case Polyhedron() | Surface():
            frame, mesh = _frame_of(pose), boundary_of(solid)
            locator = posed_locator(solid, pose) if isinstance(solid, Polyhedron) else None
            return None if frame is None else PosedBody(frame, mesh=mesh, locator=locator)  # type: ignore[arg-type]
    return None


def _frame_of(pose: Pose) -> Frame | None:
    entries, determinant = adjugate([[Fraction(entry) for entry in row] for row in pose.rotation.tolist()])
    n = pose.dimension
    inverse, shift = np.zeros((3, 3, 2)), np.zeros(3)
    inverse[2, 2, 0] = 1.0
    inverse[:n, :n] = _doubles([[entry / determinant for entry in row] for row in entries]).reshape(n, n, 2)
    shift[:n] = pose.translation
    return Frame(inverse, shift) if _are_safe(inverse[:, :, 0]) and _are_safe(shift) else None


def _doubles(numbers: list[list[Fraction]]) -> FloatArray:
    """Return numbers as double-doubles, in a row."""
    flat = [x for row in numbers for x in row]
    heads = [float(x) for x in flat]
    return np.array([(head, float(x - Fraction(head))) for head, x in zip(heads, flat)])


def _are_safe(numbers: FloatArray) -> bool:
    sizes = np.abs(numbers)
    return bool(((sizes == 0.0) | ((sizes >= SMALLEST) & (sizes <= LARGEST))).all())


def cut_posed(segments: FloatArray, body: PosedBody, radius: float, budget: Budget) -> tuple[list[Pieces], FlagArray]:
    """Return the pieces of segments (n, 2, dim) on a posed body that are settled, in parts, and the state of each."""
    n, dimension = len(segments), segments.shape[2]
    state = np.full(n, OPEN, np.uint8)
    if body.mesh is None:
        out = room_for(n, dimension)
        with np.errstate(all="ignore"):  # uncompiled runs only
            if body.center is not None:
                m = int(cut_on_posed_ball(segments, body.center, radius, budget.flag, out, state))
            else:
                m = int(cut_on_posed_rows(segments, body.rows, body.frame, budget.flag, out, state))
        budget.check()
        return [_first(out, m)], state
    locations = np.full(n, -1, np.int8)
    if body.locator is not None:
        body.locator.fill(np.ascontiguousarray(segments[:, 0]), locations, budget)
    parts, done = [], np.zeros(2, np.int64)
    while done[0] < n:  # bound: each turn has room for a segment
        out = room_for(MOST_MET + 2 * (n - int(done[0])), dimension)
        with np.errstate(all="ignore"):
            cut_on_posed_mesh(segments, locations, body.mesh, body.frame, budget.flag, out, state, done)
        budget.check()
        budget.take(_BYTES * int(done[1]))
        parts.append(_first(out, int(done[1])))
    return parts or [room_for(0, dimension)], state


def _first(out: Pieces, m: int) -> Pieces:
    return Pieces(out.source[:m], out.ends[:, :m], out.t[:m], out.faces[:m])


def completed(parts: list[Pieces], state: FlagArray, is_surface: bool, settle: Any) -> Pieces:
    """Return pieces with those of the segments that are left, by source; on a surface as points."""
    found = joined(parts) if len(parts) > 1 else parts[0]
    if is_surface:
        found = as_points(found)
    left: IntArray = np.flatnonzero(state != SETTLED)
    if not len(left):
        return found
    found = joined([found, settle(left)])
    order = np.argsort(found.source, kind="stable")
    return Pieces(found.source[order], found.ends[:, order], found.t[order], found.faces[order])


def as_points(paired: Pieces) -> Pieces:
    """Return the crossings of a surface, a piece of one point each: as if nothing were inside it, pieces from every
    other crossing to the next have been cut, whose ends are taken."""
    row, side = np.divmod(np.flatnonzero(paired.faces.ravel() >= 0), 2)
    ends = paired.ends[side, row]
    t, faces = (np.stack([each[row, side]] * 2, axis=1) for each in (paired.t, paired.faces))
    return Pieces(paired.source[row], np.stack([ends, ends]), t, faces)
