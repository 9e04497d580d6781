"""schemathesis asks the running service what its OpenAPI document allows and forbids, with all its checks."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.service.test_live import Service

HERE = Path(__file__).parent
pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("schemathesis") is None, reason="schemathesis is not installed"
)


def ask(folder: Path, *options: str, seconds: float) -> int:
    """Run schemathesis; return how many cases it made, of which none failed."""
    service = Service(access_log=False)
    try:
        service.wait_until_ready()
        command = [sys.executable, "-m", "schemathesis.cli", "--config-file", str(HERE / "schemathesis.toml")]
        command += ["run", f"{service.url}/openapi.json", "--seed", "8", *options]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=seconds, check=False)
        assert service.stop() == 0
    finally:
        service.close()
    assert done.returncode == 0, done.stdout[-10_000:] + done.stderr
    found = re.search(r"([\d,]+) generated", done.stdout)
    assert found is not None, done.stdout[-3000:]
    return int(found[1].replace(",", ""))


def test_some_cases_of_every_path(tmp_path: Path) -> None:
    assert ask(tmp_path, "--phases", "examples,fuzzing", "--max-examples", "1", seconds=200) >= 40


@pytest.mark.full
def test_five_hundred_cases(tmp_path: Path) -> None:
    assert ask(tmp_path, "--phases", "examples,fuzzing,stateful", "--max-examples", "30", seconds=200) >= 500


@pytest.mark.full
def test_five_thousand_cases(tmp_path: Path) -> None:
    assert ask(tmp_path, "--max-examples", "200", seconds=3000) >= 5000
