"""Compare libraries on your own data: ``python -m engine audit SUBJECT [ITEMS] [--question ...] [-o page.html]``.

Runs the textbook's methods, the same on numbers rounded to float32, and every installed peer; judges them by the exact
engine; prints a table and writes one self-contained page: who is wrong, how often, on which items, how fast. Asked are
points in a solid (contains) or their distances from its boundary (distances), what is left of segments on a region and
where they first meet a mesh (segments), whether two bodies meet (collide), and areas that layers have in common
(overlay). Of a mesh or polygon alone the points are the middles of its own faces or edges, rounded: on its boundary, or
off it by less than a float32 shows. A package that crashes or takes longer than `LIMIT` is named, and all others are
run again without it.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import engine
from benchmarks import errors, machine, table, web_page
from benchmarks.bodies import Pair
from benchmarks.contenders import NotApplicable, Placed, Prepared, rings_of, t_by_segment
from benchmarks.contest import LISTENERS, RUNG, Contender, Contest, Row, field_of, refusing, run_contest
from benchmarks.fields import collision as in_collision
from benchmarks.fields import containment as in_containment
from benchmarks.fields import distances as in_distances
from benchmarks.fields import overlay as in_overlay
from benchmarks.fields import segments as in_segments
from benchmarks.measure import interval
from benchmarks.web_page import percent, shown
from benchmarks.workloads import Mesh, Rings, document
from engine.errors import InvalidArrayError, InvalidInputError
from engine.files.solids import from_json, read_rows, read_solid, read_solids
from engine.textbook import methods

QUESTIONS = ("contains", "distances", "segments", "collide", "overlay")
MOST_STEPS = 2_000_000
"""Steps of a textbook's method for one item: about a second."""
MOST_NAMED = 1_000
"""Wrong items that are listed."""
LIMIT = 120.0
"""Seconds that a package may take for an answer."""
MESHES, POLYGONS = ("open3d", "trimesh", "igl", "cgal", "vtk"), ("shapely",)
BODIES, LAYERS = ("coal", "fcl", "open3d", "igl", "manifold3d", "vtk"), ("shapely", "manifold3d")
AWAY, RAYS = ("open3d", "trimesh", "igl", "vtk"), ("open3d", "trimesh")


ABOUT = "your bodies; most peers see surfaces only, and miss a body inside another"


def subject_of(solid: engine.Solid) -> Any:
    """Return a solid as contenders accept it."""
    match solid:
        case engine.Polyhedron() | engine.Surface():
            return Mesh("yours", solid.vertices.copy(), solid.triangles.copy())  # some peers take writable arrays only
        case engine.Polygon():
            return Rings("yours", np.split(solid.vertices, solid.ring_offsets[1:-1]))
    return solid


def coarse(solid: engine.Solid) -> engine.Solid:
    """Return a solid whose numbers are rounded to float32."""

    def rounded(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: rounded(each) for key, each in value.items()}
        if isinstance(value, list):
            return [rounded(each) for each in value]
        return float(np.float32(value)) if isinstance(value, float) else value

    return from_json(rounded(document(subject_of(solid))))[0]


def books(of: Callable[..., methods.Methods], *solids: engine.Solid) -> Iterator[Contender]:
    """Yield the textbook's methods for some solids, and each in float32; none that takes seconds for an item."""

    def plain(name: str, steps: int) -> Prepared:
        if steps > MOST_STEPS:
            raise NotApplicable(f"{steps:,} steps for an item")
        return Prepared(of(*solids)[name][0])

    def in_float32(name: str, steps: int) -> Prepared:
        ask = of(*map(coarse, solids))[name][0] if steps <= MOST_STEPS else plain(name, steps).ask
        return Prepared(lambda *items: ask(*(each.astype(np.float32).astype(np.float64) for each in items)))

    for name, (_, steps) in of(*solids).items():
        yield Contender(f"textbook: {name}", partial(plain, name, steps))
        yield Contender(f"textbook: {name}, float32", partial(in_float32, name, steps))


def book_of_kind(kind: str, subject: Any) -> Iterator[Contender]:
    """Yield the textbook's method for a kind of question, and the same in float32."""
    plain = field_of(kind, subject, ("textbook",), 1)[1]

    def in_float32() -> Prepared:
        made = partial(plain.make.func, "textbook", kind, _single(subject), 1)()  # type: ignore[attr-defined]
        return Prepared(lambda items: made.ask(_single(items)), made.native, made.answer)

    yield plain
    yield replace(plain, name=f"{plain.name}, float32", make=in_float32)


