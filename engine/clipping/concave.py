"""Segments on polygons and polyhedra: contacts by a box tree, pieces between them; several for each segment.

Segments without any contact lie on one side: the location of their first end decides, in batches. Those with proper
crossings only are cut by a kernel (proper_pieces.py), the others in exact arithmetic (exact_pieces.py). Zero-length
segments are points.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from engine.bounding.bvh import build_bvh
from engine.clipping.box_tree import build_box_tree
from engine.clipping.contacts import PROPER, find_contacts_2d
from engine.clipping.exact_pieces import pieces_of
from engine.clipping.exact_segments import Piece
from engine.clipping.mesh_contacts import find_mesh_contacts, is_clear
from engine.clipping.proper_pieces import SETTLED, clip_properly_2d, clip_properly_3d
from engine.clipping.single_pieces import PieceRows
from engine.containment.locators import locator_of
from engine.containment.rational_locate import rational_location
from engine.parallel import Budget
from engine.solids.base import FloatArray, IntArray
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron

_LEAST_ROOM = 1 << 12  # contacts looked for at once; doubled where one segment has more


@dataclass(frozen=True, slots=True)
class Boundary:
    """elements: (k, 2 or 3) int64 into vertices (m, dim); faces: (k,) int64, the face or edge each is reported as.

    tree: of the arguments that the kernels take, see `find_contacts_2d` and `find_mesh_contacts`.
    """

    vertices: FloatArray
    elements: IntArray
    faces: IntArray
    tree: tuple[Any, ...]


def boundary_of(region: Polygon | Polyhedron) -> Boundary:
    """Return the prepared boundary of a region: triangles, or the edges of all rings by their first vertex."""

    def build() -> Boundary:
        if isinstance(region, Polyhedron):
            elements, faces = region.triangles, region.triangle_faces
        else:
            following = np.arange(1, len(region.vertices) + 1, dtype=np.int64)
            following[region.ring_offsets[1:] - 1] = region.ring_offsets[:-1]
            faces = np.arange(len(following), dtype=np.int64)
            elements = np.stack([faces, following], axis=1)
        corners = region.vertices[elements]
        low, high = corners.min(axis=1), corners.max(axis=1)
        if isinstance(region, Polyhedron):
            wide = build_bvh(np.concatenate([low, high], axis=1))
            tree: tuple[Any, ...] = (wide.boxes, wide.child, wide.origin, 1.0 / wide.scale)
        else:
            narrow = build_box_tree(low, high)
            tree = (narrow.order, narrow.boxes)
        return Boundary(region.vertices, np.ascontiguousarray(elements), faces, tree)

    return region.prepared("clipping_boundary", build)


def clip_chunk(segments: FloatArray, first: int, last: int, region: Polygon | Polyhedron, budget: Budget) -> PieceRows:
    """Return the pieces of ``segments[first:last]``, (n, 2, dim) float64, in order of source and t."""
    boundary = boundary_of(region)
    part = segments[first:last]
    locations = np.empty(len(part), np.int8)
    counts = locator_of(region).fill(part[:, 0].copy(), locations, budget)
    offsets, elements, kinds = _contacts(segments, first, last, boundary, budget)
    n_contacts = np.diff(offsets)
    n_contacts[(part[:, 0] == part[:, 1]).all(axis=1)] = 0  # points: their location says it all
    whole = np.flatnonzero((n_contacts == 0) & (locations >= 0))
    n_improper = np.diff(np.append(0, np.cumsum(kinds != PROPER))[offsets])
    proper = np.flatnonzero((n_contacts > 0) & (n_improper == 0) & (np.abs(locations) == 1))
    rows, settled = _proper_pieces(part, proper, locations, offsets, elements, boundary, budget)
    is_open = n_contacts > 0
    is_open[settled] = False
    sources, pieces = [], []
    cut = np.flatnonzero(is_open)
    for i in cut:
        budget.check()
        mine = slice(offsets[i], offsets[i + 1])
        found = _pieces(part[i], elements[mine], kinds[mine], int(locations[i]), region, boundary, budget)
        sources += [i] * len(found)
        pieces += found
    n = len(whole)
    ends = np.tile([0.0, 1.0], (n, 1)), np.full((n, 2), -1, np.int64)
    source = np.concatenate([whole, rows.source, np.array(sources, np.int64)])
    order = np.argsort(source, kind="stable")  # pieces of one segment stay in order of t
    return PieceRows(
        source[order] + first,
        np.concatenate([part[whole, 0], rows.start, _points(pieces, 1, part.shape[2])])[order] + 0.0,
        np.concatenate([part[whole, 1], rows.end, _points(pieces, 2, part.shape[2])])[order] + 0.0,
        np.concatenate([ends[0], rows.t, _points(pieces, 0, 2)])[order],
        np.concatenate([ends[1], rows.faces, np.array([p.faces for p in pieces], np.int64).reshape(-1, 2)])[order],
        min(len(part), len(cut) + counts.beyond),
        len(cut),
    )


def _proper_pieces(
    segments: FloatArray,
    proper: IntArray,
    locations: npt.NDArray[np.int8],
    offsets: IntArray,
    elements: IntArray,
    boundary: Boundary,
    budget: Budget,
) -> tuple[PieceRows, IntArray]:
    """Return the pieces of those `proper` segments that the kernel settles, and which these are."""
    counts = (np.diff(offsets)[proper] + (locations[proper] > 0) + 1) // 2
    rows = np.cumsum(counts) - counts
    m, dimension = int(counts.sum()), segments.shape[2]
    start, end, t = np.empty((m, dimension)), np.empty((m, dimension)), np.empty((m, 2))
    faces, state = np.empty((m, 2), np.int64), np.empty(len(proper), np.uint8)
    kernel: Any = clip_properly_2d if dimension == 2 else clip_properly_3d
    if len(proper):  # no segments at all come as another kind of array, for which nothing is compiled
        with np.errstate(all="ignore"):
            kernel(
                segments,
                proper,
                locations,
                offsets,
                elements,
                boundary.vertices,
                boundary.elements,
                boundary.faces,
                rows,
                budget.flag,
                start,
                end,
                t,
                faces,
                state,
            )
    budget.check()
    kept = np.repeat(state == SETTLED, counts)
    source = np.repeat(proper, counts)[kept]
    return PieceRows(source, start[kept], end[kept], t[kept], faces[kept], 0, 0), proper[state == SETTLED]


def _points(pieces: list[Piece], field: int, width: int) -> FloatArray:
    return np.array([piece[field] for piece in pieces], np.float64).reshape(-1, width)


def _contacts(
    segments: FloatArray, first: int, last: int, boundary: Boundary, budget: Budget
) -> tuple[IntArray, IntArray, npt.NDArray[np.uint8]]:
    """Return the offsets (last - first + 1,) of each segment's contacts, their elements, and their kinds."""
    kernel: Any = find_contacts_2d if segments.shape[2] == 2 else find_mesh_contacts
    room, done = max(_LEAST_ROOM, 8 * (last - first)), first
    ends, elements, kinds = [np.zeros(1, np.int64)], [], []
    while done < last:
        met, kind = np.empty(room, np.int64), np.empty(room, np.uint8)
        offsets = np.empty(last - done + 1, np.int64)
        with np.errstate(all="ignore"):
            reached = kernel(
                segments,
                done,
                last,
                boundary.vertices,
                boundary.elements,
                *boundary.tree,
                budget.flag,
                met,
                kind,
                offsets,
            )
        budget.check()
        if reached == done:
            room *= 2
            continue
        found = int(offsets[reached - done])
        ends.append(ends[-1][-1] + offsets[1 : reached - done + 1])
        elements.append(met[:found])
        kinds.append(kind[:found])
        done = reached
    if not elements:
        return ends[0], np.zeros(0, np.int64), np.zeros(0, np.uint8)
    return np.concatenate(ends), np.concatenate(elements), np.concatenate(kinds)


