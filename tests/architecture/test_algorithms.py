"""docs/algorithms.md: each file that it names exists and cites the authors that its row names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "algorithms.md").read_text("utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("|") and "`" in line
]
METHODS = (
    "Sutherland-Hodgman", "Cohen-Sutherland", "Cyrus-Beck", "ray parity", "winding", "slabs", "GJK", "XenoCollide",
    "separating axis", "BVH with the surface area heuristic", "dual traversal", "Guigue", "noding", "snap rounding",
    "Weiler-Atherton", "Greiner-Hormann", "DCEL", "simulation of simplicity", "Shewchuk", "double-double", "Welzl",
    "double description", "ear cutting",
)  # fmt: skip


def files_in(cell: str) -> list[Path]:
    return [ROOT / "engine" / name for name in re.findall(r"`([\w/]+\.py)`", cell)]


def authors_in(cell: str) -> list[str]:
    """The surnames of a source; the textbook and methods without an author are named by their words."""
    names = [name for name in re.findall(r"\b[A-Z][a-z]+(?:-[A-Z][a-z]+)?\b", cell) if name not in ("In", "On")]
    return names or [cell.split(":")[0].removeprefix("the ")]


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_each_file_exists_and_cites_its_source(row: list[str]) -> None:
    name, cell, source, twin, difference = row
    assert difference, name
    files = files_in(cell)
    assert files, name
    assert all(file.exists() for file in (*files, *files_in(twin))), name
    for file in files:
        text = file.read_text("utf-8").lower()
        assert any(author.lower() in text for author in authors_in(source)), (file.name, authors_in(source))


def test_every_method_of_the_field_has_a_row() -> None:
    assert [name for name in METHODS if name.lower() not in PAGE.lower()] == []


def test_every_module_of_the_textbook_is_some_rows_twin() -> None:
    twins = {path.name for row in ROWS for path in files_in(row[3])}
    modules = {path.name for path in (ROOT / "engine" / "textbook").glob("*.py")} - {"__init__.py", "methods.py"}
    assert modules == twins
