"""`python -m service` as an operator starts it: flags, units, what is wrong in a line; and the files of deploy/."""

from __future__ import annotations

import configparser
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

import engine
from service.app import create_app
from service.settings import WARM_UP, Settings
from tests.contract.test_openapi import STORED
from tests.unit.service.test_live import ROOT, Service

DEPLOY = ROOT / "deploy"


def start(*flags: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run `python -m service` with flags that end it."""
    command = [sys.executable, "-m", "service", *flags]
    around = {**os.environ, **environment}
    return subprocess.run(command, cwd=ROOT, env=around, capture_output=True, text=True, timeout=300, check=False)


def test_help_names_every_setting_with_its_reason() -> None:
    done = start("--help")
    assert done.returncode == 0
    text = " ".join(done.stdout.split())
    for name, field in Settings.model_fields.items():
        assert field.description, name
        assert f"--{name.replace('_', '-')} " in text
        assert field.description.split()[0] in text


def test_version() -> None:
    done = start("--version")
    assert (done.returncode, bool(re.fullmatch(r"exact-geometry \d+\.\d+\.\d+\S*\n", done.stdout))) == (0, True)


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (("--port", "x"), "GEOMETRY_PORT=x"),
        (("--workers", "2", "--max-points", "-1"), "GEOMETRY_MAX_POINTS=-1"),
        (("--workers", "2", "--store-folder", "/dev/null/solids"), "GEOMETRY_STORE_FOLDER=/dev/null/solids"),
        (("--max-body-bytes", "64XB"), "GEOMETRY_MAX_BODY_BYTES=64XB"),
        (("--log-level", "loud"), "GEOMETRY_LOG_LEVEL=loud"),
    ],
)
def test_what_is_wrong_is_said_in_a_line_and_ends_it(flags: tuple[str, ...], said: str) -> None:
    done = start(*flags)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"a setting is wrong: {said}: ")
    assert len(done.stderr.splitlines()) == 1


def test_an_unknown_flag_ends_it() -> None:
    done = start("--no-such-thing", "1")
    assert (done.returncode, "--no-such-thing" in done.stderr) == (2, True)


def test_sizes_take_units_and_levels_any_case(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GEOMETRY_MAX_BODY_BYTES", "2MiB")
    monkeypatch.setenv("GEOMETRY_INLINE_BYTES", "1 KiB")
    monkeypatch.setenv("GEOMETRY_STORE_BYTES", "12345")
    monkeypatch.setenv("GEOMETRY_LOG_LEVEL", "WARNING")
    settings = Settings()
    assert (settings.max_body_bytes, settings.inline_bytes, settings.store_bytes) == (2**21, 2**10, 12345)
    assert settings.log_level == "warning"


def test_what_is_counted_while_it_runs() -> None:
    """In several processes, which count into files; refusals of the protocol too; unknown variables are named."""
    service = Service(workers=2, max_pionts=3, access_log=False)
    try:
        service.wait_until_ready()
        body = {"solid": {"type": "sphere", "center": [0, 0], "radius": 1}, "points": [[0, 0]]}
        assert httpx.post(f"{service.url}/v1/contains", json=body).status_code == 200
        assert b" 400 " in service.send(b"nonsense\r\n\r\n")
        service.wait_until_in_flight(0)
        text = httpx.get(f"{service.url}/metrics").text
    finally:
        service.close()
    counted = dict(re.findall(r"^(geometry_\S+) (\S+)$", text, re.MULTILINE))
    assert counted['geometry_refusals_total{code="bad_request"}'] == "1.0"
    assert counted['geometry_requests_total{operation="contains",status="200"}'] == "1.0"
    assert float(counted["geometry_requests_in_flight"]) == 1
    assert any("GEOMETRY_MAX_PIONTS" in line for line in service.log)


def test_the_systemd_unit_names_settings_and_starts_the_service() -> None:
    unit = configparser.ConfigParser(strict=False, interpolation=None)
    unit.optionxform = str  # type: ignore[assignment,method-assign]
    unit.read(DEPLOY / "exact-geometry.service")
    assert {"Unit", "Service", "Install"} == set(unit.sections())
    text = (DEPLOY / "exact-geometry.service").read_text("utf-8")
    check_names(re.findall(r"GEOMETRY_\w+", text))
    words = shlex.split(unit["Service"]["ExecStart"])
    assert words[1:] == ["-m", "service"]
    assert int(unit["Service"]["TimeoutStopSec"]) > Settings().drain_seconds
    if tool := shutil.which("systemd-analyze"):
        done = subprocess.run([tool, "verify", DEPLOY / "exact-geometry.service"], capture_output=True, text=True)
        assert not [line for line in done.stderr.splitlines() if "Unknown" in line], done.stderr


def check_names(names: list[str]) -> None:
    assert {name.removeprefix("GEOMETRY_").lower() for name in names} <= set(Settings.model_fields)


def manifest() -> dict[str, Any]:
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    documents = yaml.safe_load_all((DEPLOY / "kubernetes.yaml").read_text("utf-8"))
    return {document["kind"]: document for document in documents}


def test_the_kubernetes_manifest_is_of_one_piece() -> None:
    found = manifest()
    pod = found["Deployment"]["spec"]["template"]
    (container,) = pod["spec"]["containers"]
    check_names([item["name"] for item in container["env"] if item["name"].startswith("GEOMETRY_")])
    paths = json.loads(STORED.read_text("utf-8"))["paths"]
    for kind in ("startupProbe", "readinessProbe", "livenessProbe"):
        probe = container[kind]
        assert probe["httpGet"]["path"] in paths
        assert probe["httpGet"]["port"] == container["ports"][0]["name"]
    labels = found["Deployment"]["spec"]["selector"]["matchLabels"]
    assert labels.items() <= pod["metadata"]["labels"].items()
    assert found["Service"]["spec"]["selector"] == labels
    assert found["PodDisruptionBudget"]["spec"]["selector"]["matchLabels"] == labels
    environment = {item["name"]: item.get("value") for item in container["env"]}
    settings = Settings(drain_seconds=float(environment["GEOMETRY_DRAIN_SECONDS"]))
    assert settings.drain_seconds + 5 <= pod["spec"]["terminationGracePeriodSeconds"]
    room = settings.request_bytes + settings.store_bytes + 2**29  # the interpreter, its code and kernels
    assert int(container["resources"]["limits"]["memory"].removesuffix("Gi")) * 2**30 >= room
    mounted = {item["name"] for item in container["volumeMounts"]}
    assert mounted == {item["name"] for item in pod["spec"]["volumes"]}


def test_the_environment_of_the_manifest_starts_the_service() -> None:
    (container,) = manifest()["Deployment"]["spec"]["template"]["spec"]["containers"]
    given = {item["name"]: item["value"] for item in container["env"] if "value" in item}
    chosen = {name.removeprefix("GEOMETRY_").lower(): value for name, value in given.items() if "GEOMETRY_" in name}
    service = Service(**{**chosen, "host": "127.0.0.1", "api_keys": "secret"})
    try:
        service.wait_until_ready()
        for kind in ("startupProbe", "readinessProbe", "livenessProbe"):
            assert httpx.get(service.url + container[kind]["httpGet"]["path"]).status_code == 200
        assert httpx.get(f"{service.url}/metrics").status_code == 401
        assert service.stop() == 0
    finally:
        service.close()


def test_the_grafana_board_shows_what_is_counted() -> None:
    from service.metrics import Metrics, count_refusal

    count_refusal("not_found")
    metrics = Metrics()
    metrics.count("contains", 200, {"compute": 0.1})
    counted = set(re.findall(r"^(geometry_\w+)[ {]", metrics.text().decode(), re.MULTILINE))
    board = json.loads((DEPLOY / "grafana.json").read_text("utf-8"))
    shown = {name for panel in board["panels"] for target in panel["targets"] for name in
             re.findall(r"geometry_\w+", target["expr"])}  # fmt: skip
    assert shown <= counted
    named = {re.sub(r"_(total|bucket|count|sum|created)$", "", name) for name in counted}
    assert {re.sub(r"_(total|bucket|count|sum)$", "", name) for name in shown} == named - {"geometry_build_info"}
    places = [(panel["gridPos"]["x"], panel["gridPos"]["y"]) for panel in board["panels"]]
    assert len(set(places)) == len(places)


def is_warming() -> bool:
    return any(thread.name == WARM_UP for thread in threading.enumerate())


@pytest.mark.anyio
async def test_the_warm_up_ends_with_the_service(monkeypatch: pytest.MonkeyPatch, anyio_backend: str) -> None:
    """Python stops a thread that outlives it where it stands, which within the compiler's C++ aborts the process."""

    def warm(progress: Callable[[int], object], processes: int) -> None:
        while True:  # bound: the end of the service
            time.sleep(0.01)
            progress(0)

    monkeypatch.setattr(engine, "warm", warm)
    app = create_app(Settings())
    async with app.router.lifespan_context(app):
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app=app), base_url="http://test") as client:
            assert (await client.get("/readyz")).status_code == 503
        assert is_warming()
    assert not is_warming()


@pytest.mark.some(1)
@pytest.mark.parametrize("seconds", [0.0, 1.0])
def test_a_stop_while_kernels_compile_is_a_stop(tmp_path: Path, seconds: float) -> None:
    around = {**os.environ, "ENGINE_CACHE_DIR": str(tmp_path), "ENGINE_CACHE_SEED": ""}
    service = Service(around=around)
    try:
        time.sleep(seconds)
        begin = time.monotonic()
        assert service.stop() == 0, "".join(service.log)
        assert time.monotonic() - begin < 30
        assert "terminate" not in "".join(service.log)
    finally:
        service.close()
