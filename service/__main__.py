"""`python -m service`: starts uvicorn with the settings."""

from __future__ import annotations

import gc
import ipaddress
import logging.config
import os
import signal
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import uvicorn
from pydantic import ValidationError

from service import logs
from service.settings import Settings

log = logging.getLogger("service")


def main() -> None:
    """Serve until SIGTERM or SIGINT, finish what is under way, exit with 0."""
    gc.disable()  # while modules are imported (app.py): an eighth of the time until ready
    try:
        settings = Settings()
    except ValidationError as error:
        lines = [f"GEOMETRY_{'_'.join(map(str, item['loc'])).upper()}: {item['msg']}" for item in error.errors()]
        print("a setting is wrong: " + "; ".join(lines), file=sys.stderr)
        sys.exit(2)
    config = logs.config_of(settings.log_level)
    logging.config.dictConfig(config)
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
    known = {f"GEOMETRY_{name.upper()}" for name in Settings.model_fields}
    if unknown := [name for name in os.environ if name.startswith("GEOMETRY_") and name.upper() not in known]:
        log.warning("no setting is called %s; the README has a table of them", ", ".join(sorted(unknown)))
    if not settings.api_keys and not _is_loopback(settings.host):
        log.warning("anyone who reaches %s may use this service: GEOMETRY_API_KEYS is not set", settings.host)
    with ExitStack() as stack:
        if settings.workers > 1:
            _share(Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="geometry-"))), settings)
        from service.protocol import Protocol

        uvicorn.run(
            "service.app:create_app",
            factory=True,
            host=settings.host,
            port=settings.port,
            workers=settings.workers,
            http=Protocol,
            ws="none",
            log_config=config,
            log_level=settings.log_level,
            access_log=False,
            timeout_graceful_shutdown=round(settings.drain_seconds),
            server_header=False,
        )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _share(folder: Path, settings: Settings) -> None:
    """Give the worker processes one place for counters, and for solids if no folder is set; through the environment."""
    counters = folder / "metrics"
    counters.mkdir()
    os.environ["PROMETHEUS_MULTIPROC_DIR"] = str(counters)
    if settings.store_folder is None:
        os.environ["GEOMETRY_STORE_FOLDER"] = str(folder / "solids")


if __name__ == "__main__":
    main()
