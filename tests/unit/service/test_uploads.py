"""Files of meshes put into the store by POST /v1/solids: as the body, and in a form."""

from __future__ import annotations

import gzip
import struct
from typing import Any

import httpx
import pytest

import engine
from tests.unit.service.asking import check_problem

pytestmark = pytest.mark.anyio
CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
OFF = (
    "OFF\n4 4 0\n" + "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS) + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES)
)
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)
STL = b"\r\n--x".ljust(80) + struct.pack("<I", 4) + b"".join(
    struct.pack("<12fH", 0, 0, 0, *(x for corner in face for x in CORNERS[corner]), 0x0A0D) for face in FACES
)  # fmt: skip
OPEN = OFF.replace("4 4 0", "4 3 0").removesuffix("3 0 3 2\n")


@pytest.mark.parametrize(("kind", "content"), [("stl", STL), ("obj", OBJ.encode()), ("off", OFF.encode())])
async def test_a_file_is_a_body(client: httpx.AsyncClient, kind: str, content: bytes) -> None:
    answer = await client.post("/v1/solids", content=content, headers={"content-type": f"model/{kind}; x=y"})
    assert (answer.status_code, answer.json()["faces"]) == (201, 4), answer.text
    assert answer.headers["location"] == f"/v1/solids/{answer.json()['id']}"
    again = await client.post(
        "/v1/solids",
        content=gzip.compress(content),
        headers={"content-type": f"model/{kind}", "content-encoding": "gzip"},
    )
    assert (again.status_code, again.json()["id"]) == (200, answer.json()["id"])
    inside = {"solid": {"type": "stored", "id": answer.json()["id"]}, "points": [[0.1, 0.1, 0.1], [1, 1, 1]]}
    assert (await client.post("/v1/contains", json=inside)).json()["contained"] == [True, False]


@pytest.mark.parametrize(("name", "content"), [
    ("a.stl", STL), ("a.OBJ", OBJ.encode()), ("a.off", OFF.encode()), ("a", STL), ("mesh.bin", OFF.encode()),
])  # fmt: skip
async def test_a_file_is_a_field_of_a_form(client: httpx.AsyncClient, name: str, content: bytes) -> None:
    answer = await client.post("/v1/solids", files={"file": (name, content)})
    assert (answer.status_code, answer.json()["faces"]) == (201, 4), answer.text
    surface = await client.post("/v1/solids", files={"file": (name, content)}, data={"type": "surface"})
    assert surface.json()["type"] == "surface"


FORM = b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.off"\r\n\r\n' + OFF.encode() + b"\r\n--b--\r\n"


@pytest.mark.parametrize(("kind", "content", "status", "code"), [
    ("model/stl", b"nonsense", 422, "invalid_mesh"),
    ("model/off", OPEN.encode(), 422, "not_closed"),
    ("model/step", OFF.encode(), 415, "unsupported_media_type"),
    ("multipart/form-data", FORM, 400, "bad_request"),
    ("multipart/form-data; boundary=c", FORM, 400, "bad_request"),
    ("multipart/form-data; boundary=b", FORM[:-12], 400, "bad_request"),
    ("multipart/form-data; boundary=b", FORM.replace(b"\r\n\r\n", b"", 1), 400, "bad_request"),
    ("multipart/form-data; boundary=b", FORM.replace(b'"file"', b'"mesh"'), 422, "invalid_request"),
    ("multipart/form-data; boundary=b", b"--b--", 422, "invalid_request"),
    ("multipart/form-data; boundary=b", FORM[:-7] * 40 + FORM, 400, "bad_request"),
    ("multipart/form-data; boundary=b", FORM.replace(b".off", b".glb"), 422, "invalid_mesh"),
])  # fmt: skip
async def test_what_is_no_mesh_is_refused(
    client: httpx.AsyncClient, kind: str, content: bytes, status: int, code: str
) -> None:
    answer: Any = await client.post("/v1/solids", content=content, headers={"content-type": kind})
    check_problem(answer, status, code)


async def test_a_form_of_a_solid_is_read_once(client: httpx.AsyncClient) -> None:
    """`boundary` in quotes, and a mesh equal to the one in JSON."""
    headers = {"content-type": 'multipart/form-data; boundary="b"'}
    answer = await client.post("/v1/solids", content=FORM, headers=headers)
    body = {"type": "polyhedron", "vertices": CORNERS, "faces": FACES}
    assert (await client.post("/v1/solids", json=body)).json()["id"] == answer.json()["id"]
    assert engine.read_mesh(OFF.encode()).solid() == engine.Polyhedron(CORNERS, FACES)


MESH = {"vertices": CORNERS, "faces": FACES}


