"""POST /v1/bounds."""

from __future__ import annotations

import httpx
import pytest

from service.schemas.points import BoundsResponse
from tests.unit.service.asking import check_problem

pytestmark = pytest.mark.anyio


async def test_box_and_sphere(client: httpx.AsyncClient) -> None:
    triangle = {"type": "triangle", "vertices": [[0, 0], [4, 0], [4, 3]]}
    answer = await client.post("/v1/bounds", json={"solid": triangle})
    assert answer.status_code == 200, answer.text
    assert answer.json()["aabb"] == {"min": [0.0, 0.0], "max": [4.0, 3.0]}
    assert answer.json()["sphere"] == {"center": [2.0, 1.5], "radius": 2.5}
    BoundsResponse.model_validate_json(answer.content)


@pytest.mark.parametrize(
    ("solid", "code", "pointer"),
    [
        ({"type": "half_space", "normal": [1, 0], "offset": 0}, "unsupported_solid", "/solid"),
        ({"type": "convex", "planes": [[1, 0, 0]]}, "unsupported_solid", "/solid/planes"),
        (
            {"type": "convex", "planes": [[1, 0, -1], [-1, 0, 0], [0, 1, 0], [0, -1, 1]]},
            "empty_geometry",
            "/solid/planes",
        ),
        ({"type": "aabb", "min": [-1.7e308, -1.7e308], "max": [1.7e308, 1.7e308]}, "not_representable", ""),
    ],
)
async def test_what_has_no_bounds_is_refused(
    client: httpx.AsyncClient, solid: dict[str, object], code: str, pointer: str
) -> None:
    problem = check_problem(await client.post("/v1/bounds", json={"solid": solid}), 422, code)
    assert problem["errors"][0]["pointer"] == pointer
    name = (await client.post("/v1/solids", json=solid)).json()["id"]
    problem = check_problem(await client.post("/v1/bounds", json={"solid": {"type": "stored", "id": name}}), 422, code)
    assert problem["errors"][0]["pointer"] in ("/solid", "")
