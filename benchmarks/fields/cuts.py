"""Solids cut by planes: volumes of closed halves, areas of sections, whole volumes; judged by rationals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks import errors
from benchmarks.contest import Contest, Size, Task, field_of
from benchmarks.fields.collision import on_each
from benchmarks.workloads import Mesh, bumpy_sphere, document, generator

PEERS = {"closed halves": ("trimesh", "manifold3d", "vtk"), "sections": ("trimesh", "vtk")}
KINDS = {"closed halves": "cut volumes", "sections": "section areas"}
LATTICE = 64.0
FAR = 1e7
"""How many sizes from the origin the solids of hard volumes stand."""


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows, all with one thread, one call a plane or solid."""
    for name in KINDS:
        for place in ("random planes", "through vertices"):
            yield Task(f"{name}, {place}", partial(_planes, size, name, place), True)
    for place in ("at the origin", "far away"):
        yield Task(f"volumes, {place}", partial(_volumes, size, place), True)


def _planes(size: Size, name: str, place: str) -> Contest:
    """Hard planes pass exactly through three vertices; of closed halves half of them along a face, of which sections
    have no common rule. Coordinates are on a lattice."""
    is_hard, n = place != "random planes", size.n(120, 12)
    draw, ball = generator(f"cuts {place}", size.seed), bumpy_sphere("cuts", 1, 2)
    mesh = Mesh("ball", np.round(ball.vertices * LATTICE), ball.faces) if is_hard else ball
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    if is_hard:
        chosen = [face if k % 2 and name != "sections" else draw.choice(len(mesh.vertices), 3, replace=False)
                  for k, face in enumerate(mesh.faces[draw.integers(0, len(mesh.faces), n)])]  # fmt: skip
        a, b, c = (mesh.vertices[np.array(chosen)[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        rows = np.column_stack([normals, -(normals * a).sum(axis=1)])  # whole numbers far below 2^53: exactly through
    else:
        normals = draw.normal(size=(n, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        rows = np.column_stack([normals, draw.uniform(-0.3, 0.3, n) * extent])

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        other, far = rows.copy(), step * extent * np.linalg.norm(rows[:, :3], axis=1)
        other[:, 3] += draw.choice([-1.0, 1.0], n) * far
        return other, exact(other)

    def exact(some: np.ndarray) -> np.ndarray:
        return errors.cut_measures(mesh, some, is_section=name == "sections")

    def asked(item: int) -> tuple[str, dict[str, Any]]:
        *normal, offset = rows[item].tolist()
        if name == "sections":
            return "/v1/section", {"solid": document(mesh), "planes": [[*normal, offset]]}
        region = {"type": "half_space", "normal": normal, "offset": offset}
        return "/v1/cut", {"solid": document(mesh), "region": region}

    about = f"{len(mesh.faces)} faces, planes " + ("through three vertices each" if is_hard else "drawn at random")
    about += ", half of them along a face" if is_hard and name != "sections" else ""
    return Contest("cuts", f"{name}, {place}", is_hard, rows, exact(rows), errors.areas,
                   field_of(KINDS[name], mesh, PEERS[name], 1), about, request=asked,
                   moved=moved if is_hard else None, near=0.0 if is_hard else None)  # fmt: skip


def _volumes(size: Size, place: str) -> Contest:
    """Bumpy balls of 320 faces, each of its own shape; hard ones far from the origin, as maps and cities have them."""
    is_hard, n = place == "far away", size.n(60, 8)
    draw = generator(f"volumes {place}", size.seed)
    balls = [bumpy_sphere(f"volumes {k}", size.seed, 2) for k in range(n)]
    if is_hard:
        balls = [Mesh(ball.name, ball.vertices + draw.uniform(0.5, 1.0, 3) * FAR, ball.faces) for ball in balls]
    exact = np.array([[volume, volume] for volume in map(errors.volume_of, balls)])
    result = field_of("volume", None, ("open3d", "trimesh", "manifold3d", "vtk"), 1)
    made = [replace(each, make=partial(on_each, each, balls, n, np.nan)) for each in result]
    about = "bumpy balls of 320 faces" + (f", {FAR:.0e} sizes from the origin" if is_hard else "")
    return Contest("cuts", f"volumes, {place}", is_hard, np.arange(n), exact, errors.areas, made, about,
                   request=lambda item: ("/v1/volume", {"solid": document(balls[item])}))  # fmt: skip
