"""`python -m service`: starts uvicorn with the settings."""

from __future__ import annotations

import importlib.util
import logging
import signal
import sys
from typing import Any

import uvicorn
from pydantic import ValidationError

from service.settings import Settings

log = logging.getLogger("service")


def main() -> None:
    """Serve until SIGTERM or SIGINT, finish what is under way, exit with 0."""
    try:
        settings = Settings()
    except ValidationError as error:
        lines = [f"GEOMETRY_{'_'.join(map(str, item['loc'])).upper()}: {item['msg']}" for item in error.errors()]
        sys.exit("a setting is wrong\n" + "\n".join(lines))
    logging.basicConfig(level=settings.log_level.upper(), format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    # uvicorn drains, restores these handlers and raises the signal again: that must end in 0, not in a kill
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    log.info("starting on http://%s:%d (documentation at /docs)", settings.host, settings.port)
    uvicorn.run(
        "service.app:create_app",
        factory=True,
        host=settings.host,
        port=settings.port,
        workers=settings.workers,
        http=_http_protocol(),
        ws="none",
        log_level=settings.log_level,
        timeout_graceful_shutdown=round(settings.drain_seconds),
        server_header=False,
    )


def _http_protocol() -> Any:
    """Return the faster of the two protocols that is installed; h11 reads on after an offer by itself."""
    if importlib.util.find_spec("httptools") is None:
        return "h11"
    from service.protocol import Protocol

    return Protocol


if __name__ == "__main__":
    main()
