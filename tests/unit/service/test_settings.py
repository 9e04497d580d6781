"""Settings come from the environment, and wrong ones are refused."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

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
