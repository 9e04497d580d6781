"""The Dockerfile keeps its promises, and its steps work: run by hand in a temporary folder, since no image is built.

The slow part (marker `full`) needs a package index: it installs the service with kernels as the image does, starts the
command of the image, and sees that nothing is compiled again.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BASE = 125e6
"""Bytes of the image that ours begins with."""
Step = tuple[str, str]


def stages() -> list[list[Step]]:
    """Return the instructions of each stage as (word, rest)."""
    found: list[list[Step]] = []
    for line in (ROOT / "Dockerfile").read_text("utf-8").splitlines():
        if line and not line.startswith("#"):
            word, _, rest = line.partition(" ")
            if word == "FROM":
                found.append([])
            found[-1].append((word, rest))
    return found


def environment(stage: list[Step]) -> dict[str, str]:
    """Return what ENV sets, with the defaults of ARG put in."""
    values = dict(rest.split("=", 1) for word, rest in stage if word == "ARG")
    pairs = [pair.split("=", 1) for word, rest in stage if word == "ENV" for pair in rest.split()]
    return {name: re.sub(r"\$(\w+)", lambda match: values[match[1]], value) for name, value in pairs}


def commands(stage: list[Step]) -> tuple[str, str]:
    """Return what the image runs and what its health check runs, as JSON."""
    steps = dict(stage)
    return steps["CMD"], steps["HEALTHCHECK"].partition("CMD ")[2]


def test_the_kernels_that_are_built_are_those_of_the_wheel() -> None:
    build, run = stages()
    (command,) = [rest for word, rest in build if word == "RUN" and "exact_geometry warm" in rest]
    assert "--into /src/kernels --cpu $CPU" in command
    assert build[-1][1].startswith("EXACT_GEOMETRY_KERNELS=/src/kernels ")
    assert ("ARG", "CPU=x86-64-v3") in build
    assert "ENGINE_CACHE_SEED" not in environment(run)
    assert not any(name.startswith("NUMBA_") for name in environment(run))


def test_image_is_small_and_not_root() -> None:
    build, run = stages()
    assert {rest.split()[0] for stage in (build, run) for word, rest in stage if word == "FROM"} == {"python:3.12-slim"}
    assert [rest for word, rest in run if word == "USER"] == ["10001:10001"]
    assert not any(word in ("RUN", "ADD") for word, _ in run)
    assert not any(re.search(r"\b(curl|wget|apt-get|sudo)\b", rest) for stage in (build, run) for _, rest in stage)


def test_only_what_the_wheel_needs_is_sent_to_the_builder() -> None:
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines() if line.startswith("!")}
    copied = {name for word, rest in stages()[0] if word == "COPY" for name in rest.split()[:-1]}
    assert kept == copied
    assert all((ROOT / name).exists() for name in copied)


@pytest.mark.full
def test_steps_build_a_service_that_starts_without_compiling(tmp_path: Path) -> None:
    build, run = stages()

    def moved(text: str) -> str:
        """Return `text` with the image's folders, and its port, put into the temporary folder."""
        return re.sub(r"/(opt|src|tmp)\b", lambda match: f"{tmp_path}/{match[1]}", text).replace("8000", "18765")

    for name in ("opt", "src", "tmp"):
        (tmp_path / name).mkdir()
    plain = {name: os.environ[name] for name in ("PATH", "PIP_INDEX_URL", "PIP_CONFIG_FILE") if name in os.environ}
    plain["PATH"] = f"{Path(sys.executable).parent}:{plain.get('PATH', '')}"
    for word, rest in build:
        if word == "COPY":
            *names, _ = rest.split()
            for name in names:
                if (ROOT / name).is_dir():
                    shutil.copytree(ROOT / name, tmp_path / "src" / name, ignore=shutil.ignore_patterns("__pycache__"))
                else:
                    shutil.copy(ROOT / name, tmp_path / "src")
        elif word == "RUN":
            arguments = dict(rest.split("=", 1) for word, rest in build if word == "ARG")
            surroundings = {**plain, **environment(build), **arguments, "HOME": str(tmp_path / "tmp")}
            subprocess.run(["sh", "-c", moved(rest)], cwd=tmp_path / "src", env=surroundings, check=True, timeout=900)

    shutil.rmtree(tmp_path / "src")
    assert list((tmp_path / "opt").rglob("exact_geometry/engine/kernels/*/*/*.nbc"))
    size = sum(
        path.stat().st_size for path in (tmp_path / "opt").rglob("*") if path.is_file() and not path.is_symlink()
    )
    assert size + BASE < 400e6
    for path in (tmp_path / "opt").rglob("*"):  # the image's root is read-only
        if not path.is_symlink():
            path.chmod(0o555 if path.is_dir() or os.access(path, os.X_OK) else 0o444)
    surroundings = {**plain, **{name: moved(value) for name, value in environment(run).items()}}
    command, check = (json.loads(moved(text)) for text in commands(run))
    service = subprocess.Popen(command, cwd=tmp_path / "tmp", env=surroundings)
    try:
        before = time.monotonic()
        while subprocess.run(check, env=surroundings, check=False, capture_output=True).returncode:
            assert time.monotonic() - before < 600
            assert service.poll() is None
        with urllib.request.urlopen("http://127.0.0.1:18765/docs", timeout=5) as answer:
            assert answer.status == 200
        assert not list((tmp_path / "tmp/kernels").rglob("*.nbc"))  # nothing was compiled
    finally:
        service.terminate()
        assert service.wait(300) == 0
