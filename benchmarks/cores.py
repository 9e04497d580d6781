"""Many cores: each batch operation with 1, 2, 4 .. workers, answers compared; the service; Dask on this machine.

    python -m benchmarks cores                       # threads alone: a minute or two
    python -m benchmarks cores --http --dask         # the service by 16 clients on loopback, worker processes of Dask
    python -m benchmarks cores --workers 1,16 --items 0.1 --only "points, mesh"
    python -m benchmarks cores --simulate 16         # what 2, 4, 8 and 16 cores would give, from one thread's CPU time

Wall time, the least of the rounds, in turns. "CPU" is the CPU time with the most workers over that with one.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import orjson

import engine
from benchmarks import load, machine
from benchmarks.bodies import random_rotations
from benchmarks.measure import clocked
from benchmarks.polygon_pairs import small
from benchmarks.simulated_cores import predict
from benchmarks.wire import SPHERE, serving
from benchmarks.workloads import bumpy_sphere, generator, mesh_of_size, points_in_box, star_polygon, star_rings
from service.settings import Settings

Question = Callable[[int | None], Any]
"""A question, answered with so many workers; None: the default."""
ROUNDS = 5
CLIENTS = 16


def _bodies(seed: int, n: int = 1000) -> tuple[engine.Polyhedron, list[engine.Solid], list[engine.Pose]]:
    """Return a mesh of 1,280 faces, and a scene of n bodies, as dense for every n."""
    mesh = engine.Polyhedron(*(lambda m: (m.vertices, m.faces))(bumpy_sphere("cores", seed, 3)))
    kinds = mesh, engine.Sphere([0, 0, 0], 0.8), engine.Aabb([-1, -0.5, -0.7], [1, 0.5, 0.7])
    draw = generator("cores/scene", seed)
    moves = draw.uniform(-1.4, 1.4, (n, 3)) * np.cbrt(n)
    poses = [engine.Pose(turn, move) for turn, move in zip(random_rotations(draw, n), moves)]
    return mesh, [kinds[k % 3] for k in range(n)], poses


def _discs(n: int, seed: int) -> list[engine.Polygon]:
    """Return regular polygons of 32 vertices, whose areas add up to that of the square where they lie."""
    draw, angles = generator("cores/union", seed), np.arange(32) * (2 * np.pi / 32)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    middles = draw.uniform(0.0, np.sqrt(n), (n, 1, 2))
    return [engine.Polygon([ring]) for ring in middles + draw.uniform(0.3, 0.8, (n, 1, 1)) * circle]


def workloads(items: float, seed: int) -> Iterator[tuple[str, int, Question]]:
    """Yield name, number of items and question."""
    draw = generator("cores", seed)
    n = lambda most: max(16, int(most * items))  # noqa: E731
    large, ring = mesh_of_size("86k", seed), star_polygon(1000, seed)
    solid, polygon = engine.Polyhedron(large.vertices, large.faces), engine.Polygon(ring.rings)
    low, high = large.vertices.min(axis=0), large.vertices.max(axis=0)
    points = points_in_box(large, n(2e6), seed)
    yield "points, mesh of 86k", len(points), lambda workers: engine.locate(points, solid, workers=workers)
    flat = points_in_box(ring, n(2e6), seed)
    yield "points, polygon of 1,000", len(flat), lambda workers: engine.locate(flat, polygon, workers=workers)
    mesh, solids, poses = _bodies(seed)
    turns = random_rotations(draw, n(2e5))
    near = draw.normal(size=(len(turns), 3))
    near *= draw.uniform(1.0, 2.6, (len(turns), 1)) / np.linalg.norm(near, axis=1, keepdims=True)
    yield (
        "poses, meshes of 1k: collide",
        len(turns),
        lambda workers: engine.collide_poses(mesh, mesh, turns, near, workers=workers),
    )
    some = n(2e4)
    yield (
        "poses, meshes of 1k: clearance",
        some,
        lambda workers: engine.clearance_poses(mesh, mesh, turns[:some], 2.0 * near[:some], workers=workers),
    )
    segments, box = draw.uniform(-2, 2, (n(2e6), 2, 3)), engine.Aabb([-1, -1, -1], [1, 0.9, 1.1])
    yield "segments, box", len(segments), lambda workers: engine.clip_segments(segments, box, workers=workers)
    through = draw.uniform(low, high, (n(2e5), 2, 3))
    yield "segments, mesh of 86k", len(through), lambda workers: engine.clip_segments(through, solid, workers=workers)
    scene, long = engine.Scene(solids, poses), draw.uniform(-15, 15, (n(1e6), 1, 3)) + draw.normal(size=(n(1e6), 2, 3))
    yield "segments, scene of 1,000", len(long), lambda workers: scene.clip_segments(long, workers=workers)
    spread = draw.uniform(-15, 15, (n(1e6), 3))
    yield "points, scene of 1,000", len(spread), lambda workers: scene.locate(spread, workers=workers)
    yield from _first_questions(items, seed)
    _, solids, poses = _bodies(seed, n(4e4))
    crowd = engine.Scene(solids, poses)
    yield "pairs, scene of 40,000", len(solids), lambda workers: crowd.collide(witnesses=True, workers=workers)
    quads, window = star_rings(4, 2, n(1e6), seed), engine.Aabb([-1, -1], [1, 1])
    yield "quads, box", len(quads), lambda workers: engine.clip_polygons(quads, window, workers=workers)
    first, second = ([engine.Polygon(rings) for rings in each] for each in zip(*small("star", 10, n(1e5), seed)))
    yield "overlay_batch, stars of 10", len(first), lambda workers: engine.overlay_batch(first, second, workers=workers)
    discs = _discs(n(2e4), seed)
    yield "union of circles", len(discs), lambda workers: engine.union_all(discs, workers=workers)


def _first_questions(items: float, seed: int) -> Iterator[tuple[str, int, Question]]:
    """Yield questions to a mesh of 1.3 million faces, or a sixteenth, for which nothing is prepared yet."""
    fresh, small = (
        engine.Polyhedron(mesh.vertices + np.array([move, 0, 0]), mesh.faces)
        for mesh, move in ((bumpy_sphere("cores", seed, 8 if items >= 1 else 6), 0), (bumpy_sphere("cores", 9, 3), 1.6))
    )
    points = generator("cores/fresh", seed).uniform(-1, 1, (20_000, 2, 3))

    def first(ask: Question) -> Question:
        def question(workers: int | None) -> Any:
            fresh.drop("tree", "mesh_body", "clipping_boundary")
            return ask(workers)

        return question

    scene, n = lambda workers: engine.Scene([fresh]).locate(points[:, 0], workers=workers), fresh.n_faces
    yield "fresh mesh: points", n, first(scene)
    yield "fresh mesh: segments", n, first(lambda workers: engine.clip_segments(points, fresh, workers=workers))
    still = np.eye(3)[None], np.zeros((1, 3))
    yield "fresh mesh: pairs", n, first(lambda workers: engine.collide_poses(fresh, small, *still, workers=workers))


def digest_of(answer: Any) -> str:
    """Return a hash of all arrays of an answer, and of its witnesses."""
    named = [getattr(answer, field.name) for field in fields(answer)] if is_dataclass(answer) else [answer]
    summed = hashlib.sha256()
    for array in named:
        if isinstance(array, np.ndarray):
            summed.update(np.ascontiguousarray(array).tobytes())
        elif isinstance(array, tuple):
            summed.update(repr(array).encode())
    return summed.hexdigest()


def measure(question: Question, counts: list[int | None]) -> dict[str, Any]:
    """Return the least wall and CPU seconds by number of workers, and whether all answers have the same bytes."""
    wall: dict[str, list[float]] = {str(count or "default"): [] for count in counts}
    cpu: dict[str, list[float]] = {name: [] for name in wall}
    digests = {digest_of(question(count)) for count in counts}
    for turn in range(ROUNDS):
        for name, count in list(zip(wall, counts))[:: 1 if turn % 2 else -1]:
            for kept, took in zip((wall, cpu), clocked(lambda count=count: question(count))):
                kept[name].append(took)
    least = {name: min(seconds) for name, seconds in wall.items()}
    one, most = least[str(counts[0])], list(least)[-1]
    return {
        "seconds": least,
        "speed_up": {name: one / seconds for name, seconds in least.items()},
        "cpu": min(cpu[most]) / min(cpu[str(counts[0])]),
        "same": len(digests) == 1,
    }


def requests_a_second(seed: int, seconds: float = 3.0) -> dict[str, dict[str, float]]:
    """Return requests a second by processes of the service: 1, and the default."""
    many = generator("cores/http", seed).uniform(-1, 1, (10_000, 3)).tolist()
    bodies = {name: orjson.dumps({"solid": SPHERE, "points": points})
              for name, points in (("one point", [[0.1, 0.2, 0.3]]), ("10,000 points", many))}  # fmt: skip
    result: dict[str, dict[str, float]] = {}
    for workers in sorted({1, Settings().workers}):
        with serving(workers=workers) as (port, _):
            time.sleep(2.0)  # until the others are ready too
            for name, body in bodies.items():
                message = load.request("/v1/contains", body)
                clients = [load.in_process(load.loop, port, message, seconds) for _ in range(CLIENTS)]
                seen = [client() for client in clients]
                assert all(set(each.statuses) == {200} for each in seen), [each.statuses for each in seen]
                rates = (each.statuses[200] / each.span for each in seen)
                result.setdefault(name, {})[str(workers)] = sum(rates)
    return result


def over_dask(seed: int) -> dict[str, dict[str, float]]:
    """Return the seconds of batches by worker processes of Dask, one thread each, and their CPU seconds, with
    those of client and scheduler; `here`: one thread without Dask."""
    from distributed import Client, LocalCluster
    from psutil import Process

    from engine import distributed

    draw, (mesh, _, _) = generator("cores/dask", seed), _bodies(seed)
    points = draw.uniform(-1.2, 1.2, (2_000_000, 3))
    turns, moves = random_rotations(draw, 50_000), draw.uniform(-2, 2, (50_000, 3))
    here = {
        "points, mesh of 1k": lambda: engine.locate(points, mesh, workers=1),
        "poses, meshes of 1k": lambda: engine.collide_poses(mesh, mesh, turns, moves, workers=1),
    }
    expected = {name: question() for name, question in here.items()}
    result = {name: dict(zip(("here", "here, CPU"), _least(question))) for name, question in here.items()}
    for workers in (1, 2, 4):
        cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
        with cluster, Client(cluster) as client:
            there = (
                lambda client=client: distributed.locate(client, points, mesh),
                lambda client=client: distributed.collide_poses(client, mesh, mesh, turns, moves),
            )
            for name, question in zip(here, there):
                assert np.array_equal(question(), expected[name])
                there_too = [Process(nanny.pid) for nanny in cluster.workers.values()]
                result[name] |= zip((f"{workers}", f"{workers}, CPU"), _least(question, there_too))
    return result


def _least(question: Callable[[], Any], others: Sequence[Any] = ()) -> tuple[float, float]:
    """Return the least wall and CPU seconds of a question, that of other processes included."""
    wall, cpu = [], []
    for _ in range(5):
        before = sum(sum(each.cpu_times()[:2]) for each in others)
        took = clocked(question)
        wall.append(took[0])
        cpu.append(took[1] + sum(sum(each.cpu_times()[:2]) for each in others) - before)
    return min(wall), min(cpu)


def _simulate(given: argparse.Namespace) -> int:
    """Print predicted speed-ups, powers of two up to so many cores."""
    counts = [2**k for k in range(1, given.simulate.bit_length())]
    for name, n_items, question in workloads(given.items, given.seed):
        if given.only in name:
            question(1), question(given.simulate)
            row = predict(question, counts, ROUNDS)
            ratios = "  ".join(f"{count}: {ratio:5.2f}" for count, ratio in row["speed_up"].items())
            print(
                f"{name:32} {n_items:9,}  {1e3 * row['seconds']:8.1f} ms  {ratios}  serial {row['serial']:.1%}",
                flush=True,
            )
    return 0


def main(words: list[str]) -> int:
    """Print the tables, and store them beside the other results of machines like this one."""
    parser = argparse.ArgumentParser(
        "benchmarks cores", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--workers", default="", help="as 1,2,4; by default powers of two up to the cores")
    parser.add_argument("--items", type=float, default=1.0, help="of the sizes here")
    parser.add_argument("--only", default="", help="rows whose name has this")
    parser.add_argument("--http", action="store_true")
    parser.add_argument("--dask", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dry", action="store_true", help="write no file")
    parser.add_argument("--simulate", type=int, default=0, metavar="CORES", help="write no file, predict")
    given = parser.parse_args(words)
    engine.warm(processes=machine.cores())
    if given.simulate:
        return _simulate(given)
    counts: list[int | None] = [2**k for k in range(machine.cores().bit_length()) if 2**k <= machine.cores()]
    counts = [int(count) for count in given.workers.split(",")] if given.workers else [*counts, None]
    result: dict[str, Any] = {"facts": machine.facts(given.seed, machine.cores()), "threads": {}}
    for name, n_items, question in workloads(given.items, given.seed):
        if given.only in name:
            row = result["threads"][name] = measure(question, counts) | {"items": n_items}
            ratios = "  ".join(f"{count}: {ratio:5.2f}" for count, ratio in row["speed_up"].items())
            least = 1e3 * next(iter(row["seconds"].values()))
            print(f"{name:32} {n_items:9,}  {least:8.1f} ms  {ratios}  CPU {row['cpu']:.2f}"
                  f"{'' if row['same'] else '  ANSWERS DIFFER'}", flush=True)  # fmt: skip
    for name, measured in (("http", requests_a_second), ("dask", over_dask)):
        if getattr(given, name):
            result[name] = measured(given.seed)
            print(name, json.dumps(result[name]), flush=True)
    if not given.dry:
        path = machine.results("cores")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(result, indent=1) + "\n")
    return int(any(not row["same"] for row in result["threads"].values()))
