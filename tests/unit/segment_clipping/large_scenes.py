"""Generated scenes without end: regions of every kind, segments and contours that make clipping on them hard.

A scene is made around the origin, about as large as a unit, then moved and scaled with what is clipped: far away, into
the largest numbers, into the denormal ones. Rounding on the way makes other scenes, no less awkward.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from engine.solids.base import Solid
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere
from engine.types import FloatArray
from tests.unit.segment_clipping.scenes import nudged, through

Random = np.random.Generator

PLACES = [(1.0, 0.0)] * 10 + [
    (1.0, 1e6),
    (1.0, 1e9),
    (1e-3, 1e9),
    (2.0**1000, 0.0),
    (1e300, 0.0),
    (2.0**-950, 0.0),
    (1e-300, 0.0),
    (5e-324 * 64, 0.0),
]
"""Scale and offset of a scene; half of all stay where they are."""
CUBE = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
PRISM = [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]]


class Shape(NamedTuple):
    """A region in the making: rows, a box, a ball, rings or faces, and points where it is hard to cut."""

    kind: str
    data: Any
    targets: FloatArray


def on_lattice(rng: Random) -> bool:
    return bool(rng.random() < 0.5)


def row_shape(rng: Random, n: int, dimension: int) -> Shape:
    if on_lattice(rng):
        normals, offsets = rng.integers(-2, 3, (n, dimension)).astype(float), rng.integers(0, 4, n).astype(float)
        normals[~normals.any(axis=1), 0] = 1.0
    else:
        normals, offsets = rng.normal(size=(n, dimension)), rng.uniform(0.0, 1.5, n)
    if n > 2 and rng.random() < 0.2:  # nearly parallel, repeated, flat
        normals[1], offsets[1] = nudged(rng, normals[0]), offsets[0]
        normals[2] = -normals[0] if rng.random() < 0.5 else normals[0]
    targets = [-normal * offset / (normal @ normal) for normal, offset in zip(normals, offsets)]
    for chosen in itertools.islice(itertools.combinations(range(n), dimension), 20):
        rows = normals[list(chosen)]
        with np.errstate(divide="ignore"):
            volume = abs(np.linalg.det(rows))
        if volume > 0.1:
            targets.append(np.linalg.solve(rows, -offsets[list(chosen)]).round(12) + 0.0)
    return Shape("rows", np.c_[normals, offsets], np.array(targets))


def half_space(rng: Random, dimension: int) -> Shape:
    return row_shape(rng, 1, dimension)


def convex(rng: Random, dimension: int) -> Shape:
    """Up to twelve planes; now and then up to a hundred around a ball, a long cascade."""
    if rng.random() < 0.97:
        return row_shape(rng, int(rng.integers(2, 12)), dimension)
    normals = rng.normal(size=(int(rng.integers(20, 101)), dimension))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offsets = np.full(len(normals), 1.0) if on_lattice(rng) else rng.uniform(0.9, 1.1, len(normals))
    return Shape("rows", np.c_[normals, offsets], -normals * offsets[:, None])


def aabb(rng: Random, dimension: int) -> Shape:
    if on_lattice(rng):
        low = rng.integers(-2, 1, dimension).astype(float)
        high = low + rng.integers(0, 4, dimension)
    else:
        low = rng.uniform(-1.5, 0, dimension)
        high = low + rng.uniform(0, 2, dimension) * (rng.random(dimension) < 0.95)
    signs = np.array(list(itertools.product([0.0, 0.5, 1.0], repeat=dimension)))
    return Shape("aabb", (low, high), low + signs * (high - low))


def sphere(rng: Random, dimension: int) -> Shape:
    if on_lattice(rng):
        center, radius = rng.integers(-1, 2, dimension).astype(float), 1.25
        units = np.array(
            [[1, 0, 0], [0, -1, 0], [0.6, 0.8, 0], [-0.8, 0, 0.6], [0.28, -0.96, 0], [2 / 3, 2 / 3, 1 / 3]]
        )
        units = units[:, :dimension]
    else:
        center, radius = rng.uniform(-1, 1, dimension), float(rng.uniform(0.1, 1.5) * (rng.random() < 0.95))
        units = rng.normal(size=(6, dimension))
    units = units / np.linalg.norm(units, axis=1)[:, None]
    return Shape("sphere", (center, radius), np.concatenate([center + radius * units, center[None]]))


def edge_targets(rings: list[FloatArray]) -> FloatArray:
    return np.concatenate([[*ring, *(ring + np.roll(ring, 1, axis=0)) / 2] for ring in rings])


def polygon(rng: Random, dimension: int) -> Shape:
    """Lattice rings that cross, touch and overlap, stars, rings with holes, spikes."""
    rings = []
    for _ in range(int(rng.integers(1, 4))):
        n = int(rng.integers(3, 9))
        if on_lattice(rng):
            ring = rng.integers(-2, 3, (n, 2)).astype(float)
            rings.append(ring if n > 3 or (ring[0] != ring[-1]).any() else ring + np.array([[0, 0], [0, 0], [1, 0]]))
        else:
            angles = np.sort(rng.uniform(0, 2 * np.pi, n))
            rings.append(rng.uniform(0.3, 2, (n, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    return Shape("polygon", rings, edge_targets(rings))


def hull_faces(points: FloatArray) -> list[list[int]]:
    """Return the hull's triangles of integral points no four of which share a plane; none where some do."""
    faces = []
    whole = points.astype(np.int64)
    for i, j, k in itertools.combinations(range(len(points)), 3):
        normal = np.cross(whole[j] - whole[i], whole[k] - whole[i])
        sides = np.sign((np.delete(whole, [i, j, k], axis=0) - whole[i]) @ normal)
        if not sides.all():
            return []
        if abs(sides.sum()) == len(sides):
            faces.append([i, j, k] if sides[0] < 0 else [i, k, j])
    return faces


