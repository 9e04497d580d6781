"""Points in polyhedra, polygons, convex and all other solids: easy points, and points on and near the boundary."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.contenders import NotApplicable, Prepared, make
from benchmarks.contenders.with_ours import solid_of
from benchmarks.contest import LADDER, RUNG, Contender, Contest, Goals, Size, Task, field_of
from benchmarks.errors import OUTSIDE, REFUSED, locations, same
from benchmarks.workloads import Bodies, Mesh, Rings, document, extent_of, generator

N_EXACT = 2000
MESH_PEERS = ("textbook", "textbook:recast", "open3d", "trimesh", "igl", "cgal")
PAGE_PEERS = (*MESH_PEERS[:3], "open3d@3", "open3d@7", *MESH_PEERS[3:])
"""Open3D also with the majority of 3 and 7 rays a point."""
POLYGON_PEERS = ("textbook", "shapely")
BOOKS = ("textbook:signed angles", "textbook:unsigned angles", "textbook:same side")
MESHES = {  # against Open3D: uniform points, points near the surface
    "1k": ((10.0, 20.0), (6.0, 12.0)),
    "86k": ((20.0, 30.0), (6.0, 12.0)),
    "1.38M": ((30.0, 50.0), (7.0, 12.0)),
}
POLYGONS = {10: (12.0, 25.0), 1_000: (20.0, 25.0), 100_000: (15.0, 25.0)}
SCENES: dict[str, tuple[str, Goals]] = {"polygons": ("shapely", (3.0, 10.0)), "polyhedra": ("open3d", (5.0, 20.0))}


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows."""
    page = {"3D, uniform": _easy_3d, "3D, boundary": _hard_3d, "2D, uniform": _gear, "2D, boundary": _gear,
            "convex polygon, uniform": _convex_polygon, "convex polygon, boundary": _convex_polygon,
            "half-spaces, uniform": _half_spaces, "half-spaces, on a plane": _half_spaces,
            "triangle in space, on its walls": _triangle}  # fmt: skip
    for name, of in page.items():
        yield Task(name, partial(of, size, name), True)
    for faces, goals in list(MESHES.items())[: size.of(3, 1)]:
        for place, goal in zip(("uniform", "near"), goals, strict=True):
            name, mesh = f"{faces} faces, {place}", partial(workloads.mesh_of_size, faces, size.seed)
            yield Task(name, partial(_row, size, name, mesh, place, {"open3d": goal}))
    faces = size.of("86k", "1k")
    yield Task(f"build, {faces} faces", partial(_from_arrays, size, faces, 0))
    for n_points in (1, 1_000):
        yield Task(f"first {n_points}, {faces} faces", partial(_from_arrays, size, faces, n_points))
    for n_vertices, goal in list(POLYGONS.items())[: size.of(3, 2)]:
        for place, goals in (("uniform", goal), ("near", (5.0, 10.0))):
            name, rings = f"polygon of {n_vertices:,}, {place}", partial(workloads.star_polygon, n_vertices, size.seed)
            yield Task(name, partial(_row, size, name, rings, place, {"shapely": goals}))
    for n_planes in (6, 20, 100):
        name, solid = f"convex of {n_planes} planes", partial(workloads.convex_of, n_planes, size.seed)
        yield Task(name, partial(_row, size, name, solid, "uniform", {"numpy": (4.0, 8.0)}))
    for what, n_bodies in (("polygons", size.of(10_000, 1_000)), ("polyhedra", size.of(1_000, 27))):
        for is_new in (False, True):
            name = f"scene of {n_bodies:,} {what}" + ", first time" * is_new
            yield Task(name, partial(_scene, size, name, what, n_bodies, is_new))
    for name in workloads.SIMPLE:
        for place in ("uniform", "boundary"):
            yield Task(f"{name}, {place}", partial(_simple, size, name, place))


