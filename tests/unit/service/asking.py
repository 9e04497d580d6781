"""Asking the service in this process, and what every error answer must look like."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import httpx
from fastapi import FastAPI

from service.schemas.bodies import SCENE_ID

SPHERE = {"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0}


@asynccontextmanager
async def client_of(app: FastAPI) -> AsyncIterator[httpx.AsyncClient]:
    """Start the app, wait until it is warm, and return a client for it."""
    async with app.router.lifespan_context(app):
        assert app.state.warm.wait(60), app.state.warm_error
        transport = httpx.ASGITransport(app=app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            yield client


def resolve(document: Any, pointer: str) -> Any:
    """Return what `pointer` (RFC 6901) names in `document`; raises if there is nothing."""
    for part in pointer.split("/")[1:]:
        key = part.replace("~1", "/").replace("~0", "~")
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document


def check_problem(answer: httpx.Response, status: int, code: str) -> dict[str, Any]:
    """Assert that `answer` is a problem of RFC 9457 with this status and code, and return it."""
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json"), answer.text
    problem: dict[str, Any] = answer.json()
    assert set(problem) == {"type", "title", "status", "detail", "code", "errors"}
    assert (problem["status"], problem["code"]) == (status, code), problem
    assert problem["type"].endswith(code)
    assert problem["detail"]
    assert len(problem["errors"]) <= 20
    assert all(set(item) == {"pointer", "detail"} for item in problem["errors"])
    return problem


SHEET: dict[str, Any] = {
    "bodies": [
        {
            "solid": {
                "type": "surface",
                "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
                "faces": [[0, 1, 2], [0, 2, 3]],
            }
        }
    ]
}
"""A scene of space with a surface: what the example of hits is asked about."""


def of_scene(path: str, sheet: str) -> str:
    """Return the path of an example with the id of the scene that it is asked about; sheet: that of `SHEET`."""
    return path.replace("{scene_id}", sheet if path.endswith("/hits") else SCENE_ID)


def examples(document: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return path and body of every example of a JSON request in the OpenAPI document."""
    schemas, found = document["components"]["schemas"], []
    for path, item in document["paths"].items():
        content = item.get("post", {}).get("requestBody", {}).get("content", {})
        if "application/json" in content:
            name = content["application/json"]["schema"]["$ref"].rpartition("/")[2]
            found += [(path, example) for example in schemas[name]["examples"]]
    return found
