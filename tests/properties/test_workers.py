"""The same bytes for any number of workers: every array of the answers of large batches, at 1, 2, 3 and 16."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from benchmarks import cores
from benchmarks.workloads import bumpy_sphere
from engine import Polyhedron
from engine.collision.meshes.mesh_arrays import mesh_body_of_triangles
from engine.containment.prepared import build_tree
from engine.polygon_overlay import stripes
from engine.running.budget import Budget
from engine.segment_clipping.on_boundary.prepared_boundary import mesh_of

QUESTIONS = (
    "points, mesh", "points, polygon", "collide", "clearance", "segments, box", "segments, mesh", "segments, scene",
    "points, scene", "mesh: points", "mesh: segments", "mesh: pairs",
    "pairs, scene", "quads, box", "overlay_batch", "union",
)  # fmt: skip


@pytest.fixture(scope="module")
def questions() -> dict[str, Callable[[int | None], Any]]:
    """The questions of `python -m benchmarks cores`, smaller: large enough for several threads, and for stripes."""
    return {name: question for name, _, question in cores.workloads(0.1, seed=3)}


@pytest.mark.parametrize("name", QUESTIONS)
def test_answers_have_the_same_bytes(
    name: str, questions: dict[str, Callable[[int | None], Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stripes, "_LEAST_IN_ALL", 0)
    monkeypatch.setattr(stripes, "_LEAST", 5_000)
    (question,) = (question for each, question in questions.items() if name in each)
    digests = {cores.digest_of(question(workers)) for workers in (1, 2, 3, 16)}
    assert len(digests) == 1
    assert digests.isdisjoint({cores.digest_of(None)})


def test_every_question_is_asked(questions: dict[str, Callable[[int | None], Any]]) -> None:
    assert len(QUESTIONS) == len(questions)


def arrays_of(structure: Any) -> list[bytes]:
    """Return the bytes of all arrays and numbers of nested tuples."""
    if isinstance(structure, tuple):
        return [part for each in structure for part in arrays_of(each)]
    return [np.ascontiguousarray(structure).tobytes()]


@pytest.mark.parametrize("many", [1 << 30, 1000])
def test_structures_have_the_same_bytes(many: int) -> None:
    """Trees of a mesh of 20,480 faces, whole and in parts: for points, pairs and segments."""
    vertices, faces = (lambda mesh: (mesh.vertices, mesh.faces))(bumpy_sphere("workers", 3, 5))
    solid = Polyhedron(vertices, faces)
    given = solid.vertices, solid.triangles, solid.triangle_faces
    built: dict[str, set[int]] = {}
    for workers in (1, 2, 3, 16):
        with Budget(workers=workers):
            body = mesh_body_of_triangles(*given, True, many).arrays
            unset = body.child[:, 0] < 0, body.child[:, 0] >= 0  # rows of the other kind of node
            body = body._replace(discs=body.discs[unset[1]], blocks=body.blocks[unset[0]])
            structures = {
                "points": build_tree(solid, many),
                "pairs": body,
                "segments": mesh_of(*given, many),
            }
            for name, structure in structures.items():
                built.setdefault(name, set()).add(hash(tuple(arrays_of(structure))))
    assert {name: len(hashes) for name, hashes in built.items()} == {"points": 1, "pairs": 1, "segments": 1}
