"""The command `exact-geometry`: that of the engine, and `serve`."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import engine
from exact_geometry.__main__ import main

ROOT = Path(__file__).resolve().parents[2]


def test_the_console_script_is_this_function() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["scripts"] == {"exact-geometry": "exact_geometry.__main__:main"}


def test_a_command_of_the_engine(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["exact-geometry", "bounds", '{"type": "aabb", "min": [0, 0], "max": [2, 1]}'])
    assert main() == 0
    assert "2.0" in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["exact-geometry", "bounds", "nowhere.stl"])
    assert main() == 2
    assert "there is no such file" in capsys.readouterr().err


def test_serve_is_the_service() -> None:
    words = [sys.executable, "-m", "exact_geometry", "serve", "--version"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, f"exact-geometry {engine.__version__}")
    words[-1] = "--nonsense"
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2
