"""Vertices and faces: merging, closedness, orientation, and the errors that name the element."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine

VERTICES = [[0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def refused(error: type[engine.EngineError], faces: object, vertices: object = VERTICES) -> engine.EngineError:
    with pytest.raises(error) as info:
        engine.Polyhedron(vertices, faces)
    return info.value


def test_faces_as_array_and_as_lists_are_the_same() -> None:
    for faces in (FACES, np.array(FACES), np.array(FACES, np.uint8), [np.array(face) for face in FACES], tuple(FACES)):
        solid = engine.Polyhedron(VERTICES, faces)
        assert solid.n_faces == 4
        assert solid.triangles.tolist() == FACES
        assert solid.triangle_faces.tolist() == [0, 1, 2, 3]
        assert solid.face_offsets.tolist() == [0, 3, 6, 9, 12]
        assert solid.face_indices.tolist() == [index for face in FACES for index in face]
        assert np.shares_memory(solid.triangles, solid.face_indices)


def test_equal_coordinates_are_merged_to_the_first_index() -> None:
    soup = [VERTICES[index] for face in FACES for index in face]
    soup[4] = [1.0, -0.0, -0.0]
    solid = engine.Polyhedron(soup, np.arange(12).reshape(4, 3))
    assert solid.face_indices.tolist() == list(range(12))
    assert solid.triangles.tolist() == [[0, 1, 2], [0, 2, 5], [2, 1, 5], [1, 0, 5]]


def test_shells_that_are_accepted() -> None:
    inverted = [face[::-1] for face in FACES]
    assert engine.Polyhedron(VERTICES, inverted).n_faces == 4
    assert engine.Polyhedron(VERTICES, FACES + inverted).n_faces == 8  # everything cancels
    assert engine.Polyhedron(VERTICES, FACES + FACES).n_faces == 8  # each edge twice each way
    flat = [*FACES, [0, 1, 2], [2, 1, 0]]  # two faces of zero area in sum
    assert engine.Polyhedron([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1]], flat).n_faces == 6
    assert engine.Polyhedron([*VERTICES, [9, 9, 9]], FACES).n_faces == 4  # an unused vertex


def test_a_face_whose_corners_meet_in_one_position_is_accepted() -> None:
    # vertex 4 stands where vertex 1 does: the face 1-4-2 has no area, and its side 1-4 no length
    vertices = [*VERTICES, VERTICES[1]]
    solid = engine.Polyhedron(vertices, [*FACES, [1, 4, 2]])
    assert solid.triangles.tolist()[-1] == [1, 1, 2]


@pytest.mark.parametrize(
    ("faces", "where", "words"),
    [
        (5, ("faces",), "list of lists"),
        ("abc", ("faces",), "list of lists"),
        (np.array(FACES, float), ("faces",), "integer dtype"),
        (np.zeros((4, 3), bool), ("faces",), "integer dtype"),
        (np.array([0, 1, 2]), ("faces",), "shape (3,)"),
        ([[0, 1, 2], 7], ("faces", 1), "faces[1]"),
        ([[0, 1, 2], [0, 1.0, 2]], ("faces", 1, 1), "1.0 (float)"),
        ([[0, 1, 2], [0, True, 2]], ("faces", 1, 1), "True (bool)"),
        ([[0, 1, 2], [0, 1, "2"]], ("faces", 1, 2), "'2' (str)"),
        ([[0, 1, 2], [0, 1, None]], ("faces", 1, 2), "None"),
    ],
)
def test_what_are_no_indices_is_refused(faces: Any, where: tuple[Any, ...], words: str) -> None:
    error = refused(engine.InvalidArrayError, faces)
    assert error.where == where
    assert words in str(error)


@pytest.mark.parametrize("index", [4, -1, 2**63, -(10**30), 2**31])
def test_indices_out_of_range_are_refused(index: int) -> None:
    error = refused(engine.IndexOutOfRangeError, [*FACES[:2], [1, index, 3]])
    assert error.where == ("faces", 2, 1)
    assert str(index) in str(error)
    assert "0 to 3" in str(error)
    error = refused(engine.IndexOutOfRangeError, [[0, 1, 2, 3], [1, index, 3]])
    assert error.where == ("faces", 1, 1)
    if 0 <= index < 2**64:
        error = refused(engine.IndexOutOfRangeError, np.array([[0, 1, 2], [0, 1, index]], np.uint64))
        assert error.where == ("faces", 1, 2)


def test_short_and_missing_faces_are_refused() -> None:
    assert refused(engine.EmptyGeometryError, []).where == ("faces",)
    assert refused(engine.EmptyGeometryError, np.zeros((0, 3), int)).where == ("faces",)
    assert refused(engine.RingTooShortError, [[0, 1, 2], [0, 1]]).where == ("faces", 1)
    assert refused(engine.RingTooShortError, [[]]).where == ("faces", 0)
    assert refused(engine.RingTooShortError, np.zeros((4, 2), int)).where == ("faces", 0)


def test_vertices_are_checked() -> None:
    assert refused(engine.EmptyGeometryError, FACES, []).where == ("vertices",)
    assert refused(engine.WrongDimensionError, FACES, [[0, 0]]).where == ("vertices",)
    assert refused(engine.NotFiniteError, FACES, [*VERTICES[:3], [0, 0, float("nan")]]).where == ("vertices", 3, 2)
    assert refused(engine.InvalidArrayError, FACES, "abc").where == ("vertices",)


def test_repeated_indices_are_refused() -> None:
    error = refused(engine.RepeatedIndexError, [*FACES, [1, 2, 1]])
    assert error.where == ("faces", 4)
    assert "[1, 2, 1]" in str(error)
    assert "vertex 1" in str(error)
    error = refused(engine.RepeatedIndexError, [*FACES, [3, 1, 2, 3]])
    assert error.where == ("faces", 4)
    assert "vertex 3" in str(error)
    long = [*range(20), 5]
    error = refused(engine.RepeatedIndexError, [long], [[i, i * i, 0] for i in range(20)])
    assert "..." in str(error)


def test_open_edges_are_named_with_full_digits() -> None:
    error = refused(engine.NotClosedError, FACES[:3])
    assert error.where == ("faces", 0)
    text = str(error)
    assert "3 edges are open" in text
    assert "edge 0-2 of face 0, from [0.1, 0.0, 0.0] to [0.0, 1.0, 0.0], used 1 times" in text
    error = refused(engine.NotClosedError, [*FACES, [0, 1, 2], [0, 3, 1]])
    assert error.where == ("faces", 0)
    many = refused(engine.NotClosedError, [[0, 1, 2, 3]], VERTICES)
    assert "4 edges" in str(many)
    assert str(many).count("; edge") == 2
    assert "; ..." in str(many)


def test_open_edges_name_the_caller_s_indices() -> None:
    soup = [VERTICES[index] for face in FACES[:3] for index in face]
    error = refused(engine.NotClosedError, np.arange(9).reshape(3, 3), soup)
    assert "edge 0-1 of face 0" in str(error)
    assert "edge 7-8 of face 2" in str(error)


def test_turned_faces_are_told_from_open_ones() -> None:
    error = refused(engine.InconsistentOrientationError, [*FACES[:3], FACES[3][::-1]])
    assert error.where == ("faces", 0)
    assert "3 edges are not used equally often in both directions" in str(error)
    assert "used 2 times in this direction and 0 in the other" in str(error)


def test_one_open_edge_among_turned_ones_is_open() -> None:
    assert refused(engine.NotClosedError, [*FACES[:2], FACES[2][::-1]]).code == "not_closed"


def test_surface_takes_open_and_turned_faces() -> None:
    surface = engine.Surface(VERTICES, [FACES[0], FACES[1][::-1]])
    assert surface.type == "surface"
    assert surface.n_faces == 2
    with pytest.raises(engine.RepeatedIndexError):
        engine.Surface(VERTICES, [[0, 1, 1]])
    with pytest.raises(engine.IndexOutOfRangeError):
        engine.Surface(VERTICES, [[0, 1, 4]])


@pytest.mark.data
def test_real_meshes(data: Path) -> None:
    files = sorted((data / "meshes").glob("*.npz"))
    assert files
    for file in files:
        mesh = np.load(file)
        if file.stem.startswith("fcl_"):
            with pytest.raises(engine.NotClosedError):
                engine.Polyhedron(mesh["vertices"], mesh["faces"])
            assert engine.Surface(mesh["vertices"], mesh["faces"]).n_faces == len(mesh["faces"])
        else:
            assert engine.Polyhedron(mesh["vertices"], mesh["faces"]).n_faces == len(mesh["faces"])
