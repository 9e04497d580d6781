"""POST /v1/compare."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.schemas.points import CompareResponse
from tests.unit.service.asking import check_problem

pytestmark = pytest.mark.anyio
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
BODY = {"type": "polyhedron", "vertices": CORNERS, "faces": FACES}
BOX = {"type": "aabb", "min": [0, 0], "max": [1, 3]}
BALL = {"type": "sphere", "center": [0, 0], "radius": 1}


@pytest.mark.parametrize(
    ("question", "method"),
    [
        ({"operation": "contains", "solid": BODY, "points": [[0.1, 0.1, 0.1], [1, 1, 1]]}, "half-line"),
        ({"operation": "collide", "first": BODY, "second": BODY, "method": "volumes first"}, "volumes first"),
        ({"operation": "clip_segments", "region": BOX, "segments": [[[-1, 1], [3, 1]]]}, "Cohen-Sutherland"),
        ({"operation": "clip_polygons", "region": BOX, "polygons": [[[0, 0], [4, 0], [0, 4]]]}, "Sutherland-Hodgman"),
    ],
)
async def test_both_answer(client: httpx.AsyncClient, question: dict[str, Any], method: str) -> None:
    answer = await client.post("/v1/compare", json=question)
    assert answer.status_code == 200, answer.text
    found = CompareResponse.model_validate_json(answer.content)
    assert found.method == method
    assert method in found.methods
    assert (found.differing.tolist(), found.accuracy.decisions) == ([], "exact")


@pytest.mark.parametrize(
    ("question", "code"),
    [
        ({"operation": "contains", "solid": BODY}, "invalid_request"),
        ({"operation": "contains", "solid": BALL, "points": [[0, 0]]}, "unsupported_solid"),
        ({"operation": "clip_segments", "region": BOX, "segments": [], "method": "x"}, "invalid_operation"),
    ],
)
async def test_what_is_not_compared_is_refused(client: httpx.AsyncClient, question: dict[str, Any], code: str) -> None:
    check_problem(await client.post("/v1/compare", json=question), 422, code)