def contest(
    name: str, subject: Any, points: np.ndarray, peers: Sequence[str] | Mapping[str, Goals], n_exact: int = 0,
    about: str = "", **more: Any,
) -> Contest:  # fmt: skip
    """Return a contest about points; judged on the first so many, or where contenders differ; of ours alone, not."""
    head, _, tail = name.partition(", ")
    operation, shown = ("containment", name) if not n_exact else (
        f"containment {head}" if head in ("2D", "3D") else f"containment, {head}", tail)  # fmt: skip
    settle = (lambda rows: locations(points[rows], subject)) if peers else None
    exact = settle(slice(n_exact)) if n_exact and settle else settle
    queried, is_hard = field_of("points", subject, peers, **more), bool(n_exact) and tail != "uniform"
    how = partial(request, subject, points) if n_exact else None
    result = Contest(operation, shown, is_hard, points, exact, same, queried, about, request=how)
    if not is_hard:
        return result

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        other = shifted(points[:RUNG], np.ptp(points, axis=0).max(), step)
        return other, locations(other, subject)

    return replace(result, moved=moved, near=nearness(points[:n_exact], subject))


def shifted(points: np.ndarray, size: float | np.ndarray, step: float) -> np.ndarray:
    """Return points moved by so much of a size, in directions drawn at random."""
    directions = generator(f"moved {step}", 0).normal(size=points.shape)
    directions /= np.sqrt((directions**2).sum(axis=-1, keepdims=True))
    return np.asarray(points + step * np.reshape(size, (-1, *[1] * (points.ndim - 1))) * directions)


def nearness(points: np.ndarray, subject: Any) -> float | None:
    """Return how far points are from the boundary of a body: the median, of the largest side of their box; None where
    a body stands for more than itself, as a triangle for the prism over it, and planes for their half-spaces."""
    if isinstance(subject, engine.Triangle | engine.Convex):
        return None
    away = engine.distances(points, solid_of(subject), to="boundary")
    return float(np.median(away) / np.ptp(points, axis=0).max())


def request(subject: Any, points: np.ndarray, item: int) -> tuple[str, dict[str, Any]]:
    """Return path and body that ask about one point."""
    return "/v1/contains", {"solid": document(subject), "points": [points[item].tolist()]}


def _n_exact(size: Size) -> int:
    return size.n(N_EXACT, 500)


# --- the page ---------------------------------------------------------------------------------------------------------


def _easy_3d(size: Size, name: str) -> Contest:
    mesh = workloads.stored_or_bumpy("igl_bunny", 4, size.seed)
    about = f"uniform in the box of {mesh.name}, {len(mesh.faces):,} faces"
    return contest(name, mesh, _points(mesh, "uniform", size, 200_000), PAGE_PEERS, _n_exact(size), about)


def _hard_3d(size: Size, name: str) -> Contest:
    """Points of every mesh of the hard set, mixed, so that the first items are of every mesh."""
    paths, mixed = sorted(workloads.data("hard_containment").glob("*.npz")), generator("mixed", 0)
    meshes, owners, points, inside = [], [], [], []
    for path in paths:
        arrays = np.load(path)
        meshes.append(Mesh(path.stem, arrays["vertices"], arrays["faces"].astype(np.int64)))
        points.append(arrays["points"])
        owners.append(np.full(len(points[-1]), len(meshes) - 1))
        inside.append(arrays["location"] >= 0)
    order = mixed.permutation(sum(map(len, points)))[: size.n(24_000)]
    owner, rows, exact = (np.concatenate(each)[order] for each in (owners, points, inside))
    about = "on vertices, edges and faces and ulps beside them, offsets to 1e9, slivers, non-manifold meshes"
    spans, n_rows = np.array([np.ptp(mesh.vertices, axis=0).max() for mesh in meshes]), len(rows)
    steps = [shifted(rows[:RUNG], spans[owner[:RUNG]], step) for step in LADDER]
    rows, owner = np.concatenate([rows, *steps]), np.concatenate([owner, *[owner[:RUNG]] * len(LADDER)])
    peers = [replace(each, make=partial(_on_many, each, meshes, owner, rows))
             for each in field_of("points", None, PAGE_PEERS)]  # fmt: skip

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        items = n_rows + RUNG * LADDER.index(step) + np.arange(min(RUNG, n_rows))
        return items, np.concatenate([locations(rows[item, None], meshes[owner[item]]) for item in items])

    near = [engine.distances(rows[:1000][owner[:1000] == i], solid_of(mesh), to="boundary") / spans[i]
            for i, mesh in enumerate(meshes)]  # fmt: skip
    return Contest("containment 3D", "boundary", True, np.arange(n_rows), exact[: size.n(4_000, 1_000)], same, peers,
                   about, request=lambda item: request(meshes[owner[item]], rows, item),
                   moved=moved, near=float(np.median(np.concatenate(near))))  # fmt: skip


