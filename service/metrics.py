"""Prometheus metrics of the service: one registry an app, so that two in one process do not mix.

Several worker processes count into files of a folder that PROMETHEUS_MULTIPROC_DIR names; each of them reports the sum.
Refusals are counted for the whole process: some are made before there is an app (protocol.py).
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.multiprocess import MultiProcessCollector, mark_process_dead

import engine

_SECONDS: Final = (0.0001, 0.001, 0.01, 0.1, 1.0, 10.0)
_REFUSALS: Final = Counter("geometry_refusals", "Answers that say what is wrong, by code.", ("code",), registry=None)


@cache
def _refusal(code: str) -> Counter:
    return _REFUSALS.labels(code)


def count_refusal(code: str) -> None:
    """Count a problem answer."""
    _refusal(code).inc()


class Metrics:
    """Requests, the seconds they took by phase (decode, prepare, compute, encode) and in all, queue, bytes, store."""

    def __init__(self) -> None:
        self._registry = registry = CollectorRegistry()
        registry.register(_REFUSALS)
        made: dict[str, Any] = {"registry": registry}
        sums = {**made, "multiprocess_mode": "livesum"}
        self._requests = Counter("geometry_requests", "Requests answered.", ("operation", "status"), **made)
        self._seconds = Histogram(
            "geometry_phase_seconds",
            "Seconds that requests spent in each phase.",
            ("operation", "phase"),
            buckets=_SECONDS,
            **made,
        )
        self.in_flight = Gauge("geometry_requests_in_flight", "Requests under way.", **sums)
        self.queued = Gauge("geometry_requests_queued", "Requests that wait for a thread.", **sums)
        self.waited = Histogram(
            "geometry_queue_seconds", "Seconds that requests waited for a thread.", buckets=_SECONDS, **made
        )
        self.took = Histogram(
            "geometry_request_seconds",
            "Seconds from the first byte of a request to the last of its answer.",
            buckets=_SECONDS,
            **made,
        )
        octets = Counter("geometry_bytes", "Bytes of bodies taken, and of answers sent.", ("direction",), **made)
        self.bytes_in, self.bytes_out = octets.labels("in"), octets.labels("out")
        self.stored = Gauge("geometry_store_solids", "Solids held in memory.", **sums)
        self.stored_bytes = Gauge("geometry_store_bytes", "Bytes they hold.", **sums)
        self.evicted = Counter("geometry_store_evictions", "Solids that left for want of room.", **made)
        lookups = Counter("geometry_store_lookups", "Stored solids asked for, by where they were.", ("found",), **made)
        self.hits = {where: lookups.labels(where) for where in ("memory", "folder", "nowhere")}
        self.ready = Gauge("geometry_ready", "1 when every kernel is warm.", multiprocess_mode="livemin", **made)
        build = Gauge("geometry_build_info", "What runs.", ("version", "python"), multiprocess_mode="livemax", **made)
        build.labels(engine.__version__, platform.python_version()).set(1)
        # a look-up of labels takes longer than counting
        self._request = cache(lambda operation, status: self._requests.labels(operation, str(status)))
        self._phase = cache(self._seconds.labels)

    def count(self, operation: str, status: int, seconds: Mapping[str, float]) -> None:
        """Count one answered request."""
        self._request(operation, status).inc()
        for phase, spent in seconds.items():
            self._phase(operation, phase).observe(spent)

    def text(self) -> bytes:
        """Return all metrics, of all processes, in the text format of Prometheus."""
        folder = os.environ.get("PROMETHEUS_MULTIPROC_DIR")
        if folder is None:
            return generate_latest(self._registry)
        for path in Path(folder).glob("gauge_live*_*.db"):
            pid = int(path.stem.rpartition("_")[2])
            if not _is_alive(pid):
                mark_process_dead(pid)
        registry = CollectorRegistry()
        MultiProcessCollector(registry)
        return generate_latest(registry)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
