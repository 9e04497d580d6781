"""The wheels: what they hold, the same bytes twice, answers at once with kernels, a word while compiling without."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tarfile
import time
import zipfile
from pathlib import Path

import pytest
from numba import config as numba_config

from engine.compiling import kernel_cache
from tests.acceptance.test_versions import ask_everything
from tests.programs import COUNTER
from tests.unit.service.test_live import Service

pytest.importorskip("hatchling", reason="builds wheels")
pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")
ROOT = Path(__file__).resolve().parents[2]
PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check"]

ASK = (
    """
import numpy as np
import exact_geometry as eg
"""
    + COUNTER
    + """
corners = [[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]
cube = eg.Polyhedron(corners, [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])
ball, box = eg.Sphere((0, 0, 0), 1), eg.Aabb((0, 0), (1, 1))
angles = np.linspace(0, 2 * np.pi, 2048, endpoint=False)
circle = np.column_stack([np.cos(angles), np.sin(angles)])
rings = eg.Polygon([circle]), eg.Polygon([circle + 0.5])
square, other = (eg.Polygon([[(k, k), (k + 2, k), (k + 2, k + 2), (k, k + 2)]]) for k in (0, 1))
turns, moves = np.eye(3)[None], [(0.5, 0, 0)]
segments = [((-1.0, 0.5, 0.5), (3.0, 0.5, 0.5))]
scene = eg.Scene([cube, ball])
triangles = np.array([[(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]])
answers = {
    "locate": eg.locate([(0.5, 0.5, 0.5)], cube).tolist() == [1],
    "contains": eg.contains([(2.0, 0.5, 0.5)], cube).tolist() == [False],
    "locate_scene": len(eg.locate_scene([(0.5, 0.5, 0.5)], [cube, ball]).indices) == 2,
    "collide": eg.collide(cube, ball).relation.label == "overlapping",
    "collide_poses": [int(each) for each in eg.collide_poses(cube, cube, turns, moves)] == [3],
    "collide_scene": len(eg.collide_scene([cube, ball]).relation) == 1,
    "collide_triangles": len(eg.collide_triangles(triangles, triangles)) == 1,
    "clearance": eg.clearance(cube, eg.Sphere((3, 0.5, 0.5), 1)).distance == 1,
    "clearance_poses": eg.clearance_poses(cube, cube, turns, [(3, 0, 0)]).tolist() == [2],
    "clip_segments": eg.clip_segments(segments, cube).t.tolist() == [[0.25, 0.5]],
    "clip_lines": len(eg.clip_lines(segments, cube).source) == 1,
    "clip_polygons": eg.clip_polygons([[[(0.5, 0.5), (3, 0.5), (0.5, 3)]]], box).status.tolist() == [0],
    "overlay": eg.overlay(square, other).area == 1,
    "overlay of rings": eg.overlay(*rings).area == eg.overlay(*rings[::-1]).area > 1.75,
    "overlay_batch": len(eg.overlay_batch([square], [other])) == 1,
    "union_all": eg.union_all([square, other]).area == 7,
    "filled": len(eg.filled([square.vertices], "non_zero").vertices) == 4,
    "bounds": eg.bounds(cube).aabb.max.tolist() == [1, 1, 1],
    "Scene": len(scene.clip_segments(segments).source) == 2,
}
print([name for name, is_right in answers.items() if not is_right], counter.n)
"""
)
LOCATE = "import exact_geometry as eg; print(eg.locate([(3.0, 4.0), (3.1, 4.0)], eg.Sphere((0, 0), 5)).tolist())"


def built(folder: Path, kernels: Path | None = None, source: Path = ROOT) -> Path:
    """Return the wheel of this checkout, or of other sources."""
    around = {name: value for name, value in os.environ.items() if name != "EXACT_GEOMETRY_KERNELS"}
    around |= {} if kernels is None else {"EXACT_GEOMETRY_KERNELS": str(kernels)}
    words = [*PIP, "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(folder), str(source)]
    subprocess.run(words, env=around, check=True, timeout=300)
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(tmp_path_factory.mktemp("plain"))


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory, kernels: Path) -> Path:
    return built(tmp_path_factory.mktemp("full"), kernels)


class Environment:
    """A fresh environment and home folder; what we depend on is that of the tests."""

    def __init__(self, folder: Path, *wheels: Path) -> None:
        self.folder, self.home = folder, folder / "home"
        self.home.mkdir()
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "env"], check=True)
        self.python = folder / "env/bin/python"
        (self.site,) = (folder / "env").glob("lib/python*/site-packages")
        places = [each for each in sys.path if each.endswith("site-packages")]
        (self.site / "zz_dependencies.pth").write_text("\n".join(places) + "\n")
        for wheel in wheels:
            self.pip("install", "--no-deps", "--no-index", "--ignore-installed", str(wheel))

    def pip(self, *words: str) -> None:
        subprocess.run([*PIP, "--python", str(self.python), *words, "-q"], check=True, timeout=300)

    @property
    def around(self) -> dict[str, str]:
        own = ("PYTHON", "ENGINE_", "NUMBA_", "XDG_", "GEOMETRY_")
        return {name: value for name, value in os.environ.items() if not name.startswith(own)} | {
            "HOME": str(self.home), "TMPDIR": str(self.home)
        }  # fmt: skip

    def run(self, *words: str) -> tuple[str, str]:
        """Return what a process prints, and what it complains of."""
        done = subprocess.run([self.python, *words], cwd=self.home, env=self.around, capture_output=True, text=True,
                              timeout=600, check=False)  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout.strip(), done.stderr


def test_a_wheel_has_one_package_and_the_same_bytes_twice(
    plain: Path, full: Path, kernels: Path, tmp_path: Path
) -> None:
    assert plain.name.endswith("-py3-none-any.whl")
    assert f"-cp{sys.version_info[0]}{sys.version_info[1]}-none-" in full.name
    for wheel, seed in ((plain, None), (full, kernels)):
        again = built(tmp_path / ("full" if seed else "plain"), seed)
        assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(wheel.read_bytes()).digest()
        names = {name.partition("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
        assert {name for name in names if ".dist-info" not in name} == {
            "exact_geometry", "_exact_geometry_names.py", "_exact_geometry_names.pth"
        }  # fmt: skip
    if kernel_cache.seed() is not None:  # else kernels come from a cache, with what other tests compiled
        assert full.stat().st_size < 3_100_000
    assert not [name for name in zipfile.ZipFile(full).namelist() if name.endswith("lock")]


@pytest.mark.full
def test_the_source_archive_has_its_tests_and_builds_the_same_wheel(plain: Path, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)]
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True, timeout=300)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(tmp_path, filter="data")
    (folder,) = (path for path in tmp_path.iterdir() if path.is_dir())
    wanted = (
        "tests/unit/test_dockerfile.py",
        "Dockerfile",
        "deploy/nginx.conf",
        "CONTRIBUTING.md",
        "LICENSE",
        ".ci/run",
    )
    assert [name for name in wanted if not (folder / name).exists()] == []
    assert built(tmp_path / "again", source=folder).read_bytes() == plain.read_bytes()


def test_the_page_of_the_package_is_in_order(plain: Path) -> None:
    pytest.importorskip("twine")
    words = [sys.executable, "-m", "twine", "check", "--strict", str(plain)]
    assert subprocess.run(words, capture_output=True, text=True, timeout=60).returncode == 0
    with zipfile.ZipFile(plain) as wheel:
        (name,) = (name for name in wheel.namelist() if name.endswith("METADATA"))
        page = wheel.read(name).decode()
    for word in (
        "Author:",
        "Keywords:",
        "License-Expression: MIT",
        "Classifier: Typing :: Typed",
        "Provides-Extra: kernels",
    ):
        assert f"\n{word}" in page


def test_with_kernels_every_operation_is_answered_at_once(full: Path, tmp_path: Path) -> None:
    environment = Environment(tmp_path, full)
    assert environment.run("-c", ASK) == ("[] 0", "")
    service = Service(str(environment.python), environment.home, environment.around)
    try:
        service.wait_until_ready()
        ask_everything(service.url)
        assert service.stop() == 0
    finally:
        service.close()
    assert not [line for line in service.log if '"level":"warning"' in line or "Traceback" in line]
    assert not list(environment.home.rglob("*.nbc"))


def test_without_kernels_a_line_says_so_before_they_are_compiled(plain: Path, tmp_path: Path) -> None:
    environment = Environment(tmp_path, plain)
    code = f"import time, exact_geometry, sys; print(time.time(), file=sys.stderr); {LOCATE}"
    process = subprocess.Popen([environment.python, "-c", code], cwd=environment.home, env=environment.around,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip
    assert process.stderr is not None
    called, line, seen = float(process.stderr.readline()), process.stderr.readline(), time.time()
    assert "compiling them takes about" in line
    assert "engine.warm()" in line
    assert seen - called < 3  # promised: 0.3 s, on a machine that does nothing else
    output, more = process.communicate(timeout=300)
    assert output.strip() == "[0, -1]"
    assert more == ""
    assert environment.run("-c", LOCATE) == ("[0, -1]", "")  # from the cache


def stranger(folder: Path, name: str) -> Path:
    """Return the wheel of another project, with a package `name` at the top."""
    wheel = folder / f"stranger_{name}-1.0-py3-none-any.whl"
    info = f"stranger_{name}-1.0.dist-info"
    files = {
        f"{name}/__init__.py": "WHOSE = 'a stranger'\n",
        f"{name}/__main__.py": "print('a stranger')\n",
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: stranger-{name}\nVersion: 1.0\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    record = "".join(f"{file},,\n" for file in (*files, f"{info}/RECORD"))
    with zipfile.ZipFile(wheel, "w") as file:
        for path, text in (files | {f"{info}/RECORD": record}).items():
            file.writestr(path, text)
    return wheel


OURS = """
import subprocess, sys, exact_geometry as eg
assert callable(eg.service.router) and eg.service.__name__ == "exact_geometry.service", eg.service
serve = [sys.executable, "-m", "exact_geometry", "serve", "--version"]
assert subprocess.run(serve, capture_output=True, text=True).stdout.startswith("exact-geometry "), serve
import engine, service
assert (engine is eg.engine) == (service is eg.service)
"""


@pytest.mark.some(1)
@pytest.mark.parametrize("when", ["before", "after"])
def test_packages_of_the_same_names_and_ours_do_not_touch_each_other(full: Path, tmp_path: Path, when: str) -> None:
    strangers = [stranger(tmp_path, name) for name in ("engine", "service")]
    environment = Environment(tmp_path, *([*strangers, full] if when == "before" else [full, *strangers]))
    whose = f"{OURS}print(engine.WHOSE, service.WHOSE)\n{ASK}"
    assert environment.run("-c", whose) == ("a stranger a stranger\n[] 0", "")
    assert environment.run("-m", "service")[0] == "a stranger"
    environment.pip("uninstall", "-y", "stranger-engine", "stranger-service")
    ours = f"{OURS}import engine.containment.locate as a; print(a.locate is eg.locate)\n{ASK}"
    assert environment.run("-c", ours) == ("True\n[] 0", "")
    for name in ("service", "engine", "exact_geometry"):
        assert environment.run("-m", name, "--version")[0].startswith("exact-geometry ")
    environment.pip("uninstall", "-y", "exact-geometry")
    assert {path.name for path in environment.site.iterdir()} <= {"zz_dependencies.pth", "__pycache__"}


@pytest.mark.full
def test_ours_is_removed_and_the_others_stay(plain: Path, tmp_path: Path) -> None:
    environment = Environment(tmp_path, plain, stranger(tmp_path, "service"))
    environment.pip("uninstall", "-y", "exact-geometry")
    assert environment.run("-c", "import service; print(service.WHOSE)")[0] == "a stranger"


def test_the_audit_needs_no_checkout(full: Path, tmp_path: Path) -> None:
    environment = Environment(tmp_path, full)
    square = '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]]}'
    (environment.home / "square.geojson").write_text(square)
    words = ["-m", "engine", "audit", "square.geojson", "--seconds", "0.01", "-o", "page.html"]
    output, _ = environment.run(*words)
    assert "textbook: ray casting, float32" in output
    assert (environment.home / "page.html").stat().st_size > 10_000


@pytest.mark.full
def test_compiling_twice_gives_the_same_bytes(full: Path, tmp_path: Path) -> None:
    """In two checkouts, the second time by an installed wheel that has kernels itself: those were taken for all."""
    environment = Environment(tmp_path, full)
    seeds = [tmp_path / "first", tmp_path / "second"]
    around = {**environment.around, "PYTHONPATH": str(ROOT)}
    words = ["-m", "engine", "warm", "-q", "--cpu", "generic", "--into"]
    subprocess.run([sys.executable, *words, str(seeds[0])], env=around, cwd=ROOT, check=True, timeout=1800)
    environment.run(*words, str(seeds[1]))
    first, second = ({path.relative_to(seed): path.read_bytes() for path in seed.rglob("*") if path.is_file()}
                     for seed in seeds)  # fmt: skip
    assert len(first) > 90
    assert [str(name) for name in {*first, *second} if first.get(name) != second.get(name)] == []
