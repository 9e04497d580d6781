"""Logs for programs to read: one JSON object a line, on the standard error stream."""

from __future__ import annotations

import logging
import time
from functools import lru_cache
from typing import Any

import orjson


class JsonFormatter(logging.Formatter):
    """Writes time, level, logger and message, and the fields that a record brings along."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
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
    """Return the configuration for `logging.config.dictConfig`; worker processes set it up anew."""
    own = {"handlers": ["stderr"], "level": level.upper(), "propagate": False}
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"json": {"()": "service.logs.JsonFormatter"}},
        "handlers": {"stderr": {"class": "logging.StreamHandler", "formatter": "json"}},
        "loggers": {"engine": own, "service": own, "uvicorn": own},
    }
