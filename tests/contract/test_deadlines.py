"""Work for minutes ends when its deadline passes, and when the client goes away: every endpoint of the document.

An endpoint that is not in `WORK` fails, so that a new one cannot be forgotten. What counts is CPU time after the end.
"""

from __future__ import annotations

import json
import math
import os
import socket
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.contract.test_openapi import STORED
from tests.unit.service.test_live import Service

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="CPU time of processes is read from /proc")
DEADLINE = 0.5
AFTER, SORTED = 0.25, 0.5
"""Seconds of CPU after the end, all threads together, on a machine that sorts four million doubles in so many."""
LOOK_UPS = {"get_solid", "has_solid", "get_scene", "has_scene", "healthz", "readyz", "metrics"}
"""They do no work that could last."""


@cache
def after() -> float:
    """Return `AFTER`, on a slower machine as much longer as it takes to sort."""
    numbers, spent = np.random.default_rng(0).random(4_000_000), []
    for _ in range(3):
        start = time.process_time()
        np.sort(numbers, kind="stable")
        spent.append(time.process_time() - start)
    return AFTER * max(1.0, min(spent) / SORTED)


def check_ends(cpu_after: Callable[[], float]) -> None:
    """Assert that some work ends in time: within one of three attempts, and on a slow machine in proportion."""
    spent = math.inf
    for _ in range(3):
        spent = min(spent, cpu_after())
        if spent < AFTER:
            return
    assert spent < after()


def ball(n: int) -> dict[str, Any]:
    normals = np.random.default_rng(0).normal(size=(n, 3))
    rows = np.c_[normals / np.linalg.norm(normals, axis=1)[:, None], np.ones(n)]
    return {"type": "convex", "planes": rows.tolist()}


