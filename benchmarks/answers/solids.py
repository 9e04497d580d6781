"""Solids of every type with hard query points, drawn from a chunk's numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

import engine
from benchmarks.answers import shapes
from benchmarks.answers.draws import HOME, Array, Draw, Place, put


class Shape(NamedTuple):
    """A solid, and points on or near its boundary."""

    solid: Any
    targets: Array


def half_space(draw: Draw, dimension: int, place: Place = HOME) -> Shape:
    row, targets = _row(draw, dimension, place)
    return Shape(engine.HalfSpace(row[:-1], row[-1]), targets)


def _row(draw: Draw, dimension: int, place: Place) -> tuple[Array, Array]:
    """Return a row whose plane passes through lattice points or near others, and such points."""
    normal = draw.spots(1, dimension)[0]
    normal[0] += 0.0 if normal.any() else 1.0
    along = np.zeros((dimension, dimension))
    along[0, :2] = along[-1, :2] = -normal[1], normal[0]
    along[-1] *= 0.5
    if dimension == 3:
        along[1] = 0.0, -normal[2], normal[1]
    targets = put(draw.spots(1, dimension)[0] + along, place)
    offset = 0.0
    for a, x in zip(normal.tolist(), targets[0].tolist()):
        offset -= a * x
    return np.append(normal, offset), targets


def convex(draw: Draw, dimension: int, place: Place = HOME) -> Shape:
    """Up to twelve planes anywhere: bounded, unbounded, flat or empty; or a bounded one around a place."""
    rows, targets = zip(*[_row(draw, dimension, place) for _ in range(draw.one(2, 12))])
    planes = np.array(rows)
    if draw.chance(0.5):  # all turned towards one place
        inner = put(draw.spots(1, dimension)[0], place)
        side = planes[:, -1].copy()
        for axis in range(dimension):
            side = side + planes[:, axis] * inner[axis]
        planes = planes * np.where(side < 0.0, -1.0, 1.0)[:, None]
    return Shape(engine.Convex(planes), np.concatenate(targets))


def sphere(draw: Draw, dimension: int, place: Place = HOME) -> Shape:
    center, radius = draw.spots(1, dimension)[0], draw.pick([0.0, 1.0, 3.0, 5.0, 1 / 3])
    if draw.chance(0.3):
        radius = float(draw.unit(1)[0]) * 4.0
    rays = np.array([(1, 0, 0), (0, -1, 0), (0.6, 0.8, 0), (-0.8, 0.6, 0), (1 / 3, 2 / 3, 2 / 3), (0, 0, 0)])
    rays = np.concatenate([rays[: 4 if dimension == 2 else 6, :dimension]])
    ball = engine.Sphere(put(center, place), radius * place[0])
    return Shape(ball, put(center + radius * rays, place))


def aabb(draw: Draw, dimension: int, place: Place = HOME) -> Shape:
    ends = np.sort(draw.spots(2, dimension), axis=0)
    if draw.chance(0.1):
        ends[1, 0] = ends[0, 0]
    low, high = put(ends, place)
    return Shape(engine.Aabb(low, high), shapes.corners(low, high))


def triangle(draw: Draw, dimension: int, place: Place = HOME) -> Shape:
    vertices = put(draw.spots(3, dimension), place)
    return Shape(engine.Triangle(vertices), vertices)


def polygon(draw: Draw, dimension: int = 2, place: Place = HOME) -> Shape:
    return polygon_of(draw.pick(shapes.RINGS)(draw), place)


def polygon_of(rings: shapes.Rings, place: Place = HOME) -> Shape:
    moved = [put(ring, place) for ring in rings]
    ends = np.concatenate(moved)
    return Shape(engine.Polygon(moved), np.concatenate([ends, ends * 0.5 + np.roll(ends, 1, axis=0) * 0.5]))


def polyhedron(draw: Draw, dimension: int = 3, place: Place = HOME) -> Shape:
    if draw.chance(0.1):
        return polyhedron_of(shapes.box(draw, quads=True), place)
    return polyhedron_of(draw.pick(shapes.MESHES)(draw), place)


def polyhedron_of(mesh: shapes.Mesh, place: Place = HOME, kind: Any = engine.Polyhedron) -> Shape:
    vertices, faces = put(mesh[0], place), mesh[1]
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return Shape(kind(vertices, faces), np.concatenate([vertices, a * 0.5 + b * 0.5, a * 0.5 + b * 0.25 + c * 0.25]))


def prism(draw: Draw, dimension: int = 3, place: Place = HOME) -> Shape:
    """A prism over a comb or a star: faces of many vertices, mostly not convex."""
    ring = shapes.comb(draw) if draw.chance(0.5) else shapes.coast(draw, draw.one(5, 12))
    n = len(ring)
    walls = [[k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n)]
    vertices = np.concatenate(
        [np.pad(ring, ((0, 0), (0, 1)), constant_values=z) for z in (-1.0, draw.pick([1.0, 1 / 3]))]
    )
    order = draw.order(3)
    solid = engine.Polyhedron(put(vertices[:, order], place), [list(range(n))[::-1], list(range(n, 2 * n)), *walls])
    a, b = solid.vertices, np.roll(solid.vertices, 1, axis=0)
    return Shape(solid, np.concatenate([a, a * 0.5 + b * 0.5]))


def surface(draw: Draw, dimension: int = 3, place: Place = HOME) -> Shape:
    """An open surface: part of a mesh."""
    vertices, faces = draw.pick(shapes.MESHES)(draw)
    remaining = faces[: draw.one(1, len(faces))]
    used, renamed = np.unique(remaining, return_inverse=True)
    return polyhedron_of((vertices[used], renamed.reshape(remaining.shape)), place, engine.Surface)


def implicit(draw: Draw, dimension: int, place: Place = HOME) -> Shape:
    if draw.chance(0.2):
        return Shape(engine.Implicit.from_callable(_inside_disc, dimension), draw.spots(9, dimension))
    powers = draw.whole(0, 3, draw.one(1, 6), dimension)
    factors = draw.spots(len(powers), 2)[:, 0]
    return Shape(engine.Implicit(powers=powers, coefficients=factors), put(draw.spots(12, dimension), place))


def _inside_disc(points: Array) -> Array:
    with np.errstate(over="ignore"):
        return 9.0 - (points[:, 0] * points[:, 0] + points[:, 1] * points[:, 1])


def csg(draw: Draw, dimension: int, place: Place = HOME) -> Shape:
    operation = draw.pick(["union", "intersection", "difference"])
    n_operands = 2 if operation == "difference" else draw.one(1, 4)
    parts = [draw.pick(LEAVES[dimension])(draw, dimension, place) for _ in range(n_operands)]
    tree = engine.Csg(operation, [part.solid for part in parts])
    if draw.chance(0.4):
        tree = engine.Csg(draw.pick(["union", "difference"]), [tree, parts[0].solid])
    return Shape(tree, np.concatenate([part.targets for part in parts]))


Maker = Callable[..., Shape]
LEAVES: dict[int, tuple[Maker, ...]] = {
    2: (half_space, sphere, aabb, convex, triangle, polygon, implicit),
    3: (half_space, sphere, aabb, convex, triangle, polyhedron, implicit),
}
LOCATED = {dimension: (*leaves, csg) for dimension, leaves in LEAVES.items()}
COLLIDED: dict[int, tuple[Maker, ...]] = {
    2: (polygon, triangle, aabb, sphere, half_space),
    3: (polyhedron, surface, aabb, sphere, half_space),
}
REGIONS: dict[int, tuple[Maker, ...]] = {
    2: (half_space, aabb, convex, sphere, polygon),
    3: (half_space, aabb, convex, sphere, polyhedron),
}


def each(draw: Draw, makers: dict[int, tuple[Maker, ...]], places: Sequence[Place]) -> Iterator[Shape]:
    """Yield a shape of every maker, each at a place of its own."""
    for dimension, some in makers.items():
        for maker in some:
            yield maker(draw, dimension, draw.pick(places))


def pose(draw: Draw, dimension: int, place: Place = HOME) -> engine.Pose:
    return engine.Pose(draw.rotation(dimension), draw.spots(1, dimension)[0] * draw.pick([0.0, 0.25, 1.0]) * place[0])


def points_about(draw: Draw, targets: Array, n: int) -> Array:
    """Return n points: random, on targets, an ulp off, aligned with targets, between them, of any exponent."""
    d, low, high = targets.shape[1], targets.min(axis=0), targets.max(axis=0)
    a, b = targets[draw.whole(0, len(targets) - 1, n)], targets[draw.whole(0, len(targets) - 1, n)]
    anywhere = low + (high - low) * (draw.unit(n, d) * 1.25 - 0.125)
    lined = np.where(draw.unit(n, d) < 0.5, a, np.where(draw.unit(n, d) < 0.5, b, anywhere))
    between = a * 0.5 + b * 0.5
    wild = np.ldexp(draw.unit(n, d) - 0.5, draw.whole(-1100, 900, n, 1).astype(np.int32)) * draw.whole(0, 1, n, d)
    ways = np.stack([anywhere, anywhere, a, draw.nudged(a), lined, draw.nudged(lined), between, draw.nudged(between),
                     np.rint(anywhere), wild])  # fmt: skip
    return ways[draw.whole(0, len(ways) - 1, n), np.arange(n)]
