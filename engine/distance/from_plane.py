"""Distances of a body from a half-space, by its vertices: a linear function over a body is greatest at one of them.

With v(x) = n . (R x + t) + d, positive within the half-space, and the greatest value v at a vertex, the distance is
-v / |n|. Floats select the vertices that may have it, double-doubles measure them, correctly rounded where bounds
prove it.

**Bound.** A weight w_j = sum_i n_i R_ij is three exact products and three sums, each off by 4 u^2 of all its terms, a
value three products of a double-double and a double and three sums more, so that 64 u^2 of all terms bounds the error
of v; 128 u^2 is allowed. What underflows is less than 2^-1070 (1 + |x|) in all. A float value is off by 2^-50 of all
terms w_j x_j; 2^-49 is allowed.

**Ties.** Of vertices with equal values the first is named. Along an axis of the body they are equal where that
coordinate is, and with a power of two as normal the value is a sum of three doubles, mostly exact; else the others must
be proven to be farther.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Final

import numpy as np

from engine.bounding.aabb import corners_of_box
from engine.collision.simple.form_relations import source_of
from engine.compiling.jit import called, entry_of, inline, kernel
from engine.distance.closed_forms import (
    UNSURE,
    Wide,
    gap_of_values,
    is_power_of_two,
    less,
    plus,
    product,
    times,
    value_on_axis,
)
from engine.distance.spreads import radius_of
from engine.predicates.error_free import U2, workspace
from engine.running.budget import Budget
from engine.solids.base import Solid
from engine.solids.mesh import Mesh
from engine.solids.primitives import Aabb, HalfSpace, Sphere
from engine.solids.ragged import ascending
from engine.types import FlagArray, FloatArray, IntArray, read_only

_TINY: Final = 2.0**-1060
_LOWEST: Final = -(2.0**600)
"""Below all values that are measured."""


def gaps_from_plane(
    plane: HalfSpace, body: Solid, motions: tuple[FloatArray, FloatArray], flag: FlagArray
) -> tuple[FloatArray, IntArray]:
    """Return what `gaps_of_plane` says of a body with vertices under n poses, motions (n, d, d) and (n, d)."""
    n = len(motions[0])
    distances, extremes = np.full(n, UNSURE), np.full(n, -1)
    entry_of(gaps_of_plane)(plane.row, corners_of(body)[0], radius_of(body), *motions, distances, extremes, flag)
    return distances, extremes


def fill_gaps_from_plane(
    plane: HalfSpace, body: Solid, motions: tuple[FloatArray, FloatArray], least: Fraction | None, answers: FloatArray,
    budget: Budget,
) -> None:  # fmt: skip
    """Fill answers (n,), NaN on entry, with the distances that are proven; given `least`, with 0.0 for nearer ones and
    infinity for others."""
    distances, _ = gaps_from_plane(plane, body, motions, budget.flag)
    budget.check()
    is_known = distances != UNSURE
    if least is not None:
        bound = float(least)
        is_known &= distances != bound
        distances = np.where(distances > bound, np.inf, 0.0)
    answers[is_known] = distances[is_known]


def corners_of(body: Solid) -> tuple[FloatArray, IntArray]:
    """Return the vertices (n, d) of a mesh that its faces use, or of a box, a polygon or a triangle, or the centre of a
    ball, and their numbers, ascending. Cached."""

    def build() -> tuple[FloatArray, IntArray]:
        if isinstance(body, Mesh):
            numbers = ascending(body.triangles)
            return (body.vertices if len(numbers) == len(body.vertices) else read_only(body.vertices[numbers])), numbers
        if isinstance(body, Aabb):
            return read_only(corners_of_box(body.min, body.max)), np.arange(1 << body.dimension)
        vertices = body.center[None] if isinstance(body, Sphere) else body.vertices  # type: ignore[attr-defined]
        return read_only(vertices), np.arange(len(vertices))

    return body.prepared("corners by number", build)


@kernel
def gaps_of_plane(
    row: FloatArray, vertices: FloatArray, radius: float, turns: FloatArray, moves: FloatArray, distances: FloatArray,
    extremes: IntArray, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill distances (n,) of a body with vertices (m, d), or of balls of a radius about them, under n poses from the
    half-space row (d + 1,): n, d with n . x + d >= 0. 0.0 where they provably meet, UNSURE where nothing is proven.
    extremes (n,): the nearest vertex, the first of several as near, -1 if unproven. Returns early when the flag is
    set."""
    d, square, reach = moves.shape[1], Wide(0.0, 0.0), workspace(3)
    for k in range(d):
        square, reach[k] = plus(square, product(row[k], row[k])), 0.0
    for vertex in range(vertices.shape[0]):
        for k in range(d):
            reach[k] = max(reach[k], abs(vertices[vertex, k]))
    for item in range(distances.shape[0]):
        if flag[0] != 0:
            return
        value, slack, extremes[item] = _nearest(row, vertices, turns[item], moves[item], reach)
        distances[item] = gap_of_values(value, square, slack, radius)


