"""POST /v1/volume, /v1/section, /v1/cut, /v1/overlap."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import httpx
import numpy as np
import pytest

import engine

pytestmark = pytest.mark.anyio

CUBE = {
    "type": "polyhedron",
    "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]],
    "faces": [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
}
BOX = {"type": "aabb", "min": [0.5, 0.5, 0.5], "max": [2, 2, 2]}


async def ask(client: httpx.AsyncClient, path: str, **question: Any) -> tuple[int, Any]:
    answer = await client.post(f"/v1/{path}", json=question)
    return answer.status_code, answer.json()


async def test_measures_of_solids(client: httpx.AsyncClient) -> None:
    stored = (await client.post("/v1/solids", json=CUBE)).json()["id"]
    for solid in (CUBE, {"type": "stored", "id": stored}):
        status, answer = await ask(client, "volume", solid=solid)
        assert (status, answer["volume"], answer["area"], answer["centroid"]) == (200, 1.0, 6.0, [0.5] * 3)
    _, answer = await ask(client, "volume", solid={"type": "polygon", "rings": [[[0, 0], [2, 0], [0, 2]]]})
    assert "volume" not in answer
    assert answer["area"] == 2.0
    _, answer = await ask(client, "volume", solid={**CUBE, "type": "surface"})
    assert answer.keys() == {"area", "accuracy"}
    _, answer = await ask(client, "volume", solid={"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 0]})
    assert (answer["volume"], answer["area"], "centroid" in answer) == (0.0, 2.0, False)
    status, problem = await ask(client, "volume", solid={"type": "half_space", "normal": [1, 0], "offset": 0})
    assert (status, problem["code"]) == (422, "unsupported_solid")


async def test_sections(client: httpx.AsyncClient) -> None:
    status, answer = await ask(client, "section", solid=CUBE, heights=[0.25, 3])
    assert (status, len(answer["sections"])) == (200, 2)
    (piece,) = answer["sections"][0]["pieces"]
    assert piece["area"] == 1.0
    assert piece["holes"] == []
    assert {position[2] for position in piece["shell"]} == {0.25}
    _, answer = await ask(client, "section", solid=CUBE, planes=[[0, 0, -1, 0.25]], flat=True)
    assert {len(position) for position in answer["sections"][0]["pieces"][0]["shell"]} == {2}
    status, problem = await ask(client, "section", solid=CUBE, heights=[0.5], planes=[[0, 0, 1, 0]])
    assert (status, problem["errors"][0]["pointer"]) == (422, "/heights")
    status, problem = await ask(client, "section", solid=CUBE, through=[[0, 0, 0], [1, 1, 1], [2, 2, 2]])
    assert (status, problem["code"], problem["errors"][0]["pointer"]) == (422, "zero_normal", "/through")


async def test_cuts(client: httpx.AsyncClient) -> None:
    status, answer = await ask(client, "cut", solid=CUBE, region=BOX)
    (part,) = answer["parts"]
    assert (status, part["volume"], part["area"], min(part["origins"])) == (200, 0.125, 1.5, -5)
    half = {"type": "half_space", "normal": [0, 0, 1], "offset": -1}
    _, answer = await ask(client, "cut", solid=CUBE, region=half, keep="both")
    assert [(part["volume"], len(part["faces"]) > 0) for part in answer["parts"]] == [(0.0, False), (1.0, True)]
    _, answer = await ask(client, "cut", solid=CUBE, region=BOX, keep="outside")
    assert [(part["volume"], part["area"]) for part in answer["parts"]] == [(0.875, 6.0)]
    status, problem = await ask(client, "cut", solid=BOX, region=BOX)
    assert (status, problem["errors"][0]["pointer"]) == (422, "/solid")


async def test_overlaps(client: httpx.AsyncClient) -> None:
    status, answer = await ask(client, "overlap", first=CUBE, second=BOX)
    assert (status, answer["overlaps"]) == (200, [{"overlap": 0.125, "iou": 0.029411764705882353}])
    still = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    poses = [{"rotation": still, "translation": [-0.5, -0.5, -0.5]}, {"rotation": still, "translation": [9, 0, 0]}]
    _, answer = await ask(client, "overlap", first=CUBE, second=BOX, poses=poses)
    assert [each["overlap"] for each in answer["overlaps"]] == [1.0, 0.0]
    status, problem = await ask(
        client, "overlap", first=CUBE, second={"type": "sphere", "center": [0] * 3, "radius": 1}
    )
    assert (status, problem["code"]) == (422, "unsupported_pair")
    flat = {"type": "polygon", "rings": [[[0, 0], [1, 0], [0, 1]]]}
    for first, second in ((flat, BOX), (BOX, flat), (CUBE, {"type": "aabb", "min": [0, 0], "max": [1, 1]})):
        status, problem = await ask(client, "overlap", first=first, second=second)
        assert (status, problem["code"], problem["errors"][0]["pointer"]) == (422, "wrong_dimension", "/second")


@pytest.mark.parametrize("kind", ["ply", "off", "stl"])
async def test_a_cut_is_answered_as_the_file_that_is_preferred(client: httpx.AsyncClient, kind: str) -> None:
    """Read back it is the mesh of the JSON answer, double by double."""
    solid = {**CUBE, "vertices": [[x / 3, y / 7, z * 1e-9] for x, y, z in CUBE["vertices"]]}
    half = {"type": "half_space", "normal": [1, 2, 3], "offset": -0.2}
    for keep in ("inside", "outside"):
        question = {"solid": solid, "region": half, "keep": keep}
        (part,) = (await client.post("/v1/cut", json=question)).json()["parts"]
        accept = f"application/json;q=0.5, text/html, model/{kind}"
        answer = await client.post("/v1/cut", json=question, headers={"Accept": accept})
        assert (answer.status_code, answer.headers["content-type"]) == (200, f"model/{kind}")
        assert "collapsed=0, folded=0" in answer.headers["geometry-accuracy"]
        mesh = engine.read_mesh(BytesIO(answer.content))
        vertices = np.array(part["vertices"])
        assert (mesh.vertices[mesh.faces] == vertices[np.array(part["faces"])]).all()


async def test_a_file_takes_one_part_and_json_is_what_others_get(client: httpx.AsyncClient) -> None:
    question = {"solid": CUBE, "region": BOX, "keep": "both"}
    answer = await client.post("/v1/cut", json=question, headers={"Accept": "model/ply"})
    assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, "/keep")
    for accept in ("*/*", "text/html", "model/obj", "model/ply;q=0.1, application/json", "model/ply;q=0", "\xe9;q=x,,"):
        answer = await client.post("/v1/cut", json=question, headers={b"Accept": accept.encode("latin-1")})
        assert (answer.status_code, len(answer.json()["parts"])) == (200, 2), accept
    nothing = {"solid": CUBE, "region": {"type": "half_space", "normal": [0, 0, 1], "offset": -1}}
    answer = await client.post("/v1/cut", json=nothing, headers={"Accept": "model/off"})
    assert answer.content == b"OFF\n0 0 0\n"
