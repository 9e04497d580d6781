"""Bug reports of users of other libraries (benchmarks/filed), rerun on ours and on every peer.

    python -m benchmarks filed                 # the tables; --cases: also one line for each case
    python -m benchmarks filed --answers       # recompute the exact answers and write them into cases.json
    python -m benchmarks report --filed        # put the answers into the stored results, and write the pages again

Each contender runs in a process of its own, so that one that crashes or never returns costs its own case only. Points
on a boundary count as contained, bodies that touch as meeting. An area or a volume is wrong when it is off by more than
a millionth of that of the box, a distance or a piece of a segment by more than one of the extent, a place of a hit by
one of the segment; ours must equal the exact answer to the last bit. Nothing is timed.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import engine
from benchmarks.contenders import NotApplicable, Placed, answers, readers_of, rings_of, said_by, stated
from benchmarks.filed import museum
from benchmarks.machine import version_of
from benchmarks.workloads import Mesh, Rings

PATH = Path(__file__).resolve().parent / "cases.json"
FILES = PATH.parent / "files"
OUTCOMES = ("right", "wrong", "refused", "crashed", "no answer in time")
LIMIT = 20.0
"""Seconds for one case; imports count towards the first."""
COMPILING = 600.0
"""The same for ours and the textbook's methods, which may have to compile their kernels."""
TOLERANCE = 2.0**-20
"""Of the extent: more than rounding coordinates does, less than any piece anyone would miss."""
Case = dict[str, Any]


class Peer(NamedTuple):
    """One contender: its module, and its maker for each kind of question."""

    name: str
    module: str
    calls: dict[str, str]


POINTS, PIECES, PAIR = {"locate 3D": "points"}, {"clip_segments 3D": "pieces"}, {"collide 3D": "pair"}
OVERLAY, CLIPPING = {"overlay 2D": "overlay of made"}, {"clip_polygons 2D": "polygon areas"}
PLANE = {"locate 2D": "points", "clip_segments 2D": "pieces", **OVERLAY}
HITS, AWAY, VOLUME = {"hits 3D": "all hits"}, {"distances 3D": "point distances"}, {"volume 3D": "volume"}
BOOK = PLANE | {"overlay 2D": "overlay", "collide 3D": "pair by volumes"} | HITS | AWAY | VOLUME
CUTS = {"cut 3D": "cut volumes", "section 3D": "section areas"} | VOLUME
PEERS = (
    Peer("ours", "", {}),
    Peer("textbook", "textbook", POINTS | BOOK),
    Peer("shapely", "shapely", PLANE | {"collide 2D": "pair", "distances 2D": "point distances"}),
    Peer("shapely clip_by_rect", "shapely", {"clip_segments 2D": "pieces by rectangle", **CLIPPING}),
    Peer("Clipper2 by manifold3d", "manifold3d", CLIPPING | OVERLAY),
    Peer("numba_celltree", "celltree", {"clip_segments 2D": "pieces"}),
    Peer("Open3D", "open3d", POINTS | PAIR | HITS | AWAY | VOLUME),
    Peer("trimesh + embreex", "trimesh", POINTS | PIECES | HITS | AWAY | CUTS),
    Peer("libigl", "igl", POINTS | PAIR | HITS | AWAY),
    Peer("CGAL", "cgal", POINTS),
    Peer("coal", "coal", PAIR),
    Peer("fcl", "fcl", PAIR),
    Peer("manifold3d", "manifold3d", PAIR | HITS | CUTS | {"overlap 3D": "overlap"}),
    Peer("VTK", "vtk", POINTS | PAIR | HITS | AWAY | CUTS | {"overlap 3D": "overlap"}),
)


def load() -> list[Case]:
    """Return the cases, with what stands in their files as `input`, and with the names of the files as `given`."""
    return [case | {"input": read(case["input"]), "given": case["input"]} for case in _stored()]


def _stored() -> list[Case]:
    return json.loads(PATH.read_text("utf-8"))


