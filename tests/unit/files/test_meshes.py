"""What a mesh file holds: equal corners become one, what that collapses is left out, errors speak of the file."""

from __future__ import annotations

import io
import pickle
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine
from engine.__main__ import main
from tests.unit.files.soups import FAR, ascii_stl, ball, binary, has_equal, obj

trimesh = pytest.importorskip("trimesh", reason="the extra `formats` is not installed")


WRITERS = {"stl": binary, "stl ascii": ascii_stl, "obj": obj}
written = pytest.mark.parametrize("kind", WRITERS)


def read(kind: str, corners: Any) -> Any:
    return engine.read_mesh(WRITERS[kind](corners), kind.partition(" ")[0])


@written
def test_a_ball_of_surveyors_coordinates_in_single_precision(kind: str) -> None:
    """At 448 km two numbers are 3 cm apart: triangles of a ball of 3 m have corners in one place."""
    corners = 3 * ball(56) + FAR
    lost = has_equal(corners)
    assert 0 < lost.sum() < len(corners) / 3
    mesh = read(kind, corners)
    assert mesh.n_collapsed == lost.sum()
    assert mesh.faces_in_file.tolist() == np.flatnonzero(~lost).tolist()
    for solid in (engine.Polyhedron(*mesh), mesh.solid(), mesh.solid(engine.Surface)):
        assert solid.n_faces == len(corners) - lost.sum()
    assert engine.contains([FAR], mesh.solid()).all()
    again = pickle.loads(pickle.dumps(mesh))
    assert (again.n_collapsed, again.faces_in_file.tolist()) == (mesh.n_collapsed, mesh.faces_in_file.tolist())


@written
def test_errors_name_faces_as_the_file_has_them(kind: str) -> None:
    corners = 3 * ball(56) + FAR
    lost = np.flatnonzero(has_equal(corners))
    face = int(np.flatnonzero(~has_equal(corners))[-1])
    assert face > lost[0] + 100
    turned = corners.copy()
    turned[face] = turned[face, ::-1]
    with pytest.raises(engine.InconsistentOrientationError) as caught:
        read(kind, turned).solid()
    named = caught.value.where[1]
    assert not has_equal(corners[named : named + 1])[0]
    assert f"of face {named}, from" in caught.value.message
    shared = [(corner == turned[face].astype(np.float32)).all(axis=1).any() for corner in
              np.asarray(turned[named], np.float32)]  # fmt: skip
    assert sum(shared) >= 2  # the face itself, or one beside it
    assert str(caught.value) == caught.value.message


def test_of_triangles_without_numbers_no_number_of_a_vertex_is_said() -> None:
    corners = 3 * ball(56) + FAR
    with pytest.raises(engine.NotClosedError, match="open: an edge of face 5, from") as caught:
        read("stl", corners[:101]).solid()
    assert re.search(r"edge \d", caught.value.message) is None
    corners[77, 1, 2] = np.nan
    with pytest.raises(engine.NotFiniteError, match="face 77, corner 1"):
        read("stl", corners).solid()


def test_a_triangle_that_names_a_vertex_twice_is_refused_as_it_was() -> None:
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 1\nf 4 5 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 1 2\n"
    mesh = engine.read_mesh(text, "obj")
    assert mesh.n_collapsed == 1
    with pytest.raises(engine.RepeatedIndexError, match=r"faces\[5\]"):
        mesh.solid()


def test_relative_indices_count_from_the_last_vertex_before_the_face() -> None:
    """trimesh counts from the end of the file: both shells became the second, twice, and contained nothing."""
    shells = [[[x + dx, y, z] for x, y, z in ([0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1])] for dx in (0, 10)]
    faces = "f -4 -2//-1 -3\nf -4 -3 \\\n -1\n  f -4/1/-2 -1 -2 # f 0\nf -3 -2 -1\n"
    text = "".join("".join(f"v {x} {y} {z}\n" for x, y, z in shell) + faces for shell in shells)
    solid = engine.read_mesh(text.encode(), "obj").solid()
    assert engine.locate([[0.1, 0.1, 0.1], [10.1, 0.1, 0.1], [5, 0, 0]], solid).tolist() == [1, 1, -1]


