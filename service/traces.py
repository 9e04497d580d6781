"""W3C trace context: a request that comes with `traceparent` is named by it in the log. With the extra `telemetry`, and
OpenTelemetry's own variables set, each request is a span too, sent to where OTEL_EXPORTER_OTLP_ENDPOINT says, and named
in the answer's `traceresponse`.
"""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Mapping
from functools import cache
from importlib.util import find_spec
from typing import Any, Final

from fastapi import FastAPI

log = logging.getLogger("service")

_VARIABLES: Final = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_TRACES_EXPORTER")
_PARENT: Final = re.compile(rb"(?!ff)[0-9a-f]{2}-(?!0{32})([0-9a-f]{32})-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}(?:-.*)?")


@cache
def is_exporting() -> bool:
    """Return whether spans are requested and can be sent; log if only one of the two holds."""
    if not any(map(os.environ.get, _VARIABLES)) or os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true":
        return False
    if any(find_spec(f"opentelemetry.{part}") is None for part in ("sdk", "exporter", "instrumentation")):
        log.warning("OTEL_* variables are set, but the extra `telemetry` is not installed: no spans are sent")
        return False
    return True


def export(app: FastAPI) -> None:
    """Make every request a span, except health checks, if requested."""
    if not is_exporting():
        return
    from opentelemetry import trace
    from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
    from opentelemetry.instrumentation.asgi import OpenTelemetryMiddleware
    from opentelemetry.sdk.resources import Resource
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.sdk.trace.export import BatchSpanProcessor
    from opentelemetry.util.http import ExcludeList

    if not isinstance(trace.get_tracer_provider(), TracerProvider):  # whoever embeds the service may have one
        name = os.environ.get("OTEL_SERVICE_NAME", "exact-geometry")
        provider = TracerProvider(resource=Resource.create({"service.name": name, "service.version": app.version}))
        provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
        trace.set_tracer_provider(provider)
    excluded: Any = ExcludeList(["/healthz", "/readyz", "/metrics"])
    app.add_middleware(OpenTelemetryMiddleware, excluded_urls=excluded, exclude_spans=["receive", "send"])


def trace_of(headers: Mapping[bytes, bytes]) -> tuple[dict[str, str], bytes]:
    """Return the log fields of the trace that a request belongs to, and `traceresponse`, empty without a span."""
    if is_exporting():
        from opentelemetry import trace

        context = trace.get_current_span().get_span_context()
        if context.is_valid:
            fields = {"trace_id": f"{context.trace_id:032x}", "span_id": f"{context.span_id:016x}"}
            return fields, f"00-{'-'.join(fields.values())}-{context.trace_flags:02x}".encode()
    match = _PARENT.fullmatch(headers.get(b"traceparent", b""))
    return {"trace_id": match[1].decode()} if match else {}, b""


def note(operation: str, seconds: Mapping[str, float]) -> None:
    """Write the time of each phase, in milliseconds, on the span of the running request."""
    if is_exporting():
        from opentelemetry import trace

        span = trace.get_current_span()
        span.set_attribute("geometry.operation", operation)
        for phase, spent in seconds.items():
            span.set_attribute(f"geometry.{phase}_ms", round(1e3 * spent, 3))
