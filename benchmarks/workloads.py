"""Named, seeded inputs. The same name and seed give the same bits.

Real meshes are read from the shared data folder beside the repository; where it is absent, a generated mesh of the same
size stands in, under its own name. Nothing is fetched.
"""

from __future__ import annotations

import gzip
import json
import os
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import engine
from benchmarks.answers.shapes import subdivided

DATA = Path(os.environ.get("GEOMETRY_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
NEAR = 1e-4
"""Standard deviation of points near a surface, as part of the largest extent."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A closed triangle mesh."""

    name: str
    vertices: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Rings:
    """A polygon."""

    name: str
    rings: list[np.ndarray]


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Many bodies of one kind."""

    name: str
    bodies: list


Subject = Mesh | Rings | Bodies | engine.Solid


class MissingDataError(Exception):
    """A workload needs the shared data folder."""


def generator(name: str, seed: int) -> np.random.Generator:
    """Return the random numbers of a workload: they depend on its name and the seed only."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def data(name: str) -> Path:
    """Return a file or folder of the shared data."""
    if not (DATA / name).exists():
        raise MissingDataError(f"{name} is in the shared data folder, which is not here")
    return DATA / name


def stored_mesh(name: str) -> Mesh:
    """Return a mesh of the shared data folder."""
    arrays = np.load(data(f"meshes/{name}.npz"))
    return Mesh(name, arrays["vertices"], arrays["faces"].astype(np.int64))


def packed(name: str) -> Any:
    """Return what a compressed JSON file of the shared data folder holds."""
    return json.loads(gzip.decompress(data(name).read_bytes()))


@cache
def hard_pairs() -> list[dict[str, Any]]:
    """Return the pairs of bodies of the hard set, with their exact relations."""
    return packed("hard_collision/cases.json.gz")


def bumpy_sphere(name: str, seed: int, times: int) -> Mesh:
    """Return a sphere of 20 * 4**times triangles with bumps, star-shaped."""
    g = (1 + 5**0.5) / 2
    vertices = np.array(
        [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g],
         [0, -1, -g], [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]]
    )  # fmt: skip
    faces = np.array(
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
         [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
         [8, 6, 7], [9, 8, 1]]
    )  # fmt: skip
    for _ in range(times):
        vertices, faces = subdivided((vertices, faces))
    unit = vertices / np.linalg.norm(vertices, axis=1)[:, None]
    waves = generator(name, seed).normal(size=(12, 3)) * 3.0
    radii = 1.0 + 0.03 * np.sin(unit @ waves.T).sum(axis=1)
    return Mesh(name, np.ascontiguousarray(unit * radii[:, None]), faces)


def stored_or_bumpy(name: str, times: int, seed: int) -> Mesh:
    """Return a stored mesh, or where there are no data a bumpy sphere of 20 * 4**times faces under its own name."""
    try:
        return stored_mesh(name)
    except MissingDataError:
        return bumpy_sphere(f"bumpy_sphere_{20 * 4**times}", seed, times)


@cache
def mesh_of_size(size: str, seed: int) -> Mesh:
    """Return the mesh of `1k`, `86k` or `1.38M` faces: knight, armadillo, armadillo subdivided, or stand-ins."""
    if size == "1k":
        return stored_or_bumpy("igl_decimated-knight", 3, seed)
    result = stored_or_bumpy("igl_armadillo", 6, seed)
    if size == "86k":
        return result
    return Mesh(f"{result.name}_subdivided2", *subdivided(subdivided((result.vertices, result.faces))))


def ring_around(angles: np.ndarray, radii: Any = 1.0) -> np.ndarray:
    """Return points (..., 2) around the origin."""
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=-1)


