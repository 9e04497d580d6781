"""Settings come from the environment, and wrong ones are refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from service import settings as settings_module
from service.settings import Settings


def test_environment_sets_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GEOMETRY_MAX_POINTS", "7")
    monkeypatch.setenv("GEOMETRY_DEADLINE_SECONDS", "0.5")
    monkeypatch.setenv("GEOMETRY_CORS_ORIGINS", "https://a.example, https://b.example")
    settings = Settings()
    assert (settings.max_points, settings.deadline_seconds) == (7, 0.5)
    assert settings.cors_origins == ("https://a.example", "https://b.example")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("MAX_POINTS", "0"),
        ("MAX_POINTS", "many"),
        ("PORT", "70000"),
        ("DEADLINE_SECONDS", "-1"),
        ("MAX_CSG_DEPTH", "65"),
    ],
)
def test_wrong_settings_are_refused(monkeypatch: pytest.MonkeyPatch, name: str, value: str) -> None:
    monkeypatch.setenv(f"GEOMETRY_{name}", value)
    with pytest.raises(ValidationError):
        Settings()


@pytest.mark.parametrize(
    ("cores", "memory", "expected"),
    [(1, 64, 1), (2, 64, 1), (3, 64, 1), (4, 64, 4), (16, 64, 16), (16, 20, 10), (16, 7, 1), (4, 8, 4)],
)
def test_a_process_a_core_where_there_are_cores_and_memory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, cores: int, memory: int, expected: int
) -> None:
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 2**30 // 4096 * 1024}
    monkeypatch.setattr(settings_module.os, "sysconf", pages.__getitem__)
    monkeypatch.setattr(settings_module, "default_workers", lambda: cores)
    (tmp_path / "memory.max").write_text(f"{memory * 2**30}\n")  # of the container, less than the machine's
    assert settings_module._processes(tmp_path) == expected
    (tmp_path / "memory.max").write_text("max\n")
    assert settings_module._processes(tmp_path) == (cores if cores >= 4 else 1)
