"""What the service counts of itself, for Prometheus: one registry an app, so that two in one process stay apart."""

from __future__ import annotations

from collections.abc import Mapping

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest


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

    def count(self, operation: str, status: int, seconds: Mapping[str, float]) -> None:
        """Count one answered request."""
        self._requests.labels(operation, str(status)).inc()
        for phase, spent in seconds.items():
            self._seconds.labels(operation, phase).observe(spent)

    def text(self) -> bytes:
        """Return everything counted, in the text format of Prometheus."""
        return generate_latest(self._registry)
