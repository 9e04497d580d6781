"""Speed and error of overlay, row by row: ``python -m benchmarks.overlay [--quick]``.

All rows but the last are of one thread, and all are intersections. Polygons are made before; our rows include packing
them into arrays, the peers' rows what their Python calls cost. CGAL's Python package has no Boolean operations in 2D.
"""

from __future__ import annotations

import contextlib
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks import polygon_pairs
from benchmarks.contenders.overlays import MAKERS, Prepared, shape_of
from benchmarks.measure import Timing, clocked, interleaved, ratios
from benchmarks.suite import Row, Suite, options

Task = tuple[str, Callable[[str], Iterable[Row]]]
OPERATIONS = ("intersection", "union", "difference", "symmetric_difference")
SHAPELY_GOALS, CLIPPER_GOALS, CLIPPER_MEAN = (6.0, 15.0), (0.4, 1.0), (1.2, 3.0)
BATCH_GOALS, GROSS_GOALS, THREAD_GOALS = (5.0, 15.0), (2.0, 5.0), (1.7, 1.9)
SLOWEST, LONGEST = 10.0, 20.0
"""A peer whose first run takes so many times as long as ours, and over a second, or so many seconds, is timed once."""


def tasks(suite: Suite) -> Iterator[Task]:
    """Yield the rows of the table in its order."""
    sizes = (1000,) if suite.options.quick else (1000, 10_000, 100_000)
    against_clipper: list[float] = []
    for n in sizes:
        for family in ("smooth", "spiky", "comb", "soup"):
            yield f"{family}, {n} vertices", partial(_large, suite, family, n, against_clipper)
    yield "dense comb, 300 vertices", partial(_large, suite, "dense comb", 300, against_clipper)
    yield "Clipper2, pyclipper: geometric mean", partial(_mean, against_clipper)
    for family in ("star", "convex"):
        for size in (4, 10) if suite.options.quick else (4, 10, 30, 100):
            yield f"batch of {family}s, {size} vertices", partial(_batch, suite, family, size)
    for size in (10,) if suite.options.quick else (10, 100):
        yield f"two threads, batch of stars, {size} vertices", partial(_two_threads, suite, size)
    yield "public pairs, four operations", partial(_public, suite)
    yield "late after a deadline, combs of 100000 vertices", partial(_deadline, suite)


def _prepared(name: str, pair: Any) -> Prepared | str:
    try:
        return MAKERS[name](*pair)
    except Exception as error:  # whatever a peer raises: it refuses the input
        return f"{name}: {type(error).__name__}"


def _large(suite: Suite, family: str, n: int, against_clipper: list[float], name: str) -> Iterable[Row]:
    """Yield a row against shapely, and one against the faster of pyclipper and Clipper2."""
    pair = polygon_pairs.large(family, n, suite.options.seed)
    made, notes, cold = {}, [], {}
    for peer in MAKERS:
        prepared = _prepared(peer, pair)
        if isinstance(prepared, str):
            notes.append(prepared)
            continue
        cold[peer] = clocked(prepared.run)[0]
        if peer != "ours":
            cold["ours"] = min(cold["ours"], clocked(made["ours"].run)[0])
        made[peer] = prepared
    most = min(LONGEST, max(1.0, SLOWEST * cold["ours"]))
    timed = [peer for peer in made if peer == "ours" or cold[peer] < most]
    timings, results = interleaved([made[peer].run for peer in timed], suite.options.rounds, suite.options.seconds)
    by_name = dict(zip(timed, timings, strict=True))
    notes += [_areas(dict(zip(timed, results, strict=True)), made)]
    for peer in set(made) - set(timed):
        by_name[peer] = Timing(cold[peer], [cold[peer]] * len(timings[0].wall), [cold[peer]] * len(timings[0].cpu))
        notes.append(f"{peer} timed once")
    if "shapely" in by_name:
        yield _ratio(f"{name} vs shapely", by_name["ours"], by_name["shapely"], SHAPELY_GOALS, "; ".join(notes))
    clippers = [peer for peer in ("manifold3d", "pyclipper") if peer in by_name]
    if clippers:
        best = min(clippers, key=lambda peer: by_name[peer].median)
        others = ", ".join(f"{peer} {by_name[peer].median * 1e3:.3g} ms" for peer in clippers)
        row = _ratio(f"{name} vs Clipper", by_name["ours"], by_name[best], CLIPPER_GOALS, others)
        against_clipper.append(row.value or math.nan)
        yield row


