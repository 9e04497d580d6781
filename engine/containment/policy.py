"""Choice of the point location method for a batch by amortised cost: a pass, lists (tree or slabs), or cells.

The first batch is one pass over all faces or edges, with nothing prepared. A structure is built once the points so far,
this batch included, would have paid for it: a tree or slabs soon, cells for many points. The choice never changes an
answer. Costs are nanoseconds on one thread, measured on meshes of 10^3 to 10^6 faces and rings of 10 to 2 10^5 edges.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from engine.containment.cells.lattice import can_have_cells
from engine.containment.prepared import (
    IN_TREE,
    IN_TREE_A_FACE_OVER,
    SAMPLE,
    cost_in_tree,
    edges_in_slab,
    mean_faces_above,
)
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon


class Choice(IntEnum):
    """Structure by which the points of a batch are located in a polygon or polyhedron."""

    PASS = 0
    """One pass over all faces or edges."""
    LISTS = 1
    """A tree of boxes (polyhedron), or horizontal slabs (polygon)."""
    CELLS = 2


_FEW: Final = 192
"""Number of points up to which the tree is as fast as cells."""
_FEW_RAYS: Final = 256
"""Product of points and faces up to which one pass costs less than handing a tree to the kernel."""
_PASS_A_FACE, _PASS_A_POINT, _PASS_A_FACE_OVER, _PASS_MIXED = 20.0, 70.0, 9.0, 100.0
"""Nanoseconds of a pass: for each face, each point, each face box above a point, and the root of faces times points
(a face looks into several cells of points)."""
LONG_PASS: Final = 1 << 12
"""Number of faces from which one pass takes so long that a batch should not be cut into chunks."""
_TREE: Final = 40_000.0
_TREE_A_FACE: Final = 350.0
_SOON: Final = 1.0 / 8.0
"""Share of the tree's cost that passes may take before the tree is built: by the second or third batch, usually."""
_ALONE: Final = 5e6
"""What a batch may always take in one thread, as a pass does; more only if building the tree takes as long."""
_CELLS, _CELLS_A_FACE = 2_500_000.0, 500.0

_IN_RINGS, _PASS_AN_EDGE = 5.0, 0.8
_SLABS, _SLABS_AN_EDGE = 40_000.0, 15.0
_RING_CELLS, _RING_CELLS_AN_EDGE = 100_000.0, 80.0
_IN_SLABS: Final = 50.0


def choose_for_mesh(solid: Polyhedron, n_points: int) -> Choice:
    """Return PASS, LISTS (the tree) or CELLS for the next batch of `n_points` in a polyhedron, and count its points."""
    seen, n_faces = _points_seen(solid, n_points), len(solid.triangles)
    if n_points * n_faces <= _FEW_RAYS:
        return Choice.PASS
    if n_points > _FEW and (solid.cached("cells") is not None or _cells_amortize(solid, seen)):
        return Choice.CELLS
    if solid.cached("tree") is not None:
        return Choice.LISTS
    spent, tree = solid.prepared("passes", lambda: [0.0]), _TREE + _TREE_A_FACE * n_faces
    over = mean_faces_above(solid) if spent[0] > 0.0 or n_points > SAMPLE else 0.0  # it takes 30 us to find out
    by_points = n_points * (_PASS_A_POINT + _PASS_A_FACE_OVER * over)
    by_pass = _PASS_A_FACE * n_faces + _PASS_MIXED * (n_points * n_faces) ** 0.5 + by_points
    by_tree = tree + n_points * (IN_TREE + IN_TREE_A_FACE_OVER * over)
    if spent[0] > _SOON * tree or by_points > max(tree, _ALONE) or by_pass > by_tree:
        return Choice.LISTS
    spent[0] += by_pass
    return Choice.PASS


def _cells_amortize(solid: Polyhedron, seen: int) -> bool:
    """Return whether cells are possible, and locating `seen` points by the tree would have cost more than them."""
    n_faces = len(solid.triangles)
    least = _CELLS + _CELLS_A_FACE * n_faces
    if seen * (IN_TREE + IN_TREE_A_FACE_OVER * n_faces) <= least or seen * cost_in_tree(solid) <= least:
        return False
    return solid.prepared("can_have_cells", lambda: can_have_cells(solid))


def choose_for_rings(solid: Polygon, n_points: int) -> Choice:
    """Return PASS, LISTS (slabs) or CELLS for the next batch of `n_points` in a polygon, and count its points."""
    seen, n_edges = _points_seen(solid, n_points), len(solid.vertices)
    if solid.cached("ring_cells") is not None:
        return Choice.CELLS
    by_pass, by_slabs = _IN_RINGS + _PASS_AN_EDGE * n_edges, np.inf
    if solid.cached("slabs") is not None or seen * by_pass > _SLABS + _SLABS_AN_EDGE * n_edges:
        by_slabs = _IN_SLABS + _PASS_AN_EDGE * max(8.0, 2.0 * edges_in_slab(solid)[0])
    if seen * min(by_pass, by_slabs) > _RING_CELLS + _RING_CELLS_AN_EDGE * n_edges:
        return Choice.CELLS
    return Choice.LISTS if by_slabs < by_pass else Choice.PASS


def _points_seen(solid: Polygon | Polyhedron, n_points: int) -> int:
    seen = solid.prepared("points_seen", lambda: [0])
    seen[0] += n_points
    return seen[0]
