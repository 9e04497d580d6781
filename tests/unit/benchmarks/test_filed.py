"""The judge of the filed cases takes the exact answers, and not others; the museum says what a contender answers."""

from __future__ import annotations

import json
import multiprocessing
import re
from pathlib import Path

import pytest

from benchmarks import contenders, filed
from benchmarks.filed import museum

CASES = {case["id"]: case for case in filed.load()}


def test_every_kind_of_question_has_a_peer() -> None:
    asked = {kind for peer in filed.PEERS for kind in peer.calls}
    assert {filed.kind_of(case) for case in CASES.values()} <= asked


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("shapely/shapely#1189", [True], [False]),
        ("mikedh/trimesh#1860 equal", True, False),
        ("w8r/martinez#6 rectangles", 96.0 * 48, 96.0 * 47),
        ("AngusJohnson/Clipper2#821", 0.1 * 0.1, 0.0),
        ("mikedh/trimesh#1766", [(0, 0.5), (0, 0.5 + 2.0**-30)], [(0, 0.5), (0, 0.75)]),
        ("dimforge/parry#76", [0.1714783], [2.8686]),
        ("mikedh/trimesh#1698 cut", 6.0 + 2.0**-20, float("nan")),
        ("mikedh/trimesh#1698 section", [0.25, 0.25], [0.0, 0.25]),
        ("opencitymodel/opencitymodel#11 volume", 6.0493251e-08, 6.0495e-08),
        ("io7m-com/jspatial#7", [(0, (96.0, 32.0), (32.0, 32.0)), (0, (32.0, 32.0), (32.0, 32.0))], []),
    ],
)
def test_the_judge(name: str, right: object, wrong: object) -> None:
    assert filed.is_right(CASES[name], right)
    assert not filed.is_right(CASES[name], wrong)


def test_contenders_that_die_or_hang_are_told_apart() -> None:
    here, there = multiprocessing.Pipe()
    assert filed._ask(here, {}, 0.01) == ("no answer in time", "0.01 s", [])
    there.close()
    assert filed._ask(here, {}, 0.01) == ("crashed", "", [])


def test_the_section_counts_what_fails() -> None:
    rows = [
        {"case": name, "kind": "", "contender": contender, "version": "", "outcome": outcome, "note": ""}
        for name in CASES
        for contender, outcome in (("ours", "right"), ("other", "crashed" if name.endswith("#1189") else "right"))
    ]
    rows.append({"case": "", "kind": "", "contender": "third", "version": "", "outcome": "absent", "note": "no module"})
    text = filed.section(rows)
    assert f"| ours |  | {len(CASES)} | {len(CASES)} | 0 | 0 | 0 | 0 |" in text
    assert f"All contenders pass {len(CASES) - 1} of the cases today." in text
    assert "not installed: no module" in text


@pytest.mark.parametrize(
    ("name", "answer", "said", "is_rule"),
    [
        ("shapely/shapely#1189", [False], "outside, where exact is on the boundary", True),
        ("matplotlib/matplotlib#2708", [True] * 6, "3 of 6 points, the first inside, where exact is outside", False),
        ("mikedh/trimesh#1860 equal", False, "no common point", True),
        ("AngusJohnson/Clipper2#821", [0.25], "area 0.25", False),
        ("AngusJohnson/Clipper2#75", [], "0 pieces", True),
        ("evil-mad/plotink#40", [], "0 pieces", False),
        ("libgdx/libgdx#3122", [], "0 places hit, exactly 1", True),
        ("RenderKit/embree#416", [(0, 0.5)], "1 place of line 1 hit, exactly 2", False),
        ("mikedh/trimesh#1698 cut", float("nan"), "not closed", False),
        ("mikedh/trimesh#1698 section", [0.0, 0.25], "0.0, 0.25", False),
        ("RiSearcher/GeometRi.CSharp#26", [1211.5], "1211.5", False),
    ],
)
def test_the_museum_says_what_a_contender_answers(name: str, answer: object, said: str, is_rule: bool) -> None:
    words, where = museum.said(CASES[name], answer)
    assert words == said
    assert museum.is_on_boundary(CASES[name], where) == is_rule


def test_every_case_is_a_request() -> None:
    """What the museum shows is the service's: a path that it has, with the fields that it takes."""
    document = json.loads((Path(__file__).parents[2] / "contract" / "openapi.json").read_text("utf-8"))
    for case in CASES.values():
        path, body = museum.request(case)
        named = document["paths"][path]["post"]["requestBody"]["content"]["application/json"]["schema"]["$ref"]
        assert set(body) <= set(document["components"]["schemas"][named.rpartition("/")[2]]["properties"])
        assert museum.exact_words(case)


def test_what_a_peer_raised_names_no_path_of_a_machine() -> None:
    """A library says where it was built; that stood in a stored result and on a page."""
    error = RuntimeError("\x1b[1;31m[Open3D Error] (f() const) /somebody/Open3D/cpp/Mesh.cpp:12: a 1/2 of it.\nmore")
    assert contenders.said_by(error) == "RuntimeError: [Open3D Error] (f() const) Mesh.cpp:12: a 1/2 of it."
    root = Path(contenders.__file__).parents[2]
    for page in (*root.glob("benchmarks/results/*/*.json"), *root.glob("docs/*.html")):
        assert re.findall(r"(?<![\w.:/])/(?:root|home|work|tmp)/\S+", page.read_text("utf-8")) == [], page