def _areas(results: dict[str, Any], made: dict[str, Prepared]) -> str:
    """Tell how far each output's area lies from the exact one, and whether ours is valid for shapely."""
    exact = results["ours"].area
    told = [f"{peer} off by {abs(made[peer].area(found) - exact) / exact:.0e}" for peer, found in results.items()]
    valid = "valid" if shape_of(results["ours"]).is_valid else "INVALID"
    return f"area: {', '.join(told)}; ours {valid}"


def _ratio(name: str, ours: Timing, peer: Timing, goals: tuple[float, float], note: str = "", n_items: int = 0) -> Row:
    wall, cpu = ratios(ours, peer)
    row = Row(name, "x", *goals, wall.median, wall.low, wall.high, cpu.median, note=note)
    row.ours, row.peer = (
        f"{n_items / t.median / 1e3:.4g} k/s" if n_items else f"{t.median * 1e3:.3g} ms" for t in (ours, peer)
    )
    row.raw = {"ours": asdict(ours), "peer": asdict(peer), "n_items": n_items}
    return row


def _mean(values: list[float], name: str) -> Iterable[Row]:
    row = Row(name, "x", *CLIPPER_MEAN)
    if values:
        row.value, row.low, row.high = statistics.geometric_mean(values), min(values), max(values)
        row.note = f"of {len(values)} workloads; in the place of quartiles the least and the largest"
    yield row