def convex_polyhedron(rng: Random, dimension: int) -> Shape:
    choice = rng.integers(0, 4)
    if choice == 0:  # a box
        low = rng.uniform(-1.5, 0, 3) if on_lattice(rng) else -rng.integers(0, 2, 3).astype(float)
        faces, points = CUBE, low + np.array(list(itertools.product([0.0, 1.0], repeat=3))) * 1.5
    elif choice == 1:  # a lattice prism, its sides slanted
        base, lift = rng.integers(-2, 3, (3, 3)).astype(float), rng.integers(-2, 3, 3).astype(float)
        points, faces = np.concatenate([base, base + lift]), PRISM
        if (base[1] - base[0]) @ np.cross(base[2] - base[0], lift) < 0:
            points = points[[0, 2, 1, 3, 5, 4]]
        if np.linalg.det(np.stack([base[1] - base[0], base[2] - base[0], lift])) == 0:
            return convex_polyhedron(rng, dimension)
    else:
        size = 3 if choice == 2 else 2**17  # products fit int64
        points = rng.integers(-size, size + 1, (int(rng.integers(4, 9)), 3)).astype(float)
        faces = hull_faces(points)
        if not faces:
            return convex_polyhedron(rng, dimension)
        points = points * (2.0 / size)
        used = sorted({i for face in faces for i in face})
        points, faces = points[used], [[used.index(i) for i in face] for face in faces]
    return Shape("polyhedron", (points, faces), face_targets(points, faces))


