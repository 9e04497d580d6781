"""The site is built as `mkdocs build --strict` does, and its pictures are those that the code beside them draws."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GALLERY = ROOT / "docs" / "gallery"
SCRIPTS = sorted(path.stem for path in GALLERY.glob("*.py") if path.stem not in ("make", "drawing", "site"))
ELSEWHERE = re.compile(
    r'<(?:script|img|iframe|source)[^>]+src="?(?:https?:)?//|<link[^>]+rel="?stylesheet"?[^>]+href="?http'
)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site with links, anchors and references checked; return its folder."""
    folder = tmp_path_factory.mktemp("site")
    around = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, env=around, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def test_every_public_name_stands_in_the_reference(site: Path) -> None:
    import engine

    text = "".join(path.read_text("utf-8") for path in (site / "reference").glob("*.html"))
    names = [name for name in engine.__all__ if name not in ("layers", "__version__")]
    assert [name for name in names if f'id="engine.{name}"' not in text] == []


def test_reading_it_asks_no_other_host(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 20
    assert (site / "gallery.html").read_text("utf-8").count("canvas") > 2 * len(SCRIPTS)  # the code beside pictures
    assert [path.name for path in pages if ELSEWHERE.search(path.read_text("utf-8"))] == []


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_picture_is_what_its_code_draws(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(GALLERY))
    import drawing

    monkeypatch.setattr(drawing, "PICTURES", tmp_path)
    runpy.run_path(str(GALLERY / f"{name}.py"))
    drawn, stored = tmp_path / f"{name}.svg", GALLERY.parent / "pictures" / f"{name}.svg"
    assert drawn.read_text("utf-8") == stored.read_text("utf-8")
    assert f"pictures/{name}.svg" in "".join(path.read_text("utf-8") for path in GALLERY.parent.glob("*.md"))
