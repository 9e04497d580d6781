"""/metrics counts what was answered, by operation, status and phase."""

from __future__ import annotations

import httpx
import pytest

from tests.unit.service.asking import SPHERE

pytestmark = pytest.mark.anyio


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
