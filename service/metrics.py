"""What the service counts of itself, for Prometheus: one registry an app, so that two in one process stay apart.

Several worker processes count into files of a folder that PROMETHEUS_MULTIPROC_DIR names; any of them tells the sum.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.multiprocess import MultiProcessCollector


class Metrics:
    """Requests by operation and status, and the seconds they took by phase (decode, prepare, compute, encode)."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._requests = Counter(
            "geometry_requests", "Requests answered.", ("operation", "status"), registry=self._registry
        )
        self._seconds = Histogram(
            "geometry_phase_seconds",
            "Seconds that requests spent in each phase.",
            ("operation", "phase"),
            buckets=(0.0001, 0.001, 0.01, 0.1, 1.0, 10.0),
            registry=self._registry,
        )
        # a look-up of labels takes longer than counting
        self._request = cache(lambda operation, status: self._requests.labels(operation, str(status)))
        self._phase = cache(self._seconds.labels)

    def count(self, operation: str, status: int, seconds: Mapping[str, float]) -> None:
        """Count one answered request."""
        self._request(operation, status).inc()
        for phase, spent in seconds.items():
            self._phase(operation, phase).observe(spent)

    def text(self) -> bytes:
        """Return everything counted, by all processes, in the text format of Prometheus."""
        if "PROMETHEUS_MULTIPROC_DIR" not in os.environ:
            return generate_latest(self._registry)
        registry = CollectorRegistry()
        MultiProcessCollector(registry)
        return generate_latest(registry)
