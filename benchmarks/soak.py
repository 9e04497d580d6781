"""Hostile load for long, a tenth of what else is asked: no status from 500 on but 503 and 504, memory that stays.

    python -m benchmarks soak                # an hour
    python -m benchmarks soak --minutes 2

Loopback only; the clients share the cores with the service. Small questions (points, segments, a pair, an overlay) come
evenly, `--rate` a second; one question in ten is a hostile body of tests/contract/test_memory.py, at most 2 MB and
wanting far more, two at a time at most. Every minute says what was answered, how long small questions took, and what
the service holds.
"""

from __future__ import annotations

import argparse
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from itertools import count, cycle
from typing import Any

import orjson

from benchmarks.load import Connection, in_process, request
from benchmarks.measure import memory_of, percentile
from benchmarks.wire import SPHERE, serving

SQUARE, OTHER = ({"type": "polygon", "rings": [[[k, k], [k + 2, k], [k + 2, k + 2], [k, k + 2]]]} for k in (0, 1))
SMALL: dict[str, dict[str, Any]] = {
    "/v1/contains": {"solid": SPHERE, "points": [[0.5, 0.5, 0.5]] * 10},
    "/v1/clip/segments": {"region": SPHERE, "segments": [[[-1, 0.5, 0.5], [2, 0.5, 0.5]]] * 10},
    "/v1/collide": {"first": SPHERE, "second": {**SPHERE, "center": [1, 1, 1]}},
    "/v1/overlay": {"subject": SQUARE, "clip": OTHER, "operation": "union"},
}
ALLOWED = {503, 504}


def ask_small(port: int, seconds: float, rate: float) -> tuple[Counter[int], list[float]]:
    """Ask small questions in turn, so many a second; return the statuses, and the seconds each took."""
    messages = cycle([request(path, orjson.dumps(body)) for path, body in SMALL.items()])
    connection, statuses, took = Connection(port), Counter[int](), []
    begin = time.perf_counter()
    for turn in range(int(seconds * rate)):
        time.sleep(max(0.0, begin + turn / rate - time.perf_counter()))
        before = time.perf_counter()
        statuses[connection.ask(next(messages))[0]] += 1
        took.append(time.perf_counter() - before)
    return statuses, took


def ask_hostile(port: int, end: float, rate: float, statuses: Counter[int]) -> None:
    """Send hostile bodies in turn, so many a second and two at a time at most, until the clock says `end`."""
    from tests.contract.test_memory import bodies  # what they are is the test's matter

    messages = []
    for path, body, headers in bodies():
        if "{" not in path:
            message = request(f"/v1/{path}", body)
            lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
            messages.append(message.replace(b"\r\n\r\n", b"\r\n" + lines.encode() + b"\r\n", 1))
    turns, lock, begin = count(), threading.Lock(), time.perf_counter()

    def loop() -> None:
        connection = Connection(port)
        while time.perf_counter() < end:
            with lock:
                turn = next(turns)
            time.sleep(max(0.0, begin + turn / rate - time.perf_counter()))
            try:
                status = connection.ask(messages[turn % len(messages)])[0]
            except OSError:
                connection.close()
                status = 0
            with lock:
                statuses[status] += 1

    with ThreadPoolExecutor(2) as pool:
        for client in [pool.submit(loop) for _ in range(2)]:
            client.result()


def main(words: list[str]) -> int:
    """Run the load; return 1 where the service answered with a status that it must not."""
    parser = argparse.ArgumentParser(prog="benchmarks soak", description=__doc__.split("\n")[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=10.0, help="small questions a second")
    asked = parser.parse_args(words)
    settings = {"deadline_seconds": 2, "request_bytes": 2**29, "store_bytes": 2**24, "access_log": False}
    hostile, worst = Counter[int](), Counter[int]()
    with serving("service", ready="/readyz", **settings) as (port, process):
        ask_small(port, 4.0, 10.0)
        print(f"at rest: {memory_of(process.pid):.0f} MB, {_quantiles(ask_small(port, 10.0, asked.rate)[1])}")
        end = time.perf_counter() + 60.0 * asked.minutes
        sender = threading.Thread(target=ask_hostile, args=(port, end, asked.rate / 10, hostile))
        sender.start()
        minute = 0
        while time.perf_counter() < end:
            minute += 1
            statuses, took = in_process(ask_small, port, min(60.0, end - time.perf_counter()), asked.rate)()
            worst += statuses
            print(
                f"minute {minute:3}: {memory_of(process.pid):5.0f} MB; small {dict(statuses)}, {_quantiles(took)}; "
                f"hostile so far {dict(hostile)}",
                flush=True,
            )
        sender.join()
    wrong = {status for status in (*worst, *hostile) if status == 0 or (status >= 500 and status not in ALLOWED)}
    print(f"statuses that must not be: {wrong or 'none'}")
    return int(bool(wrong))


def _quantiles(took: list[float]) -> str:
    return ", ".join(f"{name} {1e3 * percentile(took, share):.1f} ms" for name, share in (("p50", 0.5), ("p99", 0.99)))
