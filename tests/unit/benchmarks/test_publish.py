"""The published files: every solid once and by its hash, the same bytes again, and a difference is told."""

from __future__ import annotations

import gzip
import json
from hashlib import sha256
from pathlib import Path

import pytest

pytest.importorskip("gmpy2", reason="exact answers need gmpy2")

from benchmarks import publish
from benchmarks.contest import Size
from benchmarks.fields import tasks

NAME = "clipping-polygons-along-the-box.json.gz"


def test_a_file_names_its_solids_and_is_the_same_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    task = next(task for task in tasks(Size(0, 0.01), ("polygons",), is_page=True) if "along" in task.name)
    written = publish.content(task.make())
    assert publish.content(task.make()) == written
    found = json.loads(gzip.decompress(written))
    ((name, solid),) = found["solids"].items()
    assert sha256(json.dumps(solid, sort_keys=True).encode()).hexdigest() == name
    assert found["questions"][0][0] == "/v1/clip/polygons"
    assert found["questions"][0][1]["region"] == {"sha256": name}
    assert len(found["questions"]) == len(found["exact"])
    assert publish.main([str(tmp_path), "--only", "along the box", "--check"]) in (0, 1)
    assert (tmp_path / "SHA256SUMS").read_text().split() == [
        sha256((tmp_path / NAME).read_bytes()).hexdigest(), NAME,
    ]  # fmt: skip
