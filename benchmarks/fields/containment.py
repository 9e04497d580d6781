"""Points in polyhedra, polygons and convex solids: easy points, and points on and beside the boundary."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from typing import Any

import numpy as np

import engine
from benchmarks import memory, workloads
from benchmarks.contenders import Prepared, make
from benchmarks.contest import Contender, Contest, Goals, contender
from benchmarks.errors import REFUSED, locations, same
from benchmarks.fields import Figure, Size, Task
from benchmarks.workloads import (
    Bodies,
    Mesh,
    MissingDataError,
    Planes,
    Rings,
    bumpy_sphere,
    extent_of,
    generator,
    hard_sets,
    stored_mesh,
)

N_EXACT = 2000


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of containment."""
    yield _easy_3d(seed, scale)
    hard = _hard_3d(scale)
    if hard is not None:
        yield hard
    yield from _plane(seed, scale)
    yield from _convex(seed, scale)
    yield _triangle(seed, scale)


def _n_exact(scale: float) -> int:
    return int(N_EXACT * min(1, 4 * scale))


# --- polyhedra --------------------------------------------------------------------------------------------------------


def _easy_3d(seed: int, scale: float) -> Contest:
    try:
        mesh = stored_mesh("igl_bunny")
    except MissingDataError:
        mesh = bumpy_sphere("bumpy", seed, 4)
    source = generator("report containment 3d", seed)
    points = source.uniform(mesh.vertices.min(0), mesh.vertices.max(0), (int(200_000 * scale), 3))
    exact = locations(points[: _n_exact(scale)], mesh)
    about = f"uniform in the box of {mesh.name}, {len(mesh.faces):,} faces"
    return Contest("containment 3D", "uniform", False, points, exact, same, on_mesh(mesh), about)


def _hard_3d(scale: float) -> Contest | None:
    try:
        files = hard_sets()
    except MissingDataError:
        return None
    meshes, owners, points, exact = [], [], [], []
    step = max(1, int(1 / scale))
    for path in files:
        arrays = np.load(path)
        meshes.append(Mesh(path.stem, arrays["vertices"], arrays["faces"].astype(np.int64)))
        points.append(arrays["points"][::step])
        owners.append(np.full(len(points[-1]), len(meshes) - 1))
        exact.append(arrays["location"][::step] >= 0)
    mixed = np.random.default_rng(0).permutation(sum(map(len, points)))  # so that the first items are of every mesh
    owner, rows = np.concatenate(owners)[mixed], np.concatenate(points)[mixed]
    about = "on vertices, edges and faces and ulps beside them, offsets to 1e9, slivers, non-manifold meshes"
    return Contest(
        "containment 3D", "boundary", True, np.arange(len(rows)), np.concatenate(exact)[mixed], same,
        [_on_many(each, meshes, owner, rows) for each in on_mesh(meshes[0])], about,
    )  # fmt: skip


MESH_PEERS = (
    ("ours", "ours", "points"),
    ("ours, plain signs in cells", "plain_signs", "points"),
    ("textbook: half-line", "textbook", "points"),
    ("textbook: another half-line", "textbook", "recast"),
    ("Open3D occupancy", "open3d", "points"),
    ("trimesh + embreex", "trimesh", "points"),
    ("libigl winding number", "igl", "points"),
    ("VTK enclosed points", "vtk", "points"),
    ("CGAL side of mesh", "cgal", "points"),
)


def on_mesh(mesh: Mesh) -> list[Contender]:
    """Return the contenders on one mesh."""
    return [contender(*names, mesh) for names in MESH_PEERS]


def _on_many(one: Contender, meshes: list[Mesh], owner: np.ndarray, points: np.ndarray) -> Contender:
    """Return a contender whose items are rows of `points`, each asked of the mesh that owns it."""
    module, kind = next(names[1:] for names in MESH_PEERS if names[0] == one.name)

    def build() -> Prepared:
        made = [_or_refusal(module, kind, mesh) for mesh in meshes]

        def ask(rows: np.ndarray) -> np.ndarray:
            found = np.empty(len(rows), np.int8)
            for i_mesh, prepared in enumerate(made):
                mine = np.flatnonzero(owner[rows] == i_mesh)
                if len(mine):
                    found[mine] = prepared.answer(prepared.ask(prepared.native(points[rows[mine]])))
            return found

        return Prepared(ask, share=made[-1].share)

    return Contender(one.name, build, one.package)


def _or_refusal(module: str, kind: str, mesh: Mesh) -> Prepared:
    """Return a contender on a mesh; where it refuses the mesh, what refuses every point."""
    try:
        return make(module, kind, mesh)
    except (ImportError, OSError):
        raise
    except Exception:  # whatever a peer raises
        return Prepared(lambda points: np.full(len(points), REFUSED))