def star_polygon(n_vertices: int, seed: int) -> Rings:
    """Return a polygon around the origin like a coast: radii of many wavelengths, random angles."""
    name = f"star_{n_vertices}"
    random = generator(name, seed)
    angles = np.sort(random.uniform(0.0, 2.0 * np.pi, n_vertices))
    if np.diff(angles).max() > np.pi / 2:  # few vertices: a gap would leave the origin out
        angles = (np.arange(n_vertices) + random.uniform(0.0, 0.9, n_vertices)) * (2.0 * np.pi / n_vertices)
    # roughness of about the spacing: more, and every horizontal line would meet thousands of edges
    radii = 1.0 + random.uniform(-1.0, 1.0, n_vertices) * min(0.1, 6.0 / n_vertices)
    for wave in range(2, max(3, min(40, n_vertices // 4))):
        radii += np.sin(wave * angles + random.uniform(0.0, 7.0)) / (2.0 * wave**1.5)
    return Rings(name, [ring_around(angles, radii)])


def convex_of(n_planes: int, seed: int) -> engine.Convex:
    """Return planes that touch the unit sphere from outside; six of them are the cube."""
    if n_planes == 6:
        normals = np.concatenate([np.eye(3), -np.eye(3)])
    else:
        normals = generator(f"convex_{n_planes}", seed).normal(size=(n_planes, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
    return engine.Convex(np.ascontiguousarray(np.column_stack([-normals, np.ones(n_planes)])))


def polygon_scene(n_bodies: int, seed: int) -> Bodies:
    """Return polygons of 8 to 24 vertices on a jittered square lattice of spacing 1; neighbours overlap a little."""
    name, bodies, side = f"polygons_{n_bodies}", [], int(np.ceil(n_bodies**0.5))
    random = generator(name, seed)
    for i_body in range(n_bodies):
        n = int(random.integers(8, 25))
        angles = (np.arange(n) + random.uniform(0.0, 0.9, n)) * (2.0 * np.pi / n)
        radii = random.uniform(0.35, 0.65, n)
        centre = np.array([i_body % side, i_body // side]) + random.uniform(-0.1, 0.1, 2)
        bodies.append(Rings("", [centre + ring_around(angles, radii)]))
    return Bodies(name, bodies)


def polyhedron_scene(n_bodies: int, seed: int) -> Bodies:
    """Return bumpy spheres of 1,280 faces, each of its own shape, on a jittered cubic lattice; neighbours overlap."""
    name, bodies, side = f"polyhedra_{n_bodies}", [], int(np.ceil(n_bodies ** (1 / 3)))
    random = generator(name, seed)
    for i_body in range(n_bodies):
        mesh = bumpy_sphere(f"{name}_{i_body}", seed, 3)
        place = np.array([i_body % side, i_body // side % side, i_body // side**2]) + random.uniform(-0.1, 0.1, 3)
        bodies.append(Mesh("", mesh.vertices * 0.5 + place, mesh.faces))
    return Bodies(name, bodies)


def extent_of(subject: Subject) -> tuple[np.ndarray, np.ndarray]:
    """Return low and high of the box that points are drawn from."""
    match subject:
        case Mesh(vertices=vertices):
            return vertices.min(axis=0), vertices.max(axis=0)
        case Rings(rings=rings):
            return np.concatenate(rings).min(axis=0), np.concatenate(rings).max(axis=0)
        case Bodies(bodies=bodies):
            boxes = np.array([extent_of(body) for body in bodies])
            return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    return np.full(subject.dimension, -1.2), np.full(subject.dimension, 1.2)


def points_in_box(subject: Subject, n_points: int, seed: int) -> np.ndarray:
    """Return points uniform in the subject's box, in random order."""
    low, high = extent_of(subject)
    return generator(f"{getattr(subject, 'name', '')}/uniform", seed).uniform(low, high, (n_points, len(low)))


def points_near(subject: Mesh | Rings, n_points: int, seed: int) -> np.ndarray:
    """Return points at a normal distribution of `NEAR` of the size about random places of the boundary."""
    random = generator(f"{subject.name}/near", seed)
    if isinstance(subject, Mesh):
        corners = subject.vertices[subject.faces]
        sizes = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    else:
        ends = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in subject.rings]
        corners = np.concatenate(ends)
        sizes = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    chosen = random.choice(len(sizes), n_points, p=sizes / sizes.sum())
    weights = random.dirichlet(np.ones(corners.shape[1]), n_points)
    points = (corners[chosen] * weights[:, :, None]).sum(axis=1)
    low, high = extent_of(subject)
    return points + random.normal(size=points.shape) * (NEAR * (high - low).max())


def segments_of(kind: str, dimension: int, n: int, seed: int) -> np.ndarray:
    """Return n segments near the cube from -1 to 1, or a region of about its size.

    random: ends in a cube of twice the size. corner, edge: through corners or places on edges, missed by about 1e-16.
    ulp: ends on the planes and up to four units in the last place off, on a lattice. tangent: to the unit sphere.
    """
    draw = generator(f"segments/{kind}", seed)
    if kind == "random":
        return draw.uniform(-2.0, 2.0, (n, 2, dimension))
    if kind == "ulp":
        ends = draw.integers(-4, 5, (n, 2, dimension)) * 0.5
        return ends + draw.integers(-4, 5, ends.shape) * np.spacing(np.maximum(np.abs(ends), 0.5))
    if kind == "tangent":
        touch = draw.normal(size=(n, 3))
        touch /= np.linalg.norm(touch, axis=1, keepdims=True)
        along = np.cross(touch, draw.normal(size=(n, 3)))
        return np.stack([touch - along, touch + along * draw.uniform(0.5, 2, (n, 1))], axis=1)
    targets = draw.choice([-1.0, 1.0], (n, dimension))
    if kind == "edge":
        targets[np.arange(n), draw.integers(0, dimension, n)] = draw.uniform(-1.0, 1.0, n)
    directions = draw.uniform(-1.0, 1.0, (n, 1, dimension))
    return targets[:, None] + directions * draw.uniform(0.5, 2.0, (n, 2, 1)) * np.array([[-1.0], [1.0]])


def segments_through_edges(solid: engine.Convex, n: int, seed: int) -> np.ndarray:
    """Return segments through the common line of two planes of a solid."""
    draw, segments, planes = generator("segments/planes", seed), np.empty((n, 2, 3)), solid.planes
    for segment in segments:
        first, second = planes[draw.choice(len(planes), 2, replace=False)]
        third = draw.normal(size=4)  # through the point that both share with a random plane
        at = np.linalg.solve(np.stack([first, second, third])[:, :3], -np.array([first[3], second[3], third[3]]))
        direction = draw.normal(size=3)
        segment[:] = at - direction, at + direction
    return segments


def star_rings(size: int, dimension: int, n_rings: int, seed: int) -> np.ndarray:
    """Return rings (n_rings, size, dimension): stars in the plane, turned anyhow in space, so hardly ever planar."""
    draw = generator(f"polygons/{size}/{dimension}", seed)
    angles = np.sort(draw.uniform(0.0, 2.0 * np.pi, (n_rings, size)), axis=1)
    rings = ring_around(angles) * draw.uniform(0.6, 1.0, (n_rings, size, 1))
    if dimension == 3:
        turns = np.linalg.qr(draw.normal(size=(n_rings, 3, 3)))[0]
        rings = rings @ turns[:, :2]
    return np.ascontiguousarray(rings + draw.uniform(-1.2, 1.2, (n_rings, 1, dimension)))


SIMPLE: dict[str, Callable[[], engine.Solid]] = {
    "aabb 2D": lambda: engine.Aabb([-1.0] * 2, [1.0] * 2),
    "aabb 3D": lambda: engine.Aabb([-1.0] * 3, [1.0] * 3),
    "sphere 2D": lambda: engine.Sphere([0.0] * 2, 1.0),
    "sphere 3D": lambda: engine.Sphere([0.0] * 3, 1.0),
    "half-space 2D": lambda: engine.HalfSpace([1.0, 2.0], 0.5),
    "half-space 3D": lambda: engine.HalfSpace([1.0, 2.0, 3.0], 0.5),
    "convex 2D": lambda: engine.Convex(np.hstack([ring_around(np.arange(12) * np.pi / 6), np.ones((12, 1))])),
    "triangle 2D": lambda: engine.Triangle([[-1.0, -1], [1, -0.5], [0, 1]]),
    "triangle 3D": lambda: engine.Triangle([[-1.0, -1, 0], [1, -0.5, 0.5], [0, 1, -0.5]]),
    "implicit 3D": lambda: engine.Implicit(
        powers=[[2, 0, 0], [0, 2, 0], [0, 0, 2], [0, 0, 0]], coefficients=[-1.0, -2.0, -0.5, 1.0]
    ),
    "csg 3D": lambda: engine.Csg("difference", [SIMPLE["aabb 3D"](), SIMPLE["sphere 3D"]()]),
}
"""A solid of every type without faces, each about the cube from -1 to 1."""


def document(solid: engine.Solid | Mesh | Rings) -> dict[str, Any]:
    """Return a solid as requests have it, and as tests/reference reads it."""
    match solid:
        case Mesh():
            return _document_of(solid)
        case Rings():
            return {"type": "polygon", "rings": [ring.tolist() for ring in solid.rings]}
        case engine.Polygon():
            rest: dict[str, Any] = {"rings": np.split(solid.vertices, solid.ring_offsets[1:-1])}
        case engine.Polyhedron() | engine.Surface():
            rest = {"vertices": solid.vertices, "faces": np.split(solid.face_indices, solid.face_offsets[1:-1])}
        case engine.Implicit():
            terms = zip(solid.powers.tolist(), solid.coefficients.tolist())
            rest = {"terms": [{"powers": powers, "coefficient": factor} for powers, factor in terms]}
        case engine.Csg():
            rest = {"operation": solid.operation, "operands": [document(operand) for operand in solid.operands]}
        case _:
            rest = {name: getattr(solid, name) for name in NAMES[solid.type]}
    return {"type": solid.type} | {name: _listed(value) for name, value in rest.items()}


@cache
def _document_of(mesh: Mesh) -> dict[str, Any]:
    return {"type": "polyhedron", "vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist()}


def _listed(value: Any) -> Any:
    if isinstance(value, list):
        return [_listed(each) for each in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


NAMES = {"half_space": ("normal", "offset"), "sphere": ("center", "radius"), "aabb": ("min", "max"),
         "convex": ("planes",), "triangle": ("vertices",)}  # fmt: skip
"""Members of solids that are numbers and arrays only."""
