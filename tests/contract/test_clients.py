"""Clients generated from the stored document are called against the running service, and Java's own client too.

Each part runs where its tool is installed: openapi-python-client (the extra `test`), npm, a JDK.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.unit.service.test_live import Service

DOCUMENT = Path(__file__).with_name("openapi.json")
CALLS = Path(__file__).with_name("clients")


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    service = Service(access_log=False)
    try:
        service.wait_until_ready()
        yield service
    finally:
        service.close()


def run(*command: object, folder: Path, **environment: str) -> str:
    """Run a command in `folder` and return what it prints; fail with all of it if it fails."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    environment = {**os.environ, "PATH": path, **environment}
    done = subprocess.run(
        [str(word) for word in command], cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.skipif(shutil.which("java") is None, reason="no JDK is installed")
def test_java_http_client_with_its_defaults(service: Service, tmp_path: Path) -> None:
    """It offers h2c with every request, body included."""
    printed = run("java", CALLS / "Call.java", service.url, folder=tmp_path)
    assert printed.split() == ["201", "200", "[false,true,true]"]


@pytest.mark.skipif(
    importlib.util.find_spec("openapi_python_client") is None, reason="openapi-python-client is missing"
)
def test_openapi_python_client(service: Service, tmp_path: Path) -> None:
    words = ("--path", DOCUMENT, "--output-path", "generated", "--meta", "none")
    run(sys.executable, "-m", "openapi_python_client", "generate", *words, folder=tmp_path)
    printed = run(sys.executable, CALLS / "call_openapi_python_client.py", service.url, folder=tmp_path, PYTHONPATH=".")
    assert printed.split() == ["201", "[False,True,True]", "touching", "422"]


@pytest.mark.full
@pytest.mark.skipif(shutil.which("npm") is None, reason="no npm is installed")
def test_openapi_typescript(service: Service, tmp_path: Path) -> None:
    packages = ("openapi-typescript@7", "openapi-fetch@0.14", "typescript@5.9")
    run("npm", "install", "--silent", "--no-audit", "--no-fund", *packages, folder=tmp_path)
    run("npx", "openapi-typescript", DOCUMENT, "-o", "api.d.ts", folder=tmp_path)
    shutil.copy(CALLS / "call.ts", tmp_path)
    options = ("--strict", "--target", "es2022", "--module", "nodenext", "--skipLibCheck", "--lib", "es2022,dom")
    run("npx", "tsc", *options, "call.ts", folder=tmp_path)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    assert run("node", "call.js", service.url, folder=tmp_path).split() == [
        "201",
        "[false,true,true]",
        "touching",
        "422",
    ]
