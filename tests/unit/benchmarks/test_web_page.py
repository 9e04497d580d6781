"""The page of speed against error: its sentences, and in Chromium from a file: no other host, mouse and keyboard."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from benchmarks import web_page
from tests.programs import chromium

REQUEST = ("/v1/contains", {"solid": {"type": "polygon", "rings": [[[0, 0], [4, 0], [0, 4]]]}, "points": [[2, 2]]})
WORST = {"item": 7, "answer": 0, "exact": 1, "request": REQUEST}
DOCS = Path(__file__).resolve().parents[3] / "docs"
SCRIPT = "</script><b>not markup</b>"


def row(contest: str, contender: str, rate: float, wrong: int, **more: Any) -> dict[str, Any]:
    errors = {"judged": 200, "wrong": wrong, "refused": 0, "outside": 3 * (contender == "picky")}
    known = {"operation": "containment 2D", "contest": contest, "is_hard": contest == "boundary", "about": SCRIPT}
    known |= {"contender": contender, "package": "" if contender == "ours" else contender, "absent": "", "rate": rate}
    latency = {"1": [1e-6, 2e-6, 3e-5, 200]}
    known |= {"build": 0.1, "first": 0.2, "latency": latency, "worst": WORST if wrong else {}, "seconds": [1.0]}
    return known | {"errors": errors, "setting": None} | more


ROWS = [
    *(row("uniform", name, rate, 0) for name, rate in (("ours", 2e6), ("peer", 1e6), ("picky", 1e5))),
    *(
        row("boundary", name, rate, wrong)
        for name, rate, wrong in (("ours", 1e6, 0), ("peer", 3e6, 50), ("picky", 1e5, 0))
    ),
    row("boundary", "peer", 2e6, 9, setting=7.0),
]
FOUND: dict[str, Any] = dict.fromkeys(web_page.FACTS, 0) | {"versions": {"numpy": "2"}, "quick": False, "rows": ROWS}


def test_a_question_is_said_in_words() -> None:
    (asked,) = web_page.questions(ROWS)
    assert asked["sides"]["easy"] == {"ratio": 2.0, "name": "peer", "fails": 0, "seconds": [5e-7, 1e-6]}
    assert asked["sides"]["hard"] == {"ratio": 1 / 3, "name": "peer", "fails": 0.25, "seconds": [1e-6, 1 / 3e6]}
    assert list(map(web_page.faults, asked["seen"])) == ["peer 25%", "picky 1.5% unsupported"]
    assert "Easy input: 2x faster than peer." in asked["say"]
    assert "3x slower than peer, wrong in 25% (20% to 31%); picky never wrong, but silent at times." in asked["say"]
    wrong = [row("boundary", "ours", 1.0, 3), row("boundary", "peer", 1.0, 0)]
    assert "EXACT-GEOMETRY IS WRONG in 3 of 200" in web_page.questions(wrong)[0]["say"]


def test_an_audit_names_who_is_wrong() -> None:
    asked = (("a.stl", "containment 2D", "", "boundary"),)
    rows = [each | {"near": 1e-15, "about": "your points"} for each in ROWS]
    assert web_page.questions(rows, asked)[0]["say"] == (
        "exact-geometry: 0 wrong of 200 points, half of them almost on the boundary. peer: 3 times as fast, 25% wrong."
    )
    rows += [row("boundary", "right", 5e5, 0), row("boundary", "close", 3.1e6, 0)]
    said = web_page.questions(rows, asked)[0]["say"]
    assert said.endswith("close: 3.1 times as fast, never wrong here.")
    rows[-1] |= {"rate": 1.04e6}
    said = web_page.questions(rows, asked)[0]["say"]
    assert said.endswith("peer: 3 times as fast, 25% wrong. close: about as fast, never wrong here.")
    rows[-1] |= {"rate": 2e5, "package": ""}
    said = web_page.questions(rows, asked)[0]["say"]
    assert said.endswith("right: 2 times slower, never wrong here.")


def test_what_stands_beside_speed_is_said_with_the_best_first() -> None:
    figures = [{"name": "memory", "unit": "MB", "note": "how", "raw": {"rows": {"a": 20.0, "b": 3.25}}},
               {"name": "16 cores", "unit": "x", "note": "", "raw": {"rows": {"a": 2.0, "b": 9.0}}},
               {"name": "no contest", "unit": "s", "note": "", "raw": {}}]  # fmt: skip
    expected = [("memory", "b 3.2 MB; a 20 MB", "how"), ("16 cores", "b 9 x; a 2 x", "")]
    assert web_page.costs({"figures": figures, "rows": []}) == expected
    rows = [row("uniform", name, rate, wrong) for name, rate, wrong in (("ours", 2.0, 0), (web_page.CPP, 9.0, 2))]
    assert web_page.costs({"rows": rows})[0][1] == "uniform: 4.5x as fast, 1% wrong"


def test_the_first_words_count_ours_then_who_is_faster() -> None:
    ours, easy, hard = web_page.summary(web_page.questions(ROWS), ROWS)
    assert ours[:2] == ("0 of 400", "good")
    assert easy[0] == "1 of 1"
    assert hard[0] == "0 of 1"
    assert hard[2].endswith("1 of the 1 peers that are faster give wrong or no answers")
    assert web_page.summary([], [row("boundary", "ours", 1.0, 3)])[0][:2] == ("3 of 200", "bad")


def test_numbers_on_the_page_name_their_line_of_results() -> None:
    text = web_page.text_of(FOUND, "results/report.json")
    start = text.index('type="application/json">') + len('type="application/json">')
    data = json.loads(text[start : text.index("</script>", start)])
    for contest in data["contests"].values():
        for shown in contest["rows"]:
            assert (shown["rate"], shown["wrong"]) == (ROWS[shown["i"]]["rate"], ROWS[shown["i"]]["errors"]["wrong"])
    assert data["summary"][0][0] == "0 of 400"


@pytest.fixture(scope="module")
def browser() -> Any:
    api = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    with api.sync_playwright() as driver:
        made = driver.chromium.launch(executable_path=chromium(), args=["--no-sandbox", "--disable-gpu"])
        yield made
        made.close()


@pytest.mark.parametrize(("width", "scheme"), [(1200, "light"), (390, "dark")])
def test_in_a_browser(browser: Any, tmp_path: Path, width: int, scheme: str) -> None:
    file = tmp_path / "page.html"
    file.write_text(web_page.text_of(FOUND, "results/report.json"))
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    troubles: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda asked: troubles.append(asked.url) if not asked.url.startswith("file:") else None)
    page.goto(file.as_uri())
    button = page.locator("#questions button")
    assert button.inner_text().split("\n")[0] == "Points in a polygon"
    assert "peer 25%" in button.inner_text()
    assert button.get_attribute("aria-expanded") == "true"  # the only question is open
    assert page.locator("g.mark").count() == 3  # a setting that easy rows have not cannot be mixed
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("b", has_text="not markup").count() == 0
    assert "wrong in 25% of its answers" in page.locator("#pays").inner_text()
    page.locator("#share").focus()
    page.keyboard.press("Home")
    assert "with no wrong answer seen" in page.locator("#pays").inner_text()
    page.keyboard.press("End")
    page.locator("g.mark", has_text="peer").first.focus()
    page.keyboard.press("Enter")
    shown = page.locator("#detail").inner_text()
    assert "Item 7" in shown
    assert "curl -s http://127.0.0.1:8000/v1/contains" in shown
    assert "results/report.json, rows[4]" in shown
    link = page.get_by_role("link", name="Open in the playground").get_attribute("href")
    assert json.loads(unquote(link.removeprefix("http://127.0.0.1:8000/#request="))) == list(REQUEST)
    assert page.locator("#detail svg circle").count() == 1
    button.click()
    assert page.locator("#panel").is_hidden()
    assert troubles == []


def test_a_phone_shows_on_its_first_screen_what_costs_what_and_who_is_wrong(browser: Any) -> None:
    """Of 390 x 844 a browser leaves 664: the first eleven questions, their speed and the share of a peer's errors."""
    page = browser.new_page(viewport={"width": 390, "height": 664}, color_scheme="light")
    page.goto((DOCS / "speed_and_error.html").as_uri())
    buttons = page.locator("#questions ol").first.locator("button").all()
    assert len(buttons) >= 11
    for button in buttons[:11]:
        box, (title, *said) = button.bounding_box(), button.inner_text().split("\n")
        assert box["y"] + box["height"] <= 664, title
        assert box["height"] >= 24, title  # that a finger hits
        assert re.search(r"(faster|slower|same)", " ".join(said)), (title, said)
        assert re.search(r" [\d.]+%| 0", said[-1]), (title, said)
        first = button.locator(".who span").first.bounding_box()  # the fastest peer, in full
        assert first["x"] + first["width"] <= box["x"] + box["width"], title
    assert all(fact.bounding_box()["y"] < 130 for fact in page.locator("#facts div").all())
    buttons[0].click()
    assert page.locator("#questions button .who").first.evaluate(
        "e => e.scrollWidth <= e.clientWidth"
    )  # all, once open


