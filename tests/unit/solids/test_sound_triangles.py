"""The one look at small meshes: it agrees with the checks that large meshes get, fault by fault."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import EngineError, Polyhedron, Surface
from engine.solids import mesh

CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def outcome(kind: Any, vertices: Any, faces: Any) -> tuple[Any, ...]:
    try:
        made = kind(vertices, faces)
    except EngineError as error:
        return type(error), str(error), error.where
    return made.vertices.tolist(), made.triangles.tolist(), made.face_indices.tolist(), made.face_offsets.tolist()


def test_small_meshes_are_judged_as_large_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(1)
    asked = []
    for _ in range(300):
        vertices, faces = np.array(CORNERS), np.array(FACES)
        for _ in range(int(random.integers(0, 3))):
            change = random.integers(0, 4)
            if change == 0:
                faces[random.integers(0, len(faces)), random.integers(0, 3)] = random.integers(-1, 5)
            elif change == 1:
                faces = np.delete(faces, random.integers(0, len(faces)), axis=0)
            elif change == 2:
                faces = np.concatenate([faces, faces[random.integers(0, len(faces)), None, ::-1]])
            else:
                vertices[random.integers(0, 4)] = vertices[random.integers(0, 4)] * random.choice([1.0, -1.0])
        asked.append(
            (random.choice([Polyhedron, Surface]), vertices, faces if random.random() < 0.5 else faces.tolist())
        )
    found = [outcome(*question) for question in asked]
    monkeypatch.setattr(mesh, "MOST_VERTICES", 0)
    assert found == [outcome(*question) for question in asked]
    assert len({item[0] if isinstance(item[0], type) else "made" for item in found}) >= 4
