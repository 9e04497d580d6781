"""`python -m service`: starts uvicorn with the settings, each of which is a flag too, and writes logs."""

from __future__ import annotations

import argparse
import gc
import ipaddress
import logging
import logging.config
import os
import signal
import sys
import tempfile
import time
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn

import orjson
from pydantic import ValidationError

from service.settings import Settings

if TYPE_CHECKING:
    from fastapi import FastAPI

log = logging.getLogger("service")
SWITCH_SECONDS: Final = 0.0002
"""Interval at which a thread yields the interpreter: with Python's 5 ms, a batch would delay small requests by tens of
milliseconds, since the event loop hands over several times a request."""


class JsonFormatter(logging.Formatter):
    """Formats a log record as JSON: time, level, logger, message, and extra fields."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of a record."""
        line: dict[str, Any] = {
            "time": f"{_second(int(record.created))}.{int(record.msecs):03d}Z",
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return orjson.dumps(line, default=str).decode()


@lru_cache(2)
def _second(moment: int) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(moment))


def config_of(level: str) -> dict[str, Any]:
    """Return the configuration for `logging.config.dictConfig`; worker processes apply it again."""
    own = {"handlers": ["stderr"], "level": level.upper(), "propagate": False}
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"json": {"()": f"{__package__}.__main__.JsonFormatter"}},
        "handlers": {"stderr": {"class": "logging.StreamHandler", "formatter": "json"}},
        "loggers": dict.fromkeys(("engine", "exact_geometry", "service", "uvicorn"), own),
    }


def main(arguments: list[str] | None = None) -> None:
    """Serve until SIGTERM or SIGINT, finish running requests, exit with 0."""
    gc.disable()  # while modules are imported (`create_app`): an eighth of the time until ready
    _take_flags(sys.argv[1:] if arguments is None else arguments)
    try:
        settings = Settings()
        _check_folder(settings.store_folder)
    except ValidationError as error:
        _refuse(
            "; ".join(
                f"{_variable(item['loc'][0])}={item['input']}: {item['msg'].replace('Input should be', 'expected')}"
                for item in error.errors()
            )
        )
    except OSError as error:
        _refuse(f"{_variable('store_folder')}={settings.store_folder}: {error.strerror or error}")
    config = config_of(settings.log_level)
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
        log.warning("no setting is called %s; docs/running.md and --help list them", ", ".join(sorted(unknown)))
    if not settings.api_keys and not _is_loopback(settings.host):
        log.warning("anyone who reaches %s may use this service: GEOMETRY_API_KEYS is not set", settings.host)
    with ExitStack() as stack:
        stack.push(_leave_threads)
        if settings.workers > 1:
            _share(Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="geometry-"))), settings)
        _serve(settings, config, stack)


def create_app() -> FastAPI:
    """Return the service for a process of its own: nowhere else does the service change its process."""
    from service.app import create_app
    from service.memory import configure_malloc

    gc.freeze()  # all is imported (`main`): to look through it while kernels are loaded is a tenth of their time
    gc.enable()
    configure_malloc()
    sys.setswitchinterval(SWITCH_SECONDS)
    # what the lines leave out need not be looked up for each of them: it takes as long as writing the line
    logging.logThreads = logging.logProcesses = logging.logMultiprocessing = False
    return create_app(owns_process=True)


def _serve(settings: Settings, log_config: dict[str, Any], stack: ExitStack) -> None:
    """Serve until a signal comes; stack: clean-up at the end."""
    import uvicorn

    from service.protocol import Protocol
    from service.server import HEALTH_SECONDS, Server, Supervisor

    config = uvicorn.Config(
        f"{__package__}.__main__:create_app",
        factory=True,
        host=settings.host,
        port=settings.port,
        workers=settings.workers,
        http=Protocol,
        ws="none",
        log_config=log_config,
        log_level=settings.log_level,
        access_log=False,
        timeout_graceful_shutdown=settings.drain_seconds,  # type: ignore[arg-type]
        timeout_worker_healthcheck=HEALTH_SECONDS,
        server_header=False,
        forwarded_allow_ips=settings.trusted_proxies,
    )
    if settings.workers > 1:
        gc.enable()
        Supervisor(config, [config.bind_socket()], stack.close).run()
        return
    server = Server(config, stack.close)
    server.run()
    if not server.started:
        sys.exit(3)  # as uvicorn does


def _leave_threads(_kind: object, ended: object, _trace: object) -> None:
    """End the process if threads cannot be stopped; one within the compiler's C++ would abort it."""
    from service.server import end_process, is_left_behind

    if isinstance(ended, SystemExit) and not ended.code and is_left_behind():
        end_process()


def _variable(name: object) -> str:
    return f"GEOMETRY_{name}".upper()


def _refuse(what: str) -> NoReturn:
    print(f"a setting is wrong: {what}", file=sys.stderr)
    sys.exit(2)


def _take_flags(arguments: list[str]) -> None:
    """Put flags into the environment, where worker processes read them; `--help` and `--version` exit here."""
    if not arguments:
        return
    parser = argparse.ArgumentParser(
        "python -m service",
        usage="%(prog)s [--SETTING VALUE ...]",
        description="Containment, collision and clipping with exact decisions, over HTTP.",
        epilog="Each is an environment variable too: --max-points is GEOMETRY_MAX_POINTS. Sizes take units: 64MiB.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="store_true", help="Say which version this is.")
    for name, field in Settings.model_fields.items():
        default = field.get_default(call_default_factory=True)
        said = " ".join((field.description or "").split()).replace("%", "%%")
        shown = "none" if default in (None, (), "") else str(default).lower() if isinstance(default, bool) else default
        flag = "--" + name.replace("_", "-")
        parser.add_argument(flag, dest=name, metavar=name.rpartition("_")[2].upper(), help=f"{said} [{shown}]")
    given = vars(parser.parse_args(arguments))
    if given.pop("version"):
        import engine

        print(f"exact-geometry {engine.__version__}")
        sys.exit(0)
    for name, value in given.items():
        if value is not None:
            os.environ[_variable(name)] = value


def _check_folder(folder: Path | None) -> None:
    """Raise OSError unless the folder is writable: worker processes would fail one by one, and be restarted."""
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _share(folder: Path, settings: Settings) -> None:
    """Give the worker processes a common folder for counters, and for solids if no folder is set, by the
    environment."""
    counters = folder / "metrics"
    counters.mkdir()
    os.environ["PROMETHEUS_MULTIPROC_DIR"] = str(counters)
    if settings.store_folder is None:
        os.environ["GEOMETRY_STORE_FOLDER"] = str(folder / "solids")


if __name__ == "__main__":
    main()