# --- polygons ---------------------------------------------------------------------------------------------------------


def _gear(n_teeth: int) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, 4 * n_teeth, endpoint=False)
    radii = np.where(np.arange(4 * n_teeth) % 4 < 2, 64.0, 48.0)
    return np.round(np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1), 2)


def beside_edges(ring: np.ndarray, n_points: int, ulps: np.ndarray, source: np.random.Generator) -> np.ndarray:
    """Return points near random edges, moved in y by so many ulps (one value or one for each)."""
    edges = source.integers(len(ring), size=n_points)
    t = source.uniform(size=(n_points, 1))
    points = ring[edges] * (1 - t) + np.roll(ring, -1, axis=0)[edges] * t
    points[:, 1] += ulps * np.spacing(np.abs(points[:, 1]))
    return points


def _hard_2d(ring: np.ndarray, n_points: int, source: np.random.Generator) -> np.ndarray:
    on_edges = beside_edges(ring, n_points // 2, source.integers(-2, 3, n_points // 2), source)
    level = np.stack([source.uniform(-70, 70, n_points // 4), source.choice(ring[:, 1], n_points // 4)], axis=1)
    return np.concatenate([on_edges, level, source.choice(ring, n_points // 4)])[
        source.permutation(n_points // 2 + 2 * (n_points // 4))
    ]


def _plane(seed: int, scale: float) -> Iterator[Contest]:
    source, ring = generator("report containment 2d", seed), _gear(25)
    rings, n_points = Rings("gear", [ring]), int(200_000 * scale)
    for is_hard, points in (
        (False, source.uniform(-64, 64, (n_points, 2))),
        (True, _hard_2d(ring, n_points // 10, source)),
    ):
        name = "boundary" if is_hard else "uniform"
        exact = locations(points[: _n_exact(scale)], rings)
        about = f"a gear of {len(ring)} vertices" + (", on its edges, vertices and level with them" if is_hard else "")
        yield Contest("containment 2D", name, is_hard, points, exact, same, on_polygon(rings), about)


def on_polygon(rings: Rings) -> list[Contender]:
    """Return those that take any simple polygon."""
    return [
        contender("ours", "ours", "points", rings),
        contender("textbook: half-line", "textbook", "points", rings),
        contender("shapely, prepared", "shapely", "points", rings, 1),
        contender("matplotlib Path", "matplotlib", "points", rings),
    ]


def _convex(seed: int, scale: float) -> Iterator[Contest]:
    source = generator("report convex", seed)
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    rings = Rings("16-gon", [np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    n_points = int(100_000 * scale)
    near = beside_edges(rings.rings[0], n_points // 10, source.integers(-2, 3, n_points // 10), source)
    books = {"signed angles": "signed angles", "unsigned angles, 1e-6": "unsigned angles", "same side": "same side"}
    for is_hard, asked in ((False, source.uniform(-1, 1, (n_points, 2))), (True, near)):
        exact = locations(asked[: _n_exact(scale)], rings)
        contenders = [contender("ours", "ours", "points", rings)]
        contenders += [contender(f"textbook: {name}", "textbook", kind, rings) for name, kind in books.items()]
        name = "boundary" if is_hard else "uniform"
        yield Contest("containment, convex polygon", name, is_hard, asked, exact, same, contenders, "16 vertices")
    normals = source.normal(size=(20, 3))
    planes = Planes("20 planes", np.hstack([normals, np.ones((20, 1))]))
    points = source.uniform(-1, 1, (n_points, 3))
    onto = points - normals[:1] * ((points @ normals[0] + 1) / (normals[0] @ normals[0]))[:, None]
    for is_hard, asked in ((False, points), (True, onto[: n_points // 10])):
        exact = locations(asked[: _n_exact(scale)], planes)
        yield Contest(
            "containment, half-spaces", "on a plane" if is_hard else "uniform", is_hard, asked, exact, same,
            [
                contender("ours", "ours", "points", planes),
                contender("textbook: half-spaces", "textbook", "points", planes),
                contender("numpy", "numpy", "points", planes),
            ],
            "20 random planes",
        )  # fmt: skip


def _triangle(seed: int, scale: float) -> Contest:
    """The prism over a triangle in space; half of the points on its walls, as far as doubles go."""
    source = generator("report triangle", seed)
    corners = source.integers(-8, 9, (3, 3)).astype(float)
    n_points = int(50_000 * scale)
    weights = source.dirichlet((1, 1, 1), n_points)
    weights[::2, 0] = 0.0
    points = (weights / weights.sum(axis=1, keepdims=True)) @ corners
    points += source.integers(-2, 3, (n_points, 1)) * np.cross(corners[1] - corners[0], corners[2] - corners[0])
    solid = engine.Triangle(corners)
    exact = _exact_prism(points[: _n_exact(scale)], corners)
    return Contest(
        "containment, triangle in space", "on its walls", True, points, exact, same,
        [
            contender("ours", "ours", "points", solid),
            contender("textbook: cross and dot", "textbook", "cross and dot", solid),
            contender("textbook: projection", "textbook", "projection", solid),
        ],
        "the prism over a triangle; half of the points beside its walls",
    )  # fmt: skip


def _exact_prism(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    from tests.reference.containment import locate

    solid = {"type": "triangle", "vertices": corners.tolist()}
    return np.array([locate(point, solid) >= 0 for point in points.tolist()])


# --- the table --------------------------------------------------------------------------------------------------------

MESHES = {  # against Open3D: uniform points, points near the surface
    "1k": ((10.0, 20.0), (6.0, 12.0)),
    "86k": ((20.0, 30.0), (6.0, 12.0)),
    "1.38M": ((30.0, 50.0), (7.0, 12.0)),
}
POLYGONS = {10: (12.0, 25.0), 1_000: (20.0, 25.0), 100_000: (15.0, 25.0)}


def table(size: Size) -> Iterator[Task]:
    """Yield the rows of the table."""
    for faces, goals in list(MESHES.items())[: size.of(3, 1)]:
        for place, goal in zip(("uniform", "near"), goals, strict=True):
            yield f"{faces} faces, {place}", partial(_mesh, size, faces, place, goal)
    faces = "1k" if size.is_quick else "86k"
    yield f"build, {faces} faces", partial(_from_arrays, size, faces, 0)
    for n_points in (1, 1_000):
        yield f"first {n_points}, {faces} faces", partial(_from_arrays, size, faces, n_points)
    for n_vertices, goal in list(POLYGONS.items())[: size.of(3, 2)]:
        for place in ("uniform", "near"):
            yield f"polygon of {n_vertices:,}, {place}", partial(_polygon, size, n_vertices, place, goal)
    for n_planes in (6, 20, 100):
        yield f"convex of {n_planes} planes", partial(_planes, size, n_planes)
    for what, n_bodies in (("polygons", size.of(10_000, 1_000)), ("polyhedra", size.of(1_000, 27))):
        yield f"scene of {n_bodies:,} {what}", partial(_scene, size, what, n_bodies, False)
        yield f"scene of {n_bodies:,} {what}, first time", partial(_scene, size, what, n_bodies, True)
    for name in workloads.simple_solids():
        for place in ("uniform", "boundary"):
            yield f"{name}, {place}", partial(_simple, size, name, place)


def figures(size: Size) -> Iterator[Task]:
    """Yield what is no contest."""
    for faces in ("1k",) if size.is_quick else ("86k", "1.38M"):
        yield f"memory of the build, {faces} faces", partial(_memory, size, faces)


def _contest(
    name: str, points: np.ndarray, subject: Any, contenders: list[Contender], is_judged: bool = True
) -> Contest:
    settle = (lambda rows: locations(points[rows], subject)) if is_judged else None
    return Contest("containment", name, False, points, settle, same, contenders)


def _points(size: Size, subject: Mesh | Rings, place: str) -> np.ndarray:
    draw = workloads.uniform_points if place == "uniform" else workloads.near_points
    return draw(subject, size.of(1_000_000, 50_000), size.seed)


def _mesh(size: Size, faces: str, place: str, goals: Goals) -> Contest:
    mesh = workloads.mesh_of_size(faces, size.seed)
    contenders = [
        contender("ours", "ours", "points", mesh),
        contender("Open3D occupancy", "open3d", "points", mesh, goals=goals),
        contender("ours, plain signs in cells", "plain_signs", "points", mesh),
    ]
    return _contest(f"{faces} faces, {place}", _points(size, mesh, place), mesh, contenders)


def _from_arrays(size: Size, faces: str, n_points: int) -> Contest:
    """Everything from arrays; the build: asked so much that every structure is built."""
    mesh = workloads.mesh_of_size(faces, size.seed)
    points = workloads.uniform_points(mesh, n_points or memory.points_that_pay(len(mesh.faces)), size.seed)
    name = f"first {n_points}, {faces} faces" if n_points else f"build, {faces} faces"
    contenders = [contender("ours", "ours", "points", mesh, is_new=True)]
    contenders.append(contender("Open3D occupancy", "open3d", "points", mesh, is_new=True))
    return Contest("containment", name, False, points, None, same, contenders, count=len(points))


def _polygon(size: Size, n_vertices: int, place: str, goals: Goals) -> Contest:
    rings = workloads.star_polygon(n_vertices, size.seed)
    goals = goals if place == "uniform" else (5.0, 10.0)
    contenders = [contender("ours", "ours", "points", rings)]
    contenders.append(contender("shapely, prepared", "shapely", "points", rings, goals=goals))
    return _contest(f"polygon of {n_vertices:,}, {place}", _points(size, rings, place), rings, contenders)


def _planes(size: Size, n_planes: int) -> Contest:
    planes = workloads.convex_planes(n_planes, size.seed)
    points = workloads.uniform_points(planes, size.of(1_000_000, 50_000), size.seed)
    contenders = [contender("ours", "ours", "points", planes)]
    contenders.append(contender("numpy", "numpy", "points", planes, goals=(4.0, 8.0)))
    return _contest(f"convex of {n_planes} planes", points, planes, contenders)


@cache
def _bodies(what: str, n_bodies: int, seed: int) -> Bodies:
    return (workloads.polygon_scene if what == "polygons" else workloads.polyhedron_scene)(n_bodies, seed)


def _scene(size: Size, what: str, n_bodies: int, is_new: bool) -> Contest:
    """Answers are told apart by how many bodies hold a point, and the sum of their numbers."""
    bodies = _bodies(what, n_bodies, size.seed)
    points = workloads.uniform_points(bodies, size.of(1_000_000, 30_000), size.seed)
    peer, goals = {"polygons": ("shapely", (3.0, 10.0)), "polyhedra": ("open3d", (5.0, 20.0))}[what]
    name = {"shapely": "shapely STRtree", "open3d": "Open3D occupancy"}[peer]
    each = [("ours", "ours", (None, None)), (name, peer, (None, None) if is_new else goals)]
    contenders = [
        contender(shown, module, "scene", bodies, goals=goal, is_new=is_new) for shown, module, goal in each
    ]  # fmt: skip
    told = [Contender(one.name, partial(_summed, one, n_bodies), one.package, goals=one.goals) for one in contenders]
    boxes = np.array([extent_of(body) for body in bodies.bodies])

    def exact(rows: np.ndarray) -> np.ndarray:
        found = []
        for point in points[rows]:
            near = np.flatnonzero(((boxes[:, 0] <= point) & (point <= boxes[:, 1])).all(axis=1)).tolist()
            held = [number for number in near if locations(point[None], bodies.bodies[number])[0]]
            found.append((len(held), sum(held)))
        return np.array(found)

    shown = f"scene of {n_bodies:,} {what}" + (", first time" if is_new else "")
    return Contest(
        "containment", shown, False, points, None if is_new else exact, _same_rows, told, count=len(points) * is_new
    )


def _summed(one: Contender, n_bodies: int) -> Prepared:
    made = one.make()

    def answer(found: tuple[int, Any]) -> np.ndarray:
        owners, held = np.divmod(made.answer(found[1]), n_bodies)
        return np.stack([np.bincount(owners, weights, found[0]) for weights in (None, held)], axis=1)

    return Prepared(
        lambda asked: (asked[0], made.ask(asked[1])),
        lambda points: (len(points), made.native(points)),
        answer,
        made.memory,
    )


def _same_rows(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    return same((answers != exact).any(axis=1), np.zeros(len(exact)))


def _simple(size: Size, name: str, place: str) -> Contest:
    """Points of the cube; on the boundary: of a lattice of quarters, and ulps off it. Ours alone."""
    solid, draw = workloads.simple_solids()[name], generator(f"rows/{name}", size.seed)
    n_points = size.of(500_000, 50_000) // (1 if place == "uniform" else 5)
    points = draw.uniform(-1.5, 1.5, (n_points, solid.dimension))
    if place == "boundary":
        points = np.round(points * 4) / 4
        points += draw.integers(-2, 3, points.shape) * np.spacing(np.maximum(np.abs(points), 0.25))
    return _contest(f"{name}, {place}", points, solid, [contender("ours", "ours", "points", solid)], False)


def _memory(size: Size, faces: str) -> Figure:
    found, peer = (memory.of_build(module, faces, size.seed, 2) for module in ("ours", "open3d"))
    note = ", ".join(f"{key} {value}" for key, value in found.items() if key != "peak") + f"; Open3D: {peer}"
    must, aim = (640.0, 250.0) if faces == "1.38M" else (None, None)
    return Figure(f"memory of the build, {faces} faces", "MB", [found.get("peak", np.nan) / 1e6], must, aim, note)