@inline
def _along_axis(row: FloatArray, turn: FloatArray) -> tuple[int, int]:
    """Return (k, m) if the value of a vertex x, but for what is the same of all, is n_k R_km x_m with R_km = +-1; else
    (-1, -1)."""
    axis, n_axes = 0, 0
    for k in range(turn.shape[0]):
        if row[k] != 0.0:
            axis, n_axes = k, n_axes + 1
    source = source_of(turn, axis)[0] if n_axes == 1 else -1
    return (axis, source) if source >= 0 else (-1, -1)


@inline
def _is_higher(vertices: FloatArray, vertex: int, other: int, axis: int, weight: float) -> bool:
    x, y = vertices[vertex, axis], vertices[other, axis]
    return x > y if weight > 0.0 else x < y


@called
def _nearest(
    row: FloatArray, vertices: FloatArray, turn: FloatArray, move: FloatArray, reach: FloatArray
) -> tuple[Wide, float, int]:
    """Return (v, slack, vertex): the greatest value of all vertices, a bound on its error, infinite out of range, and
    the first vertex that has it, -1 if unproven. reach: the largest magnitude of each coordinate."""
    d, w, (axis, source) = move.shape[0], workspace(6), _along_axis(row, turn)
    level, terms, spread, size = Wide(float(row[d]), 0.0), abs(float(row[d])), 0.0, 1.0
    for j in range(3):
        w[2 * j] = w[2 * j + 1] = 0.0
    for j in range(d):
        weight, weight_terms = Wide(0.0, 0.0), 0.0
        for i in range(d):
            weight, weight_terms = plus(weight, product(row[i], turn[i, j])), weight_terms + abs(row[i] * turn[i, j])
        w[2 * j], w[2 * j + 1] = weight.h, weight.low
        spread, size = spread + weight_terms * reach[j], size + reach[j]
        level, terms = plus(level, product(row[j], move[j])), terms + abs(row[j] * move[j])
    if not terms + spread < 2.0**500 or not size < 2.0**500:
        return level, np.inf, -1
    slack = 128.0 * U2 * (terms + spread) + _TINY * size
    highest = -np.inf
    for vertex in range(vertices.shape[0]):
        z = vertices[vertex, 2] if d == 3 else 0.0
        highest = max(highest, w[0] * vertices[vertex, 0] + w[2] * vertices[vertex, 1] + w[4] * z)
    highest -= 2.0**-48 * spread + _TINY * size
    most, second, best = Wide(_LOWEST, 0.0), Wide(_LOWEST, 0.0), -1
    for vertex in range(vertices.shape[0]):
        x, y, z = vertices[vertex, 0], vertices[vertex, 1], (vertices[vertex, 2] if d == 3 else 0.0)
        if not w[0] * x + w[2] * y + w[4] * z >= highest:
            continue
        if source >= 0 and best >= 0 and not _is_higher(vertices, vertex, best, source, w[2 * source]):
            continue  # case: along an axis equal values are equal coordinates
        here = plus(level, times(Wide(w[0], w[1]), Wide(x, 0.0)))
        here = plus(here, times(Wide(w[2], w[3]), Wide(y, 0.0)))
        here = plus(here, times(Wide(w[4], w[5]), Wide(z, 0.0)))
        if source >= 0 or here.h > most.h or (here.h == most.h and here.low > most.low):
            most, second, best = here, most, vertex
        elif here.h > second.h or (here.h == second.h and here.low > second.low):
            second = here
    if source < 0:
        return most, slack, best if less(most, second).h > 2.0 * slack else -1
    if best >= 0 and is_power_of_two(row[axis]):
        turned = vertices[best, source] * turn[axis, source]
        value, is_exact = value_on_axis(row[d], row[axis], turned, move[axis])
        if is_exact:
            return value, 0.0, best
    return most, slack, best
