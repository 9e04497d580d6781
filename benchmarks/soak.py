"""Long hostile load, a tenth of all requests: no status from 500 on but 503 and 504, bounded memory.

    python -m benchmarks soak                # an hour
    python -m benchmarks soak --minutes 2
    python -m benchmarks soak --each         # each attack alone, then eight of it at once: a table

Loopback only; the clients share the cores with the service. Small questions (points, segments, a pair, an overlay) come
evenly, `--rate` a second, and their answers are compared with the first; one question in ten is hostile: a body of
tests/contract/test_memory.py, at most 2 MB and wanting far more, or an attack of tests/contract/attacks.py, two at a
time at most. Every minute says what was answered, how long small questions took, and the memory of the service.
"""

from __future__ import annotations

import argparse
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from itertools import count, cycle
from typing import Any

import orjson

from benchmarks.load import Connection, in_process, request, watched
from benchmarks.measure import memory_of, percentile
from benchmarks.wire import SPHERE, serving
from tests.contract.attacks import all_attacks
from tests.contract.test_memory import bodies

SQUARE, OTHER = ({"type": "polygon", "rings": [[[k, k], [k + 2, k], [k + 2, k + 2], [k, k + 2]]]} for k in (0, 1))
SMALL: dict[str, dict[str, Any]] = {
    "/v1/contains": {"solid": SPHERE, "points": [[0.5, 0.5, 0.5]] * 10},
    "/v1/clip/segments": {"region": SPHERE, "segments": [[[-1, 0.5, 0.5], [2, 0.5, 0.5]]] * 10},
    "/v1/collide": {"first": SPHERE, "second": {**SPHERE, "center": [1, 1, 1]}},
    "/v1/overlay": {"subject": SQUARE, "clip": OTHER, "operation": "union"},
}
_ANSWERED = frozenset({*range(200, 500), 503, 504})
SETTINGS = {
    "deadline_seconds": 2, "request_bytes": 2**28, "store_bytes": 2**24, "access_log": False, "drain_seconds": 3,
}  # fmt: skip
Send = Callable[[int], list[int]]


def ask_small(port: int, seconds: float, rate: float) -> tuple[Counter[int], list[float], int]:
    """Ask small questions in turn, so many a second; return the statuses, the seconds each took, and how many answers
    differ from the first to the same question."""
    messages = [request(path, orjson.dumps(body)) for path, body in SMALL.items()]
    connection, statuses, took, wrong = Connection(port), Counter[int](), [], 0
    first: dict[bytes, bytes] = {}
    begin = time.perf_counter()
    for turn, message in zip(range(int(seconds * rate)), cycle(messages)):
        time.sleep(max(0.0, begin + turn / rate - time.perf_counter()))
        before = time.perf_counter()
        status, answer = connection.ask(message)
        took.append(time.perf_counter() - before)
        statuses[status] += 1
        if status == 200:
            wrong += first.setdefault(message, answer) != answer
    return statuses, took, wrong


def hostile_sends() -> list[tuple[Send, frozenset[int]]]:
    """Return everything hostile that the tests send, each with the statuses that may come back."""

    def sending(message: bytes) -> Send:
        return lambda port: [Connection(port).ask(message)[0]]

    sends = [(attack.send, attack.allowed | {503}) for attack in all_attacks()]
    for path, body, headers in bodies():
        if "{" not in path:
            named = {name.replace("-", "_"): value for name, value in headers.items()}
            sends.append((sending(request(f"/v1/{path}", body, **named)), _ANSWERED))
    return sends


def send_hostile(port: int, seconds: float, rate: float) -> tuple[Counter[int], Counter[int]]:
    """Send what is hostile in turn, so many a second and two at a time at most; return the statuses, 0 for a connection
    that was lost, and those of them that must not be."""
    sends, turns, lock = hostile_sends(), count(), threading.Lock()
    statuses, wrong = Counter[int](), Counter[int]()
    begin = time.perf_counter()

    def loop() -> None:
        while time.perf_counter() < begin + seconds:
            with lock:
                turn = next(turns)
            time.sleep(max(0.0, begin + turn / rate - time.perf_counter()))
            send, allowed = sends[turn % len(sends)]
            try:
                came = send(port)
            except OSError:
                came = [0]
            with lock:
                statuses.update(came)
                wrong.update(status for status in came if status not in allowed)

    with ThreadPoolExecutor(2) as pool:
        for client in [pool.submit(loop) for _ in range(2)]:
            client.result()
    return statuses, wrong


