"""The playground: served whole, without outside requests, and used with mouse and keyboard in headless Chromium."""

from __future__ import annotations

import io
import itertools
import json
import os
import re
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
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
    loaded = re.findall(r'(?:href|src)="playground/([^"]+\.js)"', (FOLDER / "index.html").read_text("utf-8"))
    assert sorted(loaded) == sorted(path.name for path in FOLDER.glob("*.js")), "all are fetched at once"


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
    last, since, end = None, time.monotonic(), time.monotonic() + 60
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
    end = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < end
        page.wait_for_timeout(50)


def figures(page: Any) -> dict[str, str]:
    return dict(row.split("\t") for row in page.inner_text("#figures").splitlines() if "\t" in row)


def colours(page: Any, canvas: str) -> int:
    """Return how many different colours the picture has, once it has more than one: a frame is drawn when the browser
    has time, which may be after the answer."""
    n = 1
    for _ in range(50):
        picture = np.asarray(Image.open(io.BytesIO(page.locator(canvas).screenshot())).convert("RGB"))
        n = len(np.unique(picture.reshape(-1, 3), axis=0))
        if n > 1:
            break
        page.wait_for_timeout(100)
    return n


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
        ("hits", 3, "of 100 meet it"), ("cut", 3, "volume inside"), ("distances", 3, "away"), ("distances", 2, "away"),
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


def test_a_plane_is_moved_through_a_body(page: Any) -> None:
    """By Shift and arrow keys; the figures are those of the engine for the request shown."""
    choose(page, "cut", 3)
    page.select_option("#first", "octahedron")
    page.check("#snap")
    before = verdict(page)
    page.focus("#view3d")
    for _ in range(12):
        page.keyboard.press("Shift+ArrowRight")
    assert verdict(page) != before
    shown, asked = figures(page), request_of(page)
    body, region = made(asked["solid"]), engine.HalfSpace(asked["region"]["normal"], asked["region"]["offset"])
    assert region.offset * 4 == round(region.offset * 4) != 0
    volume, area = engine.cut(body, region).volume, engine.section(body, region).areas.sum()  # type: ignore[union-attr]
    assert float(shown["volume inside"]) == pytest.approx(volume, rel=1e-12)  # 17 places are shown
    assert float(shown["area of the section"]) == pytest.approx(area, rel=1e-12)
    page.fill("#turn", "45")
    assert verdict(page)
    assert request_of(page)["region"]["normal"][2] != 0
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


@pytest.mark.parametrize("size", [(390, 844), (1280, 800)])
def test_bodies_are_drawn_whole(page: Any, size: tuple[int, int]) -> None:
    """Along the edges of the picture, and under the headings of two panes, there is only the colour of the stage."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.emulate_media(reduced_motion="reduce")
    for question in ("proof", "collide", "scene", "cut"):
        choose(page, question, 3)
        page.click("#centre")
        choose(page, question, 3)
        picture = np.asarray(Image.open(io.BytesIO(page.locator("#view3d").screenshot())).convert("RGB"))
        picture = picture[3:-3, 3:-3]  # without the border, which a pixel of the screen may share
        stage = picture[-1, -1]
        for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1]):
            assert (edge == stage).all(), question
    page.emulate_media(reduced_motion="no-preference")
    page.set_viewport_size({"width": 1200, "height": 820})


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


def made(solid: dict[str, Any]) -> engine.Polygon | engine.Polyhedron:
    """Return the engine's solid of a request."""
    return engine.Polygon(solid["rings"]) if "rings" in solid else engine.Polyhedron(solid["vertices"], solid["faces"])


@pytest.mark.parametrize("dimension", [3, 2])
def test_the_first_view_shows_where_plain_floats_are_wrong(page: Any, dimension: int) -> None:
    choose(page, "proof", dimension)
    page.select_option("#first", {2: "star", 3: "octahedron"}[dimension])
    assert "points wrong" in verdict(page)
    asked = request_of(page)
    page.click("#copy-answer")
    answer = json.loads(page.evaluate("navigator.clipboard.readText()"))
    solid = made(asked["solid"])
    compared = engine.compare("contains", asked["points"], solid)
    assert answer["/v1/compare"]["differing"] == compared.differing.tolist()
    assert len(compared.differing) > 5
    assert answer["/v1/contains"]["contained"] == engine.contains(asked["points"], solid).tolist()
    labels = page.locator("#labels span").all_inner_texts()
    assert labels == [
        f"exact: {len(asked['points'])} right",
        f"plain float64 (ray casting): {len(compared.differing)} wrong",
    ]
    if dimension == 2:
        page.select_option("#method", "same side")
        assert "(same side)" in verdict(page)


