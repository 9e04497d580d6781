"""What the service shows of itself: /healthz, /readyz, /metrics, and pages: / is the playground, which asks this
service and draws the answers; /docs is Swagger UI with *try it*, /redoc the same to read. Nothing of them comes from
another host: their files are those that fastapi-offline keeps.

With API keys the pages open all the same and ask for the key; what they show is the same for everybody.
"""

from __future__ import annotations

import base64
import hashlib
import re
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Final, Literal

from fastapi import APIRouter, FastAPI
from fastapi.openapi.docs import get_redoc_html, get_swagger_ui_html
from starlette.datastructures import State
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.staticfiles import StaticFiles

from service.errors import problem
from service.openapi import responses
from service.route import state_of
from service.schemas.arrays import Fault
from service.schemas.base import Schema, with_example

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


FOLDER: Final = Path(__file__).parent / "static_playground"
OPEN: Final = ("/", "/docs", "/redoc", "/openapi.json", "/playground/", "/docs-files/")
"""Where pages are; with a slash at the end, all below too."""
_FILES: Final = "docs-files"
_POLICY: Final = (
    "default-src 'none'; script-src 'self'{}; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "img-src 'self' data:; worker-src blob:; form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
_WIDTH: Final = '<meta name="viewport" content="width=device-width, initial-scale=1">'
_DARK: Final = """<style>@media (prefers-color-scheme: dark) { html { background: #111; }
body { filter: invert(0.92) hue-rotate(180deg); } .microlight { filter: invert(1) hue-rotate(180deg); } }</style>"""
_SCRIPT: Final = re.compile(r"<script>(.*?)</script>", re.DOTALL)


def add_pages(app: FastAPI) -> None:
    """Serve the pages."""
    package = find_spec("fastapi_offline")
    assert package is not None
    assert package.origin is not None
    app.mount("/playground", StaticFiles(directory=FOLDER), name="playground")
    app.mount(f"/{_FILES}", StaticFiles(directory=Path(package.origin).parent / "static"), name=_FILES)
    for path, page in (("/", _playground), ("/docs", _docs), ("/redoc", _redoc)):
        app.add_api_route(path, page, methods=["GET", "HEAD"], include_in_schema=False)


async def _playground() -> FileResponse:
    return FileResponse(FOLDER / "index.html", headers=_headers(""))


async def _docs(request: Request) -> HTMLResponse:
    page = get_swagger_ui_html(
        openapi_url="openapi.json",
        title=f"{request.app.title}: calls",
        swagger_js_url=f"{_FILES}/swagger-ui-bundle.js",
        swagger_css_url=f"{_FILES}/swagger-ui.css",
        swagger_favicon_url="data:,",
        swagger_ui_parameters={"persistAuthorization": True, "tryItOutEnabled": True, "docExpansion": "list"},
    )
    return _answer(page, _WIDTH + _DARK)


async def _redoc(request: Request) -> HTMLResponse:
    page = get_redoc_html(
        openapi_url="openapi.json",
        title=f"{request.app.title}: reference",
        redoc_js_url=f"{_FILES}/redoc.standalone.js",
        redoc_favicon_url="data:,",
        with_google_fonts=False,
    )
    return _answer(page)


def _answer(page: HTMLResponse, style: str = "") -> HTMLResponse:
    """Return FastAPI's page with a policy that allows its own script and nothing else that is written in it."""
    text = bytes(page.body).decode().replace("</head>", f"{style}</head>", 1)
    hashes = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in _SCRIPT.findall(text)]
    return HTMLResponse(text, headers=_headers("".join(f" 'sha256-{each}'" for each in hashes)))


def _headers(scripts: str) -> dict[str, str]:
    return {
        "Content-Security-Policy": _POLICY.format(scripts),
        "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff",
    }
