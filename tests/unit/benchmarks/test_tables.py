"""The smallest row of a table runs, and the parts of the tables are right. Nothing here is timed."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks import contenders, contest, errors, machine, measure, table, workloads
from benchmarks.contenders import Prepared, in_threads
from benchmarks.contest import Contender, Contest, Row, Size, contender, run_contest
from benchmarks.fields import Figure, tasks


def test_exact_answers_of_each_subject() -> None:
    mesh = workloads.bumpy_sphere("bumpy", 0, 1)
    points = np.array([np.zeros(3), mesh.vertices[3], mesh.vertices[3] * 1.01])
    assert errors.locations(points, mesh).tolist() == [True, True, False]
    square = workloads.Rings("square", [np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])])
    assert errors.locations(np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]]), square).tolist() == [True, True, False]
    assert errors.locations(np.array([[1.0, 0.5, 0.0], [1.1, 0, 0]]), workloads.convex_of(6, 0)).tolist() == [
        True,
        False,
    ]


def test_answers_that_differ_are_settled() -> None:
    square = workloads.Rings("square", [np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])])
    points = np.array([[1.0, 1.0], [3.0, 1.0], [1.0, 0.5]])
    asked = {"ours": [True, False, True], "peer": [True, True, False]}
    contenders = [Contender(name, lambda said=said: Prepared(lambda _: np.array(said))) for name, said in asked.items()]
    exact = partial(lambda rows: errors.locations(points[rows], square))
    ours, peer = run_contest(Contest("o", "c", False, points, exact, errors.same, contenders), 2, 0.01)
    assert (ours.errors["differ"], ours.errors["wrong"], peer.errors["wrong"]) == (2, 0, 2)


@pytest.mark.full
def test_a_contender_is_one_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It takes part by being there and named; a package that is not installed is reported, not raised."""
    for name, line in (("mine", ""), ("absent", "import a_package_of_nobody\n")):
        text = f"{line}from benchmarks.contenders import Prepared\n"
        text += f'PACKAGE = "nobodys"\nNAMES = {{"points": "my {name}"}}\n'
        text += 'MAKERS = {"points": lambda subject, threads: Prepared(lambda points: points[:, 0] < 0)}\n'
        (tmp_path / f"with_{name}.py").write_text(text)
    monkeypatch.setattr(contenders, "__path__", [*contenders.__path__, str(tmp_path)])
    for name in ("mine", "absent"):
        given = table.options(["--contest", "triangle 2D, boundary", "--contender", name, "--quick"], "")
        given.seconds, chosen = 0.01, tasks(given.size, ("containment",))
        rows = table.measured("containment", chosen, given)["rows"]
        assert [row["contender"] for row in rows] == ["ours", f"my {name}"]
        assert rows[1]["absent"] == ("ModuleNotFoundError: No module named 'a_package_of_nobody'" * (name == "absent"))
    assert "my mine" in capsys.readouterr().out
    contest.NAMED.clear()


def test_a_median_has_quartiles() -> None:
    assert measure.spread([3.0, 1.0, 2.0]) == measure.Spread(2.0, 1.5, 2.5)
    assert measure.spread([1.0, 2.0]) == measure.Spread(1.5, 1.0, 2.0)


@pytest.mark.parametrize(("unit", "value", "said"), [("x", 3.0, "MISS"), ("x", 5.0, "must"), ("s", 1.0, "aim")])
def test_verdicts(unit: str, value: float, said: str) -> None:
    figure = Figure("row", unit, [value], *((4.0, 8.0) if unit == "x" else (4.0, 2.0)))
    assert said in next(iter(table.lines_of(figure)))


def test_a_ratio_is_net_of_calls_and_for_the_same_items() -> None:
    ours = Row("o", "c", False, "ours", n_items=10, seconds=[1.0, 1.0], cpu=[1.0, 1.0])
    peer = Row("o", "c", False, "peer", n_items=5, seconds=[2.0, 2.0], cpu=[1.0, 1.0], call_overhead=0.1)
    found, cpu = table.ratio(ours, peer)
    assert (found.median, cpu) == (3.0, 2.0)


def test_parts_cover_all_items() -> None:
    assert in_threads(lambda part: part, 7000, 3) == [slice(0, 2333), slice(2333, 4666), slice(4666, 7000)]


def test_a_missing_peer_says_why() -> None:
    missing = contender("peer", "no_such_peer", "points", None)
    row = run_contest(Contest("o", "c", False, np.arange(3), None, errors.same, [missing]), 1, 0.01)[0]
    assert row.absent.startswith("ModuleNotFoundError")


def test_facts_name_what_figures_depend_on() -> None:
    facts = machine.facts(3, 2)
    assert facts["seed"] == 3
    assert facts["versions"]["numpy"] == np.__version__
    json.dumps(facts)


def test_every_row_has_its_own_name() -> None:
    for scale in (0.05, 1.0):
        names = [task.name for task in tasks(Size(0, scale))]
        assert len(names) == len(set(names))


@pytest.mark.full
def test_a_row_runs(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--quick", "--dry", "--rounds", "2", "--seconds", "0.01", "--only"]
    assert table.main([*words, "sphere 3D"], "segments") == 0
    printed = capsys.readouterr().out
    ours = next(
        line for line in printed.splitlines() if line.startswith("clipping segments, sphere 3D") and " ours " in line
    )
    assert "judged" in ours
    assert "wrong" not in ours
    assert "off" not in ours


@pytest.mark.full
def test_quick_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert table.main(["--quick", "--only", "polygon of 10", "--rounds", "3", "--seconds", "1"], "containment") == 0
    assert "shapely, prepared" in capsys.readouterr().out


def test_0_of_n_says_what_it_says() -> None:
    assert measure.interval(0, 134)[0] == 0.0
    assert measure.interval(0, 134)[1] == pytest.approx(0.0279, abs=1e-4)
    assert measure.interval(134, 134)[1] == 1.0
    low, high = measure.interval(5, 10)
    assert low == pytest.approx(0.2366, abs=1e-4)
    assert high == pytest.approx(1 - low)


@pytest.mark.full
def test_all_are_judged_on_all_items_and_the_worst_is_kept() -> None:
    items = np.arange(100)
    asked = {"ours": lambda rows: rows % 2 == 0, "peer": lambda rows: np.where(rows < 60, rows % 2 == 0, rows == 99)}
    contenders = [Contender(name, lambda ask=ask: Prepared(ask)) for name, ask in asked.items()]
    request = "/v1/x", {"item": 60}
    contest_ = Contest("o", "c", True, items, items % 2 == 0, errors.same, contenders, request=lambda _: request)
    ours, peer = run_contest(contest_, 1, 0.01, has_latency=True)
    assert (ours.errors["judged"], peer.errors["judged"], peer.errors["wrong"]) == (100, 100, 21)
    assert (peer.worst["item"], peer.worst["exact"], peer.worst["request"]) == (60, True, request)
    assert ours.worst == {}
    assert set(ours.latency) == {"1", "10", "100"}