def vanishing(n: int) -> dict[str, Any]:
    """Return a polynomial that is zero everywhere, which only exact arithmetic finds out."""
    powers = [[i % 9, i // 9 % 8] for i in range(n)]
    terms = [{"powers": power, "coefficient": 1 + i} for i, power in enumerate(powers)]
    return {"type": "implicit", "terms": terms + [{**term, "coefficient": -term["coefficient"]} for term in terms]}


def circle(n: int) -> Any:
    turns = 2 * np.pi * np.arange(n) / n
    return np.c_[np.cos(turns), np.sin(turns)]


def prism(ring: Any) -> dict[str, Any]:
    n = len(ring)
    vertices = np.concatenate([np.c_[ring, np.zeros(n)], np.c_[ring, np.ones(n)]])
    sides = [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    faces = [[*range(n - 1, -1, -1)], [*range(n, 2 * n)], *sides]
    return {"type": "polyhedron", "vertices": vertices.tolist(), "faces": faces}


def comb(n: int) -> list[list[float]]:
    """Return a ring whose teeth end at y = 0."""
    return [*([i, i % 2] for i in range(n)), [n, 9], [0, 9]]


def stripes(n: int) -> list[Any]:
    return [[[0, 3 * i], [3 * n, 3 * i], [3 * n, 3 * i + 1], [0, 3 * i + 1]] for i in range(n)]


def across(n: int) -> list[Any]:
    return [[[y, x] for x, y in bar] for bar in stripes(n)]


def features(shapes: list[Any], kind: str = "Polygon") -> dict[str, Any]:
    """Return a layer of shapes: polygons of one ring, or points."""
    made = [
        {"type": "Feature", "properties": None, "geometry": {"type": kind, "coordinates": shape}} for shape in shapes
    ]
    return {"type": "FeatureCollection", "features": made}


TINY = [[0, 0], [1e-200, 0], [0, 1e-200]]


def far_apart() -> dict[str, Any]:
    """Return polygons whose exponents only integers hold."""
    rings = stripes(150)
    subject, clip = ({"type": "polygon", "rings": some} for some in ([*rings, TINY], across(150)))
    return {"subject": subject, "clip": clip, "operation": "union"}


def far_apart_batch() -> dict[str, Any]:
    asked = far_apart()
    return {"subjects": [asked["subject"]] * 9, "clips": [asked["clip"]] * 9, "operation": "union"}


POSE = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [0, 0, 1]}
TIN, POLYNOMIAL = prism(circle(200)), vanishing(400)
BOX = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
MANY_SIDES = {"type": "convex", "planes": np.c_[circle(9_000), np.ones(9_000)].tolist()}
ZIGZAG = np.c_[np.arange(20_000), 10 * (np.arange(20_000) % 2)].tolist()
WORK: dict[str, Callable[[], Any]] = {
    "contains": lambda: {"solid": POLYNOMIAL, "points": [[3, 5]] * 100_000},
    "contains_scene": lambda: {"bodies": [{"solid": POLYNOMIAL}], "points": [[3, 5]] * 100_000},
    "bounds": lambda: {"solid": ball(9_000)},
    "volume": lambda: {"solid": prism(circle(9_000))},
    "section": lambda: {"solid": prism(circle(3_000)), "heights": np.linspace(0.01, 0.99, 900).tolist()},
    "cut": lambda: {"solid": prism(circle(9_000)), "region": ball(200)},
    "overlap": lambda: {"first": TIN, "second": BOX, "poses": [POSE] * 999},
    "collide": lambda: {"first": TIN, "second": TIN, "poses": [POSE] * 10_000},
    "clearance": lambda: {"first": TIN, "second": TIN, "poses": [{**POSE, "translation": [0, 0.5, 3]}] * 10_000},
    "distances": lambda: {"solid": MANY_SIDES, "points": [[5, 5]] * 100},
    "compare": lambda: {
        "operation": "clip_segments", "region": MANY_SIDES, "segments": [[[-2, 0.1], [2, 0.2]]] * 60_000
    },
    "collide_scene": lambda: {"bodies": [{"solid": TIN, **({"pose": POSE} if i % 2 else {})} for i in range(60)]},
    "clip_segments": lambda: {
        "region": {"type": "polygon", "rings": [comb(3_000)]}, "segments": [[[-1, 0], [9_000, 0]]] * 20_000
    },
    "clip_lines": lambda: {
        "region": {"type": "polygon", "rings": [comb(3_000)]}, "lines": [[[-1, 0], [9_000, 0]] * 10] * 1_000
    },
    "clip_polygons": lambda: {"region": MANY_SIDES, "polygons": [[ZIGZAG]] * 4},
    "overlay": far_apart,
    "overlay_layers": lambda: {
        "left": features([[bar] for bar in stripes(1_200)]), "right": features([[bar] for bar in across(1_200)]),
        "operation": "union",
    },
    "unite_layer": lambda: {"layer": features([[bar] for bar in [*stripes(1_500), *across(1_500), TINY]])},
    "locate_in_layer": lambda: {
        "points": features([[1 + k / 5_000, 1 + k / 5_000] for k in range(5_000)], "Point"),
        "polygons": features([[[[1e-300, 1e-300], [3, 0], [3, 3]]]] * 1_000),
    },
    "clip_layer": lambda: {
        "layer": features([[bar] for bar in stripes(1_200)]), "mask": features([[bar] for bar in across(1_200)])
    },
    "join_layers": lambda: {
        "left": features([[bar] for bar in stripes(1_500)]), "right": features([[bar] for bar in across(1_500)]),
        "predicate": "overlaps",
    },
    "join_nearest": lambda: {
        "left": features([[k % 2 * 9.0, k] for k in range(9_000)], "Point"),
        "right": features([[bar] for bar in stripes(1_500)]),
    },
    "split_layer": lambda: {
        "layer": features([[bar] for bar in stripes(300)]),
        "lines": features([[[-1, k], [9_000, k + 0.5]] for k in range(300)], "LineString"),
    },
    "stream_features": lambda: "\n".join(
        json.dumps(line)
        for line in (
            {"operation": "join", "layer": features([[bar] for bar in stripes(1_500)]), "predicate": "overlaps"},
            *features([[bar] for bar in across(1_500)])["features"],
        )
    ),
    "overlay_batch": far_apart_batch,
    "put_solid": lambda: prism(comb(1_200)),
    "inspect_solid": lambda: prism(circle(20_000)),
    "contains_stored": lambda: (POLYNOMIAL, np.tile([3.0, 5.0], 100_000).tobytes()),
    "clip_segments_stored": lambda: (MANY_SIDES, np.tile([[-2.0, 0.1], [2.0, 0.2]], (60_000, 1)).tobytes()),
    "import_solid": lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\nf 1 2 3 1 2 3\n" * 75_000,
}  # fmt: skip
TINS = {"bodies": [{"solid": TIN, **({"pose": POSE} if i % 2 else {})} for i in range(60)]}
COMBS = {"bodies": [{"solid": {"type": "polygon", "rings": [comb(3_000)]}}]}
ALONG = [[[-1, 0], [9_000, 0]]] * 20_000
IN_A_FACE = [[[-2, 0.1, 0], [2, 0.2, 0]]] * 20_000
WORK |= {
    "put_scene": lambda: {"bodies": [{"solid": prism(comb(1_200))}]},
    "distances_stored": lambda: (MANY_SIDES, np.tile([5.0, 5.0], 100).tobytes()),
    "distances_stored_scene": lambda: ({"bodies": [{"solid": MANY_SIDES}]}, {"points": [[5, 5]] * 100}),
    "distances_stored_scene_binary": lambda: ({"bodies": [{"solid": MANY_SIDES}]}, np.tile([5.0, 5.0], 100).tobytes()),
    "contains_stored_scene": lambda: ({"bodies": [{"solid": POLYNOMIAL}]}, {"points": [[3, 5]] * 100_000}),
    "contains_stored_scene_binary": lambda: (
        {"bodies": [{"solid": POLYNOMIAL}]}, np.tile([3.0, 5.0], 100_000).tobytes()
    ),
    "collide_stored_scene": lambda: (TINS, {}),
    "hits": lambda: {"surface": TIN, "segments": IN_A_FACE},
    "hits_stored": lambda: (TIN, np.array(IN_A_FACE, np.float64).tobytes()),
    "hits_stored_scene": lambda: (TINS, {"segments": IN_A_FACE}),
    "hits_stored_scene_binary": lambda: (TINS, np.array(IN_A_FACE, np.float64).tobytes()),
    "clip_segments_scene": lambda: {**COMBS, "segments": ALONG},
    "clip_segments_stored_scene": lambda: (COMBS, {"segments": ALONG}),
    "clip_segments_stored_scene_binary": lambda: (COMBS, np.array(ALONG, np.float64).tobytes()),
}  # fmt: skip
COMPILED = {"operation": "clip_segments", "region": MANY_SIDES, "segments": [[[-2, 0.1], [2, 0.2]]]}
"""The textbook's kernels are compiled by the first question that needs them, which nothing interrupts."""
OPERATIONS = {
    operation["operationId"]: path
    for path, item in json.loads(STORED.read_text("utf-8"))["paths"].items()
    for operation in item.values()
    if operation["operationId"] not in LOOK_UPS
}


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Service]]:
    """One that ends requests by itself, and one that waits for the client to go and takes what is to be stored."""
    folder = tmp_path_factory.mktemp("solids")
    seconds = {"deadline": DEADLINE, "disconnect": 300}
    found = {end: Service(deadline_seconds=seconds[end], store_folder=folder) for end in seconds}
    try:
        for service in found.values():
            service.wait_until_ready()
            httpx.post(f"{service.url}/v1/compare", json=COMPILED, timeout=300)
        yield found
        for service in found.values():
            assert service.stop() == 0, "".join(service.log)
            assert "Traceback" not in "".join(service.log)
    finally:
        for service in found.values():
            service.close()