@pytest.mark.parametrize("face", ["0 1 2", "1 2 0/3", "1 0/1/1 2", "-5 -1 -2", "1 2", "1", "3 4 # 2", "-1 -2"])
def test_faces_that_are_none_are_refused(face: str) -> None:
    """0 was taken for 1, and what has fewer than three corners left out without a word."""
    text = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf {face}\nf 1 4 3\nf 2 3 4\n"
    with pytest.raises(engine.InvalidInputError, match="face 2 has the corners"):
        engine.read_mesh(text.encode(), "obj")


def test_where_everything_collapses_it_is_said() -> None:
    with pytest.raises(engine.EmptyGeometryError, match="all triangles of the stl file have two equal corners"):
        read("stl", np.zeros((5, 3, 3)))


def test_bytes_and_open_files_are_taken_and_nothing_else() -> None:
    octets = binary(ball(8))
    for given in (octets, bytearray(octets), memoryview(octets), io.BytesIO(octets)):
        assert len(engine.read_mesh(given, "stl").faces) == len(ball(8))
    for bad in (None, "ball.stl", 3, [octets], np.zeros(3), b""):
        with pytest.raises(engine.InvalidInputError):
            engine.read_mesh(bad, "stl")  # type: ignore[arg-type]
    for bad in ("dae", b"stl", ["stl"], np.zeros(3), {}):
        with pytest.raises(engine.InvalidInputError, match="format must be one of"):
            engine.read_mesh(octets, bad)  # type: ignore[arg-type]