def _single(value: Any) -> Any:
    """Return numbers rounded to float32, in arrays, meshes and lists of them."""
    if isinstance(value, np.ndarray):
        return value.astype(np.float32).astype(np.float64)
    if isinstance(value, Mesh):
        return replace(value, vertices=_single(value.vertices))
    return type(value)(map(_single, value)) if isinstance(value, list | tuple) else value


def listing_wrong(judge: Callable[[Any, Any], dict[str, Any]]) -> Callable[[Any, Any], dict[str, Any]]:
    """Return a judge that also lists the wrong items."""

    def judged(answers: Any, exact: Any) -> dict[str, Any]:
        each = (item for item in range(len(exact)) if judge(answers[item : item + 1], exact[item : item + 1])["wrong"])
        result = judge(answers, exact)
        return result | {
            "where": [item for item, _ in zip(each, range(min(result["wrong"], MOST_NAMED)), strict=False)]
        }

    return judged


def contains(solid: engine.Solid, points: np.ndarray) -> Contest:
    """Return the contest about points in a solid."""
    subject = subject_of(solid)
    peers = MESHES if isinstance(subject, Mesh) else POLYGONS if isinstance(subject, Rings) else ()
    asked = [*field_of("points", subject, peers, 1), *books(methods.of_points, solid)]
    exact, is_measured = engine.contains(points, solid), isinstance(subject, Mesh | Rings)

    def moved(step: float) -> tuple[np.ndarray, np.ndarray]:
        extent = max(float(np.ptp(np.stack(in_containment.extent_of(subject)), axis=0).max()), 1e-300)
        other = in_containment.shifted(points[:RUNG], np.array([extent]), step)
        return other, engine.contains(other, solid)

    near = in_containment.nearness(points[:RUNG], subject) if is_measured else None
    about = (
        "your points"
        if near is None
        else f"your points, half of them within {near:.1g} of the model's size of its boundary"
    )
    return Contest("yours", "contains", True, points, exact, listing_wrong(errors.same), asked, about,
                   request=partial(in_containment.request, subject, points),
                   moved=moved if is_measured else None, near=near)  # fmt: skip


def own_points(solid: engine.Solid) -> np.ndarray:
    """Return the middles of a mesh's faces or a polygon's edges, rounded."""
    match subject_of(solid):
        case Mesh(vertices=vertices, faces=faces):
            return vertices[faces].mean(axis=1)
        case Rings(rings=rings):
            return np.concatenate([0.5 * ring + 0.5 * np.roll(ring, -1, axis=0) for ring in rings])
    raise ValueError("one file is a mesh or a polygon; to ask about other solids give points, segments or bodies, too")


def distances(solid: engine.Solid, points: np.ndarray) -> Contest:
    """Return the contest about distances of points from the boundary of a solid."""
    subject = subject_of(solid)
    peers = AWAY if isinstance(subject, Mesh) else POLYGONS if isinstance(subject, Rings) else ()
    book = book_of_kind("point distances", subject) if isinstance(subject, Mesh) else ()
    asked = [*field_of("point distances", subject, peers, 1), *book]
    exact = np.asarray(engine.distances(points, solid, to="boundary"))
    return Contest("yours", "distances", True, points, exact, listing_wrong(errors.distances), asked, "your points",
                   request=partial(in_distances.asked, subject, points))  # fmt: skip


def first_hits(mesh: Mesh, surface: engine.Solid, items: np.ndarray) -> Contest:
    """Return the contest about where segments first meet a mesh."""
    asked = [*field_of("first hits", mesh, RAYS, 1), *book_of_kind("first hits", mesh)]
    found = engine.hits(items, surface, keep="first")
    exact = t_by_segment(len(items), found.source, found.t)
    about, request = "your segments: where they first meet the mesh", partial(in_segments.hit_request, mesh, items)
    return Contest("yours", "segments", True, items, exact, listing_wrong(errors.places), asked, about, request=request)


def segments(region: engine.Solid, items: np.ndarray) -> Contest:
    """Return the contest about segments clipped to a region: whether a piece is left, and its coordinates."""
    subject = subject_of(region)
    if isinstance(subject, Mesh):
        return first_hits(subject, region, items)
    peers = ("shapely", "celltree") if isinstance(region, engine.Aabb) and region.dimension == 2 else ()
    asked = [*field_of("segments", subject, peers, 1), *books(methods.of_segments, region)]
    ours = asked[0].make()
    exact = ours.answer(ours.ask(items))
    judge = listing_wrong(errors.coordinates)
    return Contest("yours", "segments", True, items, exact, judge, asked, "your segments",
                   request=partial(in_segments.request, subject, items))  # fmt: skip


