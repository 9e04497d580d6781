"""PLY without another package: text and binary of either order, lists of several lengths, what is broken."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1 / 3)]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
PYRAMID = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.5, 0.5, 1.0)]
SIDES = [[3, 2, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]


def header(form: str, n: int, m: int, kind: str = "double", name: str = "vertex_indices") -> bytes:
    lines = ["ply", f"format {form} 1.0", "comment made by hand", f"element vertex {n}"]
    lines += [f"property {kind} {axis}" for axis in "xyz"] + ["property uchar red", "element edge 1"]
    lines += ["property int a", f"element face {m}", "property uchar quality", f"property list uchar int {name}"]
    return "\n".join([*lines, "end_header", ""]).encode()


def text_of(corners: Any, faces: Any, **options: Any) -> bytes:
    rows = [" ".join([*map(repr, at), "255"]) for at in corners] + ["7"]
    rows += [" ".join(map(str, [9, len(face), *face])) for face in faces]
    return header("ascii", len(corners), len(faces), **options) + "\n".join(rows).encode()


def binary_of(corners: Any, faces: Any, order: str, **options: Any) -> bytes:
    form = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    body = b"".join(struct.pack(order + "3dB", *at, 255) for at in corners) + struct.pack(order + "i", 7)
    body += b"".join(struct.pack(f"{order}BB{len(face)}i", 9, len(face), *face) for face in faces)
    return header(form, len(corners), len(faces), **options) + body


def forms(corners: Any, faces: Any, **options: Any) -> list[bytes]:
    return [text_of(corners, faces, **options), *(binary_of(corners, faces, order, **options) for order in "<>")]


@pytest.mark.parametrize("octets", [*forms(CORNERS, FACES), *forms(CORNERS, FACES, name="vertex_index"),
                                    *(each.replace(b"\n", b"\r\n") for each in forms(CORNERS, FACES)[:1])])  # fmt: skip
def test_triangles_of_every_form(octets: bytes, tmp_path: Path) -> None:
    expected = engine.Polyhedron(CORNERS, FACES)
    assert engine.read_mesh(octets).solid() == expected  # told by its first bytes
    assert engine.read_mesh(io.BytesIO(octets), "ply").solid() == expected
    (tmp_path / "a.PLY").write_bytes(octets)
    assert engine.read_mesh(tmp_path / "a.PLY").solid() == expected
    with (tmp_path / "a.PLY").open("rb") as file:
        assert engine.read_mesh(file).solid() == expected


def test_faces_of_several_lengths() -> None:
    meshes = [engine.read_mesh(octets) for octets in forms(PYRAMID, SIDES)]
    for mesh in meshes:
        assert mesh.faces_in_file.tolist() == [0, 0, 1, 2, 3, 4]
        assert engine.locate([(0.5, 0.5, 0.5), (0.5, 0.5, 0.0)], mesh.solid()).tolist() == [1, 0]


def test_trimesh_reads_and_writes_the_same() -> None:
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(2)
    for form in ("ascii", "binary"):
        mesh = engine.read_mesh(ball.export(file_type="ply", encoding=form))
        assert np.allclose(mesh.vertices, ball.vertices, atol=1e-6)
        assert len(mesh.faces) == len(ball.faces)


@pytest.mark.parametrize(("octets", "words"), [
    (b"ply\n", "no header"),
    (text_of(CORNERS, FACES)[:-12], "PLY|ply"),
    (binary_of(CORNERS, FACES, "<")[:-1], "ply"),
    (text_of(CORNERS, FACES).replace(b"element face 4", b"element face 4000000000"), "more than the file has"),
    (text_of(CORNERS, FACES).replace(b"ascii", b"utf16"), "unknown"),
    (text_of(CORNERS, FACES).replace(b"property double z", b"property double w"), "ply"),
    (text_of(CORNERS, FACES).replace(b"double x", b"complex x"), "ply"),
    (binary_of(CORNERS, FACES, "<").replace(b"\x09\x03", b"\x09\xff"), "ply"),
])  # fmt: skip
def test_what_is_broken_is_refused(octets: bytes, words: str) -> None:
    with pytest.raises(engine.InvalidInputError, match=words):
        engine.read_mesh(octets, "ply")


def test_points_alone_are_no_mesh() -> None:
    octets = header("ascii", 4, 0) + b"\n".join(b"0 0 %d 1" % k for k in range(4)) + b"\n7\n"
    with pytest.raises(engine.EmptyGeometryError, match="holds no faces"):
        engine.read_mesh(octets)


def text_ply(corners: str, rows: str, axes: str = "xyz") -> bytes:
    properties = "".join(f"property float {axis}\n" for axis in axes)
    head = (
        f"ply\nformat ascii 1.0\nelement vertex 3\n{properties}element face 1\nproperty list {corners} vertex_indices"
    )
    return f"{head}\nend_header\n0 0 0\n1 0 0\n0 1 0\n{rows}\n".encode()


@pytest.mark.parametrize(("octets", "words"), [
    (text_ply("uchar float", "3 0 1.5 2"), "a type of whole numbers"),
    (text_ply("float int", "3 0 1 2"), "number of items of vertex_indices"),
    (text_ply("uchar int", "0"), "face 0 of the file has 0 corners"),
    (text_ply("uchar int", "2 0 1"), "face 0 of the file has 2 corners"),
    (text_ply("uchar int", "3 0 1 99999999999999999999"), "names vertex 9223372036854775807"),
    (text_ply("uchar int", "3 0 1 1_0"), "more than numbers"),
    (text_ply("uchar int", "3 0 1 2", "xyw"), "properties x, y and z"),
])  # fmt: skip
def test_what_would_be_taken_wrongly_is_refused(octets: bytes, words: str) -> None:
    with pytest.raises(engine.InvalidInputError, match=words):
        engine.read_mesh(octets)
