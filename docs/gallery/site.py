"""What the site has beside the files of docs/: the README as its front page, and the pages of the top folder.

A hook of mkdocs (mkdocs.yml). The report has an HTML page of its own name, so its text is called report.md on the site.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "CHANGELOG.md": "changelog.md",
    "docs/speed_and_error.md": "report.md",
}
"""File of the repository -> page of the site."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the top folder."""
    for name, page in PAGES.items():
        named_so = files.get_file_from_path(name.removeprefix("docs/"))
        if named_so is not None:
            files.remove(named_so)
        folder = "docs" if name.startswith("docs/") else ""
        files.append(File.generated(config, page, content=_linked((ROOT / name).read_text("utf-8"), folder)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: object) -> str:
    """Rewrite the links of pages that stand in docs/ itself."""
    return markdown if "/" in page.file.src_uri or page.file.src_uri in PAGES.values() else _linked(markdown, "docs")


def _linked(text: str, folder: str) -> str:
    """Return `text` of a file in `folder` with links as the site has them; of links to other files the words stay."""

    def link(match: re.Match[str]) -> str:
        words, target, anchor = match.groups()
        if "://" in target or not target:
            return match.group()
        path = (ROOT / folder / target).resolve().relative_to(ROOT).as_posix()
        if path not in PAGES and not path.startswith("docs/"):
            return words
        return f"[{words}]({PAGES.get(path, path.removeprefix('docs/'))}{anchor})"

    return re.sub(r"(?<!!)\[([^\]]+)\]\(([^)#\s]*)(#[^)]*)?\)".replace("(#[^)]*)?", "((?:#[^)]*)?)"), link, text)