def polyhedron(rng: Random, dimension: int) -> Shape:
    """A cube with a pyramid pushed in or out of some faces, and other bodies beside, inside or across it."""
    parts = []
    for _ in range(int(rng.integers(1, 3))):
        if rng.random() < 0.3:
            parts.append(convex_polyhedron(rng, dimension).data)
            continue
        corners = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
        corners = corners + (rng.integers(-1, 2, 3) if on_lattice(rng) else rng.uniform(-0.4, 0.4, (8, 3)))
        points, faces = list(corners), []
        for face in CUBE:
            if rng.random() < 0.5 or not on_lattice(rng):
                tip = np.round(corners[face].mean(axis=0) * rng.uniform(0.1, 1.6), int(rng.integers(0, 9)))
                points.append(tip)
                faces += [[face[k - 1], face[k], len(points) - 1] for k in range(4)]
            else:
                faces += [[face[0], face[1], face[2]], [face[0], face[2], face[3]]]
        parts.append((np.array(points), faces))
    found, starts = [], np.cumsum([0, *(len(points) for points, _ in parts)])
    for start, (_, faces) in zip(starts, parts):
        found += [[int(start) + i for i in face] for face in faces]
    points = np.concatenate([points for points, _ in parts])
    return Shape("polyhedron", (points, found), face_targets(points, found))


def face_targets(points: FloatArray, faces: list[list[int]]) -> FloatArray:
    middles = [points[face].mean(axis=0) for face in faces]
    return np.concatenate([points, edge_targets([points[face] for face in faces]), middles])


def placed(rng: Random, shape: Shape, scale: float, offset: float) -> Solid:
    """Return the region at its place; rows times powers of two of their own now and then."""
    match shape.kind:
        case "rows":
            rows = shape.data.copy()
            rows[:, -1] = rows[:, -1] * scale - rows[:, :-1].sum(axis=1) * offset
            if scale == 1.0 and rng.random() < 0.2:
                rows *= 2.0 ** rng.integers(-300, 300, (len(rows), 1))
            return Convex(rows) if len(rows) > 1 else HalfSpace(rows[0, :-1], float(rows[0, -1]))
        case "aabb":
            return Aabb(*(corner * scale + offset for corner in shape.data))
        case "sphere":
            return Sphere(shape.data[0] * scale + offset, shape.data[1] * scale)
        case "polygon":
            return Polygon([ring * scale + offset for ring in shape.data])
    points, faces = shape.data
    return Polyhedron(points * scale + offset, faces)


def segments_on(rng: Random, shape: Shape, n: int) -> FloatArray:
    """Return 8 n segments: free, lattice, through targets, between them, along faces, tiny, long, mixed."""
    targets = shape.targets
    dimension = targets.shape[1]
    some = targets[rng.integers(0, len(targets), (3, n, 2))]
    grazing = through(rng, targets, n)
    grazing[:, 1] = grazing[:, 0] + along_faces(rng, shape, n) * rng.choice([-1.0, 1.0, 3.0], (n, 1))
    families = [
        rng.uniform(-2, 2, (n, 2, dimension)),
        rng.integers(-3, 4, (n, 2, dimension)).astype(float),
        through(rng, targets, n),
        nudged(rng, some[0]),
        nudged(rng, grazing, 1),
        some[1][:, :1] + rng.uniform(-1, 1, (n, 2, dimension)) * 10.0 ** rng.integers(-17, -3, (n, 2, 1)),
        some[2] * rng.choice([1.0, 1.0 + 2.0**-52, 1.0 - 2.0**-53, 2.0], (n, 2, 1)),
        rng.uniform(-2, 2, (n, 2, dimension)) * 10.0 ** rng.integers(-9, 10, (n, 2, dimension)),
    ]
    return np.concatenate(families)


