"""The catalogue of hard cases shows pictures that are drawn and figures of every set that it names."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[3] / "docs" / "hard_cases.md"
TEXT = PAGE.read_text("utf-8")
MARK = re.compile(r"<!-- measured: (.*?) -->\n(?:.+\n)*")


def test_every_picture_is_stored_and_shown() -> None:
    shown = re.findall(r"\(pictures/hard_(\w+)\.svg\)", TEXT)
    stored = (PAGE.parent / "pictures").glob("hard_*.svg")
    assert sorted(shown) == sorted(path.stem.removeprefix("hard_") for path in stored)


def test_every_set_has_its_figures_and_none_of_ours_is_wrong() -> None:
    for mark in MARK.finditer(TEXT):
        wanted, lines = mark[1].split("; "), mark[0].splitlines()[1:]
        assert [line.split("*")[1] for line in lines] == wanted
        assert all("**ours 0**" in line for line in lines)
