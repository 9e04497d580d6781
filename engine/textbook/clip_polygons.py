"""Sutherland-Hodgman: a polygon clipped on a half-space, contour by contour, and on a cascade of half-spaces.

Source: section 22.4.2 of the chapter on computer graphics in Algorithms of Informatics, algorithm
Sutherland-Hodgeman-Polygon-Clipping (figures 22.26 and 22.27); I. Sutherland and G. Hodgman, Reentrant polygon
clipping, 1974. A concave contour that falls apart stays one ring, its parts connected by an even number of edges; a
multiply connected polygon is clipped contour by contour; a convex polyhedron is a series of half-spaces, the result of
one step being the input of the next.
What goes wrong: later steps decide about points that were rounded by earlier ones, so a vertex that lies on two planes
may be kept by one and lost by the other.

Clipping one simple polygon on another, concave ones too: cut both at their crossings, then walk alternately.

Each crossing is put into both rings. Along a ring crossings enter and leave the other polygon in turn; starting from a
crossing not yet used, the walk follows the subject where it is inside and changes ring at every crossing until it is
back. For the intersection the walk goes forward at entries and backward at exits.

Source: exercise 22.4-3 of the chapter on computer graphics in Algorithms of Informatics; G. Greiner and K. Hormann,
Efficient clipping of arbitrary polygons, 1998.
What goes wrong: a vertex of one ring on an edge of the other, or edges that overlap, are not crossings in the sense
above, and then entries and exits no longer take turns: whole parts are lost or invented. Plain Python, quadratic.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from engine.compiling.jit import allocating_kernel
from engine.textbook.polygons import by_half_line
from engine.textbook.solids import signed_distance
from engine.types import FloatArray


@allocating_kernel
def clip_contour(contour: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Return the part of a closed contour (n, dim) in the half-space normal . p + offset >= 0; at most 2 n vertices."""
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
    """Clip each contour of a multiply connected polygon to a half-space; return those that are not empty."""
    clipped = [clip_contour(contour, normal, offset) for contour in contours]
    return [contour for contour in clipped if len(contour) > 0]


def on_convex(contours: list[FloatArray], planes: FloatArray) -> list[FloatArray]:
    """Clip a polygon to a convex polyhedron given by plane rows (normal, offset), one plane after another; return the
    contours that are left."""
    for row in planes:
        contours = clip_polygon(contours, row[:-1].copy(), float(row[-1]))
    return contours


@dataclass(slots=True, eq=False)
class Node:
    """A vertex of one ring, or a crossing of two rings, linked to its neighbours on its ring; of a crossing `twin` is
    the node for it in the other ring, and is_entry says whether its ring enters the other polygon there."""

    x: float
    y: float
    at: tuple[int, float] = (0, 0.0)  # edge and parameter along it
    twin: Node | None = None
    is_entry: bool = False
    is_used: bool = False
    after: Node | None = field(default=None, repr=False)
    before: Node | None = field(default=None, repr=False)


def crossing(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> tuple[float, float] | None:
    """Return the parameters, on ab and on cd, of the point where two segments cross, both strictly between 0 and 1;
    None if they do not."""
    u, v, w = b - a, d - c, c - a
    area = u[0] * v[1] - u[1] * v[0]
    if area == 0.0:
        return None
    t, s = (w[0] * v[1] - w[1] * v[0]) / area, (w[0] * u[1] - w[1] * u[0]) / area
    return (float(t), float(s)) if 0.0 < t < 1.0 and 0.0 < s < 1.0 else None


def link(ring: FloatArray, crossings: list[Node], other: FloatArray) -> list[Node]:
    """Return the nodes of a ring, vertices and crossings in order, linked to each other; a crossing is marked as entry
    into the polygon `other` or as exit."""
    nodes = [Node(float(x), float(y), (i, 0.0)) for i, (x, y) in enumerate(ring)]
    nodes = sorted(nodes + crossings, key=lambda node: node.at)
    inside = bool(by_half_line(ring[:1], other, np.array([0, len(other)]))[0])
    for node, following in zip(nodes, nodes[1:] + nodes[:1]):
        node.after, following.before = following, node
        if node.twin is not None:
            inside = not inside
            node.is_entry = inside
    return nodes


def intersection(subject: FloatArray, clip: FloatArray) -> list[FloatArray]:
    """Return the rings of the intersection of the regions of two simple rings (n, 2) and (m, 2)."""
    of_subject, of_clip = [], []
    for i in range(len(subject)):
        for j in range(len(clip)):
            a, b = subject[i], subject[(i + 1) % len(subject)]
            found = crossing(a, b, clip[j], clip[(j + 1) % len(clip)])
            if found is not None:
                x, y = a + found[0] * (b - a)
                one, two = Node(float(x), float(y), (i, found[0])), Node(float(x), float(y), (j, found[1]))
                one.twin, two.twin = two, one
                of_subject.append(one)
                of_clip.append(two)
    if not of_subject:
        return _without_crossings(subject, clip)
    nodes = link(subject, of_subject, clip)
    link(clip, of_clip, subject)
    rings = []
    for start in nodes:
        if start.twin is not None and not start.is_used:
            rings.append(_walk(start, 2 * (len(subject) + len(clip) + 2 * len(of_subject))))
    return rings


def _without_crossings(subject: FloatArray, clip: FloatArray) -> list[FloatArray]:
    for inner, outer in ((subject, clip), (clip, subject)):
        if by_half_line(inner[:1], outer, np.array([0, len(outer)]))[0]:
            return [inner]
    return []


def _walk(start: Node, n_steps: int) -> FloatArray:
    """Follow the boundary of the intersection from a crossing, changing ring at each crossing, and return it as a ring
    (n, 2). n_steps: nodes visited at most, since wrong marks may never lead back."""
    ring, node, forward = [], start, True
    for _ in range(n_steps):
        node.is_used = True
        if node.twin is not None:
            node.twin.is_used = True
        ring.append((node.x, node.y))
        forward = node.is_entry if node.twin is not None else forward
        step = node.after if forward else node.before
        assert step is not None
        node = step
        if node.twin is not None:
            node = node.twin
        if node is start or node.twin is start:
            break
    found: FloatArray = np.array(ring)
    return found
