"""Figures along an axis: wrong answers against the distance from the boundary, speed against size."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from benchmarks.contest import Contender, field_of
from benchmarks.errors import locations
from benchmarks.fields import containment
from benchmarks.measure import clocked
from benchmarks.workloads import Mesh, Rings, bumpy_sphere, generator, points_in_box, ring_around

ULPS = (0, 1, 2, 4, 16, 64, 2**10, 2**14, 2**18, 2**24, 2**30)
SIZES = (1, 2, 3, 4, 5, 6)
"""Subdivisions of the icosahedron: 80 to 81,920 faces."""
LARGEST = 8


def by_distance(seed: int, n_points: int) -> dict[str, Any]:
    """Return for polygon and mesh the share of wrong answers of each contender, for points so many ulps off."""
    source = generator("report distance", seed)
    angles = np.linspace(0, 2 * np.pi, 97, endpoint=False) + 0.1
    ring = ring_around(angles, 2 + np.sin(5 * angles))
    mesh = bumpy_sphere("report distance", seed, 3)
    found: dict[str, Any] = {"ulps": list(ULPS), "containment 2D": {}, "containment 3D": {}}
    for ulps in ULPS:
        signs = source.choice([-1, 1], n_points)
        rings = Rings("flower", [ring])
        plane = containment.beside_edges(ring, n_points, ulps * signs, source)
        _count(found["containment 2D"], field_of("points", rings, containment.POLYGON_PEERS), plane, rings)
        space = _beside_faces(mesh, n_points, ulps * signs, source)
        _count(found["containment 3D"], field_of("points", mesh, containment.MESH_PEERS), space, mesh)
    return found


def _beside_faces(mesh: Mesh, n_points: int, ulps: np.ndarray, source: np.random.Generator) -> np.ndarray:
    corners = mesh.vertices[mesh.faces[source.integers(len(mesh.faces), size=n_points)]]
    points = (source.dirichlet((1, 1, 1), n_points)[:, :, None] * corners).sum(axis=1)
    points[:, 2] += ulps * np.spacing(np.abs(points[:, 2]))
    return points


def _count(table: dict[str, list[float]], contenders: list[Contender], points: np.ndarray, subject: Any) -> None:
    exact = locations(points, subject)
    for contender in contenders:
        try:
            made = contender.make()
        except (ImportError, OSError):
            continue
        answers = made.answer(made.ask(made.native(points)))
        table.setdefault(contender.name, []).append(float((answers.astype(bool) != exact).mean()))


def by_size(seed: int, quick: bool) -> dict[str, Any]:
    """Return items a second of containment in bumpy balls of growing face count, and of batches of growing length."""
    found: dict[str, Any] = {"faces": {}, "batch": {}}
    for times in (*SIZES[:2], *(() if quick else (*SIZES[2:], LARGEST))):
        mesh = bumpy_sphere("report size", seed, times)
        points = points_in_box(mesh, 2_000 if quick else 50_000, seed)
        for contender in field_of("points", mesh, containment.MESH_PEERS):
            if contender.name.startswith("textbook") and times > 4:
                continue
            _time(found["faces"], contender, points, len(mesh.faces))
    mesh = bumpy_sphere("report size", seed, 2 if quick else 5)
    points = points_in_box(mesh, 100_000, seed)
    contenders = field_of("points", mesh, containment.MESH_PEERS)
    for n_points in (1, 10, 100, 1_000, *(() if quick else (10_000, 100_000))):
        for contender in contenders:
            if not contender.name.startswith(("textbook", "CGAL")):
                _time(found["batch"], contender, points[:n_points], n_points)
    return found


def _time(table: dict[str, list[list[float]]], contender: Contender, items: np.ndarray, place: int) -> None:
    try:
        made = contender.make()
    except (ImportError, OSError):
        return

    def ask(asked: np.ndarray) -> object:
        return made.answer(made.ask(made.native(asked)))

    if clocked(partial(ask, items[:100]))[0] * len(items) > 3000:  # a contender of 30 ms a point is given 100 points
        items = items[:100]
    seconds = []
    for _ in range(5):
        seconds.append(clocked(partial(ask, items))[0])
        if sum(seconds) > 3:
            break
    table.setdefault(contender.name, []).append([place, len(items) / float(np.median(seconds))])
