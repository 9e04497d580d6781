"""The report of speed against error: every operation, ours beside the textbook and the peers, easy and hard apart.

    python -m benchmarks report             # the record: page, pictures, results/<machine>/report.json
    python -m benchmarks report --quick     # minutes: every contender runs, ours has 0 wrong; writes nothing
    python -m benchmarks report --keep      # with --quick: writes all the same, and the page says that it is quick
    python -m benchmarks report --pages     # the page and its pictures again from the results that it names

A figure is items a second at the median of interleaved rounds. Errors are counted against exact answers by rational
arithmetic that shares nothing with the engine (tests/reference).
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import filed, machine, page, pictures, table, web_page
from benchmarks.contest import Contest, field_of, hold
from benchmarks.errors import locations, same
from benchmarks.fields import containment, tasks
from benchmarks.filed import museum
from benchmarks.workloads import Mesh, Rings, bumpy_sphere, generator, points_in_box, ring_around

DOCS, README = machine.ROOT / "docs", machine.ROOT / "README.md"
BEGIN, END = "<!-- benchmarks report writes this table -->", "<!-- to here -->"


def main(words: list[str] | None = None) -> int:
    """Hold the contests, write the page; 1 if an answer of ours is wrong."""
    given = table.options(
        words,
        __doc__ or "",
        pages="only write the page, from the results that it names",
        keep="write what is quick, too",
    )
    if given.pages:
        _write_pages(named_by_the_page())
        return 0
    found = table.measured("report", tasks(given.size, is_page=True), given, has_latency=True)
    if not given.only:
        found["curves"] = {
            "distance": by_distance(given.seed, given.size.n(2000, 100)),
            "size": by_size(given.seed, given.quick),
        }
        found["filed"] = filed.replay()
    ours = [row["errors"] for row in found["rows"] if row["contender"] == "ours" and row["errors"]]
    wrong = sum(errors.get("wrong", 0) + errors.get("refused", 0) + errors.get("off", 0) for errors in ours)
    wrong += sum(row["contender"] == "ours" and row["outcome"] != "right" for row in found.get("filed", ()))
    print(f"wrong answers, refusals or inexact coordinates of ours: {wrong}")
    if given.writes or (given.keep and not given.only):
        table.store("report", found)
        _write_pages(machine.results("report"))
    return 1 if wrong else 0


def named_by_the_page() -> Path:
    """Return the stored results that the page as it stands is made of."""
    named = re.search(r"benchmarks/results/[\w-]+/report\.json", (DOCS / "speed_and_error.html").read_text("utf-8"))
    assert named is not None
    return machine.ROOT / named[0]


def keep(name: str, part: Any) -> None:
    """Put a part that is not timed into the stored results, and write the pages."""
    path = named_by_the_page()
    path.write_text(table.written(json.loads(path.read_text()) | {name: part}))
    _write_pages(path)


def _write_pages(results: Path) -> None:
    drawn = {DOCS / "pictures" / name: text for name, text in pictures.draw(json.loads(results.read_text())).items()}
    for path, text in (drawn | pages_of(results)).items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")


def pages_of(results: Path) -> dict[Path, str]:
    """Return every file but the pictures that is made of stored results, and its text."""
    found, cold_start = json.loads(results.read_text()), results.with_name("cold_start.json")
    if cold_start.exists():
        found["cold_start"] = json.loads(cold_start.read_text())
    found["filed"] = [row for row in found["filed"] if row["outcome"] != "not applicable"]  # older results have them
    path = results.relative_to(machine.ROOT).as_posix()
    head, _, rest = README.read_text("utf-8").partition(BEGIN)
    return {
        DOCS / "speed_and_error.md": page.text_of(found),
        DOCS / "speed_and_error.html": web_page.text_of(found, path),
        DOCS / "museum.html": museum.text_of(found["filed"], filed.load(), path),
        README: f"{head}{BEGIN}\n{page.smallest(found)}{END}{rest.partition(END)[2]}",
    }


ULPS = (0, 1, 2, 4, 16, 64, 2**10, 2**14, 2**18, 2**24, 2**30)
TIMES, LARGEST = (1, 2, 3, 4, 5, 6), 8
"""Subdivisions of the icosahedron: 80 to 81,920 faces, and 1,310,720."""
SECONDS = 0.2
"""Of a contender at each place."""


def by_distance(seed: int, n_points: int) -> dict[str, Any]:
    """Return for polygon and mesh the share of wrong answers of each contender, for points so many ulps off."""
    source = generator("report distance", seed)
    angles = np.linspace(0, 2 * np.pi, 97, endpoint=False) + 0.1
    rings = Rings("flower", [ring_around(angles, 2 + np.sin(5 * angles))])
    mesh = bumpy_sphere("report distance", seed, 3)
    found: dict[str, Any] = {"ulps": list(ULPS), "containment 2D": {}, "containment 3D": {}}
    for ulps in ULPS:
        off = ulps * source.choice([-1, 1], n_points)
        plane = containment.beside_edges(rings.rings[0], n_points, off, source)
        _add(found["containment 2D"], rings, containment.POLYGON_PEERS, plane)
        _add(found["containment 3D"], mesh, containment.MESH_PEERS, _beside_faces(mesh, n_points, off, source))
    return found


def _beside_faces(mesh: Mesh, n_points: int, ulps: np.ndarray, source: np.random.Generator) -> np.ndarray:
    corners = mesh.vertices[mesh.faces[source.integers(len(mesh.faces), size=n_points)]]
    points = (source.dirichlet((1, 1, 1), n_points)[:, :, None] * corners).sum(axis=1)
    points[:, 2] += ulps * np.spacing(np.abs(points[:, 2]))
    return points


def by_size(seed: int, quick: bool) -> dict[str, Any]:
    """Return items a second of containment in bumpy balls of growing face count, and of batches of growing length."""
    found: dict[str, Any] = {"faces": {}, "batch": {}}
    for times in TIMES[:2] if quick else (*TIMES, LARGEST):
        mesh = bumpy_sphere("report size", seed, times)
        peers = [peer for peer in containment.MESH_PEERS if times <= 4 or not peer.startswith("textbook")]
        _add(found["faces"], mesh, peers, points_in_box(mesh, 2_000 if quick else 50_000, seed), len(mesh.faces))
    mesh = bumpy_sphere("report size", seed, 2 if quick else 5)
    peers = [peer for peer in containment.MESH_PEERS if not peer.startswith(("textbook", "cgal"))]
    for n_points in (1, 10, 100, 1_000, 10_000, 100_000)[: 4 if quick else None]:
        _add(found["batch"], mesh, peers, points_in_box(mesh, n_points, seed), n_points)
    return found


def _add(table: dict[str, list[Any]], subject: Any, peers: Any, points: np.ndarray, place: int = 0) -> None:
    """Add a place of each contender's curve: its speed there, or without a place its share of wrong answers."""
    exact = None if place else locations(points, subject)
    asked = field_of("points", subject, peers)
    for row in hold(Contest("containment", "", True, points, exact, same, asked), 1, SECONDS):
        if not row.absent:
            one = [place, row.rate] if place else row.errors["wrong"] / row.errors["judged"]
            table.setdefault(row.contender, []).append(one)
