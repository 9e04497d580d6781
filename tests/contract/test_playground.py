"""The playground: served whole, without outside requests, and used with mouse and keyboard in headless Chromium."""

from __future__ import annotations

import io
import json
import os
import re
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
from service.pages import FOLDER
from tests.programs import chromium
from tests.unit.service.asking import client_of
from tests.unit.service.test_live import Service

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
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium(), args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.mark.full
def test_the_calls_are_tried_on_their_page_with_a_key(browser: Any) -> None:
    """Nothing of /docs and /redoc comes from outside; with keys the pages open, and Swagger UI asks for one."""
    service = Service(api_keys="secret")
    service.wait_until_ready()
    loaded: list[str] = []
    try:
        page = browser.new_page(viewport={"width": 390, "height": 844})
        page.on("response", lambda response: loaded.append(response.url))
        page.goto(f"{service.url}/docs")
        page.click("button.authorize")
        page.fill(".auth-container input >> nth=0", "secret")
        page.click(".auth-btn-wrapper button[type=submit] >> nth=0")
        page.click(".auth-btn-wrapper .btn-done >> nth=0")
        page.click("#operations-containment-contains .opblock-summary-control")
        page.click("#operations-containment-contains button.execute")
        page.wait_for_selector("#operations-containment-contains .live-responses-table")
        shown = page.inner_text("#operations-containment-contains .live-responses-table")
        assert "200" in shown
        assert "contained" in shown
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        page.goto(f"{service.url}/redoc")
        page.wait_for_selector('text="/v1/contains"', state="attached")
        page.close()
    finally:
        service.close()
    assert len(loaded) > 5
    assert all(url.startswith((service.url, "data:", "blob:")) for url in loaded)


@pytest.fixture(scope="module")
def page(browser: Any) -> Iterator[Any]:
    """A page of a running service at a phone's or a desk's width; fails on script errors and outside requests."""
    service = Service()
    service.wait_until_ready()
    faults: list[str] = []
    try:
        page = browser.new_context(viewport={"width": 1200, "height": 820}).new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on(
            "request",
            lambda request: (
                None if request.url.startswith((service.url, "data:", "blob:")) else faults.append(request.url)
            ),
        )
        page.goto(f"{service.url}/")
        yield page
        page.context.close()
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
    """Return the verdict when no request is under way and it has not changed for a while."""
    last, since, end = None, time.monotonic(), time.monotonic() + 180
    while time.monotonic() < end:
        text = page.inner_text("#verdict")
        if text != last or page.get_attribute("#stage", "aria-busy") != "false":
            last, since = text, time.monotonic()
        elif text and time.monotonic() - since > 0.6:
            assert not page.is_visible("#problem"), page.inner_text("#problem")
            return str(text)
        page.wait_for_timeout(50)
    raise AssertionError(f"no verdict: {page.inner_text('#problem')}")


def wait_until(page: Any, condition: Callable[[], bool]) -> None:
    """Wait here: the page's own policy forbids the strings that `wait_for_function` evaluates again and again."""
    end = time.monotonic() + 180
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


