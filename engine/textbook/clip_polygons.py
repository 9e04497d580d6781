"""Sutherland-Hodgman: a polygon clipped on a half-space, contour by contour, and on a cascade of half-spaces.

Source: section 22.4.2 of the chapter on computer graphics in Algorithms of Informatics, algorithm
Sutherland-Hodgeman-Polygon-Clipping (figures 22.26 and 22.27); I. Sutherland and G. Hodgman, Reentrant polygon
clipping, 1974. A concave contour that falls apart stays one ring, its parts connected by an even number of edges; a
multiply connected polygon is clipped contour by contour; a convex polyhedron is a series of half-spaces, the result of
one step being the input of the next.
What goes wrong: later steps decide about points that were rounded by earlier ones, so a vertex that lies on two planes
may be kept by one and lost by the other.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray
from engine.compiling.jit import allocating_kernel
from engine.textbook.solids import signed_distance


@allocating_kernel
def clip_contour(contour: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Return what the half-space leaves of a closed contour (n, dim); at most 2 n vertices."""
    n = len(contour)
    kept = np.empty((2 * n, contour.shape[1]))
    m = 0
    for i in range(n):
        p, q = contour[i], contour[(i + 1) % n]
        at_p, at_q = signed_distance(p, normal, offset), signed_distance(q, normal, offset)
        if at_p >= 0.0:
            kept[m] = p
            m += 1
        if (at_p >= 0.0) != (at_q >= 0.0):
            kept[m] = p + at_p / (at_p - at_q) * (q - p)
            m += 1
    return kept[:m].copy()


def clip_polygon(contours: list[FloatArray], normal: FloatArray, offset: float) -> list[FloatArray]:
    """Return the contours that are left of a multiply connected polygon."""
    clipped = [clip_contour(contour, normal, offset) for contour in contours]
    return [contour for contour in clipped if len(contour) > 0]


def on_convex(contours: list[FloatArray], planes: FloatArray) -> list[FloatArray]:
    """Return what a convex polyhedron, given by rows (normal, offset), leaves of a polygon: one plane after another."""
    for row in planes:
        contours = clip_polygon(contours, row[:-1].copy(), float(row[-1]))
    return contours