def read(given: dict[str, Any], module: str = "") -> dict[str, Any]:
    """Return an input with its files read, by the contender's own reader where it has one, else by ours."""
    readers = OUR_READERS | (readers_of(module) if module else {})
    result = dict(given)
    for key, solid in given.items():
        if isinstance(solid, dict) and "file" in solid:
            path = FILES / solid["file"]
            fields = ("rings",) if solid["type"] == "polygon" else ("vertices", "faces")
            parts = [np.asarray(part).tolist() for part in readers[path.suffix](str(path))]
            result[key] = {"type": solid["type"]} | dict(zip(fields, parts, strict=True))
    return result


def _our_rings(path: str) -> tuple[list[Any]]:
    (feature,) = engine.read_layer(path)["features"]
    return ([ring[:-1] for ring in feature["geometry"]["coordinates"]],)


def _rings_of_wkt(path: str) -> tuple[list[Any]]:
    rings = re.findall(r"\(([^()]+)\)", Path(path).read_text("utf-8"))
    return ([[list(map(float, point.split())) for point in ring.split(",")[:-1]] for ring in rings],)


OUR_READERS = {f".{name}": engine.read_mesh for name in ("stl", "obj", "off", "ply", "glb")} | {
    ".geojson": _our_rings, ".wkt": _rings_of_wkt,
}  # fmt: skip


def kind_of(case: Case) -> str:
    """Return the operation and the dimension."""
    from tests.reference.solids import dimension

    data = case["input"]
    solids = (data[key] for key in ("solid", "region", "first", "subject", "surface") if key in data)
    return f"{case['operation']} {dimension(next(solids, None) or data['bodies'][0]['solid'])}D"


# --- judging ----------------------------------------------------------------------------------------------------------


def is_right(case: Case, answer: Any) -> bool:
    """Return whether a peer's answer is the exact one, up to rounding."""
    exact, data = case["answer"], case["input"]
    match case["operation"]:
        case "locate":
            return [bool(inside) for inside in answer] == [location >= 0 for location in exact]
        case "collide":
            return bool(answer) == (exact != "disjoint")
        case "overlay":
            size = np.prod(np.maximum(*(_extent(data[key]["rings"]) for key in ("subject", "clip"))))
            area = Fraction(*(int(part, 16) for part in exact["area"].split("/")))
            return abs(answer - float(area)) <= TOLERANCE * size
        case "clip_polygons":
            size = np.prod(_extent([ring for rings in data["polygons"] for ring in rings]))
            return abs(np.sum(answer) - sum(abs(_area(ring)) for rings in exact for ring in rings)) <= TOLERANCE * size
        case "hits":
            return not museum.wrong_lines(case, answer)
        case "distances" | "volume" | "cut" | "section" | "overlap":
            return not museum.far_off(case, answer)
    slack = TOLERANCE * _extent([data["segments"]]).max()
    pieces = _long_pieces([(piece["segment"], piece["start"], piece["end"]) for piece in exact], slack)
    result = _long_pieces(answer, slack)
    pairs = zip(pieces, result)
    return len(pieces) == len(result) and all(i == j and np.abs(a - b).max() <= slack for (i, a), (j, b) in pairs)


def _area(ring: Any) -> float:
    x, y = np.asarray(ring, float).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _extent(rings: list[Any]) -> np.ndarray:
    every = np.concatenate([np.array(ring, float).reshape(-1, np.shape(ring)[-1]) for ring in rings])
    return np.ptp(every, axis=0)


def _long_pieces(pieces: Sequence[Any], slack: float) -> list[tuple[int, np.ndarray]]:
    """Return the pieces that are more than a point, in order, each from its least end."""
    rows = [(int(i), np.array(sorted([tuple(start), tuple(end)]), float)) for i, start, end in pieces]
    rows = [row for row in rows if np.abs(row[1][1] - row[1][0]).max() > slack]
    return sorted(rows, key=lambda row: (row[0], row[1].tolist()))


# --- replaying --------------------------------------------------------------------------------------------------------


def _subject(solid: dict[str, Any], is_region: bool = False) -> Any:
    """Return a solid as contenders accept it."""
    match solid["type"]:
        case "polyhedron" if is_region:
            return engine.Polyhedron(solid["vertices"], solid["faces"])
        case "polyhedron" | "surface" if not is_region:
            return Mesh("case", np.array(solid["vertices"], float), np.array(solid["faces"], np.int64))
        case "sphere" if not is_region:
            return engine.Sphere(solid["center"], solid["radius"])
        case "aabb":
            box = engine.Aabb(solid["min"], solid["max"])
            return box if is_region or box.dimension == 3 else Rings("case", rings_of(box))
        case "polygon":
            return Rings("case", [np.array(ring, float) for ring in solid["rings"]])
    raise NotApplicable(solid["type"])


