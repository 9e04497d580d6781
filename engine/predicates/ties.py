"""Simulation of simplicity: a zero of orient2d is decided as for a point moved by (eps, eps^2).

Seen along a ray, or along the line beside a segment, that line is a point q, and an edge a b of the boundary has it on
its left or right by the sign of orient2d(a, b, q). For every eps > 0 that is small enough, the sign for
q + (eps, eps^2) is

    sign orient2d(a, b, q)   where that is not 0
    sign (a.y - b.y)         else where that is not 0: the derivative of orient2d(a, b, q) by q.x
    sign (b.x - a.x)         else: the derivative by q.y; 0 where a = b alone

So moved, q lies on no vertex and no edge. Two elements at a common edge decide its zero alike, and so do all that count
crossings by this rule, in whichever arithmetic: containment/methods/polyhedron_ray_parity.py and rational_locate.py,
collision/meshes/parity.py and exact_regions.py, segment_clipping/exact_pieces.py and on_boundary/mesh_contacts.py.
tests/unit/predicates/test_ties.py compares them. In the plane a ray to the right is moved up by eps
(polygon_ray_parity.py).

Source: H. Edelsbrunner, E. P. Muecke, Simulation of simplicity, 1990.
"""

from __future__ import annotations

from typing import Any

from engine.compiling.jit import inline


def tie_sign_exact(ax: Any, ay: Any, bx: Any, by: Any) -> int:
    """Return the sign of orient2d(a, b, q + (eps, eps^2)) where orient2d(a, b, q) is 0; for numbers of any kind."""
    if ay != by:
        return 1 if ay > by else -1
    return 1 if bx > ax else -1 if bx < ax else 0


tie_sign: Any = inline(tie_sign_exact)
"""The same, compiled for float64."""
