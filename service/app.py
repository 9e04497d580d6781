"""create_app(): settings, warm-up, routes, the error table."""

from __future__ import annotations

import asyncio
import atexit
import logging
import os
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Final

from fastapi import APIRouter, Depends, FastAPI
from starlette.datastructures import State
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

import engine
from service import pages, stream, traces
from service.errors import faults_of, http_fault, problem
from service.gate import Gate
from service.memory import Memory, freeze
from service.metrics import Metrics
from service.openapi import completed, openapi_of
from service.route import posts_of
from service.routes import questions, stored
from service.settings import WARM_UP, Settings
from service.store import Store
from service.tools import PATH, Tools
from service.work import Pool

log = logging.getLogger("service")

ROUTERS: Final = (
    questions.router,
    stored.router,
    stored.binary,
    pages.router,
    stored.lookup,
    stored.scene_binary,
    stream.router,
)
_SHOWN: Final = "ETag, Geometry-Accuracy, Location, Retry-After, Server-Timing, Traceresponse, X-Request-ID"
END_SECONDS: Final = 0.7
"""Time at shutdown for threads, which poll their switch, and then for the warm-up, which polls between two parts."""
DESCRIPTION = """Containment, collision and clipping with exact decisions.

Every float64 given is taken as the exact number it is; every yes/no, side, order, count and relation equals what exact
arithmetic gives. Constructed coordinates are the nearest float64 to the exact value. Each answer carries an `accuracy`
object and the header `Server-Timing` (decode, prepare, compute, encode). Errors are `application/problem+json`.
"""


def create_app(settings: Settings | None = None, owns_process: bool = False) -> FastAPI:
    """Return the service as an ASGI application; owns_process: whether it is alone in its process (`__main__`)."""
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
    _prepare(app.state, settings, owns_process)
    app.openapi = openapi_of(app, settings)  # type: ignore[method-assign]
    for router in ROUTERS:
        app.include_router(router)
    pages.add_pages(app)
    app.state.tools = Tools(app, settings, ROUTERS)
    app.router.routes.append(Route(PATH, app.state.tools, methods=["POST"], include_in_schema=False))
    app.add_exception_handler(HTTPException, _answer_http_exception)
    app.add_exception_handler(Exception, _answer_anything)
    app.add_middleware(Gate, settings=settings, posts=posts_of(ROUTERS), metrics=app.state.metrics)
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=list(settings.cors_origins),
            allow_methods=["GET", "HEAD", "POST"],
            allow_headers=["Authorization", "Content-Type", "Traceparent", "X-API-Key", "X-Request-ID"],
            expose_headers=[_SHOWN],
        )
    traces.export(app)
    return app


def create_router(settings: Settings | None = None) -> APIRouter:
    """Return the calls of the service as a router for another FastAPI application.

    Its lifespan, which FastAPI runs with the application's own, warms the kernels and keeps stored solids and threads;
    `/readyz` tells when the kernels are warm. In an application that is mounted in another, whose lifespan nobody runs,
    the first request begins this. Keys, names of requests and log lines are the application's own matter: guard the
    calls by `include_router(..., dependencies=[...])` or a middleware. Nothing of the process is changed. Limits and
    examples are put into the application's OpenAPI document when it starts.
    """
    settings = settings or Settings()
    if settings.api_keys:
        log.warning(
            "GEOMETRY_API_KEYS is not looked at within another application: whoever reaches it may call; guard the "
            "calls yourself: app.include_router(service.router(), dependencies=[Depends(check_key)])"
        )
    guest = _EmbeddedService(settings)
    router = APIRouter(lifespan=guest.lifespan, dependencies=[Depends(guest.start_once)])
    for each in ROUTERS:
        router.include_router(each)
    return router


class _EmbeddedService:
    """The service within another application."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings

    @asynccontextmanager
    async def lifespan(self, app: FastAPI) -> AsyncIterator[None]:
        """Start and end with the application."""
        state = self._started(app)
        if hasattr(state, "pool") and not state.is_ending:  # the router was included twice: the first ends it
            yield
            return
        async with _running(state):
            yield

    async def start_once(self, request: Request) -> None:
        """Start with the first request if nobody runs the application's lifespan."""
        state = self._started(request.app)
        if not hasattr(state, "pool"):
            warming = _start(state)
            atexit.register(_end, state, warming)

    def _started(self, app: FastAPI) -> State:
        """Return the state in `app` that calls share; an ended one is made again."""
        state: State = getattr(app.state, "geometry", None) or State({"guest": self, "is_ending": True})
        if state.guest is not self:
            raise RuntimeError(
                "this application has two service routers, and would answer by the settings of one: include one twice, "
                "or mount an application of its own for the second: app.mount(path, FastAPI())"
            )
        if not state.is_ending:
            return state
        state = app.state.geometry = State({"guest": self})
        _prepare(state, self._settings, owns_process=False)
        make = getattr(app.openapi, "made_by", app.openapi)

        def document() -> dict[str, Any]:
            if app.openapi_schema is None:
                app.openapi_schema = completed(make(), self._settings)
            return app.openapi_schema

        document.made_by = make  # type: ignore[attr-defined]
        app.openapi_schema, app.openapi = None, document  # type: ignore[method-assign]
        return state


def _prepare(state: State, settings: Settings, owns_process: bool) -> None:
    """Make the state that requests share."""
    state.settings, state.owns_process = settings, owns_process
    state.metrics = Metrics()
    state.store = Store(settings.store_bytes, settings.store_folder, settings.store_folder_bytes, state.metrics)
    state.memory = Memory(settings.request_bytes, owns_process)
    state.warm, state.warm_error, state.is_ending = threading.Event(), None, False
    state.warm_begin, state.warm_hundredths = time.perf_counter(), 0


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    async with _running(app.state), app.state.tools:
        yield


@asynccontextmanager
async def _running(state: State) -> AsyncIterator[None]:
    """Start, and end again: running requests are cancelled, and awaited for a while."""
    warming = _start(state)
    try:
        yield
    finally:
        await asyncio.to_thread(_end, state, warming)


def _start(state: State) -> threading.Thread:
    """Compile or load the kernels in a thread, so that /healthz answers meanwhile."""
    state.pool = Pool(state.settings, state.metrics)
    warming = threading.Thread(target=_warm, args=(state,), name=WARM_UP, daemon=True)
    warming.start()
    return warming


def _end(state: State, warming: threading.Thread) -> None:
    state.is_ending = True
    state.pool.close(END_SECONDS)
    warming.join(END_SECONDS)  # a thread within the compiler when Python ends would abort the process
    state.warm.clear()
    state.metrics.ready.set(0)


class _EndingError(Exception):
    """Ends the warm-up at shutdown."""


def _warm(state: State) -> None:
    before = time.perf_counter()

    def note(share: int) -> None:
        state.warm_hundredths += share
        if state.is_ending:
            raise _EndingError

    try:
        engine.warm(progress=note, processes=os.cpu_count() or 1)
    except _EndingError:
        return
    except Exception as error:
        state.warm_error = f"warm-up failed: {error}; restart the service"
        log.exception("warm-up failed")
        return
    if state.owns_process:
        freeze()
    state.warm.set()
    state.metrics.ready.set(1)
    log.info("ready: kernels warm after %.1f s", time.perf_counter() - before)


async def _answer_http_exception(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    return problem([http_fault(error.status_code, request.url.path, request.method)], error.headers or {})


async def _answer_anything(request: Request, error: Exception) -> Response:
    return problem(faults_of(error))  # outside the geometry routes; the server logs it