def _placed(data: dict[str, Any], key: str) -> Placed:
    pose = data.get(f"{key}_pose")
    placed = None if pose is None else tuple(np.array(pose[part], float) for part in ("rotation", "translation"))
    return Placed(_subject(data[key]), placed, data[key]["type"] != "surface")  # type: ignore[arg-type]


def _answer_of_peer(module: str, kind: str, operation: str, data: dict[str, Any]) -> Any:
    """Return a contender's answer to a case."""
    match operation:
        case "locate":
            return answers(module, kind, _subject(data["solid"]), np.array(data["points"], float))
        case "clip_segments":
            return answers(module, kind, _subject(data["region"], True), np.array(data["segments"], float))
        case "clip_polygons":
            polygons = [[np.array(ring, float) for ring in rings] for rings in data["polygons"]]
            return answers(module, kind, _subject(data["region"], True), polygons)
        case "hits":
            return answers(module, kind, _subject(data["surface"]), np.array(data["segments"], float))
        case "distances":
            signed = "signed distances" if data.get("signed") else kind
            return answers(module, signed, _subject(data["solid"]), np.array(data["points"], float))
        case "volume":
            return answers(module, kind, _subject(data["solid"]), None)
        case "cut":
            row = [*data["region"]["normal"], data["region"]["offset"]]
            return _of_planes(module, kind, data["solid"], [row])[0]
        case "section":
            return _of_planes(module, kind, data["solid"], data["planes"])
        case "overlay":
            pair = tuple(rings_of(_subject(data[key])) for key in ("subject", "clip"))
            area = answers(module, kind, data["operation"], [pair])[0]
            if np.isinf(area):
                raise NotApplicable("out of its domain")
            return area
    return answers(module, kind, (_placed(data, "first"), _placed(data, "second")), None)


def _of_planes(module: str, kind: str, solid: dict[str, Any], rows: list[list[float]]) -> np.ndarray:
    result = answers(module, kind, _subject(solid), np.array(rows, float))
    if np.isinf(result).any():
        raise NotApplicable("out of its domain")
    return result


def _answer(peer: Peer, case: Case) -> tuple[str, str, list[int]]:
    """Return the outcome of one case, a note and the items that are wrong; in the contender's own process."""
    try:
        if peer.name == "ours":
            from tests.hard.operations import OPERATIONS

            is_ok = OPERATIONS[case["operation"]].by_engine(case["input"]) == case["answer"]
            return "right" if is_ok else "wrong", "", []
        data = read(case.get("given", case["input"]), peer.module)
        answer = _answer_of_peer(peer.module, peer.calls[kind_of(case)], case["operation"], data)
        return ("right", "", []) if is_right(case, answer) else ("wrong", *museum.said(case, answer))
    except NotApplicable:
        return "not applicable", "", []
    except Exception as error:  # whatever a peer raises
        outcome = "absent" if isinstance(error, ImportError | OSError) else "refused"
        return outcome, said_by(error), []


def _serve(pipe: Connection, name: str) -> None:
    """Answer cases until there are no more."""
    peer = next(peer for peer in PEERS if peer.name == name)
    while (case := pipe.recv()) is not None:
        pipe.send(_answer(peer, case))


def replay(names: Sequence[str] = (), limit: float = LIMIT, cases: list[Case] | None = None) -> list[dict[str, Any]]:
    """Return a row for each contender and case that it takes: its outcome, what it said, and which items are wrong.

    A contender that cannot be imported has one row, with the outcome `absent`. cases: those that users filed, if None.
    """
    queried = load() if cases is None else cases
    rows = [row for peer in PEERS if not names or peer.name in names for row in _replay_one(peer, queried, limit)]
    return [row for row in rows if row["outcome"] != "not applicable"]


