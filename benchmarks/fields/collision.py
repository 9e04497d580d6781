"""Pairs of closed polyhedra: do the solids meet? Most peers see surfaces, and miss a body inside another."""

from __future__ import annotations

import gzip
import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import engine
from benchmarks.contest import REFUSED, Ask, Contender, Contest, same
from benchmarks.workloads import DATA, Mesh, bumpy_sphere, generator
from engine.textbook import collide_by_edges, collide_by_vertices, collide_by_volumes

Pair = tuple[Mesh, Mesh]


def contests(seed: int, scale: float) -> Iterator[Contest]:
    """Yield the contests of collision."""
    path = DATA / "hard_collision" / "cases.json.gz"
    if path.is_file():
        cases = json.loads(gzip.decompress(path.read_bytes()))
        cases = [
            cases[i] for i in np.random.default_rng(0).permutation(len(cases))[: int(len(cases) * min(1, 2 * scale))]
        ]
        pairs = [(_mesh(case["first"]), _mesh(case["second"])) for case in cases]
        exact = np.array([case["relation"] != "disjoint" for case in cases])
        about = "inside one another, touching, edges only, ulps apart, far from the origin, linked, in cavities"
        yield Contest("collision", "contact", True, np.arange(len(pairs)), exact, same, contenders(pairs), about)
    pairs, exact = _easy(seed, int(400 * scale))
    about = "bumpy balls of 80 faces, half of them meeting, none closely"
    yield Contest("collision", "apart or crossing", False, np.arange(len(pairs)), exact, same, contenders(pairs), about)


def _mesh(body: dict[str, Any]) -> Mesh:
    return Mesh("case", np.array(body["vertices"], float), np.array(body["faces"], np.int64))


def _easy(seed: int, n_pairs: int) -> tuple[list[Pair], np.ndarray]:
    """Return pairs of star-shaped bodies about two centres: certain by their radii and the distance of the centres."""
    body, source, pairs, exact = bumpy_sphere("report", seed, 1), generator("report collision", seed), [], []
    radii = np.linalg.norm(body.vertices, axis=1)
    inner, outer = 0.9 * radii.min(), radii.max()  # faces lie within the vertices' radii by less than a tenth
    for i_pair in range(n_pairs):
        direction = source.normal(size=3)
        meet = bool(i_pair % 2)
        distance = source.uniform(1.0, 1.9) * inner if meet else source.uniform(2.02, 3) * outer
        offset = direction / np.linalg.norm(direction) * distance
        pairs.append((body, Mesh("moved", body.vertices + offset, body.faces)))
        exact.append(meet)
    return pairs, np.array(exact)


def contenders(pairs: list[Pair]) -> list[Contender]:
    """Return the contenders; items are indices of pairs."""

    def each(build: Callable[[Mesh, Mesh], Callable[[], bool]]) -> Callable[[], Ask]:
        """One call from Python for each pair; models are made beforehand; an error is a refusal."""

        def make() -> Ask:
            calls = [build(*pair) for pair in pairs]
            return lambda rows: np.array([_called(calls[row]) for row in rows])

        return make

    return [
        Contender("ours", each(_ours)),
        Contender("textbook: vertices in the other", each(_textbook(collide_by_vertices.collide))),
        Contender("textbook: edges through faces", each(_textbook(collide_by_edges.collide))),
        Contender("textbook: volumes first", each(_textbook(collide_by_volumes.collide))),
        Contender("coal", each(_coal), "coal", overhead=_overhead(_coal)),
        Contender("fcl", each(_fcl), "python-fcl", overhead=_overhead(_fcl)),
        Contender("Open3D", each(_open3d), "open3d"),
        Contender("VTK", each(_vtk), "vtk"),
        Contender("libigl", each(_libigl), "libigl"),
        Contender("manifold3d", each(_manifold), "manifold3d"),
    ]


def _called(call: Callable[[], bool]) -> int:
    try:
        return int(call())
    except Exception:  # whatever a peer raises
        return REFUSED


