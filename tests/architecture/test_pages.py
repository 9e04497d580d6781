"""What the pages for newcomers name is there."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from benchmarks.__main__ import NAMES
from engine.__main__ import COMMANDS as COMMANDS_ON_FILES

ROOT = Path(__file__).resolve().parents[2]
NAMED = re.compile(r"`([\w./]+(?:\.py|/|\.md|\.json))`")
PLACES = ("", "engine", "tests", "service", "tests/contract", "engine/collision/meshes", "engine/collision")


def names_in(page: str) -> set[str]:
    return set(NAMED.findall((ROOT / page).read_text("utf-8")))


@pytest.mark.parametrize("page", ["docs/architecture.md", "CONTRIBUTING.md"])
def test_every_file_and_folder_named_exists(page: str) -> None:
    files = {
        path.relative_to(ROOT).as_posix()
        for part in ("engine", "service", "tests")
        for path in (ROOT / part).rglob("*.py")
    }
    missing = []
    for name in names_in(page):
        known = any((ROOT / place / name).exists() for place in PLACES)
        if not known and not any(("/" + file).endswith("/" + name) for file in files):
            if not any(f"/{name}" in f"/{file}" for file in files if name.endswith("/")):
                missing.append(name)
    assert not missing


def test_the_glossary_names_constants_that_exist() -> None:
    words = re.findall(r"^\| ([A-Z_]+) \|", (ROOT / "docs/architecture.md").read_text("utf-8"), re.MULTILINE)
    sources = "\n".join(path.read_text("utf-8") for path in (ROOT / "engine").rglob("*.py"))
    assert len(words) == 4
    assert all(re.search(rf"^{word}(: Final)? = ", sources, re.MULTILINE) for word in words)


COMMANDS = {*COMMANDS_ON_FILES, "audit", "warm"}
PAGES = sorted(
    path
    for folder in (".", "docs", "benchmarks", "benchmarks/filed", "tests/hard")
    for path in (ROOT / folder).glob("*.md")
)


def anchors(text: str) -> set[str]:
    """Return the names that a page's headings have in links."""
    heads = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere_and_commands_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    for link, anchor in re.findall(r"\]\(((?!http)[^)#\s]*)(?:#([^)]*))?\)", text):
        place = page.parent / link if link else page
        assert place.exists() or page.name == "page.md", link
        assert not anchor or anchor in anchors(place.read_text("utf-8")), f"{link}#{anchor}"
    for kind, names in (("benchmarks", set(NAMES)), ("engine", COMMANDS)):
        named = set(re.findall(rf"python3? -m {kind} ([a-z_]+)", text))
        assert named <= names, named - names


def test_the_page_on_calls_lists_every_path_with_its_methods() -> None:
    paths = json.loads((ROOT / "tests/contract/openapi.json").read_text("utf-8"))["paths"]
    wanted = {f"{', '.join(method.upper() for method in methods)} {path}" for path, methods in paths.items()}
    listed = re.findall(r"^\| `([A-Z, ]+ /\S+)` \|", (ROOT / "docs/calling.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(wanted)


def test_the_counts_of_wrong_answers_are_those_of_the_stored_run() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    (path,) = re.findall(r"\(([\w/-]+/audit_igl_bunny\.json)\)", text)
    run = json.loads((ROOT / path).read_text("utf-8"))
    (items,) = re.findall(r"its (\S+) face centroids", text)
    lines = re.findall(r"^\| (?:libigl's bunny|wrong \().*$", text, re.MULTILINE)
    head, counts = (line.strip("| ").split(" | ")[1:] for line in lines)
    names = {
        "trimesh with Embree": "trimesh + embreex",
        "libigl": "libigl winding number",
        "Open3D": "Open3D occupancy",
        "plain float64": "textbook: half-line",
        "CGAL": "CGAL side of mesh",
        "exact-geometry": "ours",
    }
    assert items == f"{run['items']:,}"
    assert dict(zip(head, counts, strict=True)) == {name: f"{run['wrong'][key]:,}" for name, key in names.items()}