def along_faces(rng: Random, shape: Shape, n: int) -> FloatArray:
    """Return directions that lie in a face, or touch a ball where they start."""
    dimension = shape.targets.shape[1]
    free = rng.uniform(-1, 1, (n, dimension))
    match shape.kind:
        case "rows" | "sphere":
            normals = shape.data[:, :-1] if shape.kind == "rows" else shape.targets - shape.data[0]
            normals = normals[rng.integers(0, len(normals), n)]
            if dimension == 2:
                return np.stack([-normals[:, 1], normals[:, 0]], axis=1)
            return np.cross(normals, free)
        case "aabb":
            return free * rng.integers(0, 2, (n, dimension))
        case "polygon":
            ring = shape.data[0]
            return (ring - np.roll(ring, 1, axis=0))[rng.integers(0, len(ring), n)]
    points, faces = shape.data
    chosen = [points[faces[int(i)]] for i in rng.integers(0, len(faces), n)]
    weights = rng.integers(-1, 2, (n, 2, 1))
    return np.array([weights[i, 0] * (f[1] - f[0]) + weights[i, 1] * (f[2] - f[0]) for i, f in enumerate(chosen)])


def contours_on(rng: Random, shape: Shape, n: int) -> list[list[FloatArray]]:
    """Return 7 n polygons of one to three contours, in space hardly ever planar."""
    targets = shape.targets
    dimension = targets.shape[1]

    def ring() -> FloatArray:
        size = int(rng.integers(1, 9)) if rng.random() < 0.1 else int(rng.integers(3, 9))
        match int(rng.integers(0, 7)):
            case 0:
                return rng.uniform(-2, 2, (size, dimension))
            case 1:
                return rng.integers(-2, 3, (size, dimension)).astype(float)
            case 2:
                return nudged(rng, rng.integers(-2, 3, (size, dimension)).astype(float))
            case 3:  # a float-rotated square: flat only before rounding
                frame = np.linalg.qr(rng.normal(size=(dimension, dimension)))[0][:2] * rng.uniform(0.5, 2)
                return np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) @ frame + rng.integers(-1, 2, dimension)
            case 4:  # edges through corners and along edges of the region
                through_targets = through(rng, targets, (size + 1) // 2).reshape(-1, dimension)
                return through_targets[:size]
            case 5:  # vertices on planes, edges and corners
                return targets[rng.integers(0, len(targets), size)]
        exponents = rng.integers(-9, 10, (size, dimension))
        return rng.uniform(-2, 2, (size, dimension)) * 10.0**exponents

    return [[ring() for _ in range(1 + int(rng.integers(0, 5)) // 3)] for _ in range(7 * n)]


SHAPES: dict[str, Callable[[Random, int], Shape]] = {
    "half_space": half_space,
    "aabb": aabb,
    "convex": convex,
    "convex_polyhedron": convex_polyhedron,
    "sphere": sphere,
    "polygon": polygon,
    "polyhedron": polyhedron,
}


def scene_of_segments(rng: Random, kind: str, n: int) -> tuple[Solid, FloatArray]:
    """Return a region and 8 n segments, all finite."""
    scale, offset = PLACES[int(rng.integers(0, len(PLACES)))]
    shape = SHAPES[kind](rng, dimension_of(rng, kind))
    with np.errstate(over="ignore", under="ignore"):
        region, segments = placed(rng, shape, scale, offset), segments_on(rng, shape, n) * scale + offset
    return region, segments[np.isfinite(segments).all(axis=(1, 2))]


def scene_of_contours(rng: Random, kind: str, n: int) -> tuple[Solid, list[list[FloatArray]]]:
    """Return a region and up to 7 n polygons, all finite."""
    scale, offset = PLACES[int(rng.integers(0, len(PLACES)))]
    shape = SHAPES[kind](rng, dimension_of(rng, kind))
    with np.errstate(over="ignore", under="ignore"):
        region = placed(rng, shape, scale, offset)
        polygons = [[ring * scale + offset for ring in rings] for rings in contours_on(rng, shape, n)]
    return region, [rings for rings in polygons if all(np.isfinite(ring).all() for ring in rings)]


def dimension_of(rng: Random, kind: str) -> int:
    if kind == "polygon":
        return 2
    return 3 if kind.endswith("polyhedron") else int(rng.integers(2, 4))