def _on_many(each: Contender, meshes: list[Mesh], owner: np.ndarray, points: np.ndarray) -> Prepared:
    """Return a contender whose items are rows of `points`, each located in the mesh that owns it."""
    module, kind, _, threads, *setting = each.make.args  # type: ignore[attr-defined]

    def built(mesh: Mesh) -> Prepared:
        try:
            return make(module, kind, mesh, threads, *setting)
        except (ImportError, OSError):
            raise
        except Exception as error:  # whatever a peer raises
            label = OUTSIDE if isinstance(error, NotApplicable) else REFUSED
            return Prepared(lambda points: np.full(len(points), label))

    made = [built(mesh) for mesh in meshes]

    def ask(rows: np.ndarray) -> np.ndarray:
        result = np.empty(len(rows), np.int8)
        for i_mesh in np.unique(owner[rows]):
            mine, prepared = np.flatnonzero(owner[rows] == i_mesh), made[i_mesh]
            result[mine] = prepared.answer(prepared.ask(prepared.native(points[rows[mine]])))
        return result

    return Prepared(ask, share=made[-1].share)


def beside_edges(ring: np.ndarray, n_points: int, ulps: np.ndarray, source: np.random.Generator) -> np.ndarray:
    """Return points near random edges, moved in y by so many ulps (one value or one for each)."""
    edges = source.integers(len(ring), size=n_points)
    t = source.uniform(size=(n_points, 1))
    points = ring[edges] * (1 - t) + np.roll(ring, -1, axis=0)[edges] * t
    points[:, 1] += ulps * np.spacing(np.abs(points[:, 1]))
    return points


def _gear(size: Size, name: str) -> Contest:
    source, n_points = generator("report containment 2d", size.seed), size.n(200_000)
    angles, about = np.linspace(0, 2 * np.pi, 100, endpoint=False), "a gear of 100 vertices"
    ring = np.round(workloads.ring_around(angles, np.where(np.arange(100) % 4 < 2, 64.0, 48.0)), 2)
    points = source.uniform(-64, 64, (n_points, 2))
    if name.endswith("boundary"):
        n, about = n_points // 40, f"{about}, on its edges, vertices and level with them"
        level = np.stack([source.uniform(-70, 70, n), source.choice(ring[:, 1], n)], axis=1)
        on_edges = beside_edges(ring, 2 * n, source.integers(-2, 3, 2 * n), source)
        points = source.permutation(np.concatenate([on_edges, level, source.choice(ring, n)]))
    return contest(name, Rings("gear", [ring]), points, POLYGON_PEERS, _n_exact(size), about)


