"""What the service shows of itself: pages, documents, counts."""

from __future__ import annotations

import re

import httpx
import pytest

from tests.unit.service.asking import SHEET, SPHERE, examples, of_scene

pytestmark = pytest.mark.anyio


@pytest.mark.parametrize("path", ["/docs", "/redoc"])
async def test_page_asks_nobody_else(client: httpx.AsyncClient, path: str) -> None:
    answer = await client.get(path)
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "unsafe-inline" not in answer.headers["content-security-policy"].split("style-src")[0]
    assert not re.search(r"https?://", answer.text)
    parts = re.findall(r'(?:src|href)="([^"]+)"', answer.text)
    assert sum("docs-files" in part for part in parts) > 0
    for part in parts:
        if not part.startswith("data:"):
            assert (await client.get("/" + part)).status_code == 200, part


async def test_every_request_has_an_example_and_each_is_answered(client: httpx.AsyncClient) -> None:
    document = (await client.get("/openapi.json")).json()
    assert len(examples(document)) > 8
    sheet = (await client.post("/v1/scenes", json=SHEET)).json()["id"]
    for path, example in examples(document):
        answer = await client.post(of_scene(path, sheet), json=example)
        assert answer.status_code in (200, 201), (path, answer.text)


async def test_answers_are_counted_by_operation_and_status(client: httpx.AsyncClient) -> None:
    body = {"solid": SPHERE, "points": [[0, 0, 0]]}
    assert (await client.post("/v1/contains", json=body)).status_code == 200
    assert (await client.post("/v1/contains", json={**body, "points": "none"})).status_code == 422
    answer = await client.get("/metrics")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/plain; version=0.0.4; charset=utf-8")
    lines = answer.text.splitlines()
    assert 'geometry_requests_total{operation="contains",status="200"} 1.0' in lines
    assert 'geometry_requests_total{operation="contains",status="422"} 1.0' in lines
    assert 'geometry_phase_seconds_count{operation="contains",phase="compute"} 2.0' in lines
