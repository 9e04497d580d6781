"""The playground: served whole, without outside requests, and used with mouse and keyboard in headless Chromium."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import anyio
import numpy as np
import pytest
from PIL import Image

import engine
from service.app import create_app
from service.playground import FOLDER
from tests.unit.service.asking import client_of
from tests.unit.service.test_live import Service

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
ARGUMENTS = [
    "--no-sandbox", "--no-first-run", "--disable-quic", "--disable-background-networking", "--disable-sync",
    "--disable-component-update", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
]  # fmt: skip


def test_every_part_is_served_and_names_no_outside_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "warm", lambda **_: None)
    names = sorted(path.name for path in FOLDER.iterdir() if path.name != "index.html")

    async def ask() -> None:
        async with client_of(create_app()) as client:
            page = await client.get("/")
            assert page.status_code == 200
            assert "default-src 'none'" in page.headers["content-security-policy"]
            texts = [page.text]
            for name in names:
                part = await client.get(f"/playground/{name}")
                assert part.status_code == 200, name
                texts.append(part.text)
            for text in texts:
                assert not re.findall(r"(?:https?:)?//[a-z0-9]+\.[a-z]+", text)

    anyio.run(ask)


def test_every_imported_module_is_there() -> None:
    for path in FOLDER.glob("*.js"):
        for name in re.findall(r'from "\./([^"]+)"', path.read_text("utf-8")):
            assert (FOLDER / name).is_file(), f"{path.name} imports {name}"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A page of a running service at a phone's or a desk's width; fails on script errors and outside requests."""
    playwright = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine (Debian: apt-get install chromium)")
    service = Service()
    service.wait_until_ready()
    faults: list[str] = []
    try:
        with playwright.sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
            page = browser.new_page(viewport={"width": 1200, "height": 820})
            page.on("pageerror", lambda error: faults.append(str(error)))
            page.on(
                "request",
                lambda request: (
                    None if request.url.startswith((service.url, "data:", "blob:")) else faults.append(request.url)
                ),
            )
            page.goto(f"{service.url}/")
            yield page
            browser.close()
    finally:
        service.stop()
        assert service.process.stderr is not None
        service.process.stderr.close()
    assert faults == []


def choose(page: Any, question: str, dimension: int) -> str:
    """Choose a question by its tab and return the verdict once it is the answer to it."""
    page.check(f"[name=question][value={question}]", force=True)
    if page.is_enabled(f"[name=dimension][value='{dimension}']"):
        page.check(f"[name=dimension][value='{dimension}']", force=True)
    return verdict(page)


def verdict(page: Any) -> str:
    """Return the verdict when it has not changed for a while."""
    last, since, end = None, time.monotonic(), time.monotonic() + 60
    while time.monotonic() < end:
        text = page.inner_text("#verdict")
        if text != last:
            last, since = text, time.monotonic()
        elif text and time.monotonic() - since > 0.6:
            assert not page.is_visible("#problem"), page.inner_text("#problem")
            return str(text)
        page.wait_for_timeout(50)
    raise AssertionError(f"no verdict: {page.inner_text('#problem')}")


