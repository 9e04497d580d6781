"""Hits over HTTP: JSON and the binary lane say what the engine says, of stored solids and scenes too."""

from __future__ import annotations

from typing import Any

import httpx
import numpy as np
import pytest

import engine
from tests.unit.service.asking import check_problem

pytestmark = pytest.mark.anyio
OCTETS = {"Content-Type": "application/octet-stream"}
SHEET: dict[str, Any] = {
    "type": "surface", "vertices": [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], "faces": [[0, 1, 2], [0, 2, 3]]
}  # fmt: skip
RAYS = np.array([[[1, 2, 5], [0, 0, -1]], [[0, 1, 5], [0, 0, -1]], [[9, 9, 5], [0, 0, -1]]], np.float64)
TURNED = {"rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]], "translation": [4, 0, 1]}
SURFACE = engine.Surface(SHEET["vertices"], SHEET["faces"])


async def test_json_says_what_the_engine_says(client: httpx.AsyncClient) -> None:
    answer = (await client.post("/v1/hits", json={"surface": SHEET, "segments": RAYS.tolist(), "rays": True})).json()
    first, second = answer["hits"]
    assert first == {
        "segment": 0, "t": 5.0, "t_end": 5.0, "face": 1, "triangle": 1, "kind": "across",
        "barycentric": [0.5, 0.25, 0.25], "normal": [0.0, 0.0, 1.0],
    }  # fmt: skip
    assert (second["segment"], second["kind"]) == (1, "rim")
    assert answer["accuracy"]["decisions"] == "exact"
    question = {"surface": SHEET, "segments": RAYS.tolist(), "rays": True, "keep": "any"}
    assert (await client.post("/v1/hits", json=question)).json()["met"] == [True, True, False]
    nothing = (await client.post("/v1/hits", json={"surface": SHEET, "segments": []})).json()
    assert nothing["hits"] == []


async def test_stored_solids_and_scenes(client: httpx.AsyncClient) -> None:
    solid = (await client.post("/v1/solids", json=SHEET)).json()["id"]
    bodies = [{"solid": {"type": "stored", "id": solid}}, {"solid": SHEET, "pose": TURNED}]
    path = (await client.post("/v1/scenes", json={"bodies": bodies})).headers["location"]
    question = {"segments": RAYS.tolist(), "rays": True, "keep": "first"}
    answer = (await client.post(f"{path}/hits", json=question)).json()
    assert [(hit["segment"], hit["body"], hit["t"]) for hit in answer["hits"]] == [(0, 1, 4.0), (1, 1, 4.0)]
    lifted = {**TURNED, "translation": [4, 0, -1]}
    moved = await client.post(f"{path}/hits", json={**question, "moved": [{"body": 1, "pose": lifted}]})
    assert [hit["body"] for hit in moved.json()["hits"]] == [0, 0]
    raw = await client.post(f"/v1/solids/{solid}/hits?rays=true", content=RAYS.tobytes(), headers=OCTETS)
    rows = np.frombuffer(raw.content).reshape(-1, 12)
    here = engine.hits(RAYS, SURFACE, rays=True)
    np.testing.assert_array_equal(rows[:, :6], np.column_stack([getattr(here, name) for name in here.__slots__[:6]]))
    np.testing.assert_array_equal(rows[:, 6:], np.hstack([here.barycentric, here.normal]))
    raw = await client.post(f"{path}/binary/hits?rays=true", content=RAYS.tobytes(), headers=OCTETS)
    rows = np.frombuffer(raw.content).reshape(-1, 13)
    assert rows[:, :3].tolist() == [[0, 1, 4], [0, 0, 5], [1, 1, 4], [1, 0, 5]]
    raw = await client.post(f"{path}/binary/hits?rays=true&keep=any", content=RAYS.tobytes(), headers=OCTETS)
    assert np.frombuffer(raw.content, np.int8).tolist() == [1, 1, 0]


@pytest.mark.parametrize(
    ("body", "code", "pointer"),
    [
        ({"surface": {"type": "sphere", "center": [0, 0, 0], "radius": 1}}, "unsupported_solid", "/surface"),
        ({"segments": [[[0, 0], [1, 1]]]}, "wrong_dimension", "/segments"),
        ({"keep": "last"}, "invalid_request", "/keep"),
        ({"segments": [[[1, 2, 1e300], [0, 0, -1e-300]]], "rays": True}, "not_representable", ""),
    ],
)
async def test_what_is_refused(client: httpx.AsyncClient, body: dict[str, Any], code: str, pointer: str) -> None:
    question = {"surface": SHEET, "segments": RAYS.tolist(), **body}
    problem = check_problem(await client.post("/v1/hits", json=question), 422, code)
    assert pointer in [error["pointer"] for error in problem["errors"]]


async def test_a_scene_with_other_bodies_names_one(client: httpx.AsyncClient) -> None:
    box = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
    path = (await client.post("/v1/scenes", json={"bodies": [{"solid": SHEET}, {"solid": box}]})).headers["location"]
    problem = check_problem(await client.post(f"{path}/hits", json={"segments": []}), 422, "unsupported_solid")
    assert "hits does not take an aabb" in problem["detail"]