@pytest.mark.parametrize("dimension", [3, 2])
def test_a_wrong_point_is_looked_at_down_to_the_doubles_around_it(page: Any, dimension: int) -> None:
    choose(page, "proof", dimension)
    page.select_option("#first", {2: "star", 3: "octahedron"}[dimension])
    verdict(page)
    seen: list[dict[str, Any]] = []
    page.on("request", lambda request: seen.append(json.loads(request.post_data)) if request.method == "POST" else None)
    page.click("#to-lens")
    wait_until(page, lambda: "doubles around" in page.inner_text("#verdict"))
    (lattice,) = (body for body in seen if "operation" in body and len(body["points"]) == 17**2)
    compared = engine.compare("contains", lattice["points"], made(lattice["solid"]))
    words = f"Plain float64 is wrong at {len(compared.differing)} of the 289 doubles around this point"
    assert page.inner_text("#verdict") == words
    assert len(compared.differing) > 0
    spread = np.ptp(np.array(lattice["points"]), axis=0)
    assert 0 < spread.max() < 1e-14
    assert (spread > 0).sum() == 2
    wait_until(page, lambda: float(page.input_value("#depth")) == 1.0)
    assert "10¹" in page.inner_text("#zoomed")
    assert colours(page, "#lens") > 20
    page.mouse.move(*middle_of(page, "#lens"))
    page.mouse.wheel(0, 600)
    wait_until(page, lambda: float(page.input_value("#depth")) < 1.0)
    page.click("#zoom-in")
    page.click("#next-wrong")
    page.click("#from-lens")
    wait_until(page, lambda: "points wrong" in page.inner_text("#verdict"))
    assert page.is_visible(f"#view{dimension}d")


def test_the_boundary_is_drawn_where_rational_arithmetic_has_it(page: Any) -> None:
    """`planeFrom` and `ratio`, which place the line between neighbouring doubles."""
    draw = np.random.default_rng(3)
    for dimension in (2, 3):
        for scale in (1.0, 1e-160, 1e9):
            corners = (draw.normal(size=(dimension, dimension)) * scale).tolist()
            p = np.mean(corners, axis=0).tolist()
            found = page.evaluate(
                """async ([p, corners]) => {
                    const { planeFrom, ratio } = await import('/playground/exact.js');
                    const { n, d, unit } = planeFrom(p, corners);
                    return n.map((v) => ratio(d, v) * 2 ** unit);
                }""",
                [p, corners],
            )
            exact = [[Fraction(v) for v in q] for q in [p, *corners]]
            u = [[v - w for v, w in zip(q, exact[1], strict=True)] for q in exact[2:]]
            normal = [-u[0][1], u[0][0]] if dimension == 2 else [
                u[0][i] * u[1][j] - u[0][j] * u[1][i] for i, j in ((1, 2), (2, 0), (0, 1))
            ]  # fmt: skip
            d = sum(a * (x - y) for a, x, y in zip(normal, exact[0], exact[1], strict=True))
            assert np.allclose(found, [float(d / a) for a in normal], rtol=1e-15, atol=0)


def middle_of(page: Any, name: str) -> tuple[float, float]:
    page.evaluate("scrollTo(0, 0)")
    box = page.locator(name).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def paste(page: Any, text: str) -> None:
    page.evaluate(
        """text => {
            const event = new ClipboardEvent('paste', { clipboardData: new DataTransfer(), bubbles: true });
            event.clipboardData.setData('text', text);
            dispatchEvent(event);
        }""",
        text,
    )