def _replay_one(peer: Peer, cases: list[Case], limit: float) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    process, pipe = None, None
    package = stated(peer.module).get("PACKAGE") if peer.module else ""
    about = {"contender": peer.name, "version": version_of(package) if package else ""}
    for case in cases:
        kind, outcome, note, where = kind_of(case), "not applicable", "", list[int]()
        if peer.name == "ours" or kind in peer.calls:
            if process is None:
                pipe, process = _started(peer.name)
            outcome, note, where = _ask(pipe, case, limit if peer.module not in ("", "textbook") else COMPILING)
            if outcome == "absent":
                rows = [about | {"case": "", "kind": "", "outcome": outcome, "note": note}]
                break
            if outcome in ("crashed", "no answer in time"):
                process.kill()
                process.join()
                note, process = note or f"exit code {process.exitcode}", None
        row = about | {"case": case["id"], "kind": kind, "outcome": outcome, "note": note}
        rows.append(row | ({"where": where} if where else {}))
    if process is not None:
        process.kill()
        process.join()
    return rows


def _started(name: str) -> tuple[Any, Any]:
    context = multiprocessing.get_context("spawn")
    pipe, other = context.Pipe()
    process = context.Process(target=_serve, args=(other, name), daemon=True)
    process.start()
    other.close()
    return pipe, process


def _ask(pipe: Any, case: Case, limit: float) -> tuple[str, str, list[int]]:
    try:
        pipe.send(case)
        return pipe.recv() if pipe.poll(limit) else ("no answer in time", f"{limit:g} s", [])
    except (EOFError, ConnectionError):
        return "crashed", "", []


# --- writing ----------------------------------------------------------------------------------------------------------


def section(rows: list[dict[str, Any]]) -> str:
    """Return the section of the report: contenders and their counts; the museum shows each case."""
    replayed = {row["case"] for row in rows}
    threads = {case["thread"] for case in load() if case["id"] in replayed}
    lines = [
        "## Cases that users filed\n",
        f"{len(replayed - {''})} inputs from {len(threads)} public threads about peers and other libraries, replayed "
        "on the installed versions; [the museum](museum.html) draws each, with what every library says of it today "
        "([how one is added](../benchmarks/filed/README.md)). A boundary counts as contained, contact as meeting; "
        "areas, volumes, distances, pieces and places of hits may be off by a millionth of the extent; ours must be "
        "exact to the last bit.\n",
        "| contender | version | asked | " + " | ".join(OUTCOMES) + " |",
        "|---|---|---|" + "---|" * len(OUTCOMES),
    ]
    for name in dict.fromkeys(row["contender"] for row in rows):
        mine = [row for row in rows if row["contender"] == name]
        if mine[0]["outcome"] == "absent":
            lines.append(f"| {name} | not installed: {mine[0]['note']} |" + " |" * (1 + len(OUTCOMES)))
            continue
        count = Counter(row["outcome"] for row in mine)
        cells = " | ".join(str(count[outcome]) for outcome in OUTCOMES)
        lines.append(f"| {name} | {mine[0]['version']} | {len(mine)} | {cells} |")
    failed = {row["case"] for row in rows if row["outcome"] not in ("right", "absent")}
    lines += [f"\nAll contenders pass {len(replayed - failed - {''})} of the cases today."]
    return "\n".join(lines) + "\n"


def write_answers() -> None:
    """Compute every exact answer by the rational reference."""
    from tests.hard.operations import OPERATIONS

    cases = [case | {"answer": OPERATIONS[case["operation"]].exact(read(case["input"]))} for case in _stored()]
    PATH.write_text("[\n" + ",\n".join(json.dumps(case) for case in cases) + "\n]\n", "utf-8")


def main(words: list[str] | None = None) -> int:
    """Replay and print; 1 if an answer of ours is not right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--answers", action="store_true", help="write the exact answers into cases.json")
    parser.add_argument("--only", nargs="*", default=(), metavar="NAME", help="only these contenders")
    parser.add_argument("--cases", action="store_true", help="print every answer that is not right, with its note")
    parser.add_argument("--quick", action="store_true", help="the first twenty cases")
    options = parser.parse_args(words)
    if options.answers:
        write_answers()
        return 0
    rows = replay(options.only, cases=load()[: 20 if options.quick else None])
    for row in rows:
        if options.cases and row["outcome"] != "right":
            print(f"{row['contender']:<24} {row['outcome']:<18} {row['case']:<50} {row['note']}")
    print(section(rows))
    return int(any(row["contender"] == "ours" and row["outcome"] != "right" for row in rows))
