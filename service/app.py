"""create_app(): settings, warm-up, routes, the error table."""

from __future__ import annotations

import gc
import logging
import os
import sys
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import Response

import engine
from service.docs import router as docs_router
from service.errors import faults_of, http_fault, problem
from service.gate import Gate
from service.metrics import Metrics
from service.openapi import openapi_of
from service.playground import add_playground
from service.route import posts_of
from service.routes import (
    binary,
    bounds,
    clearance,
    collision,
    compare,
    containment,
    health,
    overlay,
    polygons,
    segments,
    solids,
)
from service.settings import Settings
from service.store import Store
from service.work import Memory, Pool

log = logging.getLogger("service")

SWITCH_SECONDS: Final = 0.0002
"""How long one thread keeps the interpreter while others wait: the event loop hands over several times a request, and
with Python's 5 ms each time beside a batch, small requests would wait for tens of milliseconds."""
DESCRIPTION = """Containment, collision and clipping with exact decisions.

Every float64 given is taken as the exact number it is; every yes/no, side, order, count and relation equals what exact
arithmetic gives. Constructed coordinates are the nearest float64 to the exact value. Each answer carries an `accuracy`
object and the header `Server-Timing` (decode, prepare, compute, encode). Errors are `application/problem+json`.
"""


def create_app(settings: Settings | None = None) -> FastAPI:
    """Return the service as an ASGI application."""
    gc.enable()  # all is imported (__main__.py)
    settings = settings or Settings()
    app = FastAPI(
        title="exact-geometry",
        version=engine.__version__,
        description=DESCRIPTION,
        lifespan=_lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    app.state.settings = settings
    app.state.store = Store(settings.store_bytes, settings.store_folder, settings.store_folder_bytes)
    app.state.memory = Memory(settings.request_bytes)
    app.state.metrics = Metrics()
    app.state.warm, app.state.warm_error = threading.Event(), None
    app.state.warm_begin, app.state.warm_hundredths = time.perf_counter(), 0
    app.openapi = openapi_of(app, settings)  # type: ignore[method-assign]
    modules = (containment, collision, clearance, segments, polygons, overlay, bounds, compare, solids, binary, health)
    for module in modules:
        app.include_router(module.router)
    app.include_router(solids.lookup)
    app.include_router(docs_router)
    add_playground(app)
    app.add_exception_handler(HTTPException, _answer_http_exception)
    app.add_exception_handler(Exception, _answer_anything)
    app.add_middleware(Gate, settings=settings, posts=posts_of(module.router for module in modules))
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=list(settings.cors_origins),
            allow_methods=["GET", "HEAD", "POST"],
            allow_headers=["Authorization", "Content-Type", "X-API-Key", "X-Request-ID"],
            expose_headers=["ETag", "Geometry-Accuracy", "Location", "Retry-After", "Server-Timing", "X-Request-ID"],
        )
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Compile or load the kernels in a thread, so that /healthz answers meanwhile; drain the pool at the end."""
    app.state.pool = Pool(app.state.settings)
    sys.setswitchinterval(SWITCH_SECONDS)
    threading.Thread(target=_warm, args=(app,), name="warm-up", daemon=True).start()
    try:
        yield
    finally:
        app.state.warm.clear()
        app.state.pool.close()


def _warm(app: FastAPI) -> None:
    before = time.perf_counter()

    def note(share: int) -> None:
        app.state.warm_hundredths += share

    try:
        engine.warm(progress=note, processes=os.cpu_count() or 1)
    except Exception as error:
        app.state.warm_error = f"warm-up failed: {error}; restart the service"
        log.exception("warm-up failed")
        return
    if not gc.get_freeze_count():
        gc.freeze()  # half a million objects of modules and compiler that no later collection has to walk through
    app.state.warm.set()
    log.info("ready: kernels warm after %.1f s", time.perf_counter() - before)


async def _answer_http_exception(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    return problem([http_fault(error.status_code, request.url.path, request.method)], error.headers or {})


async def _answer_anything(request: Request, error: Exception) -> Response:
    return problem(faults_of(error))  # outside the geometry routes; the server logs it