@pytest.mark.some(3)
@pytest.mark.parametrize(
    ("text", "field", "expected"),
    [
        ("POLYGON ((100 100, 140 100, 140 135.5, 100 100), (110 101, 111 101, 111 102, 110 101))", "solid",
         {"type": "polygon", "rings": [[[100, 100], [140, 100], [140, 135.5]], [[110, 101], [111, 101], [111, 102]]]}),
        ('{"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": {"type": "MultiPolygon", '
         '"coordinates": [[[[0, 0], [4, 0], [0, 4], [0, 0]]], [[[9, 9], [12, 9], [9, 12], [9, 9]]]]}}]}', "solid",
         {"type": "polygon", "rings": [[[0, 0], [4, 0], [0, 4]], [[9, 9], [12, 9], [9, 12]]]}),
        ('{"type": "aabb", "min": [0, 0, 0], "max": [10, 20, 5.5]}', "solid",
         {"type": "aabb", "min": [0, 0, 0], "max": [10, 20, 5.5]}),
        ("x;y;z\n1;2;3\n1e5;2.25;-3", "points", [[1, 2, 3], [1e5, 2.25, -3]]),
        ("MULTIPOINT ((0.1 0.2), (3 4))", "points", [[0.1, 0.2], [3, 4]]),
        ("GEOMETRYCOLLECTION (POINT (7 8), LINESTRING (0 0, 1 0.5, 2 0))", "segments",
         [[[0, 0], [1, 0.5]], [[1, 0.5], [2, 0]]]),
    ],
)  # fmt: skip
def test_what_is_pasted_is_asked_about_as_it_is(page: Any, text: str, field: str, expected: Any) -> None:
    """And stands in the link, which another page opens."""
    choose(page, "contains", 2)
    paste(page, text)
    key = "region" if field == "segments" else field
    wait_until(page, lambda: request_of(page).get(field if field != "solid" else key) == expected)
    asked, words = request_of(page), verdict(page)
    page.click("#copy-link")
    other = page.context.new_page()
    other.goto(page.evaluate("navigator.clipboard.readText()"))
    assert verdict(other) == words
    assert request_of(other) == asked
    other.close()
    page.click("#centre")


@pytest.mark.some(2)
@pytest.mark.parametrize(
    "text", ["POLYGON ((0 0, 1", "1,2\n3,a", "{", '{"type": "CircularString", "coordinates": [1]}', "x"]
)
def test_what_is_no_geometry_is_refused_by_its_name(page: Any, text: str) -> None:
    choose(page, "contains", 2)
    paste(page, text)
    page.wait_for_selector("#problem:visible")
    assert "what was pasted" in page.inner_text("#problem")
    page.fill("#count", "2.25")
    verdict(page)


@pytest.mark.some(2)
@pytest.mark.parametrize("kind", ["stl", "off", "ply", "glb", "obj"])
def test_files_of_meshes_are_read_as_the_service_reads_them(page: Any, tmp_path: Path, kind: str) -> None:
    trimesh = pytest.importorskip("trimesh", reason="the extra 'formats' is not installed")
    scene = trimesh.Scene()
    box = trimesh.creation.box((1, 2, 3))
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1], [5, 0, 0])
    scene.add_geometry(box, transform=turn if kind == "glb" else None)
    path = tmp_path / f"part.{kind}"
    path.write_bytes(scene.export(file_type="glb") if kind == "glb" else as_bytes(box.export(file_type=kind)))
    choose(page, "contains", 3)
    page.set_input_files("#file", path)
    wait_until(page, lambda: page.input_value("#first") == f"file part.{kind}")
    verdict(page)
    solid = request_of(page)["solid"]
    corners = np.array(solid["vertices"])[np.array(solid["faces"])]
    expected = (scene if kind == "glb" else box).bounds
    assert np.allclose([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))], expected, atol=1e-6)
    assert corners.shape == (12, 3, 3)


def as_bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


@pytest.mark.full
def test_a_link_says_that_it_cannot_hold_what_is_large(page: Any) -> None:
    choose(page, "contains", 2)
    paste(page, "\n".join(f"{x!r} {y!r}" for x, y in np.random.default_rng(1).normal(size=(20_000, 2)).tolist()))
    wait_until(page, lambda: page.inner_text("#count-shown") == "20,000, as brought")
    verdict(page)
    page.click("#copy-link")
    wait_until(page, lambda: "too large for a link" in page.inner_text("#copy-link"))
    assert "own=" not in page.evaluate("navigator.clipboard.readText()")
    page.click("#centre")