SHOWN = """kept => kept.map(request => { const made = document.createElement("div"); made.innerHTML = asking(request);
    return made.querySelector("pre").textContent; })"""


@pytest.mark.parametrize("name", ["speed_and_error", "museum"])
def test_every_command_shown_asks_what_the_page_holds(browser: Any, name: str) -> None:
    """The same requests are sent to a service in tests/contract/test_pages_answered.py."""
    page = browser.new_page()
    page.goto((DOCS / f"{name}.html").as_uri())
    rows = "Object.values(data.contests).flatMap(one => one.rows).map(row => row.worst.request)"
    kept = page.evaluate(f"data.cases ? data.cases.map(one => one.request) : {rows}.filter(one => one && one[1])")
    assert len(kept) >= 40
    for command, (path, body) in zip(page.evaluate(SHOWN, kept), kept, strict=True):
        words = shlex.split(command)
        assert words[:-1] == [
            "curl",
            "-s",
            f"http://127.0.0.1:8000{path}",
            "-H",
            "content-type: application/json",
            "-d",
        ]
        assert json.loads(words[-1]) == body


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["speed_and_error", "museum"])
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_the_pages_as_committed(browser: Any, name: str, width: int, scheme: str) -> None:
    """No other host, nothing beside the screen, every label of every chart beside the others."""
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    troubles: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda asked: troubles.append(asked.url) if not asked.url.startswith("file:") else None)
    page.goto((DOCS / f"{name}.html").as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for button in page.locator("#questions button").all():
        button.click()
        boxes = [label.bounding_box() for label in page.locator("#chart g.mark > text").all()]
        for i, a in enumerate(boxes):
            for b in boxes[:i]:
                apart = max(a["x"] - b["x"] - b["width"], b["x"] - a["x"] - a["width"],
                            a["y"] - b["y"] - b["height"], b["y"] - a["y"] - a["height"])  # fmt: skip
                assert apart > -4, (button.inner_text(), a, b)  # letters reach less far than their boxes
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    if name == "museum":
        n_failed = page.locator("article").count()
        assert page.locator("nav").bounding_box()["height"] < 60 or width > 600  # one row, that scrolls sideways
        cases = page.evaluate("data.cases.map(one => one.today)")
        wrong = sum(any(name != "textbook" and said == "wrong" for name, said, *_ in today) for today in cases)
        assert f"today, {wrong} of them by a library" in page.inner_text("#head")
        page.locator("nav button", has_text="all").first.click()
        assert page.locator("article").count() >= 120 > n_failed > 0
        assert page.locator("article svg").count() == page.locator("article").count()
        house = page.locator("article", has_text="opencitymodel#11 points").locator("svg")  # in degrees and metres
        box = house.evaluate("svg => { const {width, height} = svg.getBBox(); return [width, height]; }")
        assert min(box) > 150
        assert "axes stretched: 0.000084 by 0.00018 by 9.0" in house.text_content()
    assert troubles == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["speed_and_error", "museum", "audit"])
def test_axe_finds_no_violation(browser: Any, tmp_path: Path, name: str, scheme: str) -> None:
    """The report with a question and a contender open, the museum with a request open, the page of an audit."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
    page = browser.new_page(viewport={"width": 1280, "height": 800}, color_scheme=scheme)
    file = DOCS / f"{name}.html"
    if name == "audit":
        file = tmp_path / "audit.html"
        file.write_text(web_page.text_of(FOUND, "this page", (("a.stl", "containment 2D", "", "boundary"),)))
    page.goto(file.as_uri())
    if name == "museum":
        page.locator("article summary").first.click()
    else:
        if page.locator("#panel").is_hidden():
            page.locator("#questions button").first.click()
        page.locator("g.mark").last.press("Enter")
        assert page.locator("#detail").is_visible()
    found = axe.Axe().run(page).response["violations"]
    assert [(rule["id"], [node["html"] for node in rule["nodes"]]) for rule in found] == []
    page.close()