def cpu_of(service: Service) -> float:
    """Return the CPU seconds of the process and of the children it waited for."""
    fields = Path(f"/proc/{service.process.pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def cpu_when_idle(service: Service) -> float:
    """Return it once it does not grow any more."""
    spent = cpu_of(service)
    for _ in range(300):
        time.sleep(0.2)
        before, spent = spent, cpu_of(service)
        if spent - before < 0.02:
            break
    return spent


def request_of(storing: Service, name: str) -> bytes:
    """Return the bytes that ask for the work of an operation; storing: where to put what it is about."""
    path, work = OPERATIONS[name], WORK[name]()
    if isinstance(work, tuple):
        stored, work = work
        where = "solids" if "bodies" not in stored else "scenes"
        stored_id = httpx.post(f"{storing.url}/v1/{where}", json=stored, timeout=300).json()["id"]
        path = path.replace("{solid_id}", stored_id).replace("{scene_id}", stored_id)
    kind = "application/json" if isinstance(work, dict) else "application/octet-stream"
    body = json.dumps(work).encode() if isinstance(work, dict) else work
    if isinstance(work, str):
        kind, body = "application/x-ndjson", work.encode()
    assert len(body) < 2**21
    query = "?format=obj" if name == "import_solid" else ""
    head = f"POST {path}{query} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n\r\n"
    return head.encode() + body


def test_every_operation_has_its_work() -> None:
    assert set(WORK) == set(OPERATIONS)


@pytest.mark.some(5)
@pytest.mark.parametrize("end", ["deadline", "disconnect"])
@pytest.mark.parametrize("name", WORK)
def test_work_ends(services: dict[str, Service], name: str, end: str) -> None:
    service = services[end]
    message = request_of(services["disconnect"], name)

    def cpu_after() -> float:
        with socket.create_connection(("127.0.0.1", service.port), timeout=300) as connection:
            connection.sendall(message)
            time.sleep(DEADLINE * (1 + (name == "stream_features")))  # its first line has a deadline of its own
            at_the_end = cpu_of(service)
            if end == "deadline":
                assert connection.recv(2**16)[9:12] in (b"504", b"201", b"200")
        return cpu_when_idle(service) - at_the_end

    check_ends(cpu_after)
