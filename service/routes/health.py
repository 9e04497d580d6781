"""Is the service alive, is it ready, and what has it done?"""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from service.errors import problem
from service.routes.base import responses
from service.schemas.arrays import Fault
from service.schemas.problem import Schema

router = APIRouter(tags=["health"])


class Health(Schema):
    """Alive, or ready."""

    status: Literal["ok"]


@router.get("/healthz", operation_id="healthz", response_model=Health)
async def healthz() -> Response:
    """Alive: the process answers."""
    return _ok()


@router.get("/readyz", operation_id="readyz", response_model=Health, responses=responses(503))
async def readyz(request: Request) -> Response:
    """Ready: every kernel is compiled and no shutdown has begun."""
    if request.app.state.warm.is_set():
        return _ok()
    reason = request.app.state.warm_error or "kernels are being compiled or loaded; ask again in a second"
    return problem([Fault((), "not_ready", reason)])


@router.get("/metrics", operation_id="metrics", response_class=PlainTextResponse)
async def metrics(request: Request) -> Response:
    """Requests and phases counted by this process, in the text format of Prometheus."""
    return PlainTextResponse(request.app.state.metrics.text(), media_type="text/plain; version=0.0.4")


def _ok() -> Response:
    return Response(b'{"status":"ok"}', media_type="application/json")