def collide(first: engine.Solid, second: engine.Solid, poses: np.ndarray | None) -> Contest:
    """Return the contest about two bodies, without poses or under poses (n, 3, 4) of the second."""
    bodies = [subject_of(body) for body in (first, second)]
    if poses is None:
        is_met = engine.collide(first, second, boolean=True).relation != engine.Relation.DISJOINT
        couple = [Placed(body, is_closed=not isinstance(solid, engine.Surface))
                  for body, solid in zip(bodies, (first, second))]  # fmt: skip
        made = in_collision.on_couples("collide", True, [couple], np.array([is_met]), ABOUT, BODIES)
        own = [replace(each, make=partial(_for_one, each)) for each in books(methods.of_pairs, first, second)]
        return replace(made, operation="yours", contenders=[*made.contenders, *own], judge=listing_wrong(errors.same))
    is_closed = all(isinstance(solid, engine.Polyhedron) for solid in (first, second))
    pair = Pair("yours", bodies[0], bodies[1], is_closed, poses[:, :, :3], poses[:, :, 3])
    exact = engine.collide_poses(first, second, pair.rotations, pair.translations, boolean=True)
    rows, asked = np.arange(len(poses)), field_of("poses", pair, BODIES[:2], 1)
    met = np.asarray(exact) != engine.Relation.DISJOINT
    return Contest("yours", "collide", True, rows, met, listing_wrong(errors.same), asked, ABOUT,
                   request=partial(in_collision.request, pair))  # fmt: skip


def _for_one(contender: Contender) -> Prepared:
    ask = contender.make().ask
    return Prepared(lambda rows: np.array([int(refusing(lambda _: ask(), None)) for _ in rows]))


def overlay(subjects: Sequence[engine.Solid], clips: Sequence[engine.Solid]) -> Contest:
    """Return the contest about the areas of intersections, pair by pair; with one polygon on a side, that with all."""
    n = max(len(subjects), len(clips))
    if len({len(subjects), len(clips), 1, n}) > 2:
        counts = f"{len(subjects)} and {len(clips)} polygons"
        raise InvalidInputError(f"layers are asked pair by pair: {counts}; make one of them 1", ("file",))
    sides = [[_rings(solid) for solid in (side if len(side) == n else side * n)] for side in (subjects, clips)]
    pairs = list(zip(*sides, strict=True))
    exact = np.array([in_overlay.by_ours(pair) for pair in pairs])
    asked = [*field_of("overlay", "intersection", LAYERS, 1), *book_of_kind("overlay", "intersection")]
    return Contest("yours", "overlay", True, pairs, exact, listing_wrong(errors.areas), asked, "your layers",
                   request=partial(in_overlay.request, pairs))  # fmt: skip


def _rings(solid: engine.Solid) -> list[np.ndarray]:
    try:
        return rings_of(subject_of(solid))
    except NotApplicable:
        message = f"layers are of polygons or boxes of the plane, not of a {solid.type}"
        raise InvalidInputError(message, ("file",)) from None


def contest_of(question: str | None, files: Sequence[str], poses: str | None) -> Contest:
    """Return the contest for these files; without a question the one that fits the second file."""
    first, second = files[0], files[-1]
    if len(files) == 1:
        solid = read_solid(first)
        return (distances if question == "distances" else contains)(solid, own_points(solid))
    is_table = Path(second).suffix.lower() in (".npy", ".csv")
    dimension = read_solids(first)[0].dimension
    if question is None and is_table:
        width = read_rows(second, (-1,)).shape[1]
        question = "contains" if width == dimension else "segments"
    elif question is None:
        question = "overlay" if dimension == 2 else "collide"
    if question == "overlay":
        return overlay(read_solids(first), read_solids(second))
    if question in ("contains", "distances"):
        ask = contains if question == "contains" else distances
        return ask(read_solid(first), _some(second, (dimension,)))
    if question == "segments":
        return segments(read_solid(first), _some(second, (2, dimension)))
    rows = None if poses is None else _some(poses, (dimension, dimension + 1))
    return collide(read_solid(first), read_solid(second), rows)


def _some(source: str, shape: tuple[int, ...]) -> np.ndarray:
    rows = read_rows(source, shape)
    if not len(rows):
        raise InvalidArrayError(f"{source} holds nothing to ask about", ("file",))
    return rows


