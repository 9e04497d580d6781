"""The wire and the service under load: what HTTP adds to a kernel, what a batch does to others, what too much does.

    python -m benchmarks wire            # about five minutes
    python -m benchmarks wire --quick    # about a minute

Loopback only. The load generator (load.py) shares the cores with the service. Requests and answers of both sides are
counted whole; contenders take turns.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import orjson

import engine
from benchmarks import load, table
from benchmarks.contest import Task
from benchmarks.fields import Figure
from benchmarks.load import Connection, free_port, in_process, request, wait_until
from benchmarks.machine import ROOT
from benchmarks.measure import clocked, memory_of, percentile
from service.settings import Settings

OCTETS = "application/octet-stream"
SPHERE = {"type": "sphere", "center": [0.5, 0.5, 0.5], "radius": 0.5}


@contextlib.contextmanager
def serving(**settings: object) -> Iterator[tuple[int, subprocess.Popen[bytes]]]:
    """Run the service in a process of its own; once it is ready yield port and process."""
    port = free_port()
    own = {f"GEOMETRY_{name.upper()}": str(value) for name, value in {"port": port, **settings}.items()}
    command = [sys.executable, "-m", "service"]
    process = subprocess.Popen(command, cwd=ROOT, env={**os.environ, **own}, stderr=subprocess.DEVNULL)
    try:
        wait_until(port, "/readyz")
        yield port, process
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(60)


def rate(port: int, message: bytes, seconds: float, n_connections: int) -> float:
    """Return requests a second; every answer must be 200."""
    seen = load.many(port, message, seconds, n_connections)
    assert set(seen.statuses) == {200}, seen.statuses
    return seen.statuses[200] / seen.span


class Wire:
    """The rows, on one service that runs throughout."""

    def __init__(self, given: argparse.Namespace, ours: int, process: subprocess.Popen[bytes]) -> None:
        self.quick, self.random = given.quick, np.random.default_rng(given.seed)
        self.ours, self.process = ours, process

    def binary(self, name: str, solid: engine.Solid, document: dict[str, Any]) -> Figure:
        """1e6 points as octets against kernel and bare loopback."""
        points = self.random.random((1_000_000, 3)) - 0.5
        connection = Connection(self.ours)
        stored = json.loads(connection.ask(request("/v1/solids", orjson.dumps(document)))[1])
        message = request(f"/v1/solids/{stored['id']}/contains", points.tobytes(), OCTETS)
        expected = engine.locate(points, solid).tobytes()
        with echo() as echo_port:
            echoed = Connection(echo_port)
            runs: list[Callable[[], Any]] = [
                lambda: connection.ask(message),
                lambda: engine.locate(points, solid, report=True),
                lambda: echoed.ask(message),
            ]
            took: list[list[float]] = [[], [], []]
            wrong = int(runs[0]() != (200, expected))
            for _ in range(3 + (10 if self.quick else 40)):
                for run, seconds in zip(runs, took):
                    seconds.append(clocked(run)[0])
            echoed.close()
        connection.close()
        values = [ours / (kernel + bare) for ours, kernel, bare in zip(*(one[3:] for one in took))]
        row = Figure(name, "over", values, 1.35, 1.15)
        medians = [1e3 * statistics.median(one[3:]) for one in took]
        row.ours, row.peer = f"{medians[0]:.4g} ms", f"{medians[1] + medians[2]:.4g} ms"
        row.error, row.note = f"wrong: {wrong}", f"kernel {medians[1]:.3g} ms, loopback {medians[2]:.3g} ms"
        row.raw["seconds"] = took
        return row

    def beside_batches(self, name: str) -> Figure:
        """One-point requests while two clients loop the largest JSON that is taken."""
        limit = Settings().max_body_bytes
        n_points = int(limit / 61)
        points = self.random.random((n_points, 3))
        body = orjson.dumps({"solid": SPHERE, "points": points}, option=orjson.OPT_SERIALIZE_NUMPY)
        assert 0.9 * limit < len(body) <= limit
        seconds = 8.0 if self.quick else 30.0
        message = request("/v1/contains", body)
        batches = [in_process(load.loop, self.ours, message, seconds + 2) for _ in range(2)]
        time.sleep(1.5)  # until both are at it
        one = request("/v1/contains", json.dumps({"solid": SPHERE, "points": [[0.1, 0.2, 0.3]]}).encode())
        seen = in_process(load.loop, self.ours, one, seconds - 2, 0.005)()
        batch = [waiting() for waiting in batches]
        row = Figure(name, "ms", [1e3 * percentile(seen.seconds, 0.99)], 25, 12)
        row.ours = f"{len(seen.seconds)} asked"
        statuses = sum((other.statuses for other in batch), seen.statuses)
        took = statistics.median([second for other in batch for second in other.seconds] or [float("nan")])
        waited = f"median {1e3 * percentile(seen.seconds, 0.5):.3g}, longest {1e3 * max(seen.seconds):.3g}"
        row.note = f"{waited}; batches of {len(body) / 2**20:.0f} MB took {took:.2f} s; {dict(statuses)}"
        row.raw["seconds"] = seen.seconds
        return row

    def overload(self, name: str) -> Figure:
        """Ten times the load that can be sustained, batches of 1e4 points."""
        body = {"solid": SPHERE, "points": self.random.random((10_000, 3)).tolist()}
        message, seconds = request("/v1/contains", json.dumps(body).encode()), 5.0 if self.quick else 60.0
        sustainable = in_process(rate, self.ours, message, 2.0, 2)()
        n_clients, n_connections = 4, 40  # as many under way as ten times the two that sustain it, eight times over
        before = memory_of(self.process.pid)
        clients = [in_process(load.many, self.ours, message, seconds, n_connections) for _ in range(n_clients)]
        seen = [waiting() for waiting in clients]
        after = memory_of(self.process.pid)
        statuses = sum((one.statuses for one in seen), load.Seen().statuses)
        accepted = [second for one in seen for second in one.seconds]
        offered = sum(statuses.values()) / seconds
        row = Figure(name, "s", [percentile(accepted, 0.99)], 30, 30)
        row.ours, row.raw["statuses"] = f"{len(accepted) / seconds:.3g}/s", dict(statuses)
        odd = sum(count for status, count in statuses.items() if status not in (200, 503))
        lost = sum(one.lost for one in seen)
        row.error = f"neither 200 nor 503: {odd}, lost: {lost}"
        row.note = (
            f"p99 of accepted, median {statistics.median(accepted):.3g}, longest {max(accepted):.3g}, deadline 30 s; "
            f"{n_clients * n_connections} connections ask "
            f"{offered:.0f}/s, {sustainable:.0f}/s are sustainable; {dict(statuses)}; "
            f"memory {before:.0f} to {after:.0f} MB; {'runs' if self.process.poll() is None else 'CRASHED'}"
        )
        return row


@contextlib.contextmanager
def echo() -> Iterator[int]:
    """Run the bare loopback: it reads as many bytes as a request of 1e6 points has and answers 1e6 of its own."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        waiting = in_process(_echo, server)
        yield int(server.getsockname()[1])
    waiting()