@pytest.mark.parametrize("ending", ["stl", "obj", "off", "ply", "glb"])
def test_a_path_and_the_first_bytes_tell_the_format(ending: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    for text in (False, True):
        path = tmp_path / f"box.{ending}"
        kind = {"stl": "stl_ascii"}.get(ending, ending) if text else ending
        octets = box.export(file_type=kind)
        path.write_bytes(octets.encode() if isinstance(octets, str) else octets)
        meshes = [
            engine.read_mesh(given) for given in (path, str(path), path.read_bytes(), io.BytesIO(path.read_bytes()))
        ]
        assert all(mesh.solid() == meshes[0].solid() for mesh in meshes)
        assert sorted(map(tuple, meshes[0].vertices.tolist())) == sorted(map(tuple, box.vertices.tolist()))
        assert engine.locate([(0, 0, 0), (0.5, 0, 0), (9, 9, 9)], meshes[0].solid()).tolist() == [1, 0, -1]
    path.rename(tmp_path / "box.data")
    assert engine.read_mesh(tmp_path / "box.data").solid() == meshes[0].solid()
    with pytest.raises(engine.InvalidInputError, match="there is no such file"):
        engine.read_mesh(path)


@pytest.mark.parametrize("ending", ["stl", "obj", "off", "ply"])
def test_these_formats_need_no_other_package(ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    octets = pytest.importorskip("trimesh").creation.box().export(file_type=ending)
    monkeypatch.setitem(sys.modules, "trimesh", None)
    assert engine.read_mesh(octets.encode() if isinstance(octets, str) else octets).solid().n_faces == 12
    with pytest.raises(engine.InvalidInputError, match="glb files need the package trimesh"):
        engine.read_mesh(b"glTF")


def test_no_facet_of_a_text_file_is_lost() -> None:
    """Facets may stand on one line, in capitals, behind a byte order mark; what has not three corners is refused."""
    facet = "facet normal 0 0 1 outer loop vertex {} vertex {} vertex {} endloop endfacet"
    corners = ("0 0 0", "1 0 0", "0 1 0", "0 0 1")
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    lines = [facet.format(*(corners[k] for k in face)) for face in faces]
    for text in ("\n".join(lines), " ".join(lines), "\n".join(lines).upper(), "\r".join(lines)):
        octets = f"solid x\n{text}\nendsolid x\n".encode()
        for given in (octets, b"\xef\xbb\xbf" + octets):
            assert engine.read_mesh(given, "stl").solid().n_faces == 4
    for bad in (lines[0].replace("vertex 1 0 0", "", 1), lines[0].replace("0 1 0", "0 1_0 0"), lines[0][:-9]):
        with pytest.raises(engine.InvalidInputError):
            engine.read_mesh(f"solid x\n{bad}\n".encode(), "stl")


def test_damaged_stl_files_are_refused() -> None:
    octets = binary(ball(8))
    for damaged in (octets[:-1], octets + b"\0", octets[:50], b"solid x\n vertex 1 2\n", b"solid x\n vertex 1 2 3\n"):
        with pytest.raises(engine.InvalidInputError):
            engine.read_mesh(damaged, "stl")


def test_the_command_line_says_how_many_are_left_out(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    corners = 3 * ball(56) + FAR
    (tmp_path / "ball.stl").write_bytes(binary(corners))
    (tmp_path / "p.csv").write_text("448262,5411932,150\n")
    arguments = ["contains", str(tmp_path / "ball.stl"), str(tmp_path / "p.csv")]
    assert main(arguments) == 0
    found = capsys.readouterr()
    assert found.out.split() == ["location", "inside"]
    assert f"ball.stl: {has_equal(corners).sum()} triangles have two equal corners and are left out" in found.err
    assert main([*arguments, "--quiet"]) == 0
    assert not capsys.readouterr().err


CONCAVE = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 1, 0], [0, 4, 0]]
QUAD = [[3, 0, 0], [0, 0, 0], [0, 3, 0], [1, 1, 0]]
PLY = (
    "ply\nformat ascii 1.0\nelement vertex {}\n{}element face {}\nproperty list uchar int vertex_indices\nend_header\n"
)


def polygons(kind: str, vertices: Any, faces: Any) -> bytes:
    if kind == "obj":
        lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {' '.join(str(i + 1) for i in f)}" for f in faces]
        return "\r\n".join(["\ufeff# made by hand", *lines]).encode()
    rows = [*(f"{x} {y} {z}" for x, y, z in vertices), *(f"{len(f)} {' '.join(map(str, f))}" for f in faces)]
    if kind == "off":
        return "\n".join([f"OFF # by hand\n{len(vertices)} {len(faces)} 0", *rows, ""]).encode()
    axes = "".join(f"property double {axis}\n" for axis in "xyz")
    if kind == "ply":
        return (PLY.format(len(vertices), axes, len(faces)) + "\n".join(rows) + "\n").encode()
    head = PLY.format(len(vertices), axes, len(faces)).replace("ascii", "binary_little_endian").encode()
    corners = [np.uint8(len(f)).tobytes() + np.array(f, "<i4").tobytes() for f in faces]
    return head + np.array(vertices, "<f8").tobytes() + b"".join(corners)


@pytest.mark.parametrize("vertices", [CONCAVE, QUAD], ids=["pentagon", "quad"])
@pytest.mark.parametrize("kind", ["obj", "off", "ply", "ply binary"])
def test_polygons_are_cut_as_the_constructors_cut_them(kind: str, vertices: Any) -> None:
    """trimesh makes fans: a ball in the notch of a concave face met the surface."""
    n = len(vertices)
    mesh = engine.read_mesh(polygons(kind, vertices, [list(range(n))]), kind.partition(" ")[0])
    own = engine.Surface(vertices, [list(range(n))])
    assert mesh.faces.tolist() == own.triangles.tolist()
    assert mesh.faces_in_file.tolist() == [0] * (n - 2)
    notch = engine.Sphere([2.5, 2.2, 0] if n == 5 else [1.2, 1.2, 0], 0.05)
    assert engine.collide(mesh.solid(engine.Surface), notch).relation == engine.Relation.DISJOINT


@pytest.mark.parametrize("kind", ["obj", "off", "ply"])
def test_triangles_and_polygons_stand_in_the_order_of_the_file(kind: str) -> None:
    vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]]
    faces = [[0, 1, 4], [3, 2, 1, 0], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    mesh = engine.read_mesh(polygons(kind, vertices, faces), kind)
    assert mesh.faces_in_file.tolist() == [0, 1, 1, 2, 3, 4]
    assert engine.locate([[0.3, 0.3, 0.2], [0.9, 0.9, 0.9]], mesh.solid()).tolist() == [1, -1]
    faces[3].reverse()
    with pytest.raises(engine.InconsistentOrientationError, match="of face"):
        engine.read_mesh(polygons(kind, vertices, faces), kind).solid()
    with pytest.raises(engine.FaceNotSimpleError, match=r"faces\[1\] = \[0, 2, 1, 3\]"):
        engine.read_mesh(polygons(kind, vertices, [faces[0], [0, 2, 1, 3]]), kind)
    with pytest.raises(engine.IndexOutOfRangeError, match="face 1 names vertex 7, the file holds 5"):
        engine.read_mesh(polygons(kind, vertices, [faces[0], [0, 1, 2, 7]]), kind)
    vertices[2][2] = float("nan")  # type: ignore[call-overload]
    with pytest.raises(engine.NotFiniteError, match=r"vertices\[2"):
        engine.read_mesh(polygons(kind, vertices, faces), kind).solid()


def test_sides_of_polygons_that_rounding_makes_points_are_left_out() -> None:
    """Two of a prism's vertices are one in single precision: a side of it is a triangle then, and it stays closed."""
    low = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [2, 2, 0], [0, 2, 0]]
    vertices = low + [[x, y, 1] for x, y, _ in low]
    vertices[7], vertices[8] = [2, 2, 1], [1, 2, 1]
    sides = [[i, (i + 1) % 5, (i + 1) % 5 + 5, i + 5] for i in range(5)]
    mesh = engine.read_mesh(polygons("obj", vertices, [[4, 3, 2, 1, 0], [5, 6, 7, 8, 9], *sides]), "obj")
    assert engine.locate([[1, 1, 0.5], [3, 1, 0.5]], mesh.solid()).tolist() == [1, -1]


