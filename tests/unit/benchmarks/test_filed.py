"""The judge of the filed cases takes the exact answers, and not others; the section names what fails."""

from __future__ import annotations

import multiprocessing

import pytest

from benchmarks import filed

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
        ("io7m-com/jspatial#7", [(0, (96.0, 32.0), (32.0, 32.0)), (0, (32.0, 32.0), (32.0, 32.0))], []),
    ],
)
def test_the_judge(name: str, right: object, wrong: object) -> None:
    assert filed.is_right(CASES[name], right)
    assert not filed.is_right(CASES[name], wrong)


def test_contenders_that_die_or_hang_are_told_apart() -> None:
    here, there = multiprocessing.Pipe()
    assert filed._ask(here, {}, 0.01) == ("no answer in time", "0.01 s")
    there.close()
    assert filed._ask(here, {}, 0.01) == ("crashed", "")


def test_the_section_names_what_fails() -> None:
    rows = [
        {"case": name, "kind": "", "contender": contender, "version": "", "outcome": outcome, "note": ""}
        for name in CASES
        for contender, outcome in (("ours", "right"), ("other", "crashed" if name.endswith("#1189") else "right"))
    ]
    rows.append({"case": "", "kind": "", "contender": "third", "version": "", "outcome": "absent", "note": "no module"})
    text = filed.section(rows)
    assert f"| ours |  | {len(CASES)} | {len(CASES)} | 0 | 0 | 0 | 0 |" in text
    assert "| a point exactly on an edge was expected to be contained | other (crashed) |" in text
    assert "not installed: no module" in text
