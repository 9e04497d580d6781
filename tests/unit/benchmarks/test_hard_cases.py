"""The catalogue of hard cases names sets that exist and pictures that are drawn, and its page can be written anew."""

from __future__ import annotations

import re

from benchmarks import hard_cases

TEXT = hard_cases.PAGE.read_text("utf-8")


def test_every_picture_is_stored_and_shown() -> None:
    shown = re.findall(r"\(pictures/hard_(\w+)\.svg\)", TEXT)
    stored = (hard_cases.PAGE.parent / "pictures").glob("hard_*.svg")
    assert sorted(shown) == sorted(path.stem.removeprefix("hard_") for path in stored)


def test_every_set_has_its_figures_and_none_of_ours_is_wrong() -> None:
    for mark in hard_cases.MARK.finditer(TEXT):
        wanted, lines = mark[1].split("; "), mark[0].splitlines()[1:]
        assert [line.split("*")[1] for line in lines] == wanted
        assert all("**ours 0**" in line for line in lines)
        assert {each.split(" ")[0] for each in wanted} <= set(hard_cases.SETS)
        assert hard_cases._paragraph(mark, {}) == mark[0]


def test_a_line_of_figures() -> None:
    found = hard_cases.sentence("cases x/y", {"ours": (0, 8), "a": (3, 5), "b": (0, 8)})
    assert found == "- *cases x/y* (8): **ours 0**, b 0, a 3 of 5\n"