async def test_a_mesh_is_inspected_before_it_is_stored(client: httpx.AsyncClient) -> None:
    sound = (await client.post("/v1/solids/inspect", json=MESH)).json()
    assert (sound["closed"], sound["shells"], sound["advice"]) == (True, 1, [])
    assert "vertices" not in sound
    answer = await client.post("/v1/solids/inspect", json={**MESH, "faces": FACES[:-1]})
    assert answer.json()["open_edges"] == [[0, 2], [0, 3], [2, 3]]
    assert [each["kind"] for each in answer.json()["advice"]] == ["open_edges"]
    turned = {**MESH, "faces": [FACES[0][::-1], *FACES[1:]], "orient": True}
    mended = (await client.post("/v1/solids/inspect", json=turned)).json()
    assert (mended["closed"], mended["mended"]) == (True, ["orient: 1 faces are turned"])
    stored = {"type": "polyhedron", "vertices": mended["vertices"], "faces": mended["faces"]}
    assert (await client.post("/v1/solids", json=stored)).status_code == 201
    for question in ({"content": OPEN, "headers": {"content-type": "model/off"}}, {"files": {"file": ("a.off", OPEN)}}):
        found = (await client.post("/v1/solids/inspect", **question)).json()  # type: ignore[arg-type]
        assert len(found["open_edges"]) == 3
        assert len(found["faces"]) == 3


async def test_what_cannot_be_inspected_is_refused(client: httpx.AsyncClient) -> None:
    problem = check_problem(
        await client.post("/v1/solids/inspect", json={**MESH, "faces": [[0, 1, 9]]}), 422, "index_out_of_range"
    )
    assert problem["errors"][0]["pointer"] == "/faces/0/2"
    check_problem(await client.post("/v1/solids/inspect", json={**MESH, "weld": -1}), 422, "invalid_input")
    headers = {"content-type": "model/stl"}
    check_problem(await client.post("/v1/solids/inspect", content=b"x", headers=headers), 422, "invalid_mesh")


MENDS = [
    (OPEN, "", [], 3),
    (OFF.replace("3 0 2 1", "3 0 1 2"), "orient=true", ["orient: 1 faces are turned"], 0),
    (OFF, "orient=false", [], 0),
    (OPEN, "fill_t_junctions=true", ["fill_t_junctions: 0 sides of faces are split at the vertices on them"], 3),
    (
        OFF,
        "weld=0",
        ["weld: 0 vertices are made one with another, moved by 0.0 at most on an axis; 0 faces collapsed"],
        0,
    ),
    (OFF, "weld=2&orient=1", ["weld: 3 vertices", "orient: 0 faces"], 0),
]


@pytest.mark.parametrize(("text", "query", "mended", "n_open"), MENDS)
async def test_a_file_is_inspected_after_the_mends_of_the_query(
    client: httpx.AsyncClient, text: str, query: str, mended: list[str], n_open: int
) -> None:
    for question in ({"content": text, "headers": {"content-type": "model/off"}}, {"files": {"file": ("a.off", text)}}):
        answer = await client.post(f"/v1/solids/inspect?{query}", **question)  # type: ignore[arg-type]
        assert answer.status_code == 200, answer.text
        assert len(answer.json()["open_edges"]) == n_open
        said = answer.json()["mended"]
        assert len(said) == len(mended)
        assert all(sentence.startswith(begun) for sentence, begun in zip(said, mended, strict=True)), said


@pytest.mark.parametrize("query", ["weld=-1", "weld=nan", "weld=x", "orient=perhaps", "weld="])
async def test_mends_that_are_none_are_refused(client: httpx.AsyncClient, query: str) -> None:
    answer = await client.post(f"/v1/solids/inspect?{query}", content=OFF, headers={"content-type": "model/off"})
    assert check_problem(answer, 422, answer.json()["code"])["code"] in ("invalid_request", "invalid_input")


async def test_a_distance_of_zero_is_one(client: httpx.AsyncClient) -> None:
    """Faces that name a vertex twice are left out; a polyhedron is not taken with them."""
    mesh = {**MESH, "faces": [*FACES, (0, 0, 1)]}
    assert not (await client.post("/v1/solids/inspect", json=mesh)).json()["closed"]
    answer = (await client.post("/v1/solids/inspect", json={**mesh, "weld": 0})).json()
    assert (answer["closed"], len(answer["faces"])) == (True, 4)


async def test_a_face_on_itself_is_filled(client: httpx.AsyncClient) -> None:
    corners = [[1, 1, 1], [1, 0, 0], [0, 1, 1], [2, 1, 1]]
    faces = [[2, 2, 3], [1, 2, 3], [0, 1, 2], [0, 2, 1], [3, 2, 0], [3, 2, 2], [2, 0, 1], [2, 3, 1], [0, 3, 3]]
    answer = await client.post(
        "/v1/solids/inspect", json={"vertices": corners, "faces": faces, "fill_t_junctions": True}
    )
    assert answer.status_code == 200, answer.text


async def test_a_part_whose_headers_are_long_is_refused_at_once(client: httpx.AsyncClient) -> None:
    form = b"--b\r\n" + b'; name="a"' * 90_000 + b"\r\n\r\nx\r\n--b--"
    headers = {"content-type": "multipart/form-data; boundary=b"}
    check_problem(await client.post("/v1/solids", content=form, headers=headers), 400, "bad_request")
