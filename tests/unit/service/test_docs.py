"""/docs needs nothing from outside, lists everything, and every example in the document is answered."""

from __future__ import annotations

import re

import httpx
import pytest

from service.errors import STATUS
from tests.unit.service.asking import examples

pytestmark = pytest.mark.anyio


async def test_page_is_complete_and_asks_nobody_else(client: httpx.AsyncClient) -> None:
    answer = await client.get("/docs")
    page, document = answer.text, (await client.get("/openapi.json")).json()
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert not re.search(r"https?://|<script|<link|<img|@import", page)
    for path, item in document["paths"].items():
        assert all(f"{method.upper()} {path}" in page for method in item)
    assert all(f"id=model-{name}" in page for name in document["components"]["schemas"])
    assert all(f"<code>{code}</code>" in page for code in STATUS)
    links = re.findall(r"href=#([\w-]+)", page)
    assert all(f"id={link}>" in page for link in links)


async def test_every_request_has_an_example_and_each_is_answered(client: httpx.AsyncClient) -> None:
    document = (await client.get("/openapi.json")).json()
    assert len(examples(document)) > 8
    for path, example in examples(document):
        answer = await client.post(path, json=example)
        assert answer.status_code in (200, 201), (path, answer.text)
