"""The service in this process: an app with small limits, and a client that speaks ASGI to it."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator

import httpx
import pytest
from fastapi import FastAPI

import engine
from service.app import create_app
from service.settings import Settings
from tests.unit.service.asking import client_of


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture
def app(monkeypatch: pytest.MonkeyPatch) -> FastAPI:
    """An app whose kernels compile when first used: warming all of them is a test of its own."""
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    return create_app(Settings(max_body_bytes=2**20, deadline_seconds=300))


@pytest.fixture
async def client(app: FastAPI, anyio_backend: str) -> AsyncIterator[httpx.AsyncClient]:
    async with client_of(app) as client:
        yield client


@pytest.fixture(autouse=True)
def no_unexpected_failure(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """Fail any test in which the service met an error that it did not expect."""
    yield
    assert not [record for record in caplog.get_records("call") if record.name == "service" and record.levelno >= 40]
