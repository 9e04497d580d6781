"""`python -m service`: starts uvicorn with the settings."""

from __future__ import annotations

import importlib.util
import logging.config
import signal
import sys
from copy import deepcopy
from typing import Any

import uvicorn
from pydantic import ValidationError
from uvicorn.config import LOGGING_CONFIG

from service.settings import Settings

log = logging.getLogger("service")


def main() -> None:
    """Serve until SIGTERM or SIGINT, finish what is under way, exit with 0."""
    try:
        settings = Settings()
    except ValidationError as error:
        lines = [f"GEOMETRY_{'_'.join(map(str, item['loc'])).upper()}: {item['msg']}" for item in error.errors()]
        sys.exit("a setting is wrong\n" + "\n".join(lines))
    logs = _log_config(settings)
    logging.config.dictConfig(logs)
    # uvicorn drains, restores these handlers and raises the signal again: that must end in 0, not in a kill
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    log.info(
        "starting on http://%s:%d, documentation at /docs, %d process(es), bodies up to %d bytes, deadline %g s",
        settings.host,
        settings.port,
        settings.workers,
        settings.max_body_bytes,
        settings.deadline_seconds,
    )
    uvicorn.run(
        "service.app:create_app",
        factory=True,
        host=settings.host,
        port=settings.port,
        workers=settings.workers,
        http=_http_protocol(),
        ws="none",
        log_config=logs,
        log_level=settings.log_level,
        timeout_graceful_shutdown=round(settings.drain_seconds),
        server_header=False,
    )


def _log_config(settings: Settings) -> dict[str, Any]:
    """Return uvicorn's way to log, with the service's own lines in it; worker processes set it up anew."""
    config: dict[str, Any] = deepcopy(LOGGING_CONFIG)
    config["formatters"]["default"]["fmt"] = "%(asctime)s %(levelprefix)s %(name)s: %(message)s"
    config["loggers"]["service"] = {"handlers": ["default"], "level": settings.log_level.upper(), "propagate": False}
    return config


def _http_protocol() -> Any:
    """Return the faster of the two protocols that is installed; h11 reads on after an offer by itself."""
    if importlib.util.find_spec("httptools") is None:
        return "h11"
    from service.protocol import Protocol

    return Protocol


if __name__ == "__main__":
    main()