def wait_until(page: Any, condition: Callable[[], bool]) -> None:
    """Wait here: the page's own policy forbids the strings that `wait_for_function` evaluates again and again."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        page.wait_for_timeout(50)


def figures(page: Any) -> dict[str, str]:
    return dict(row.split("\t") for row in page.inner_text("#figures").splitlines() if "\t" in row)


def colours(page: Any, canvas: str) -> int:
    """Return how many different colours the picture has."""
    picture = np.asarray(Image.open(io.BytesIO(page.locator(canvas).screenshot())).convert("RGB"))
    return len(np.unique(picture.reshape(-1, 3), axis=0))


def request_of(page: Any) -> dict[str, Any]:
    """Return the whole request that stands beside the picture, as `Copy JSON` gives it."""
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("#copy-request")
    return dict(json.loads(page.evaluate("navigator.clipboard.readText()")))


@pytest.mark.parametrize(
    ("question", "dimension", "words"),
    [
        ("contains", 3, "inside"), ("contains", 2, "inside"),
        ("collide", 3, "overlapping"), ("collide", 2, "overlapping"),
        ("segments", 3, "of 56 segments"), ("segments", 2, "of 56 segments"), ("polygons", 3, "of 6 polygons"),
        ("polygons", 2, "of 6 polygons"), ("overlay", 2, "6 pieces"),
    ],
)  # fmt: skip
def test_each_question_is_answered_and_drawn(page: Any, question: str, dimension: int, words: str) -> None:
    assert words in choose(page, question, dimension)
    shown = figures(page)
    assert shown["decisions"] == "exact"
    assert "ms" in shown["round trip"]
    assert page.inner_text("#curl").startswith("curl -s http://127.0.0.1")
    assert colours(page, f"#view{dimension}d") > 20


def test_the_mouse_moves_the_second_body(page: Any) -> None:
    choose(page, "collide", 3)
    page.select_option("#first", "cube")
    page.select_option("#second", "cube")
    page.check("#snap")
    page.click("#centre")
    assert verdict(page) == "overlapping"
    box = page.locator("#view3d").bounding_box()
    page.keyboard.down("Shift")
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] - 5, box["y"] + box["height"] / 2, steps=5)
    page.mouse.up()
    page.keyboard.up("Shift")
    assert verdict(page) == "disjoint"
    page.uncheck("#snap")


def test_the_keyboard_moves_the_clip_polygon(page: Any) -> None:
    before = choose(page, "overlay", 2)
    page.focus("#view2d")
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    assert verdict(page) != before


def test_the_request_shown_gives_the_answer_shown(page: Any) -> None:
    choose(page, "contains", 2)
    page.check("#snap")
    shown, asked = verdict(page), request_of(page)
    locations = engine.locate(asked["points"], engine.Polygon(asked["solid"]["rings"]))
    assert shown.startswith(f"{(locations == 1).sum():,} inside, {(locations == 0).sum():,} on the boundary")
    page.uncheck("#snap")


def test_a_mesh_file_is_opened_and_asked(page: Any, tmp_path: Path) -> None:
    """The bunny where the shared data is, else a cube; by the file dialog's input."""
    bunny = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "meshes" / "igl_bunny.npz"
    if bunny.is_file():
        with np.load(bunny) as arrays:
            vertices, faces = arrays["vertices"], arrays["faces"]
    else:
        vertices = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
        quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
        faces = np.array([triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))])
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    path = tmp_path / "mesh.obj"
    path.write_text("\n".join(lines))
    choose(page, "contains", 3)
    page.set_input_files("#file", path)
    wait_until(page, lambda: page.input_value("#first") == "file mesh.obj")
    if bunny.is_file():
        wait_until(page, lambda: "stored" in page.text_content("#request"))
    assert "inside" in verdict(page)
    assert int(figures(page)["inside"].replace(",", "")) > 0
    for question in ("collide", "segments"):
        choose(page, question, 3)
        page.select_option("#first", "file mesh.obj")
        assert verdict(page)
    if folder := os.environ.get("PLAYGROUND_PICTURES"):
        page.screenshot(path=f"{folder}/mesh.png")


def test_a_phone_shows_picture_above_panel(page: Any) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    choose(page, "collide", 3)
    too_wide = "[...document.querySelectorAll('*')].filter(each => each.getBoundingClientRect().right > innerWidth)"
    assert page.evaluate(f"{too_wide}.map(each => each.tagName + each.id)") == []
    stage, panel = page.locator("#stage").bounding_box(), page.locator("#panel").bounding_box()
    assert stage["y"] + stage["height"] <= panel["y"]
    page.set_viewport_size({"width": 1200, "height": 820})


def test_errors_of_the_service_are_shown(page: Any) -> None:
    choose(page, "contains", 3)
    page.route(
        "**/v1/contains",
        lambda route: route.fulfill(status=503, body=json.dumps({"code": "busy", "detail": "try later"})),
    )
    page.fill("#count", "2")
    page.wait_for_selector("#problem:visible")
    assert page.inner_text("#problem") == "503 busy: try later"
    page.unroute("**/v1/contains")
    page.fill("#count", "2.5")
    assert "inside" in verdict(page)
