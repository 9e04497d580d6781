"""W3C trace context is taken and passed on; with OpenTelemetry enabled, requests are spans in it."""

from __future__ import annotations

import http.server
import json
import logging
import os
import threading
import time

import httpx
import pytest

from service.__main__ import JsonFormatter
from service.traces import trace_of
from tests.unit.service.asking import SPHERE
from tests.unit.service.test_live import Service

PARENT = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"
TRACE = PARENT.split("-")[1]


@pytest.mark.anyio
async def test_a_trace_names_the_request(client: httpx.AsyncClient, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "service.access"):
        answer = await client.post("/v1/solids", json=SPHERE, headers={"traceparent": PARENT})
    assert "traceresponse" not in answer.headers  # there is no span that it could name
    line = json.loads(JsonFormatter().format(caplog.records[-1]))
    assert line["trace_id"] == TRACE
    assert "span_id" not in line


@pytest.mark.parametrize(
    "given",
    [
        "", "00", PARENT[:-1], PARENT + "0", PARENT.upper(), PARENT.replace("00-", "ff-", 1),
        f"00-{'0' * 32}-b7ad6b7169203331-01", f"00-{TRACE}-{'0' * 16}-01", PARENT.replace("-", " "),
    ],
)  # fmt: skip
def test_what_is_no_trace_is_left_alone(given: str) -> None:
    assert trace_of({b"traceparent": given.encode()}) == ({}, b"")


def test_a_later_version_is_read_as_this_one() -> None:
    assert trace_of({b"traceparent": b"cc" + PARENT[2:].encode() + b"-what-else"}) == ({"trace_id": TRACE}, b"")


def test_spans_are_sent_to_a_collector() -> None:
    pytest.importorskip("opentelemetry.instrumentation.asgi", reason="the extra `telemetry` is not installed")
    bodies: list[tuple[str, bytes]] = []

    class Collector(http.server.BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            bodies.append((self.path, self.rfile.read(int(self.headers["content-length"]))))
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_: object) -> None: ...

    collector = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Collector)
    threading.Thread(target=collector.serve_forever, daemon=True).start()
    around = {
        "OTEL_EXPORTER_OTLP_ENDPOINT": f"http://127.0.0.1:{collector.server_port}",
        "OTEL_EXPORTER_OTLP_COMPRESSION": "none",
        "OTEL_BSP_SCHEDULE_DELAY": "100",
    }
    service = Service(around={**os.environ, **around})
    try:
        service.wait_until_ready()
        answer = httpx.post(f"{service.url}/v1/solids", json=SPHERE, headers={"traceparent": PARENT})
        assert answer.headers["traceresponse"].split("-")[1] == TRACE
        end = time.monotonic() + 120
        while not any(bytes.fromhex(TRACE) in body for _, body in bodies):
            assert time.monotonic() < end
            time.sleep(0.05)
        path, body = next(item for item in bodies if bytes.fromhex(TRACE) in item[1])
        assert path == "/v1/traces"
        assert bytes.fromhex(answer.headers["traceresponse"].split("-")[2]) in body
        for word in (b"exact-geometry", b"geometry.operation", b"put_solid", b"geometry.decode_ms"):
            assert word in body
        assert b"readyz" not in b"".join(body for _, body in bodies)
        assert service.stop() == 0
    finally:
        service.close()
        collector.shutdown()
        collector.server_close()