def lines_of(rows: Sequence[Row]) -> Iterator[str]:
    """Yield a line a contender: speed, wrong answers with their 95% interval, refusals, the first items."""
    judged = max(row.errors.get("judged", 0) for row in rows)
    names = {id(row): shown(row.contender) for row in rows}
    wide = max(34, *(len(name) + 2 for name in names.values()))
    yield f"{'contender':<{wide}}{'a second':>12}  {f'wrong of {judged:,} (95% interval)':<30}  items"
    for row in (row for row in rows if not row.absent):
        wrong, where, result = row.errors["wrong"], row.errors["where"], row.errors
        between = " to ".join(map(percent, interval(wrong, result["judged"])))
        said = [f"{result[kind]:,} {kind}" for kind in ("refused", "outside") if result.get(kind)]
        if result.get("off"):
            worst = f"the worst by {result['ulp_largest']:.3g} ulps"
            said.append(f"{result['off']:,} of {result['coordinates']:,} numbers not the nearest double, {worst}")
        said.append(", ".join(map(str, where[:6])) + ", ..." * (wrong > 6))
        about = "the judge" if row.contender == "ours" else "; ".join(filter(None, said))
        rate = f"{row.rate:,.{0 if row.rate >= 10 else 2}f}"
        yield f"{names[id(row)]:<{wide}}{rate:>12}  {f'{wrong:,} ({between})':<30}  {about}".rstrip()
    for row in (row for row in rows if row.absent):
        yield f"{names[id(row)]}: {'not installed' if 'ModuleNotFoundError' in row.absent else row.absent}"


def seconds(text: str) -> float:
    """Return a time of measuring."""
    if not 0 < (value := float(text)) < math.inf:
        raise argparse.ArgumentTypeError(f"{text}: some seconds, more than 0")
    return value


def page(text: str) -> str:
    """Return the name of a file that can be written."""
    if not text.endswith((".html", ".json")) or not Path(text).parent.is_dir():
        raise argparse.ArgumentTypeError(
            f"{text}: a file .html, or .json for the results alone, in a folder that is there"
        )
    return text


def options(words: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser("python -m engine audit", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("file", help="a solid or a layer")
    parser.add_argument("items", nargs="?", help="points, segments, a solid or a layer; else its own faces or edges")
    parser.add_argument("--question", choices=QUESTIONS, help="by default the one that fits the files")
    parser.add_argument("--poses", metavar="FILE", help="of the second body: rows [R | t], 12 numbers")
    parser.add_argument("--seconds", type=seconds, default=1.0, help="of each contender")
    parser.add_argument("--without", action="append", default=[], metavar="NAME", help="a contender to leave out")
    parser.add_argument("-o", "--output", type=page, metavar="PAGE", help=".html, or .json for the results alone")
    parser.add_argument("--asked", help=argparse.SUPPRESS)  # file in which `watched` reads the running package
    return parser.parse_args(words)


def watched(words: Sequence[str]) -> int:
    """Run the audit in a process of its own, and again without each package that crashes or hangs."""
    without: list[str] = []
    options(words)
    with tempfile.TemporaryDirectory() as folder:
        asked = Path(folder, "asked")
        while True:  # bound: each turn but the last leaves a contender out
            asked.write_text("")
            more = [word for name in without for word in ("--without", name)]
            process = subprocess.Popen(
                [sys.executable, "-m", "exact_geometry", "audit", *words, "--asked", str(asked), *more]
            )
            while process.poll() is None:
                time.sleep(0.05)
                if asked.read_text() and time.time() - asked.stat().st_mtime > LIMIT:
                    process.kill()
            name = asked.read_text()
            if process.returncode in (0, 1, 2) or not name or name in without:
                return process.returncode
            print(f"{name} ended the process, or gave no answer within {LIMIT:g} s: all again without it", flush=True)
            without.append(name)


def main(words: Sequence[str] | None = None) -> int:
    """Run the contest, print and write the page."""
    given = options(words)
    files = [given.file, *([given.items] if given.items else [])]
    contest = contest_of(given.question, files, given.poses)
    remaining = [replace(each, make=_left_out) if each.name in given.without else each for each in contest.contenders]
    LISTENERS[:] = [Path(given.asked).write_text] if given.asked else []
    facts = machine.facts(0, machine.cores())
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # what a peer says of its arithmetic
        rows = run_contest(replace(contest, contenders=remaining), 3, given.seconds, has_latency=True)
    print(f"{contest.about}, judged by exact arithmetic")
    print("\n".join(lines_of(rows)))
    result = facts | {"load_after": machine.load(), "seconds": given.seconds, "quick": False}
    result["rows"] = [asdict(row) | {"rate": row.rate, "net_rate": row.net_rate} for row in rows]
    if given.output and given.output.endswith(".json"):
        Path(given.output).write_text(json.dumps(result, default=table.plain))
    elif given.output:
        title = " and ".join(Path(name).name for name in files)
        asked = ((title, "yours", "", contest.name),)
        Path(given.output).write_text(web_page.text_of(result, "this page", asked), "utf-8")
    return 0


def _left_out() -> Prepared:
    raise NotApplicable("left out, since it ended the process, gave no answer in time, or was named")
