"""Figures along an axis: wrong answers against the distance from the boundary, speed against size."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.contest import Contest, field_of, hold
from benchmarks.errors import locations, same
from benchmarks.fields import containment
from benchmarks.workloads import Mesh, Rings, bumpy_sphere, generator, points_in_box, ring_around

ULPS = (0, 1, 2, 4, 16, 64, 2**10, 2**14, 2**18, 2**24, 2**30)
TIMES, LARGEST = (1, 2, 3, 4, 5, 6), 8
"""Subdivisions of the icosahedron: 80 to 81,920 faces, and 1,310,720."""
SECONDS = 0.2
"""Of a contender at each place."""


def by_distance(seed: int, n_points: int) -> dict[str, Any]:
    """Return for polygon and mesh the share of wrong answers of each contender, for points so many ulps off."""
    source = generator("report distance", seed)
    angles = np.linspace(0, 2 * np.pi, 97, endpoint=False) + 0.1
    rings = Rings("flower", [ring_around(angles, 2 + np.sin(5 * angles))])
    mesh = bumpy_sphere("report distance", seed, 3)
    found: dict[str, Any] = {"ulps": list(ULPS), "containment 2D": {}, "containment 3D": {}}
    for ulps in ULPS:
        off = ulps * source.choice([-1, 1], n_points)
        plane = containment.beside_edges(rings.rings[0], n_points, off, source)
        _add(found["containment 2D"], rings, containment.POLYGON_PEERS, plane)
        _add(found["containment 3D"], mesh, containment.MESH_PEERS, _beside_faces(mesh, n_points, off, source))
    return found


def _beside_faces(mesh: Mesh, n_points: int, ulps: np.ndarray, source: np.random.Generator) -> np.ndarray:
    corners = mesh.vertices[mesh.faces[source.integers(len(mesh.faces), size=n_points)]]
    points = (source.dirichlet((1, 1, 1), n_points)[:, :, None] * corners).sum(axis=1)
    points[:, 2] += ulps * np.spacing(np.abs(points[:, 2]))
    return points


def by_size(seed: int, quick: bool) -> dict[str, Any]:
    """Return items a second of containment in bumpy balls of growing face count, and of batches of growing length."""
    found: dict[str, Any] = {"faces": {}, "batch": {}}
    for times in TIMES[:2] if quick else (*TIMES, LARGEST):
        mesh = bumpy_sphere("report size", seed, times)
        peers = [peer for peer in containment.MESH_PEERS if times <= 4 or not peer.startswith("textbook")]
        _add(found["faces"], mesh, peers, points_in_box(mesh, 2_000 if quick else 50_000, seed), len(mesh.faces))
    mesh = bumpy_sphere("report size", seed, 2 if quick else 5)
    peers = [peer for peer in containment.MESH_PEERS if not peer.startswith(("textbook", "cgal"))]
    for n_points in (1, 10, 100, 1_000, 10_000, 100_000)[: 4 if quick else None]:
        _add(found["batch"], mesh, peers, points_in_box(mesh, n_points, seed), n_points)
    return found


def _add(table: dict[str, list[Any]], subject: Any, peers: Any, points: np.ndarray, place: int = 0) -> None:
    """Add a place of each contender's curve: its speed there, or without a place its share of wrong answers."""
    exact = None if place else locations(points, subject)
    asked = field_of("points", subject, peers)
    for row in hold(Contest("containment", "", True, points, exact, same, asked), 1, SECONDS):
        if not row.absent:
            one = [place, row.rate] if place else row.errors["wrong"] / row.errors["judged"]
            table.setdefault(row.contender, []).append(one)
