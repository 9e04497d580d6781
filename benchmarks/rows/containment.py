"""Points in every type of solid, uniform, near and on the boundary; builds, first answers, scenes, the hard set."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache, partial

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.rows import Question, Run, Size, asked_before
from benchmarks.workloads import Bodies, Mesh, MissingDataError, Rings

THREADS = 2


def questions(size: Size) -> Iterator[Question]:
    """Yield the rows of containment."""
    for faces in ("1k",) if size.is_quick else ("1k", "86k", "1.38M"):
        for place in ("uniform", "near"):
            yield Question(f"containment, polyhedron of {faces}, {place}", partial(_mesh, size, faces, place))
    for n_vertices in (10, 1_000) if size.is_quick else (10, 1_000, 100_000):
        for place in ("uniform", "near"):
            yield Question(f"containment, polygon of {n_vertices}, {place}", partial(_polygon, size, n_vertices, place))
    for name in simple_solids():
        for place in ("uniform", "boundary"):
            yield Question(f"containment, {name}, {place}", partial(_simple, size, name, place))
    for n_planes in (6, 20, 100):
        yield Question(f"containment, convex of {n_planes}, uniform", partial(_convex, size, n_planes))
    faces = "1k" if size.is_quick else "86k"
    yield Question(f"containment, build, polyhedron of {faces}", partial(_build, size, faces))
    for n_points in (1, 1_000):
        for first in dict.fromkeys(("1k", faces)):
            yield Question(
                f"containment, first {n_points}, polyhedron of {first}", partial(_first, size, first, n_points)
            )
    yield Question("containment, first 1000, polygon of 1000", partial(_first_polygon, size, 1_000))
    for what, n_bodies in (("polygons", size.of(10_000, 1_000)), ("polyhedra", size.of(1_000, 27))):
        yield Question(f"containment, scene of {n_bodies} {what}, asked again", partial(_scene, size, what, n_bodies))
    yield Question("containment, scene of polyhedra, first time", partial(_first_scene, size))
    yield Question("containment, posed scene of polyhedra", partial(_posed_scene, size))
    yield Question("containment, hard set", partial(_hard, size))


def _points(size: Size, subject: Mesh | Rings, place: str) -> np.ndarray:
    draw = workloads.uniform_points if place == "uniform" else workloads.near_points
    return draw(subject, size.of(500_000, 50_000), size.seed)


def _asked(points: np.ndarray, solid: engine.Solid) -> Run:
    return asked_before(lambda: engine.locate(points, solid, workers=THREADS))


@lru_cache(maxsize=1)
def _settled(faces: str, seed: int) -> engine.Polyhedron:
    """Return a solid that has been asked so much that all it ever builds is there."""
    mesh = workloads.mesh_of_size(faces, seed)
    solid = engine.Polyhedron(mesh.vertices, mesh.faces)
    engine.locate(workloads.uniform_points(mesh, 8 * len(mesh.faces) + (1 << 17), seed), solid, workers=THREADS)
    return solid


def _mesh(size: Size, faces: str, place: str) -> Run:
    points = _points(size, workloads.mesh_of_size(faces, size.seed), place)
    return _asked(points, _settled(faces, size.seed))


def _polygon(size: Size, n_vertices: int, place: str) -> Run:
    rings = workloads.star_polygon(n_vertices, size.seed)
    return _asked(_points(size, rings, place), engine.Polygon(rings.rings))


def simple_solids() -> dict[str, engine.Solid]:
    """Return a solid of every type without faces, each about the unit cube."""
    axes = {(1, 0, 0): 1.0, (0, 1, 0): 1.0, (0, 0, 1): 1.0, (1, 1, 1): 0.5}
    return {
        "aabb 2D": engine.Aabb([-1.0] * 2, [1.0] * 2),
        "aabb 3D": engine.Aabb([-1.0] * 3, [1.0] * 3),
        "sphere 2D": engine.Sphere([0.0] * 2, 1.0),
        "sphere 3D": engine.Sphere([0.0] * 3, 1.0),
        "half-space 2D": engine.HalfSpace([1.0, 2.0], 0.5),
        "half-space 3D": engine.HalfSpace([1.0, 2.0, 3.0], 0.5),
        "convex 2D": engine.Convex(_planes_2d(12)),
        "triangle 2D": engine.Triangle([[-1.0, -1], [1, -0.5], [0, 1]]),
        "triangle 3D": engine.Triangle([[-1.0, -1, 0], [1, -0.5, 0.5], [0, 1, -0.5]]),
        "implicit 3D": engine.Implicit(powers=[list(axis) for axis in axes], coefficients=list(axes.values())),
        "csg 3D": engine.Csg(
            "difference", [engine.Aabb([-1.0] * 3, [1.0] * 3), engine.Csg("union", [engine.Sphere([0.0] * 3, 1.0)])]
        ),
    }


def _planes_2d(n_lines: int) -> np.ndarray:
    angles = np.linspace(0.0, 2.0 * np.pi, n_lines, endpoint=False)
    return np.stack([np.cos(angles), np.sin(angles), np.ones(n_lines)], axis=1)


def _simple(size: Size, name: str, place: str) -> Run:
    """Points of the cube; on the boundary: of a lattice of quarters, and ulps off it."""
    solid, draw = simple_solids()[name], workloads.generator(f"rows/{name}", size.seed)
    n_points = size.of(500_000, 50_000) // (1 if place == "uniform" else 5)
    points = draw.uniform(-1.5, 1.5, (n_points, solid.dimension))
    if place == "boundary":
        points = np.round(points * 4) / 4
        points += draw.integers(-2, 3, points.shape) * np.spacing(np.maximum(np.abs(points), 0.25))
    return _asked(points, solid)


def _convex(size: Size, n_planes: int) -> Run:
    planes = workloads.convex_planes(n_planes, size.seed)
    points = workloads.uniform_points(planes, size.of(500_000, 50_000), size.seed)
    return _asked(points, engine.Convex(planes.rows))


def _build(size: Size, faces: str) -> Run:
    """A new solid every time, asked so much that everything is built."""
    mesh = workloads.mesh_of_size(faces, size.seed)
    points = workloads.uniform_points(mesh, 8 * len(mesh.faces) + (1 << 17), size.seed)
    return lambda: engine.locate(points, engine.Polyhedron(mesh.vertices, mesh.faces), workers=THREADS)


def _first(size: Size, faces: str, n_points: int) -> Run:
    mesh = workloads.mesh_of_size(faces, size.seed)
    points = workloads.uniform_points(mesh, n_points, size.seed)
    return lambda: engine.locate(points, engine.Polyhedron(mesh.vertices, mesh.faces), workers=THREADS)


def _first_polygon(size: Size, n_vertices: int) -> Run:
    rings = workloads.star_polygon(n_vertices, size.seed)
    points = workloads.uniform_points(rings, 1_000, size.seed)
    return lambda: engine.locate(points, engine.Polygon(rings.rings), workers=THREADS)


def _bodies(size: Size, what: str, n_bodies: int) -> tuple[Bodies, list[engine.Solid]]:
    if what == "polygons":
        scene = workloads.polygon_scene(n_bodies, size.seed)
        return scene, [engine.Polygon(body.rings) for body in scene.bodies]
    scene = workloads.polyhedron_scene(n_bodies, size.seed)
    return scene, [engine.Polyhedron(body.vertices, body.faces) for body in scene.bodies]


def _scene(size: Size, what: str, n_bodies: int) -> Run:
    scene, solids = _bodies(size, what, n_bodies)
    points = workloads.uniform_points(scene, size.of(300_000, 30_000), size.seed)
    return asked_before(lambda: engine.locate_scene(points, solids, workers=THREADS), 3)


def _first_scene(size: Size) -> Run:
    scene = workloads.polyhedron_scene(27, size.seed)
    points = workloads.uniform_points(scene, 20_000, size.seed)

    def run() -> object:
        solids = [engine.Polyhedron(body.vertices, body.faces) for body in scene.bodies]
        return engine.locate_scene(points, solids, workers=THREADS)

    return run


def _posed_scene(size: Size) -> Run:
    scene, solids = _bodies(size, "polyhedra", 27)
    draw = workloads.generator("rows/posed scene", size.seed)
    turns = np.linalg.qr(draw.normal(size=(len(solids), 3, 3)))[0]
    turns[np.linalg.det(turns) < 0, 0] *= -1.0
    poses = [engine.Pose(turn, draw.uniform(-0.2, 0.2, 3)) for turn in turns]
    points = workloads.uniform_points(scene, size.of(100_000, 10_000), size.seed)
    return asked_before(lambda: engine.locate_scene(points, solids, poses, workers=THREADS), 3)


def _hard(size: Size) -> Run:
    """The points of the hard set; where there are no data, corners and middles of edges of a generated mesh."""
    try:
        cases = [np.load(path) for path in workloads.hard_sets()]
        asked = [(case["points"], engine.Polyhedron(case["vertices"], case["faces"])) for case in cases]
    except MissingDataError:
        mesh = workloads.bumpy_sphere("rows/hard", size.seed, 4)
        middles = 0.5 * mesh.vertices[mesh.faces[:, 0]] + 0.5 * mesh.vertices[mesh.faces[:, 1]]
        points = np.concatenate([mesh.vertices, middles])
        asked = [(points, engine.Polyhedron(mesh.vertices, mesh.faces))]
    return asked_before(lambda: [engine.locate(points, solid, workers=THREADS) for points, solid in asked])
