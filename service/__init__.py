"""The HTTP service over the engine: `python -m service` runs it, `service.router()` puts its calls into your own."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fastapi import APIRouter

    from service.settings import Settings

__all__ = ["router"]


def router(settings: Settings | None = None) -> APIRouter:
    """Return the calls of the service as a router: ``app.include_router(service.router(), prefix="/geometry")``.

    settings: limits and the store, from the environment unless given; see `service.app.create_router`.
    """
    from service.app import create_router

    return create_router(settings)
