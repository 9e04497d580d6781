"""/docs and /redoc need nothing from outside, and every example in the document is answered."""

from __future__ import annotations

import re

import httpx
import pytest

from service.schemas.bodies import SCENE_ID
from tests.unit.service.asking import examples

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
    for path, example in examples(document):
        answer = await client.post(path.replace("{scene_id}", SCENE_ID), json=example)
        assert answer.status_code in (200, 201), (path, answer.text)