def _pairs_of(size: int, quick: bool) -> int:
    return max(1000, 120_000 // size) // (10 if quick else 1)


def _batch(suite: Suite, family: str, size: int, name: str) -> Iterable[Row]:
    """Yield rows against shapely's vectorised intersection, and pyclipper called per pair: gross, and net of calls."""
    import pyclipper
    import shapely

    n_pairs = _pairs_of(size, suite.options.quick)
    first, second = polygon_pairs.small(family, size, n_pairs, suite.options.seed)
    subjects, clips = ([engine.Polygon([ring]) for ring in rings] for rings in (first, second))
    shapes = [shapely.polygons(rings) for rings in (first, second)]
    paths = [np.rint(rings * 2.0**50).astype(np.int64).tolist() for rings in (first, second)]

    def each(executes: bool) -> list[Any]:
        found = []
        for subject, clip in zip(*paths, strict=True):
            clipper = pyclipper.Pyclipper()
            clipper.AddPath(subject, pyclipper.PT_SUBJECT, True)
            clipper.AddPath(clip, pyclipper.PT_CLIP, True)
            if executes:
                found.append(clipper.Execute(pyclipper.CT_INTERSECTION))
        return found

    runs: list[Callable[[], Any]] = [
        lambda: engine.overlay_batch(subjects, clips, workers=1),
        lambda: shapely.intersection(*shapes),
        lambda: each(True),
        lambda: each(False),
    ]
    (ours, geos, gross, calls), results = interleaved(runs, suite.options.rounds, suite.options.seconds)
    batch = results[0]
    outputs = np.array([shape_of(found) for found in batch])
    invalid = np.count_nonzero(~shapely.is_valid(outputs))
    differ = np.count_nonzero(abs(shapely.area(outputs) - shapely.area(results[1])) > 1e-12)
    note = (
        f"ours: {invalid} invalid; {differ} of {n_pairs} areas differ from shapely's; {_settled(batch, first, second)}"
    )
    yield _ratio(f"{name} vs shapely", ours, geos, BATCH_GOALS, note, n_pairs)
    yield _ratio(f"{name} vs pyclipper, gross", ours, gross, GROSS_GOALS, n_items=n_pairs)
    net = Timing(gross.cold, *([a - b for a, b in zip(x, y, strict=True)] for x, y in
                               ((gross.wall, calls.wall), (gross.cpu, calls.cpu))))  # fmt: skip
    row = _ratio(
        f"{name} vs pyclipper, net", ours, net, GROSS_GOALS, "without the time of making and filling it", n_pairs
    )
    row.must = row.aim = None
    yield row


def _settled(batch: Any, first: np.ndarray, second: np.ndarray) -> str:
    """Compare exact areas of some pairs with the reference, in rationals."""
    try:
        from tests.reference.overlay import overlay as reference
    except ImportError as error:
        return f"exact answers need {error.name}, of the extra test"
    n_sample = max(3, min(60, 1500 // first.shape[1] ** 2))
    wrong = 0
    for i in range(n_sample):
        sides = [{"type": "polygon", "rings": [ring.tolist()]} for ring in (first[i], second[i])]
        area = reference(*sides, "intersection").area
        exact = batch[i].area_exact
        wrong += (exact.numerator, exact.denominator) != (area.numerator, area.denominator)
    return f"wrong: ours {wrong} of {n_sample} settled"


def _two_threads(suite: Suite, size: int, name: str) -> Iterable[Row]:
    first, second = polygon_pairs.small("star", size, _pairs_of(size, suite.options.quick), suite.options.seed)
    subjects, clips = ([engine.Polygon([ring]) for ring in rings] for rings in (first, second))
    runs = [lambda n=n: engine.overlay_batch(subjects, clips, workers=n) for n in (2, 1)]
    (two, one), _ = interleaved(runs, suite.options.rounds, suite.options.seconds)
    yield _ratio(name, two, one, THREAD_GOALS, "one thread stands in the place of the peer", len(subjects))


def _public(suite: Suite, name: str) -> Iterable[Row]:
    """Yield how many outputs of ours are wrong, invalid or missing, the same of peers' intersections, and their times.

    A peer's time is that of the pairs that it answers, once warm, against ours for the same pairs.
    """
    bad, n_pairs = 0, 0
    fails = dict.fromkeys(list(MAKERS)[1:], 0)
    seconds = {peer: [0.0, 0.0] for peer in fails}
    for pair in polygon_pairs.public():
        if sum(map(len, pair[0] + pair[1])) > (300 if suite.options.quick else 5000):
            continue
        n_pairs += 1
        first, second = map(engine.Polygon, pair)
        found = {operation: engine.overlay(first, second, operation) for operation in OPERATIONS}
        both, union, only, either = (found[operation].area_exact for operation in OPERATIONS)
        other = engine.overlay(second, first, "difference").area_exact
        bad += (either + both != union) or (only + other != either)
        bad += sum(not shape_of(each).is_valid for each in found.values())
        ours = clocked(partial(engine.overlay, first, second))[0]
        for peer in fails:
            taken = _asked(peer, pair, float(both))
            if taken is None:
                fails[peer] += 1
            else:
                seconds[peer][0] += ours
                seconds[peer][1] += taken
    error = ", ".join(f"{peer} {count}" for peer, count in fails.items())
    yield Row(name, "wrong", 0, 0, bad, error=f"intersections refused or off by 1e-6 (shapely: or invalid): {error}",
              note=f"{n_pairs} pairs; ours: areas that do not add up exactly, outputs invalid for shapely")  # fmt: skip
    for peer, (ours, theirs) in seconds.items():
        if theirs:
            row = Row(f"public pairs, intersection vs {peer}", "x", value=theirs / ours)
            row.ours, row.peer = f"{ours * 1e3:.3g} ms", f"{theirs * 1e3:.3g} ms"
            row.note = f"the {n_pairs - fails[peer]} pairs that {peer} answers"
            yield row


def _asked(peer: str, pair: Any, area: float) -> float | None:
    """Return seconds for a pair, None where a peer refuses it, is clearly wrong, or, for shapely, not valid."""
    try:
        if peer == "shapely":
            import shapely

            made = [shapely.Polygon(rings[0], rings[1:]) for rings in pair]
            prepared = Prepared(lambda: shapely.intersection(*made), lambda shape: shape.area)
        else:
            prepared = MAKERS[peer](*pair)
        found = prepared.run()
        if (peer == "shapely" and not found.is_valid) or abs(prepared.area(found) - area) > 1e-6 * area:
            return None
        return clocked(prepared.run)[0]
    except Exception:  # whatever a peer raises: a refusal
        return None


def _deadline(suite: Suite, name: str) -> Iterable[Row]:
    """Yield how long after its deadline a large overlay returns at the latest, for deadlines all over its time."""
    pair = polygon_pairs.large("comb", 1000 if suite.options.quick else 100_000, suite.options.seed)
    first, second = map(engine.Polygon, pair)
    engine.overlay(first, second)
    whole = clocked(partial(engine.overlay, first, second))[0]
    late = []
    for share in np.linspace(0.02, 0.98, 13):
        start = time.perf_counter()
        with contextlib.suppress(engine.DeadlineExceededError):
            engine.overlay(first, second, deadline=whole * share)
            continue
        late.append(time.perf_counter() - start - whole * share)
    yield Row(
        name, "s", None, None, max(late, default=0.0), note=f"the whole takes {whole:.3g} s; {len(late)} deadlines"
    )


def main(words: list[str] | None = None) -> int:
    """Run the suite; the exit code is 0 also where a row misses its goal: the table says so."""
    suite = Suite("overlay", options(words, __doc__ or ""))
    suite.run(tasks(suite))
    return 0


if __name__ == "__main__":
    sys.exit(main())
