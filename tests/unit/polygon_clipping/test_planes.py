"""The planes of a convex polyhedron, by the short certificate and by the long one that also names what is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron, UnsupportedSolidError
from engine.polygon_clipping.planes import planes_of

CUBE = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)


def planes(faces: list[list[int]], vertices: np.ndarray = CORNERS) -> list:
    return planes_of(Polyhedron(vertices, faces), lambda: None)


def test_a_cube_has_six_planes_whichever_way_its_faces_are_turned() -> None:
    assert len(planes(CUBE)) == 6
    assert set(planes([face[::-1] for face in CUBE])) == set(planes(CUBE))


def test_a_face_without_area_goes_the_long_way() -> None:
    sliver = [*CUBE[:5], [4, 5, 7], [4, 7, 8], [4, 8, 6], [6, 8, 7]]
    middle = np.concatenate([CORNERS, [[0.5, 0.5, 1.0]]])
    assert set(planes(sliver, middle)) == set(planes(CUBE))


def test_a_dent_is_refused_with_its_face() -> None:
    dented = np.concatenate([CORNERS, [[0.5, 0.5, 0.5]]])
    with pytest.raises(UnsupportedSolidError, match="not convex"):
        planes([*CUBE[:5], [4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]], dented)