@pytest.mark.full
def test_a_solid_is_edited_as_a_text(page: Any) -> None:
    choose(page, "contains", 2)
    page.select_option("#first", "star")
    page.click("#edit summary")
    wait_until(page, lambda: json.loads(page.input_value("#text") or "{}").get("type") == "polygon")
    page.check("#as-wkt")
    assert page.input_value("#text").startswith("POLYGON ((")
    page.fill("#text", "POLYGON ((0 0, 8 0, 0 8, 0 0))")
    page.click("#apply")
    wait_until(page, lambda: request_of(page)["solid"].get("rings") == [[[0, 0], [8, 0], [0, 8]]])
    page.uncheck("#as-wkt")
    page.click("#edit summary")
    page.click("#undo")
    wait_until(page, lambda: page.input_value("#first") == "star")


def test_vertices_are_added_and_deleted_and_it_is_undone(page: Any) -> None:
    choose(page, "contains", 2)
    page.select_option("#first", "star")
    page.click("#centre")
    verdict(page)
    page.wait_for_timeout(500)
    before = request_of(page)["solid"]["rings"][0]
    x, y = middle_of(page, "#view2d")
    box = page.locator("#view2d").bounding_box()
    scale = min(box["width"], box["height"]) / (2.3 * 2.1)

    def at(p: Any) -> tuple[float, float]:
        return x + scale * p[0], y - scale * p[1]

    halfway = np.mean(before[:2], axis=0)
    page.mouse.dblclick(*at(halfway))
    wait_until(page, lambda: len(request_of(page)["solid"]["rings"][0]) == 11)
    assert np.allclose(request_of(page)["solid"]["rings"][0][1], halfway, atol=0.02)
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_timeout(500)
    page.mouse.dblclick(*at(before[4]))
    wait_until(page, lambda: len(request_of(page)["solid"]["rings"][0]) == 10)
    assert before[4] not in request_of(page)["solid"]["rings"][0]
    page.wait_for_timeout(500)
    page.focus("#view2d")
    page.keyboard.press("Control+z")
    wait_until(page, lambda: len(request_of(page)["solid"]["rings"][0]) == 11)
    page.wait_for_timeout(500)
    page.keyboard.press("Control+Shift+z")
    wait_until(page, lambda: len(request_of(page)["solid"]["rings"][0]) == 10)
    page.wait_for_timeout(500)
    for _ in range(2):
        page.click("#undo")
        page.wait_for_timeout(500)
    wait_until(page, lambda: request_of(page)["solid"]["rings"][0] == before)


@pytest.mark.full
def test_the_plane_is_zoomed_and_panned(page: Any) -> None:
    choose(page, "contains", 2)
    page.click("#centre")
    page.check("#snap")
    verdict(page)
    before = colours(page, "#view2d")
    page.mouse.move(*middle_of(page, "#view2d"))
    page.mouse.wheel(0, -1500)
    wait_until(page, lambda: "view=" in page.evaluate("location.hash"))
    assert colours(page, "#view2d") != before
    page.keyboard.down("Shift")
    x, y = middle_of(page, "#view2d")
    page.mouse.down()
    page.mouse.move(x + 40, y, steps=2)
    page.mouse.up()
    page.keyboard.up("Shift")
    page.wait_for_timeout(500)
    middle = [float(v) for v in page.evaluate("new URLSearchParams(location.hash.slice(1)).get('view')").split(",")]
    assert middle[0] < 0
    assert middle[2] > 10
    page.uncheck("#snap")
    page.click("#centre")


def test_a_corner_is_taken_where_its_body_is(page: Any) -> None:
    """In a scene the first body stands twice; each of its corners moves the corner of both."""
    choose(page, "scene", 2)
    page.select_option("#first", "star")
    page.click("#centre")
    verdict(page)
    body = request_of(page)["bodies"][2]
    ring, rotation = np.array(body["solid"]["rings"][0]), np.array(body["pose"]["rotation"])
    place = rotation @ ring[3] + body["pose"]["translation"]
    x, y = middle_of(page, "#view2d")
    box = page.locator("#view2d").bounding_box()
    scale = min(box["width"], box["height"]) / (2.3 * 2.1)
    page.mouse.move(x + scale * place[0], y - scale * place[1])
    page.mouse.down()
    page.mouse.move(x + scale * place[0] + 30, y - scale * place[1], steps=3)
    page.mouse.up()
    verdict(page)
    moved = np.array(request_of(page)["bodies"][2]["solid"]["rings"][0])
    change = rotation @ (moved[3] - ring[3])
    assert np.allclose(change, [30 / scale, 0], atol=0.02)
    assert np.allclose(np.delete(moved, 3, axis=0), np.delete(ring, 3, axis=0))
    page.click("#centre")