@pytest.mark.some(4)
@pytest.mark.parametrize(
    ("question", "dimension", "words"),
    [
        ("contains", 3, "inside"), ("contains", 2, "inside"),
        ("collide", 3, "overlapping"), ("collide", 2, "overlapping"),
        ("segments", 3, "of 56 segments"), ("segments", 2, "of 56 segments"), ("polygons", 3, "of 6 polygons"),
        ("scene", 3, "first met: body"), ("scene", 2, "first met: body"),
        ("distances", 3, "away"), ("distances", 2, "away"),
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
    assert verdict(page).startswith("disjoint, ")
    shown = figures(page)
    assert verdict(page) == f"disjoint, {float(shown['distance']):#.6g} apart"
    assert len(shown["nearest features"].split(", ")) == 2
    page.uncheck("#snap")


def test_the_switch_float64_asks_the_plain_method_too(page: Any) -> None:
    choose(page, "contains", 2)
    page.select_option("#first", "comb")
    page.check("#snap")
    page.check("#plain")
    verdict(page)
    wait_until(page, lambda: "float64 wrong" in figures(page))
    assert int(figures(page)["float64 wrong"]) > 0  # of points on the boundary a half-line leaves out some
    page.uncheck("#plain")
    page.uncheck("#snap")
    choose(page, "collide", 2)
    assert page.is_hidden("#plain")


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


def test_the_first_view_shows_where_plain_floats_are_wrong(page: Any) -> None:
    assert "points wrong" in choose(page, "proof", 2)
    asked = request_of(page)
    page.click("#copy-answer")
    answer = json.loads(page.evaluate("navigator.clipboard.readText()"))
    polygon = engine.Polygon(asked["solid"]["rings"])
    compared = engine.compare("contains", asked["points"], polygon)
    assert answer["/v1/compare"]["differing"] == compared.differing.tolist()
    assert len(compared.differing) > 5
    assert answer["/v1/contains"]["contained"] == engine.contains(asked["points"], polygon).tolist()
    page.select_option("#method", "same side")
    assert "(same side)" in verdict(page)


def test_a_link_holds_the_whole_state(page: Any) -> None:
    choose(page, "overlay", 2)
    page.select_option("#operation", "symmetric_difference")
    page.fill("#turn", "30")
    before = verdict(page)
    for ring, index in (("subject", 7), ("clip", 3)):
        asked = request_of(page)
        page.evaluate("scrollTo(0, 0)")
        box = page.locator("#view2d").bounding_box()
        corner = asked[ring]["rings"][0][index]
        scale = min(box["width"], box["height"]) / (2.3 * 2.1)
        place = [box["x"] + box["width"] / 2 + scale * corner[0], box["y"] + box["height"] / 2 - scale * corner[1]]
        page.mouse.move(*place)
        page.mouse.down()
        page.mouse.move(place[0] + 30, place[1] - 20, steps=3)
        page.mouse.up()
        now = verdict(page)
        assert now != before, ring
        before = now
    asked = request_of(page)
    page.click("#copy-link")
    address = page.evaluate("navigator.clipboard.readText()")
    other = page.context.new_page()
    other.goto(address)
    assert verdict(other) == before
    assert np.allclose(np.concatenate(request_of(other)["clip"]["rings"]), np.concatenate(asked["clip"]["rings"]))
    assert request_of(other)["subject"] == asked["subject"]
    other.close()
    wait_until(page, lambda: page.evaluate("location.href") == address)
    page.goto(address.partition("#")[0])  # as a first visitor
    assert "points wrong" in verdict(page)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("path", "body", "words"),
    [
        ("/v1/contains", {"solid": {"type": "polygon", "rings": [[[1e6, 0.0], [1e6 + 3, 0.1], [1e6, 4.0]]]},
                          "points": [[1000000.1, 0.1]]}, "1 inside"),
        ("/v1/clip/segments", {"region": {"type": "aabb", "min": [0.0, 0.0, 0.0], "max": [1.0, 2.0, 3.0]},
                               "segments": [[[-1.0, 0.1, 0.1], [2.0, 0.3, 0.7]]]}, "1 piece of 1 segment"),
    ],
)  # fmt: skip
def test_a_link_of_the_report_asks_what_it_holds(page: Any, path: str, body: dict[str, Any], words: str) -> None:
    """Every number as given, also far from the origin, until a control is moved."""
    page.evaluate("text => { location.hash = new URLSearchParams({ request: text }).toString(); }",
                  json.dumps([path, body]))  # fmt: skip
    wait_until(page, lambda: words in page.inner_text("#verdict"))
    assert request_of(page) == body
    assert colours(page, f"#view{len(body.get('points', body.get('segments', [[]])[0])[0])}d") > 3
    page.evaluate("location.hash = ''")
    choose(page, "contains", 2)
    assert page.evaluate("location.hash").startswith("#question=contains")


def test_a_link_that_is_no_link_shows_the_first_view(page: Any) -> None:
    for odd in ("#question=nothing&dimension=9&first=x&count=many&offset=1,2&camera=a", "#first-rings=[[", "#%"):
        other = page.context.new_page()
        other.goto(page.evaluate("location.origin") + "/" + odd)
        assert "points wrong" in verdict(other)
        other.close()


def test_a_file_that_cannot_be_read_is_said_so_until_the_next_answer(page: Any, tmp_path: Path) -> None:
    choose(page, "contains", 3)
    path = tmp_path / "mesh.glb"
    path.write_bytes(b"glTF")
    page.set_input_files("#file", path)
    page.wait_for_selector("#problem:visible")
    page.wait_for_timeout(700)  # it stays
    assert "mesh.glb cannot be drawn" in page.inner_text("#problem")
    assert "old" in (page.get_attribute("#stage", "class") or "")
    page.fill("#count", "2.25")
    verdict(page)
    assert "old" not in (page.get_attribute("#stage", "class") or "")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_what_is_drawn_stands_out(page: Any, scheme: str) -> None:
    """Contrast with the stage: 3 for what is drawn (WCAG 2.2, 1.4.11), 4.5 for text."""
    page.emulate_media(color_scheme=scheme)
    script = """name => {
        const probe = document.body.appendChild(document.createElement('i'));
        probe.style.color = `var(--${name})`;
        const found = getComputedStyle(probe).color;
        probe.remove();
        return found;
    }"""

    def brightness(name: str) -> float:
        shares = [int(part) / 255 for part in re.findall(r"\d+", page.evaluate(script, name))[:3]]
        linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    def contrast(name: str, other: str) -> float:
        low, high = sorted((brightness(name), brightness(other)))
        return (high + 0.05) / (low + 0.05)

    for name in ("inside", "boundary", "outside", "kept", "wrong", "second", "first"):
        assert contrast(name, "stage") >= 3, name
    for name in ("ink", "quiet", "inside", "wrong"):
        assert contrast(name, "paper") >= 4.5, name
    page.emulate_media(color_scheme="light")


@pytest.mark.full
def test_a_key_is_asked_for_on_the_page(browser: Any) -> None:
    service = Service(api_keys="secret")
    service.wait_until_ready()
    try:
        page = browser.new_page()
        page.goto(service.url)
        page.wait_for_selector("#problem:visible")
        assert "missing_key" in page.inner_text("#problem")
        assert page.evaluate("document.activeElement.id") == "key"
        page.keyboard.type("secret")
        page.keyboard.press("Tab")
        assert "points wrong" in verdict(page)
        page.reload()
        assert "points wrong" in verdict(page)
        page.close()
    finally:
        service.close()
