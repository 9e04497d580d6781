"""/: the playground, a page that asks this service and draws the answers; self-contained, no outside request."""

from __future__ import annotations

from pathlib import Path

from fastapi import FastAPI
from starlette.responses import FileResponse
from starlette.staticfiles import StaticFiles

FOLDER = Path(__file__).parent / "static_playground"
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self'; img-src 'self' data:; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


def add_playground(app: FastAPI) -> None:
    """Serve the page at / and its parts below /playground."""
    app.mount("/playground", StaticFiles(directory=FOLDER), name="playground")
    app.add_api_route("/", _page, methods=["GET", "HEAD"], include_in_schema=False)


async def _page() -> FileResponse:
    return FileResponse(FOLDER / "index.html", headers=_HEADERS)
