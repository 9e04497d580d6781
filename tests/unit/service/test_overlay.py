"""POST /v1/overlay and /v1/overlay/batch."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.schemas.clipping import OverlayBatchResponse, OverlayResponse
from tests.unit.service.asking import SPHERE, check_problem

pytestmark = pytest.mark.anyio


def square(low: float, high: float) -> list[list[float]]:
    return [[low, low], [high, low], [high, high], [low, high]]


def polygon(*rings: list[list[float]]) -> dict[str, Any]:
    return {"type": "polygon", "rings": list(rings)}


async def ask(client: httpx.AsyncClient, **change: object) -> httpx.Response:
    body = {"subject": polygon(square(0, 4)), "clip": polygon(square(1, 2)), "operation": "difference", **change}
    return await client.post("/v1/overlay", json=body)


async def test_pieces_are_the_coordinates_of_a_multipolygon(client: httpx.AsyncClient) -> None:
    answer = await ask(client)
    assert answer.status_code == 200, answer.text
    assert answer.json()["pieces"] == [
        {
            "shell": [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]],
            "holes": [[[1, 1], [1, 2], [2, 2], [2, 1], [1, 1]]],
        }
    ]
    assert (answer.json()["area"], answer.json()["collapsed"]) == (15.0, [])
    rounding = answer.json()["rounding"]
    assert (rounding["pieces_exact"], rounding["holes_exact"]) == (1, 1)
    OverlayResponse.model_validate_json(answer.content)


async def test_output_can_be_clipped_again(client: httpx.AsyncClient) -> None:
    first = (await ask(client)).json()["pieces"][0]
    answer = await ask(client, subject=polygon(first["shell"], *first["holes"]), operation="union")
    assert answer.json()["area"] == 16.0


async def test_nothing_left_is_no_piece(client: httpx.AsyncClient) -> None:
    answer = await ask(client, clip=polygon(square(5, 6)), operation="intersection")
    assert (answer.json()["pieces"], answer.json()["area"]) == ([], 0.0)


async def test_the_area_of_a_large_result_is_asked_for(client: httpx.AsyncClient) -> None:
    comb = [[x, y] for i in range(60) for x, y in ((2 * i, 0), (2 * i, 5), (2 * i + 1, 5), (2 * i + 1, 0))]
    body = {"subject": {"type": "polygon", "rings": [[*comb, [120, -1], [0, -1]]]}, "operation": "union"}
    body["clip"] = {"type": "polygon", "rings": [[[-9, -9], [-8, -9], [-8, -8]]]}
    assert "area" not in (await client.post("/v1/overlay", json=body)).json()
    assert (await client.post("/v1/overlay", json={**body, "area": True})).json()["area"] == 420.0
    small = {**body, "subject": body["clip"], "area": False}
    assert "area" not in (await client.post("/v1/overlay", json=small)).json()


async def test_area_beyond_float64_is_left_out(client: httpx.AsyncClient) -> None:
    answer = await ask(client, subject=polygon(square(-1e300, 1e300)), operation="union")
    assert answer.status_code == 200, answer.text
    assert "area" not in answer.json()
    assert answer.json()["pieces"][0]["shell"][0] == [-1e300, -1e300]


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"operation": "xor"}, "invalid_request", "/operation"),
        ({"output": "valid"}, "unknown_field", "/output"),
        ({"grid": 3}, "invalid_input", "/grid"),
        ({"subject": SPHERE}, "unsupported_solid", "/subject"),
        ({"clip": SPHERE}, "unsupported_solid", "/clip"),
        ({"clip": polygon([[0, 0]])}, "ring_too_short", "/clip/rings/0"),
        ({"clip": polygon(square(0, 1), [[0, 0, 0]] * 3)}, "invalid_array", "/clip/rings/1/0"),
    ],
)
async def test_what_is_wrong_is_named(
    client: httpx.AsyncClient, change: dict[str, object], code: str, pointer: str
) -> None:
    problem = check_problem(await ask(client, **change), 422, code)
    assert problem["errors"][0]["pointer"] == pointer


async def test_borders_are_joined_on_a_grid(client: httpx.AsyncClient) -> None:
    body = {"subject": polygon(square(0, 1)), "clip": polygon([[1.0000001, 0], [2, 0], [2, 1], [0.9999999, 1]])}
    answer = (await ask(client, **body, operation="union", grid=1e-3)).json()
    assert answer["pieces"] == [{"shell": [[0, 0], [2, 0], [2, 1], [0, 1], [0, 0]], "holes": []}]
    assert (answer["area"], answer["rounding"]["snapped"]) == (2.0, True)
    assert 0 < answer["rounding"]["largest_displacement"] < 1e-3


async def test_batch_is_each_pair_alone(client: httpx.AsyncClient) -> None:
    subjects = [polygon(square(0, 4)), polygon(), polygon(square(-1e300, 1e300))]
    clips = [polygon(square(1, 2)), polygon(square(0, 1)), polygon([[0, 0], [1, 0]])]
    for operation in ("difference", "union"):
        body = {"subjects": subjects, "clips": clips, "operation": operation}
        answer = await client.post("/v1/overlay/batch", json=body)
        assert answer.status_code == 200, answer.text
        for pair, subject, clip in zip(answer.json()["overlays"], subjects, clips, strict=True):
            alone = (await ask(client, subject=subject, clip=clip, operation=operation)).json()
            assert (pair["status"], pair["pieces"]) == ("done", alone["pieces"])
            assert pair["largest_displacement"] == alone["rounding"]["largest_displacement"]
        OverlayBatchResponse.model_validate_json(answer.content)


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"clips": []}, "invalid_array", "/clips"),
        ({"clips": [SPHERE]}, "unsupported_solid", "/clips/0"),
        ({"subjects": [polygon([[0, 0]])]}, "ring_too_short", "/subjects/0/rings/0"),
        ({"grid": 1}, "unknown_field", "/grid"),
    ],
)
async def test_what_is_wrong_with_a_batch_is_named(
    client: httpx.AsyncClient, change: dict[str, object], code: str, pointer: str
) -> None:
    body = {"subjects": [polygon(square(0, 1))], "clips": [polygon(square(0, 1))], "operation": "union", **change}
    problem = check_problem(await client.post("/v1/overlay/batch", json=body), 422, code)
    assert problem["errors"][0]["pointer"] == pointer


async def test_lost_area_beyond_float64_is_left_out(client: httpx.AsyncClient) -> None:
    scale = 2.0**1000
    sliver = [[scale, scale], [2 * scale, scale], [2 * scale, (1 + 2.0**-52) * scale]]
    around = [[1.25 * scale, 0], [1.5 * scale, 0], [1.5 * scale, 4 * scale], [1.25 * scale, 4 * scale]]
    answer = await ask(client, subject=polygon(sliver), clip=polygon(around), operation="intersection")
    assert answer.status_code == 200, answer.text
    assert answer.json()["collapsed"] == [{"kind": "piece", "near": [1.25 * scale, scale]}]