def _echo(server: socket.socket) -> None:
    buffer, answer = bytearray(2**20), b"HTTP/1.1 200 OK\r\ncontent-length: 1000000\r\n\r\n" + bytes(1_000_000)
    connection, _ = server.accept()
    with connection:
        while got := connection.recv_into(buffer):
            head, _, _ = bytes(buffer[:got]).partition(b"\r\n\r\n")
            left = len(head) + 4 + 24_000_000 - got
            while left > 0:
                left -= connection.recv_into(buffer)
            connection.sendall(answer)


def main(words: list[str] | None = None) -> int:
    """Print the table."""
    given = table.options(words, __doc__ or "")
    print(f"load generator: {load.NAME}, on the same cores; loopback")
    planes = np.random.default_rng(given.seed).normal(size=(32, 4))
    planes[:, 3] = 1 + np.abs(planes[:, 3])
    ball = engine.Sphere([0, 0, 0], 0.5), {"type": "sphere", "center": [0, 0, 0], "radius": 0.5}
    convex = engine.Convex(planes), {"type": "convex", "planes": planes.tolist()}
    with serving(access_log="true") as (ours, process):
        wire = Wire(given, ours, process)
        rows: dict[str, Callable[[str], Figure]] = {
            "1e6 points, octets, over kernel + loopback, sphere": lambda name: wire.binary(name, *ball),
            "1e6 points, octets, over kernel + loopback, 32 planes": lambda name: wire.binary(name, *convex),
            "p99 of one point beside two batches": wire.beside_batches,
            "overload": wire.overload,
        }
        return table.run("wire", [Task(name, partial(make, name)) for name, make in rows.items()], given)
