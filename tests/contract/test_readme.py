"""What README.md shows is what happens: its calls are made, its Python is run, its commands exist."""

from __future__ import annotations

import doctest
import json
import re
from pathlib import Path
from typing import Any

import anyio
import pytest

import engine
from service.app import create_app
from service.settings import Settings
from tests.unit.service.asking import client_of

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    """Return the fenced blocks of one language."""
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


CALLS = [block for block in blocks("sh") if block.startswith("curl")]


def test_every_call_shows_its_answer() -> None:
    assert len(CALLS) == len(blocks("json")) > 0


@pytest.mark.parametrize("number", range(len(CALLS)))
def test_a_call_has_the_answer_shown(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "warm", lambda: None)
    path, body = re.search(r"localhost:8000(\S+).*?-d '(.*?)'", CALLS[number], re.DOTALL).groups()  # type: ignore[union-attr]

    async def ask() -> Any:
        async with client_of(create_app(Settings(deadline_seconds=300))) as client:
            return (await client.post(path, content=body, headers={"content-type": "application/json"})).json()

    assert anyio.run(ask) == json.loads(blocks("json")[number])


def test_the_python_shown_does_what_it_shows() -> None:
    for number, block in enumerate(blocks("python")):
        test = doctest.DocTestParser().get_doctest(block, {}, f"README block {number}", "README.md", 0)
        assert doctest.DocTestRunner().run(test).failed == 0


def test_the_two_commands_are_one_line_each_and_ci_runs_the_test_command() -> None:
    commands = [block.strip() for block in blocks("sh") if block.startswith("python3 -m venv")]
    assert [command.split(" && ")[-1] for command in commands] == [
        ".venv/bin/python -m service",
        ".venv/bin/python -m pytest",
    ]
    assert "python -m pytest$" in (ROOT / ".ci" / "run").read_text("utf-8")
