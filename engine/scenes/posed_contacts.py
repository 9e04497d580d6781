"""Segments that touch a mesh of a scene, run in its surface or pass so near that filters leave them open, cut at the
contacts that `find_hits` decides exactly.

A start off the boundary is inside if a ray from it crosses an odd number of triangles. After one on the boundary the
perturbed line tells: it is inside before the start if it crosses an odd number of triangles there.
"""

from __future__ import annotations

from typing import Final, cast

import numpy as np

from engine.compiling.jit import entry_of
from engine.running.budget import Budget
from engine.scenes.hits import lines_on
from engine.segment_clipping.hit_search import CUT, IS_INSIDE
from engine.segment_clipping.hits import Target, plain_lines, search
from engine.segment_clipping.on_boundary.boundary_cut import Crossings, emit_contacts
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, boundary_of
from engine.segment_clipping.pieces import Pieces, allocate_pieces, first_of, joined, take_rows
from engine.segment_clipping.profiles import clip_exactly
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.pose import Pose
from engine.types import OPEN, UNDECIDED, FloatArray, IntArray, read_only

_NO_RIMS: Final = read_only(np.zeros(0, np.uint8))
_NO_NORMALS: Final = read_only(np.zeros((0, 3)))


def cut_posed(
    segments: FloatArray, solid: Polyhedron | Surface, pose: Pose | None, budget: Budget
) -> tuple[Pieces, IntArray, IntArray]:
    """Return the pieces of segments (n, 2, 3) within a mesh, sorted by source and t; the segments that took rational
    arithmetic; and of pieces whether they are longer than a point (`LoosePieces`)."""
    n, mesh = len(segments), cast(Mesh, boundary_of(solid))
    target = Target(mesh, _NO_RIMS, _NO_NORMALS)
    lines, is_closed = lines_on(plain_lines(segments, False), np.arange(n), pose), isinstance(solid, Polyhedron)
    rows, state = search(lines if is_closed else lines._replace(pose=lines.pose[:4]), target, CUT, budget, 1)
    contacts = Crossings(
        rows.t,
        rows.barycentric,
        mesh.faces[rows.triangle],
        np.arange(len(rows.t)),
        rows.t_end.astype(np.int64),
        rows.triangle,
    )
    state[state != OPEN] &= IS_INSIDE
    out = allocate_pieces(len(rows.t) + n, 3)
    m = entry_of(emit_contacts)(segments, rows.source, contacts, is_closed, np.empty(2, np.int8), out, state)
    pieces = first_of(out, m)
    are_long = np.where(pieces.source < 0, 0, 1)
    pieces = pieces._replace(source=np.maximum(pieces.source, -1 - pieces.source))
    left = np.flatnonzero(state)
    if not len(left):
        return pieces, left, are_long
    pieces = joined([pieces, clip_exactly(segments, left, solid, pose, budget)])
    are_long = np.append(are_long, np.full(len(pieces.source) - m, UNDECIDED))
    order = np.argsort(pieces.source, kind="stable")
    return take_rows(pieces, order), left, are_long[order]
