"""What pyproject promises of versions: a fresh environment with the lowest of all, and one with the newest, answers.

Each needs a package index and compiles all kernels from nothing.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.unit.service.asking import SHEET, SPHERE, examples, of_scene
from tests.unit.service.test_live import Service

ROOT = Path(__file__).resolve().parents[2]
EXTRA = "formats"  # what the service itself can use
TETRAHEDRON = b"OFF 4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"


def requirements() -> list[str]:
    """Return what the service is allowed to be installed with, as pyproject writes it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    found: list[str] = project["dependencies"] + project["optional-dependencies"][EXTRA]
    return found


@pytest.mark.full
@pytest.mark.parametrize("which", ["lowest", "newest"])
def test_every_operation_and_endpoint_answers(tmp_path: Path, which: str) -> None:
    wanted = requirements()
    if which == "lowest":
        wanted = [re.sub(r",<[\d.]+", "", item).replace(">=", "==") for item in wanted]
    python = tmp_path / "env/bin/python"
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "env"], check=True)
    pip = [python, "-m", "pip", "install", "-q", "--upgrade", "--no-cache-dir"]
    subprocess.run([*pip, *wanted], check=True, timeout=600)
    subprocess.run([*pip, "--no-deps", ROOT], check=True, timeout=600)
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ENGINE_", "NUMBA_"))}
    plain |= {"ENGINE_CACHE_DIR": str(tmp_path / "kernels"), "PYTHONWARNINGS": "error::RuntimeWarning"}
    warm = subprocess.run(
        [python, "-P", "-m", "engine", "warm"], cwd=tmp_path, env=plain, capture_output=True, text=True, timeout=1800
    )
    assert warm.returncode == 0, warm.stderr
    assert list((tmp_path / "kernels").rglob("*.nbc"))
    service = Service(str(python), tmp_path, plain)
    try:
        service.wait_until_ready()
        ask_everything(service.url)
        assert service.stop() == 0
        assert "Traceback" not in "".join(service.log)
    finally:
        service.close()


def ask_everything(url: str) -> None:
    """Send each example of the document to its endpoint, and one question to each that takes numbers or files."""
    with httpx.Client(base_url=url, timeout=60) as client:
        document: dict[str, Any] = client.get("/openapi.json").raise_for_status().json()
        asked, sheet = set(), client.post("/v1/scenes", json=SHEET).raise_for_status().json()["id"]
        for path, example in examples(document):
            client.post(of_scene(path, sheet), json=example).raise_for_status()
            asked.add(path)
        stored = client.post("/v1/solids", json=SPHERE).raise_for_status().headers["location"]
        box = {"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]}
        region = client.post("/v1/solids", json=box).raise_for_status().headers["location"]
        raw = {"content-type": "application/octet-stream"}
        rows = np.array([[0.5, 0.5, 0.5], [2.0, 2.0, 2.0]])
        inside = client.post(f"{stored}/contains", content=rows.tobytes(), headers=raw).raise_for_status()
        assert np.frombuffer(inside.content, np.int8).tolist() == [1, -1]
        pieces = client.post(f"{region}/clip/segments", content=rows.tobytes(), headers=raw).raise_for_status()
        assert np.frombuffer(pieces.content).tolist() == [0.5, 0.5, 0.5, 1.0, 1.0, 1.0]
        client.post("/v1/solids/import?format=off", content=TETRAHEDRON, headers=raw).raise_for_status()
        point = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [1, 2]}}
        lines = [
            {"operation": "contains", "layer": {"type": "FeatureCollection", "features": []}, "outside": True},
            point,
        ]
        text, kind = "\n".join(map(json.dumps, lines)), {"content-type": "application/x-ndjson"}
        assert client.post("/v1/layers/stream", content=text, headers=kind).json()["point"] == {"index": 0}
        client.get(stored).raise_for_status()
        client.head(stored).raise_for_status()
        for path in ("/healthz", "/readyz", "/metrics", "/docs"):
            client.get(path).raise_for_status()
        by_hand = {"/v1/solids/import", "/v1/layers/stream", "/healthz", "/readyz", "/metrics"}
        left = {path for path in document["paths"] if path not in asked | by_hand and "{" not in path}
        assert not left, left


def test_every_requirement_has_a_lowest_version() -> None:
    assert all(re.match(r"[\w-]+>=[\d.]+(,<[\d.]+)?(;|$)", item) for item in requirements())