def _convex_polygon(size: Size, name: str) -> Contest:
    source, n_points = generator("report convex", size.seed), size.n(100_000)
    ring = workloads.ring_around(np.linspace(0, 2 * np.pi, 16, endpoint=False))
    points = source.uniform(-1, 1, (n_points, 2))
    if name.endswith("boundary"):
        points = beside_edges(ring, n_points // 10, source.integers(-2, 3, n_points // 10), source)
    return contest(name, Rings("16-gon", [ring]), points, BOOKS, _n_exact(size), "16 vertices")


def _half_spaces(size: Size, name: str) -> Contest:
    source, n_points = generator("report half-spaces", size.seed), size.n(100_000)
    normals = source.normal(size=(20, 3))
    points = source.uniform(-1, 1, (n_points, 3))
    if name.endswith("plane"):
        distances = (points @ normals[0] + 1) / (normals[0] @ normals[0])
        points = (points - normals[:1] * distances[:, None])[: n_points // 10]
    solid = engine.Convex(np.hstack([normals, np.ones((20, 1))]))
    return contest(name, solid, points, ["textbook:planes", "numpy"], _n_exact(size), "20 random planes")


def _triangle(size: Size, name: str) -> Contest:
    """The prism over a triangle in space; half of the points on its walls, as far as doubles go."""
    source, n_points = generator("report triangle", size.seed), size.n(50_000)
    corners = source.integers(-8, 9, (3, 3)).astype(float)
    weights = source.dirichlet((1, 1, 1), n_points)
    weights[::2, 0] = 0.0
    points = (weights / weights.sum(axis=1, keepdims=True)) @ corners
    points += source.integers(-2, 3, (n_points, 1)) * np.cross(corners[1] - corners[0], corners[2] - corners[0])
    books = ["textbook:cross and dot", "textbook:projection"]
    about = "the prism over a triangle; half of the points beside its walls"
    return contest(name, engine.Triangle(corners), points, books, _n_exact(size), about)


# --- the table --------------------------------------------------------------------------------------------------------


def _points(subject: Any, place: str, size: Size, n: int = 1_000_000) -> np.ndarray:
    draw = workloads.points_in_box if place == "uniform" else workloads.points_near
    return draw(subject, size.n(n), size.seed)


def _row(size: Size, name: str, make: Callable[[], Any], place: str, peers: Mapping[str, Goals]) -> Contest:
    subject = make()
    return contest(name, subject, _points(subject, place, size), peers)


def _from_arrays(size: Size, faces: str, n_points: int) -> Contest:
    """Everything from arrays; the build includes every structure, after enough questions."""
    mesh = workloads.mesh_of_size(faces, size.seed)
    points = workloads.points_in_box(mesh, n_points or 8 * len(mesh.faces) + (1 << 17), size.seed)
    name = f"first {n_points}, {faces} faces" if n_points else f"build, {faces} faces"
    return replace(contest(name, mesh, points, ["open3d"], is_new=True), exact=None, count=len(points))


@cache
def _bodies(what: str, n_bodies: int, seed: int) -> Bodies:
    return (workloads.polygon_scene if what == "polygons" else workloads.polyhedron_scene)(n_bodies, seed)


def _scene(size: Size, name: str, what: str, n_bodies: int, is_new: bool) -> Contest:
    """Points in many bodies; answers are compared as `summed` returns them."""
    bodies, (peer, goals) = _bodies(what, n_bodies, size.seed), SCENES[what]
    points = _points(bodies, "uniform", size)
    result = field_of("scene", bodies, {peer: None if is_new else goals}, is_new=is_new)
    reported = [replace(each, make=partial(summed, each, n_bodies)) for each in result]
    boxes = np.array([extent_of(body) for body in bodies.bodies])

    def exact(rows: np.ndarray) -> np.ndarray:
        contained = []
        for point in points[rows]:
            near = np.flatnonzero(((boxes[:, 0] <= point) & (point <= boxes[:, 1])).all(axis=1)).tolist()
            owners = [number for number in near if locations(point[None], bodies.bodies[number])[0]]
            contained.append((len(owners), sum(owners)))
        return np.array(contained)

    return Contest("containment", name, False, points, None if is_new else exact, same_rows, reported,
                   count=len(points) * is_new)  # fmt: skip


def summed(one: Contender, n_bodies: int) -> Prepared:
    """Return a contender that answers with how many bodies an item is in, and the sum of their numbers."""
    made = one.make()

    def answer(result: tuple[int, Any]) -> np.ndarray:
        owners, contained = np.divmod(made.answer(result[1]), n_bodies)
        return np.stack([np.bincount(owners, weights, result[0]) for weights in (None, contained)], axis=1)

    return Prepared(
        lambda queried: (queried[0], made.ask(queried[1])),
        lambda points: (len(points), made.native(points)),
        answer,
        made.memory,
    )


def same_rows(answers: np.ndarray, exact: np.ndarray) -> dict[str, Any]:
    """Judge rows of labels: all of a row are equal, or it is wrong."""
    return same((answers != exact).any(axis=1), np.zeros(len(exact)))


def _simple(size: Size, name: str, place: str) -> Contest:
    """Points of the cube; on the boundary: of a lattice of quarters, and ulps off it. Ours alone."""
    solid, draw = workloads.SIMPLE[name](), generator(f"rows/{name}", size.seed)
    points = draw.uniform(-1.5, 1.5, (size.n(500_000) // (1 if place == "uniform" else 5), solid.dimension))
    if place == "boundary":
        points = np.round(points * 4) / 4
        points += draw.integers(-2, 3, points.shape) * np.spacing(np.maximum(np.abs(points), 0.25))
    return contest(f"{name}, {place}", solid, points, ())
