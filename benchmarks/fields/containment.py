"""Points in polyhedra, polygons and convex solids: easy points, and points on and beside the boundary."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import engine
from benchmarks import errors
from benchmarks.contenders import Prepared
from benchmarks.contenders.plain_signs import with_plain_signs
from benchmarks.contest import REFUSED, Ask, Contender, Contest, same
from benchmarks.workloads import Mesh, MissingDataError, Planes, Rings, bumpy_sphere, generator, hard_sets, stored_mesh
from engine.textbook import (
    convex,
    polygon_angle_sum,
    polygon_ray_parity,
    polygon_same_side,
    polyhedron_ray_parity,
    polyhedron_recast,
    triangle_cross_dot,
    triangle_projection,
)

N_EXACT = 2000
OBLIQUE = np.array([0.5773, 0.2113, 0.7886])
"""A direction without zero components for the textbook's half-line."""


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of containment."""
    yield _easy_3d(seed, scale)
    hard = _hard_3d(scale)
    if hard is not None:
        yield hard
    yield from _plane(seed, scale)
    yield from _convex(seed, scale)
    yield _triangle(seed, scale)


def exact_locations(points: np.ndarray, subject: Any) -> np.ndarray:
    """Return whether each point is in the closed subject, by rational arithmetic."""
    return np.array([errors.contained(point, subject)[0] for point in points])


# --- polyhedra --------------------------------------------------------------------------------------------------------


def _easy_3d(seed: int, scale: float) -> Contest:
    try:
        mesh = stored_mesh("igl_bunny")
    except MissingDataError:
        mesh = bumpy_sphere("bumpy", seed, 4)
    source = generator("report containment 3d", seed)
    points = source.uniform(mesh.vertices.min(0), mesh.vertices.max(0), (int(200_000 * scale), 3))
    exact = exact_locations(points[: int(N_EXACT * min(1, 4 * scale))], mesh)
    contenders = on_meshes([mesh], np.zeros(len(points), int), points)
    about = f"uniform in the box of {mesh.name}, {len(mesh.faces):,} faces"
    return Contest("containment 3D", "uniform", False, np.arange(len(points)), exact, same, contenders, about)


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
    contenders = on_meshes(meshes, owner, rows)
    about = "on vertices, edges and faces and ulps beside them, offsets to 1e9, slivers, non-manifold meshes"
    return Contest(
        "containment 3D", "boundary", True, np.arange(len(rows)), np.concatenate(exact)[mixed], same, contenders, about
    )


def on_meshes(meshes: list[Mesh], owner: np.ndarray, points: np.ndarray) -> list[Contender]:
    """Return the contenders; items are rows of `points`, each asked of the mesh that owns it."""
    share: list[float] = []

    def grouped(build: Callable[[Mesh], Ask]) -> Callable[[], Ask]:
        def make() -> Ask:
            asks = [_or_refusal(build, mesh) for mesh in meshes]

            def ask(rows: np.ndarray) -> np.ndarray:
                found = np.empty(len(rows), np.int8)
                for i_mesh, one in enumerate(asks):
                    mine = np.flatnonzero(owner[rows] == i_mesh) if len(asks) > 1 else slice(None)
                    chosen = points[rows[mine]]
                    if len(chosen):
                        found[mine] = one(chosen)
                return found

            return ask

        return make

    def ours(mesh: Mesh) -> Ask:
        solid = engine.Polyhedron(mesh.vertices, mesh.faces)

        def ask(chosen: np.ndarray) -> np.ndarray:
            found, accuracy = engine.locate(chosen, solid, report=True)
            share.append(accuracy.n_beyond_filter / max(1, accuracy.n_items))
            return found >= 0

        return ask

    def plain(mesh: Mesh) -> Ask:
        """The same kernel without its bands and without what is exact behind it; where it is small, there is none."""
        solid = engine.Polyhedron(mesh.vertices, mesh.faces)
        prepared = Prepared(lambda rows: rows, lambda rows: engine.locate(rows, solid), lambda found: found >= 0)
        signs = with_plain_signs(prepared)
        return lambda chosen: signs.ask(chosen) >= 0

    return [
        Contender("ours", grouped(ours), exact_share=lambda: share[-1]),
        Contender("ours, plain signs in cells", grouped(plain)),
        Contender("textbook: half-line", grouped(_textbook_parity)),
        Contender("textbook: another half-line", grouped(_textbook_recast)),
        Contender("Open3D occupancy", grouped(_open3d), "open3d"),
        Contender("trimesh + embreex", grouped(_trimesh), "trimesh"),
        Contender("libigl winding number", grouped(_libigl), "libigl"),
        Contender("VTK enclosed points", grouped(_vtk), "vtk"),
        Contender("CGAL side of mesh", grouped(_cgal), "cgal"),
    ]


def _or_refusal(build: Callable[[Mesh], Ask], mesh: Mesh) -> Ask:
    """Return what `build` makes; where it refuses the mesh, what refuses every point."""
    try:
        return build(mesh)
    except (ImportError, OSError):
        raise
    except Exception:  # whatever a peer raises
        return lambda points: np.full(len(points), REFUSED)


def _textbook_parity(mesh: Mesh) -> Ask:
    return lambda points: polyhedron_ray_parity.contains(points, mesh.vertices, mesh.faces, OBLIQUE)


def _textbook_recast(mesh: Mesh) -> Ask:
    directions = np.random.default_rng(1).normal(size=(16, 3))

    def ask(points: np.ndarray) -> np.ndarray:
        contained, unfinished = polyhedron_recast.contains(points, mesh.vertices, mesh.faces, directions, 1e-9)
        return np.where(unfinished, REFUSED, contained)

    return ask


def _open3d(mesh: Mesh) -> Ask:
    import open3d
    from open3d.core import Tensor

    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(Tensor(mesh.vertices.astype(np.float32)), Tensor(mesh.faces.astype(np.uint32)))
    return lambda points: scene.compute_occupancy(Tensor(points.astype(np.float32))).numpy() > 0.5


def _trimesh(mesh: Mesh) -> Ask:
    import embreex  # noqa: F401, without it trimesh would use a slower method
    import trimesh

    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    return body.contains


def _libigl(mesh: Mesh) -> Ask:
    import igl

    faces = mesh.faces.astype(np.int64)
    return lambda points: igl.fast_winding_number(mesh.vertices, faces, points) > 0.5


def _vtk(mesh: Mesh) -> Ask:
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

    def surface_of(vertices: np.ndarray) -> Any:
        corners, data = vtk.vtkPoints(), vtk.vtkPolyData()
        corners.SetData(numpy_to_vtk(np.ascontiguousarray(vertices), deep=True))
        data.SetPoints(corners)
        return data

    body, cells = surface_of(mesh.vertices), vtk.vtkCellArray()
    rows = np.hstack([np.full((len(mesh.faces), 1), 3), mesh.faces]).astype(np.int64)
    cells.SetCells(len(rows), numpy_to_vtkIdTypeArray(rows.ravel(), deep=True))
    body.SetPolys(cells)

    def ask(points: np.ndarray) -> np.ndarray:
        tester = vtk.vtkSelectEnclosedPoints()
        tester.SetInputData(surface_of(points))
        tester.SetSurfaceData(body)
        tester.SetTolerance(0.0)
        tester.Update()
        return vtk_to_numpy(tester.GetOutput().GetPointData().GetArray("SelectedPoints")) > 0

    return ask


def _cgal(mesh: Mesh) -> Ask:
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Polygon_mesh_processing import Side_of_triangle_mesh
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3, Polyhedron_modifier

    modifier = Polyhedron_modifier()
    modifier.begin_surface(len(mesh.vertices), len(mesh.faces))
    for vertex in mesh.vertices.tolist():
        modifier.add_vertex(Point_3(*vertex))
    for face in mesh.faces.tolist():
        modifier.begin_facet()
        for corner in face:
            modifier.add_vertex_to_facet(corner)
        modifier.end_facet()
    body = Polyhedron_3()
    body.delegate(modifier)
    if body.size_of_facets() != len(mesh.faces) or not body.is_closed():
        raise ValueError("CGAL's Polyhedron_3 takes closed manifolds only")
    side = Side_of_triangle_mesh(body)

    def ask(points: np.ndarray, kept: Any = body) -> np.ndarray:  # `side` borrows the body
        return np.array([side.bounded_side(Point_3(*point)) >= 0 for point in points.tolist()])

    return ask


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
        exact = exact_locations(points[: int(N_EXACT * min(1, 4 * scale))], rings)
        about = f"a gear of {len(ring)} vertices" + (", on its edges, vertices and level with them" if is_hard else "")
        yield Contest("containment 2D", name, is_hard, points, exact, same, polygon_contenders(ring), about)


def polygon_contenders(ring: np.ndarray) -> list[Contender]:
    """Return those that take any simple polygon; items are points."""
    share: list[float] = []

    def ours() -> Ask:
        solid = engine.Polygon([ring])

        def ask(points: np.ndarray) -> np.ndarray:
            found, accuracy = engine.locate(points, solid, report=True)
            share.append(accuracy.n_beyond_filter / max(1, accuracy.n_items))
            return found >= 0

        return ask

    def textbook() -> Ask:
        offsets = np.array([0, len(ring)])
        return lambda points: polygon_ray_parity.contains(points, ring, offsets)

    def with_shapely() -> Ask:
        import shapely

        shape = shapely.Polygon(ring)
        shapely.prepare(shape)
        return lambda points: shapely.intersects_xy(shape, points[:, 0], points[:, 1])

    def with_matplotlib() -> Ask:
        from matplotlib.path import Path

        path = Path(np.concatenate([ring, ring[:1]]), closed=True)
        return path.contains_points

    return [
        Contender("ours", ours, exact_share=lambda: share[-1]),
        Contender("textbook: half-line", textbook),
        Contender("shapely, prepared", with_shapely, "shapely"),
        Contender("matplotlib Path", with_matplotlib, "matplotlib"),
    ]


def _convex(seed: int, scale: float) -> Iterator[Contest]:
    source = generator("report convex", seed)
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ring, n_points = np.stack([np.cos(angles), np.sin(angles)], axis=1), int(100_000 * scale)
    near = beside_edges(ring, n_points // 10, source.integers(-2, 3, n_points // 10), source)
    for is_hard, asked in ((False, source.uniform(-1, 1, (n_points, 2))), (True, near)):
        exact = exact_locations(asked[: int(N_EXACT * min(1, 4 * scale))], Rings("16-gon", [ring]))
        contenders = [
            polygon_contenders(ring)[0],
            Contender(
                "textbook: signed angles", lambda: lambda points: polygon_angle_sum.contains_signed(points, ring)
            ),
            Contender(
                "textbook: unsigned angles, 1e-6",
                lambda: lambda points: polygon_angle_sum.contains_unsigned(points, ring, 1e-6),
            ),
            Contender("textbook: same side", lambda: lambda points: polygon_same_side.contains(points, ring)),
        ]
        name = "boundary" if is_hard else "uniform"
        yield Contest("containment, convex polygon", name, is_hard, asked, exact, same, contenders, "16 vertices")
    normals = source.normal(size=(20, 3))
    rows = np.hstack([normals, np.ones((20, 1))])
    points = source.uniform(-1, 1, (n_points, 3))
    onto = points - normals[:1] * ((points @ normals[0] + 1) / (normals[0] @ normals[0]))[:, None]
    for is_hard, asked in ((False, points), (True, onto[: n_points // 10])):
        exact = exact_locations(asked[: int(N_EXACT * min(1, 4 * scale))], Planes("20 planes", rows))
        yield Contest(
            "containment, half-spaces", "on a plane" if is_hard else "uniform", is_hard, asked, exact, same,
            [
                Contender("ours", lambda: _ours_convex(rows)),
                Contender("textbook: half-spaces", lambda: lambda points: convex.contains(points, rows)),
                Contender("numpy", lambda: lambda points: (points @ normals.T + 1 >= 0).all(axis=1), "numpy"),
            ],
            "20 random planes",
        )  # fmt: skip


def _ours_convex(rows: np.ndarray) -> Ask:
    solid = engine.Convex(rows)
    return lambda points: engine.contains(points, solid)


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
    exact = _exact_prism(points[: int(N_EXACT * min(1, 4 * scale))], corners)
    return Contest(
        "containment, triangle in space", "on its walls", True, points, exact, same,
        [
            Contender("ours", lambda: lambda points: engine.contains(points, solid)),
            Contender(
                "textbook: cross and dot", lambda: lambda points: triangle_cross_dot.contains(points, corners)
            ),
            Contender("textbook: projection", lambda: lambda points: triangle_projection.contains(points, corners)),
        ],
        "the prism over a triangle; half of the points beside its walls",
    )  # fmt: skip


def _exact_prism(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    from tests.reference.containment import locate

    solid = {"type": "triangle", "vertices": corners.tolist()}
    return np.array([locate(point, solid) >= 0 for point in points.tolist()])
