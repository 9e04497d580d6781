"""docs/jobs.md: ten jobs, each at most six lines of Python and one call over HTTP, with the answers shown.

Answers are written anew by ``python -m tests.contract.test_jobs``.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from tests.unit.service.test_live import Service

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "jobs.md"
BLOCK = re.compile(r"```(python|text|sh|json|ts)\n(.*?)```", re.DOTALL)
MOST_LINES = 6


def square(x: float, y: float, size: float) -> list[list[float]]:
    return [[x, y], [x + size, y], [x + size, y + size], [x, y + size], [x, y]]


def feature(kind: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def layer(*features: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": [*features]}


LAYERS = {
    "country": layer(feature("MultiPolygon", [[square(0, 0, 10), square(4, 4, 2)[::-1]], [square(12, 0, 3)]])),
    "towns": layer(*(feature("Point", at) for at in ([1, 1], [5, 5], [4, 5], [13, 1], [11, 1]))),
    "county": layer(feature("Polygon", [square(0, 0, 4)], name="Kent")),
    "roads": layer(feature("LineString", [[-1, 2], [2, 2], [2, 5]]), feature("LineString", [[6, 6], [7, 7]])),
    "parcels": layer(
        feature("Polygon", [square(0, 0, 2)], owner="Ada"), feature("Polygon", [square(2, 2, 2)], owner="Bo")),
    "floods": layer(feature("Polygon", [square(1, 1, 2)], year=1962)),
}  # fmt: skip
QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def stl(low: float, high: float) -> bytes:
    """Return a cube as a binary STL file."""
    corners = [(x, y, z) for z in (low, high) for y in (low, high) for x in (low, high)]
    triangles = [(a, b, c) for a, b, c, d in QUADS] + [(a, c, d) for a, b, c, d in QUADS]
    rows = (struct.pack("<12fH", 0, 0, 0, *(x for at in each for x in corners[at]), 0) for each in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(rows)


def write_files(folder: Path) -> None:
    for name, value in LAYERS.items():
        (folder / f"{name}.geojson").write_text(json.dumps(value))
    (folder / "part.stl").write_bytes(stl(0, 10))
    (folder / "gripper.stl").write_bytes(stl(2, 4))


def jobs() -> list[dict[str, list[str]]]:
    """Return the blocks of each job by language."""
    found: list[dict[str, list[str]]] = []
    for part in PAGE.read_text("utf-8").split("\n## ")[1:]:
        blocks: dict[str, list[str]] = {}
        for language, text in BLOCK.findall(part):
            blocks.setdefault(language, []).append(text)
        found.append({"title": [part.partition("\n")[0]], **blocks})
    return found


class Desk:
    """A folder with the files, and a service."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        write_files(folder)
        self.service = Service(access_log=False, deadline_seconds=300)
        self.service.wait_until_ready()

    def run(self, command: list[str], text: str) -> str:
        around = {**os.environ, "PYTHONPATH": str(ROOT)}
        text = text.replace("localhost:8000", f"127.0.0.1:{self.service.port}")
        done = subprocess.run(
            command, input=text, cwd=self.folder, env=around, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def python(self, text: str) -> str:
        return self.run([sys.executable, "-"], text)

    def curl(self, text: str) -> str:
        return self.run(["bash", "-euo", "pipefail"], text)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    made = Desk(tmp_path_factory.mktemp("jobs"))
    yield made
    made.service.close()


def last_json(text: str) -> Any:
    """Return the last of the answers of one curl."""
    decoder, at, value = json.JSONDecoder(), 0, None
    while at < len(text.rstrip()):
        value, at = decoder.raw_decode(text, at)
    return value


def without_accuracy(answer: Any) -> Any:
    return {name: value for name, value in answer.items() if name != "accuracy"}


def test_there_are_ten_and_they_are_short() -> None:
    found = jobs()
    assert len(found) == 10
    for job in found:
        for code in (*job["python"], *job.get("ts", ())):
            assert len([line for line in code.splitlines() if line.strip()]) <= MOST_LINES, job["title"]
        (call,) = job["sh"]
        assert call.count("curl") == 1
        assert all(
            len(line) <= 120
            for kind in ("python", "sh", "ts")
            for code in job.get(kind, ())
            for line in code.splitlines()
        )


@pytest.mark.parametrize("number", range(10))
def test_a_job_in_python_prints_what_is_shown(desk: Desk, number: int) -> None:
    job = jobs()[number]
    if "shapely" in job["python"][0]:
        pytest.importorskip("shapely")
    assert desk.python(job["python"][0]) == job["text"][0]


@pytest.mark.parametrize("number", range(10))
def test_a_job_over_http_has_the_answer_shown(desk: Desk, number: int) -> None:
    job = jobs()[number]
    assert without_accuracy(last_json(desk.curl(job["sh"][0]))) == json.loads(job["json"][0])


@pytest.mark.skipif(shutil.which("node") is None, reason="no node is installed")
def test_the_client_in_typescript_prints_the_same(desk: Desk) -> None:
    (code,) = (code for job in jobs() for code in job.get("ts", ()))
    answer = desk.run(["node", "--input-type=module"], code)  # plain JavaScript too
    assert json.loads(answer) == [[True, False], [0]]


@pytest.mark.full
def test_a_type_checker_takes_them(tmp_path: Path) -> None:
    files = []
    for number, job in enumerate(jobs()):
        files.append(tmp_path / f"job_{number}.py")
        files[-1].write_text(job["python"][0])
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", "pyproject.toml", *map(str, files)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert [line for line in done.stdout.splitlines() if "job_" in line and ": error" in line] == [], done.stdout


def rewrite() -> None:
    """Write the answers into the page."""
    text = PAGE.read_text("utf-8")
    with TemporaryDirectory() as folder:
        desk = Desk(Path(folder))
        try:
            stored = last_json(desk.curl("curl -s localhost:8000/v1/solids -F file=@part.stl"))["id"]
            PAGE.write_text(re.sub(r'"id": "\w+"', f'"id": "{stored}"', text), "utf-8")
            head, *parts = PAGE.read_text("utf-8").split("\n## ")
            for number, job in enumerate(jobs()):
                answer = json.dumps(without_accuracy(last_json(desk.curl(job["sh"][0]))))
                for kind, shown in (("text", desk.python(job["python"][0])), ("json", answer + "\n")):
                    before, _, rest = parts[number].partition(f"```{kind}\n")
                    parts[number] = f"{before}```{kind}\n{shown}```{rest.partition('```')[2]}"
            PAGE.write_text("\n## ".join([head, *parts]), "utf-8")
        finally:
            desk.service.close()


if __name__ == "__main__":
    rewrite()
