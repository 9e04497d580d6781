"""Is the service alive, is it ready, and what has it done?"""

from __future__ import annotations

import time
from typing import Literal

from fastapi import APIRouter
from starlette.datastructures import State
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from service.errors import problem
from service.route import state_of
from service.routes.base import responses
from service.schemas.arrays import Fault
from service.schemas.problem import Schema, with_example

router = APIRouter(tags=["health"], responses=responses())


class Health(Schema):
    """Alive, or ready."""

    model_config = with_example({"status": "ok"})

    status: Literal["ok"]


@router.head("/healthz", include_in_schema=False)
@router.get("/healthz", operation_id="healthz", response_model=Health)
async def healthz() -> Response:
    """Alive: the process answers."""
    return _ok()


@router.head("/readyz", include_in_schema=False)
@router.get("/readyz", operation_id="readyz", response_model=Health)
async def readyz(request: Request) -> Response:
    """Ready: every kernel is compiled and no shutdown has begun."""
    state = state_of(request.app)
    if not state.warm.is_set():
        return problem([Fault((), "not_ready", state.warm_error or _how_far(state))])
    if state.pool.is_stuck():
        detail = "every thread for large requests works on one whose deadline has passed; ask another replica, or wait"
        return problem([Fault((), "not_ready", detail)])
    return _ok()


@router.get("/metrics", operation_id="metrics", response_class=PlainTextResponse)
async def metrics(request: Request) -> Response:
    """What is counted of requests, their phases, the queue, bytes, refusals and the store, for Prometheus."""
    return PlainTextResponse(state_of(request.app).metrics.text(), media_type="text/plain; version=0.0.4")


def _how_far(state: State) -> str:
    seconds, done = time.perf_counter() - state.warm_begin, state.warm_hundredths
    left = f", some {seconds * (100 - done) / done:.0f} s are left" if done else ""
    return f"kernels are being compiled or loaded, {done} % after {seconds:.0f} s{left}; ask again in a second"


def _ok() -> Response:
    return Response(b'{"status":"ok"}', media_type="application/json")
