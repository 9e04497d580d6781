"""What README.md shows is what happens: its calls are made, its Python is run, its commands exist."""

from __future__ import annotations

import doctest
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import anyio
import pytest

import engine
from service.app import create_app
from service.errors import STATUS
from service.settings import Settings
from tests.unit.service.asking import client_of
from tests.unit.service.test_live import Service

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
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    path, body = re.search(r"localhost:8000(\S+).*?-d '(.*?)'", CALLS[number], re.DOTALL).groups()  # type: ignore[union-attr]

    async def ask() -> Any:
        async with client_of(create_app(Settings(deadline_seconds=300))) as client:
            return (await client.post(path, content=body, headers={"content-type": "application/json"})).json()

    shown, answer = json.loads(blocks("json")[number]), anyio.run(ask)
    if "accuracy" not in shown:  # README says that parts are left out
        answer = {name: answer[name] for name in shown}
    assert answer == shown


def test_the_calls_for_stored_solids_do_what_they_say() -> None:
    (session,) = [block for block in blocks("sh") if block.startswith("url=localhost")]
    service = Service(access_log=False)
    try:
        service.wait_until_ready()
        script = "set -euo pipefail\n" + session.replace("localhost:8000", f"127.0.0.1:{service.port}")
        command = ["bash", "-c", script.replace("| head -3", "")]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    finally:
        service.close()
    assert done.returncode == 0, done.stderr
    for expected in (
        r'"type":"sphere","dimension":3,"memory":24',
        r"HTTP/1.1 200 OK",
        r"^ +1$",
        r"^( +0){2}\n( +0){2}\n( +0){2}$",
        r'"type":"polyhedron","dimension":3,"vertices":4,"faces":4',
        r'{"status":"ok"}{"status":"ok"}',
        r"geometry_requests_total",
    ):
        assert re.search(expected, done.stdout, re.MULTILINE), (expected, done.stdout)


def test_every_setting_and_every_code_stands_in_a_table() -> None:
    settings = re.findall(r"^\| `GEOMETRY_(\w+)` \| (.*?) \|", README, re.MULTILINE)
    assert [name.lower() for name, _ in settings] == list(Settings.model_fields)
    for name, shown in settings:
        default = Settings.model_fields[name.lower()].get_default(call_default_factory=True)
        if isinstance(default, int) and shown[0].isdigit() and "core" not in shown:
            assert int(re.sub(r"\D", "", shown)) * (2**20 if "MiB" in shown else 1) == default, name
    rows = re.findall(r"^\| (\d{3}) \| (.*?) \|", README, re.MULTILINE)
    shown = {code: int(status) for status, codes in rows for code in re.findall(r"`(\w+)`", codes)}
    assert shown == STATUS


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
