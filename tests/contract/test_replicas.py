"""Replicas behind nginx on one store: one is killed under load, nothing accepted is lost, ids agree."""

from __future__ import annotations

import os
import re
import ssl
import subprocess
import threading
import time
from contextlib import suppress
from pathlib import Path

import httpx
import numpy as np
import orjson
import pytest

import engine
from benchmarks.load import Connection, free_port, request, wait_until
from tests.programs import program
from tests.unit.service.test_live import Service

ROOT = Path(__file__).resolve().parents[2]
CONF = (ROOT / "deploy" / "nginx.conf").read_text("utf-8")


def test_compose_states_the_same_topology() -> None:
    compose = (ROOT / "deploy" / "compose.yml").read_text("utf-8")
    names = re.findall(r"server (\S+):8000", CONF)
    assert names == re.findall(r"^  (\S+): \*replica$", compose, re.MULTILINE)
    assert re.search(r"listen (\d+);", CONF)[1] in re.search(r'"(\d+:\d+)"', compose)[1]  # type: ignore[index]


def config(folder: Path, port: int, replicas: list[Service], text: str = CONF) -> Path:
    """Write a file of deploy/ with these ports, and all that it writes below `folder`."""
    text = text.replace("listen 8080", f"listen 127.0.0.1:{port}")
    for i_replica, replica in enumerate(replicas, 1):
        text = text.replace(f"geometry-{i_replica}:8000", f"127.0.0.1:{replica.port}")
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    paths = "".join(f"    {kind}_temp_path {folder}/{kind};\n" for kind in kinds)
    text = text.replace("http {\n", f"http {{\n    access_log off;\n{paths}")
    path = folder / "nginx.conf"
    user = "user root;\n" if os.geteuid() == 0 else ""  # else its workers cannot enter `folder`, which is for its owner
    path.write_text(f"{user}pid {folder}/nginx.pid;\nerror_log {folder}/error.log;\ndaemon off;\n{text}")
    return path


def wait_for(statuses: list[int], count: int) -> None:
    """Wait until there are so many answers."""
    end = time.monotonic() + 300
    while len(statuses) < count:
        assert time.monotonic() < end, len(statuses)
        time.sleep(0.05)


@pytest.mark.full
def test_a_replica_killed_under_load_loses_nothing(tmp_path: Path) -> None:
    command = program("nginx", package="nginx")
    is_over = threading.Event()
    replicas = [Service(store_folder=tmp_path / "solids", access_log=False) for _ in range(2)]
    port = free_port()
    nginx = subprocess.Popen([command, "-p", str(tmp_path), "-c", str(config(tmp_path, port, replicas))])
    try:
        for replica in replicas:
            replica.wait_until_ready()
        wait_until(port, "/readyz")
        names, lost, wrong = set(), [], []
        statuses: list[int] = []
        points = np.random.default_rng(0).random((500, 3))

        def work(seed: int) -> None:
            connection = Connection(port)
            source = np.random.default_rng(seed)
            while not is_over.is_set():
                radius = 0.25 + int(source.integers(8)) / 16
                body = orjson.dumps({"type": "sphere", "center": [0, 0, 0], "radius": radius})
                try:
                    status, answer = connection.ask(request("/v1/solids", body))
                    statuses.append(status)
                    name = orjson.loads(answer)["id"]
                    names.add((radius, name))
                    ask = request(f"/v1/solids/{name}/contains", points.tobytes(), "application/octet-stream")
                    status, answer = connection.ask(ask)
                    statuses.append(status)
                    wrong.append(answer != engine.locate(points, engine.Sphere([0, 0, 0], radius)).tobytes())
                except OSError as error:
                    lost.append(error)
                    connection.close()
            connection.close()

        workers = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
        for worker in workers:
            worker.start()
        wait_for(statuses, 200)
        replicas[0].process.kill()
        wait_for(statuses, 400)
        is_over.set()
        for worker in workers:
            worker.join()
        assert not lost, (tmp_path / "error.log").read_text()[-2000:]
        assert set(statuses) <= {200, 201}
        assert not any(wrong)
        assert len(names) == len({radius for radius, _ in names}) == 8
    finally:
        is_over.set()
        nginx.terminate()
        nginx.wait()
        for replica in replicas:
            replica.close()


def test_below_a_path_of_a_site_with_tls(tmp_path: Path) -> None:
    """Everything is found below the path, links lead there, and the log names the client and not the proxy."""
    command, openssl = program("nginx", package="nginx"), program("openssl", package="openssl")
    service, port = Service(root_path="/geometry", trusted_proxies="127.0.0.1"), free_port()
    made = (tmp_path / "cert.pem", tmp_path / "cert.key")
    words = "req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=127.0.0.1 -addext subjectAltName=IP:127.0.0.1"
    subprocess.run(
        [openssl, *words.split(), "-out", made[0], "-keyout", made[1]], check=True, capture_output=True, timeout=60
    )
    text = (ROOT / "deploy" / "nginx-tls.conf").read_text("utf-8")
    for shown, here in (
        ("listen 443", f"listen 127.0.0.1:{port}"),
        ("listen 80;", f"listen 127.0.0.1:{free_port()};"),
        ("server 127.0.0.1:8000", f"server 127.0.0.1:{service.port}"),
        ("/etc/ssl/geometry.example.pem", str(made[0])),
        ("/etc/ssl/private/geometry.example.key", str(made[1])),
    ):
        assert text.count(shown) == 1
        text = text.replace(shown, here)
    path = config(tmp_path, port, [], text)
    nginx = subprocess.Popen([command, "-p", str(tmp_path), "-c", str(path)])
    try:
        service.wait_until_ready()
        trust = ssl.create_default_context(cafile=made[0])
        with httpx.Client(base_url=f"https://127.0.0.1:{port}", verify=trust, follow_redirects=True) as client:
            end = time.monotonic() + 120
            while time.monotonic() < end:
                with suppress(httpx.ConnectError):
                    client.get("/")
                    break
                time.sleep(0.05)
            disk = {"type": "sphere", "center": [0, 0], "radius": 1}
            for kind, body in (("solids", disk), ("scenes", {"bodies": [{"solid": disk}]})):
                stored = client.post(f"/geometry/v1/{kind}", json=body)
                assert stored.headers["location"].startswith(f"/geometry/v1/{kind}/")
                assert client.get(stored.headers["location"]).json() == stored.json()
                assert stored.headers["strict-transport-security"]
            document = client.get("/geometry/openapi.json").json()
            assert document["servers"][0]["url"] == "/geometry"
            for page in ("/geometry", "/geometry/docs", "/geometry/playground/main.js", "/geometry/readyz"):
                assert client.get(page).status_code == 200, page
            assert client.get("/geometry/metrics").status_code == 404
        # what the client itself says of its address is believed no further than the last proxy that is trusted
        httpx.get(f"{service.url}/healthz", headers={"X-Forwarded-For": "198.51.100.1, 203.0.113.7"})
        end = time.monotonic() + 120
        while not any('"client":"203.0.113.7"' in line for line in service.log):
            assert time.monotonic() < end, service.log[-3:]
            time.sleep(0.05)
    finally:
        nginx.terminate()
        nginx.wait()
        service.close()