def test_a_body_is_turned_by_the_ring_around_it(page: Any) -> None:
    choose(page, "collide", 3)
    for name in ("first", "second"):
        page.select_option(f"#{name}", "cube")
    verdict(page)
    x, y = middle_of(page, "#view3d")
    box = page.locator("#view3d").bounding_box()
    for far in range(60, int(box["width"] / 2), 7):  # to the right of the second body a ring is met
        page.mouse.move(x + far, y)
        if page.evaluate("document.getElementById('view3d').style.cursor") == "move":
            break
    else:
        pytest.fail("no ring is met")
    page.mouse.down()
    page.mouse.move(x + far, y - 40, steps=4)
    page.mouse.up()
    wait_until(page, lambda: page.inner_text("#turn-shown") == "by hand")
    verdict(page)
    rotation = np.array(request_of(page)["poses"][0]["rotation"])
    assert np.abs(rotation - np.eye(3)).max() > 0.05
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    page.fill("#turn", "0")


def test_before_the_first_answer_the_picture_has_the_colour_of_its_stage(page: Any) -> None:
    other = page.context.new_page()
    other.route("**/v1/**", lambda _: None)  # no answer comes
    other.goto(page.evaluate("location.origin") + "/")
    other.wait_for_timeout(500)
    picture = Image.open(io.BytesIO(other.locator("#view3d").screenshot())).convert("RGB")
    stage = re.findall(r"\d+", other.evaluate("getComputedStyle(stage).backgroundColor"))
    assert picture.getpixel((picture.width // 2, picture.height // 2)) == tuple(map(int, stage))
    other.close()


def test_it_turns_until_it_is_taken_in_hand_and_not_for_those_who_want_less_motion(page: Any) -> None:
    turned = {}
    for motion in ("no-preference", "reduce"):
        other = page.context.new_page()
        other.emulate_media(reduced_motion=motion)
        other.goto(page.evaluate("location.origin") + "/")
        verdict(other)
        pictures = []
        for _ in range(2):
            pictures.append(other.locator("#view3d").screenshot())
            other.wait_for_timeout(600)
        turned[motion] = pictures[0] != pictures[1]
        if motion == "no-preference":
            other.mouse.click(*middle_of(other, "#view3d"))
            other.wait_for_timeout(300)
            assert other.locator("#view3d").screenshot() == other.locator("#view3d").screenshot()
            wait_until(other, lambda at=other: at.evaluate("view3d.width === 2 * view3d.clientWidth"))  # smooth at rest
        other.close()
    assert turned == {"no-preference": True, "reduce": False}


def test_axe_finds_no_violation(page: Any) -> None:
    """On every tab in every dimension that it has, light and dark; with the lens and the solid's editor open too."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed").Axe()

    def check() -> None:
        for scheme in ("dark", "light"):
            page.emulate_media(color_scheme=scheme)
            found = axe.run(page).response["violations"]
            assert [(rule["id"], [node["html"] for node in rule["nodes"]]) for rule in found] == [], scheme

    tabs = page.locator("[name=question]").evaluate_all("tabs => tabs.map(tab => tab.value)")
    assert len(tabs) == 10
    for question, dimension in itertools.product(tabs, (3, 2)):
        choose(page, question, dimension)
        if page.is_checked(f"[name=dimension][value='{dimension}']"):
            check()
    choose(page, "proof", 3)
    page.click("#edit summary")
    page.click("#to-lens")
    verdict(page)
    check()
    page.click("#from-lens")
    page.click("#edit summary")


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
    assert "mesh.glb cannot be drawn: it does not begin as a GLB file" in page.inner_text("#problem")
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