def _overhead(build: Callable[[Mesh, Mesh], Callable[[], bool]]) -> Callable[[], float]:
    """Return what one call costs on two triangles' worth of bodies far apart."""

    def measure() -> float:
        vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
        call = build(Mesh("a", vertices, faces), Mesh("b", vertices + 100.0, faces))
        before = time.perf_counter()
        for _ in range(1000):
            call()
        return (time.perf_counter() - before) / 1000

    return measure


def _ours(a: Mesh, b: Mesh) -> Callable[[], bool]:
    first, second = engine.Polyhedron(a.vertices, a.faces), engine.Polyhedron(b.vertices, b.faces)
    return lambda: engine.collide(first, second).relation != engine.Relation.DISJOINT


def _textbook(collide: Callable[..., bool]) -> Callable[[Mesh, Mesh], Callable[[], bool]]:
    return lambda a, b: lambda: collide(a.vertices, a.faces, b.vertices, b.faces)


def _coal(a: Mesh, b: Mesh) -> Callable[[], bool]:
    import coal

    from benchmarks.contenders.coal_calls import model

    first, second, still = model(a), model(b), coal.Transform3s()
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    request.num_max_contacts = 1

    def call() -> bool:
        result.clear()
        return coal.collide(first, still, second, still, request, result) > 0

    return call


def _fcl(a: Mesh, b: Mesh) -> Callable[[], bool]:
    import fcl

    def body(mesh: Mesh) -> Any:
        made = fcl.BVHModel()
        made.beginModel(len(mesh.vertices), len(mesh.faces))
        made.addSubModel(mesh.vertices, mesh.faces)
        made.endModel()
        return fcl.CollisionObject(made)

    first, second, request = body(a), body(b), fcl.CollisionRequest(num_max_contacts=1)
    return lambda: fcl.collide(first, second, request, fcl.CollisionResult()) > 0


def _open3d(a: Mesh, b: Mesh) -> Callable[[], bool]:
    import open3d

    def body(mesh: Mesh) -> Any:
        vector = open3d.utility
        return open3d.geometry.TriangleMesh(vector.Vector3dVector(mesh.vertices), vector.Vector3iVector(mesh.faces))

    first, second = body(a), body(b)
    return lambda: first.is_intersecting(second)


def _vtk(a: Mesh, b: Mesh) -> Callable[[], bool]:
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

    def body(mesh: Mesh) -> Any:
        corners, data, cells = vtk.vtkPoints(), vtk.vtkPolyData(), vtk.vtkCellArray()
        corners.SetData(numpy_to_vtk(np.ascontiguousarray(mesh.vertices), deep=True))
        rows = np.hstack([np.full((len(mesh.faces), 1), 3), mesh.faces]).astype(np.int64)
        cells.SetCells(len(rows), numpy_to_vtkIdTypeArray(rows.ravel(), deep=True))
        data.SetPoints(corners)
        data.SetPolys(cells)
        return data

    tester = vtk.vtkCollisionDetectionFilter()
    for port, mesh in enumerate((a, b)):
        tester.SetInputData(port, body(mesh))
        tester.SetMatrix(port, vtk.vtkMatrix4x4())
    tester.SetCollisionModeToFirstContact()

    def call() -> bool:
        tester.Modified()
        tester.Update()
        return tester.GetNumberOfContacts() > 0

    return call


def _libigl(a: Mesh, b: Mesh) -> Callable[[], bool]:
    import igl
    import igl.copyleft.cgal as cgal

    del igl
    return lambda: len(cgal.intersect_other(a.vertices, a.faces, b.vertices, b.faces, first_only=True)[0]) > 0


def _manifold(a: Mesh, b: Mesh) -> Callable[[], bool]:
    import manifold3d

    def body(mesh: Mesh) -> Any:
        return manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices, mesh.faces.astype(np.uint64)))

    first, second = body(a), body(b)

    def call() -> bool:
        for solid in (first, second):
            if solid.status() != manifold3d.Error.NoError:
                raise ValueError(solid.status())
        return not (first ^ second).is_empty()

    return call
