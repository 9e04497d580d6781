"""Parameters of the engine say what they take: `Any` stays the exception."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST = 0.06
"""Share of parameters that may be `Any`."""


def test_few_parameters_are_any() -> None:
    annotations = [
        parameter.annotation
        for path in (ROOT / "engine").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.FunctionDef)
        for parameter in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
        if parameter.arg not in ("self", "cls")
    ]
    n_any = sum(isinstance(found, ast.Name) and found.id == "Any" for found in annotations)
    assert len(annotations) > 5000
    assert n_any <= MOST * len(annotations), f"{n_any} of {len(annotations)}"
