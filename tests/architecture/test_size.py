"""What a person can hold: functions that fit on a screen and a half, shallow, with arguments that have names."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2] / "engine"
MOST_LINES, DEEPEST, MOST_ARGUMENTS, MOST_FILES, LONGEST = 90, 5, 14, 24, 430
BLOCKS = (ast.For, ast.While, ast.If, ast.With, ast.Try)
INNER = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    for path in sorted(ROOT.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef):
                yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node


def depth(node: ast.AST) -> int:
    """Return how many blocks stand in each other below `node`; an elif is as deep as its if."""
    deepest = 0
    for child in ast.iter_child_nodes(node):
        if isinstance(child, INNER):
            continue
        is_elif = isinstance(node, ast.If) and isinstance(child, ast.If) and node.orelse == [child]
        deepest = max(deepest, depth(child) + (isinstance(child, BLOCKS) and not is_elif))
    return deepest


def test_functions_fit_on_a_screen_and_a_half() -> None:
    sizes = {
        name: (node.end_lineno or 0) - node.lineno + 1 - len((ast.get_docstring(node, False) or "").splitlines())
        for name, node in functions()
    }
    assert {name: lines for name, lines in sizes.items() if lines > MOST_LINES} == {}


def test_files_can_be_read_in_one_go() -> None:
    sizes = {str(path.relative_to(ROOT)): len(path.read_text("utf-8").splitlines()) for path in ROOT.rglob("*.py")}
    assert {name: lines for name, lines in sizes.items() if lines > LONGEST} == {}


def test_nothing_nests_deeper_than_a_reader_follows() -> None:
    deep = {name: depth(node) for name, node in functions()}
    assert {name: levels for name, levels in deep.items() if levels > DEEPEST} == {}


def test_what_belongs_together_is_handed_over_together() -> None:
    counts = {name: len(node.args.args) + len(node.args.kwonlyargs) for name, node in functions()}
    assert {name: count for name, count in counts.items() if count > MOST_ARGUMENTS} == {}


def test_a_folder_has_one_subject() -> None:
    counts = {
        str(folder.relative_to(ROOT)): len(list(folder.glob("*.py")))
        for folder in ROOT.rglob("*")
        if folder.is_dir() and folder.relative_to(ROOT).parts[0] != "textbook"
    }
    assert {folder: count for folder, count in counts.items() if count > MOST_FILES} == {}