def _many(name: str, port: int, n: int) -> tuple[list[int], float]:
    """Send an attack n times at once; return the statuses, and the seconds that the slowest took."""
    send = next(attack.send for attack in all_attacks() if attack.name == name)
    with suppress(OSError):
        send(0)  # makes the body: nobody listens there

    def one(_: int) -> tuple[list[int], float]:
        before = time.perf_counter()
        return send(port), time.perf_counter() - before

    with ThreadPoolExecutor(n) as pool:
        outcome = list(pool.map(one, range(n)))
    return [status for statuses, _ in outcome for status in statuses], max(seconds for _, seconds in outcome)


def each_alone() -> bool:
    """Print what each attack does, once and eight times at once; return whether only statuses came that may."""
    is_well = True
    with serving(**SETTINGS) as (port, process):
        in_process(ask_small, port, 4.0, 10.0)()
        print(f"at rest {memory_of(process.pid):.0f} MB; seconds until answered, longest /healthz, most memory")
        for attack in all_attacks():
            cells = []
            for n in (1, 8):
                with watched(port, process.pid, 60.0) as seen:
                    statuses, seconds = in_process(_many, attack.name, port, n)()
                figures = f"{seconds:6.2f} s {seen.wait:6.3f} s {seen.memory:5.0f} MB"
                cells.append(f"{dict(Counter(statuses))!s:24} {figures}")
                is_well = is_well and {*statuses} <= attack.allowed | {503}
            print(f"{attack.name:44} {' | '.join(cells)}", flush=True)
    return is_well


def stops(n: int) -> bool:
    """Print how long SIGTERM takes, n times under each attack, eight of it at once; return whether all ended in time,
    with 0."""
    is_well, most = True, SETTINGS["drain_seconds"] + 2
    for attack in all_attacks():
        took, codes = [], Counter[int]()
        for _ in range(n):
            with serving(**SETTINGS) as (port, process):
                sender = in_process(_many, attack.name, port, 8)
                time.sleep(2.5)
                before = time.perf_counter()
                process.send_signal(signal.SIGTERM)
                codes[process.wait(60)] += 1
                took.append(time.perf_counter() - before)
                with suppress(OSError):
                    sender()
        print(f"{attack.name:44} {max(took):5.1f} s at most of {most}; ended with {dict(codes)}", flush=True)
        is_well = is_well and max(took) <= most and {*codes} == {0}
    return is_well


def main(words: list[str]) -> int:
    """Run the load; return 1 where the service answered with a status that it must not, or wrong."""
    parser = argparse.ArgumentParser(prog="benchmarks soak", description=__doc__.split("\n")[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=10.0, help="small questions a second")
    parser.add_argument("--each", action="store_true", help="each attack alone and eight times at once")
    parser.add_argument("--stops", type=int, default=0, help="end the service so many times under each attack")
    options = parser.parse_args(words)
    if options.each or options.stops:
        is_well = each_alone() if options.each else True
        return int(not ((stops(options.stops) if options.stops else True) and is_well))
    worst, wrong = Counter[int](), 0
    with serving(**SETTINGS) as (port, process):
        ask_small(port, 4.0, 10.0)
        print(f"at rest: {memory_of(process.pid):.0f} MB, {_quantiles(ask_small(port, 10.0, options.rate)[1])}")
        seconds = 60.0 * options.minutes
        end = time.perf_counter() + seconds
        hostile = in_process(send_hostile, port, seconds, options.rate / 10)
        every: list[float] = []
        for minute in count(1):
            if (left := end - time.perf_counter()) <= 0:
                break
            statuses, took, n_wrong = in_process(ask_small, port, min(60.0, left), options.rate)()
            worst, wrong, every = worst + statuses, wrong + n_wrong, every + took
            memory = memory_of(process.pid)
            print(f"minute {minute:3}: {memory:5.0f} MB; small {dict(statuses)}, {_quantiles(took)}", flush=True)
        answered, bad = hostile()
        print(f"small in all: {_quantiles(every)}, {wrong} wrong; hostile: {dict(answered)}")
    refused = {*bad, *(status for status in worst if status not in _ANSWERED)}
    print(f"statuses that must not be: {refused or 'none'}")
    return int(bool(refused or wrong))


def _quantiles(took: list[float]) -> str:
    return ", ".join(f"{name} {1e3 * percentile(took, share):.1f} ms" for name, share in (("p50", 0.5), ("p99", 0.99)))
