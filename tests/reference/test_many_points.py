"""The fast reference for many points against the slow one, and against the answers that came with the hard sets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.reference.containment import locate_many
from tests.reference.many_points import locate_points
from tests.reference.shapes import box, tetrahedron, union_of


def triangulated(solid: dict[str, Any]) -> tuple[Any, Any]:
    faces = [[face[0], face[k], face[k + 1]] for face in solid["faces"] for k in range(1, len(face) - 1)]
    return np.array(solid["vertices"], float), np.array(faces)


SPIRE = tetrahedron((0, 0, 0), (4, 1, 0), (1, 4, 0), (2, 2, 4))
SOLIDS = [
    box((0, 0, 0), (4, 4, 4)),
    union_of(box((0, 0, 0), (3, 3, 3)), box((1, 1, 1), (4, 4, 2)), SPIRE),
    union_of(box((0, 0, 0), (2, 2, 2)), box((0, 0, 0), (2, 2, 2)), box((2, 0, 0), (4, 2, 2))),
    union_of(box((0, 0, 0), (1, 4, 4)), box((1, 1, 1), (1, 3, 3))),  # the second without a volume
]


@pytest.mark.parametrize("number", range(len(SOLIDS)))
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (5e-324, 0.0), (2.0**900, 0.0), (0.1, 1e9), (1e-5, 1.0)])
def test_equal_to_the_slow_reference(number: int, scale: float, offset: float) -> None:
    vertices, faces = triangulated(SOLIDS[number])
    axis = np.arange(-1.0, 6.0)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)[number::7]
    points = np.concatenate([points, np.random.default_rng(number).uniform(-1, 5, (10, 3))])
    vertices, points = vertices * scale + offset, points * scale + offset
    solid = {"type": "polyhedron", "vertices": vertices.tolist(), "faces": faces.tolist()}
    assert locate_points(points, vertices, faces).tolist() == locate_many(points.tolist(), solid)


@pytest.mark.data
@pytest.mark.parametrize("name", ["c3d_spot_off1e6", "syn_bracket_off1e9", "syn_menger2", "syn_sliver_uv"])
def test_equal_to_the_answers_of_the_hard_sets(data: Path, name: str) -> None:
    case = np.load(data / "hard_containment" / f"{name}.npz")
    some = slice(None, None, 7)
    assert (locate_points(case["points"][some], case["vertices"], case["faces"]) == case["location"][some]).all()