def _pieces(
    segment: FloatArray,
    elements: IntArray,
    kinds: npt.NDArray[np.uint8],
    location: int,
    region: Polygon | Polyhedron,
    boundary: Boundary,
    budget: Budget,
) -> list[Piece]:
    corners = boundary.vertices[boundary.elements[elements]].tolist()

    def locate(point: list[Fraction]) -> int:
        near = _near_point(point, boundary, budget) if len(point) == 3 else None
        if near is None:
            return rational_location(point, region, None, budget.check)
        found = np.empty(1, np.int8)
        locator_of(region).fill(near[None], found, budget)
        return int(found[0])

    return pieces_of(
        segment[0].tolist(),
        segment[1].tolist(),
        list(zip(boundary.faces[elements].tolist(), corners)),
        bool((kinds == PROPER).all()),
        location,
        locate,
    )


def _near_point(point: list[Fraction], boundary: Boundary, budget: Budget) -> FloatArray | None:
    """Return a point of doubles that lies as `point` does, as nothing of the boundary is between them; else None."""
    try:
        middle = np.array([float(x) for x in point])
    except OverflowError:
        return None
    low, high = np.nextafter(middle, -np.inf), np.nextafter(middle, np.inf)
    is_known = np.array([x == y for x, y in zip(point, middle.tolist())])
    low[is_known], high[is_known] = middle[is_known], middle[is_known]
    corners = np.array(np.meshgrid(*zip(low, high), indexing="ij")).reshape(3, 8).T.copy()
    with np.errstate(all="ignore"):
        if not is_known.all() and not is_clear(
            corners, boundary.vertices, boundary.elements, *boundary.tree, budget.flag
        ):
            return None
    return middle