SHORT = ("3 1 0\n{}2 0 1\n", "3 1 0\n{}3 0 1\n", "3 2 0\n{}3 0 1 2\n", "3 1 0\n0 0 0\n1 0 0\n", "")


@pytest.mark.parametrize("text", SHORT)
def test_off_files_that_say_too_little_are_refused(text: str) -> None:
    with pytest.raises(engine.InvalidInputError, match="cannot be read as off"):
        engine.read_mesh(b"OFF " + text.format("0 0 0\n1 0 0\n0 1 0\n").encode(), "off")


FLAT = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
SPOTS = b"0 0 0\n1 0 0\n0 1 0\n"


@pytest.mark.parametrize(("octets", "file_format", "words"), [
    (FLAT + b"f 1 2 99999999999999999999\n", None, "names vertex 9223372036854775807"),
    (FLAT + b"f 1 2 1_3\n", None, "no numbers"),
    (FLAT.replace(b"1", b"1_0", 1) + b"f 1 2 3\n", None, "no numbers"),
    (b"OFF\n3 1 0\n" + SPOTS.replace(b"1", b"1_0", 1) + b"3 0 1 2\n", None, "numbers alone"),
    (b"OFF\n-1 1 0\n" + SPOTS + b"3 0 1 2\n", None, "-1 vertices"),
    (b"OFF\n3 -1 0\n" + SPOTS + b"3 0 1 2\n", None, "-1 faces"),
    (b"4OFF\n3 1 0\n0 0 0 2\n1 0 0 2\n0 1 0 2\n3 0 1 2\n", "off", "begins with OFF"),  # of homogeneous coordinates
    (b"solid of bytes".ljust(80) + b"\1\0\0\0" + bytes(52), None, "a binary file of 1 triangles has 134 bytes"),
    (b"\x1f\x8b\b\0" + bytes(200), None, "compressed"),
])  # fmt: skip
def test_what_readers_would_take_wrongly_is_refused(octets: bytes, file_format: str | None, words: str) -> None:
    with pytest.raises(engine.InvalidInputError, match=words):
        engine.read_mesh(octets, file_format)


def test_off_with_normals_and_colours() -> None:
    for head, row in ((b"NOFF", b" 0 0 1"), (b"# made by\nCOFF", b" 255 0 0 255"), (b"STOFF", b" 0 1")):
        octets = head + b"\n3 1 0\n" + SPOTS.replace(b"\n", row + b"\n") + b"3 0 1 2\n"
        assert engine.read_mesh(octets).vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
