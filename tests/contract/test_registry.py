"""A solid that only has a row is answered or refused by name, everywhere: nothing asserts, no key is missing."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import engine
from engine.solids import registry

ROOT = Path(__file__).resolve().parents[2]
LOCATED = ("locate", "contains", "csg", "locate_scene", "Scene.locate", "binary contains")
"""What is answered where a row says nothing but how a point is located exactly."""


@pytest.fixture(scope="module")
def answers() -> list[dict[str, str]]:
    """What came of every question about two solids that only this test knows; another process, for the table of
    solids is one a process."""
    arguments = [sys.executable, "-m", "tests.contract.own_solids"]
    run = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert run.returncode == 0, run.stderr[-2000:]
    return [json.loads(line) for line in run.stdout.splitlines()]


def test_every_question_is_answered_or_refused_by_name(answers: list[dict[str, str]]) -> None:
    assert len(answers) > 1000
    for answer in answers:
        question, kind, told = answer["question"], answer["kind"], answer["told"]
        if kind in ("UnsupportedSolidError", "UnsupportedPairError", "422"):
            assert any(name in told for name in registry.solid_types) or "diamond" in told or "fog" in told, answer
        elif kind == "404":
            assert "binary" in question, answer
            assert question.startswith("fog"), answer  # it was not stored
        else:
            assert kind in ("answer", "200", "201"), answer


def test_the_least_row_locates_points(answers: list[dict[str, str]]) -> None:
    """(0.25, 0.25) and the third are in the diamond, (9, 9) is not; what the partner refuses does not count."""
    asked = 0
    for answer in answers:
        name = " ".join(answer["question"].split()[2:])
        if answer["question"].startswith("diamond") and name.startswith(LOCATED) and "surface" not in name:
            assert answer["kind"] in ("answer", "200"), answer
            asked += 1
            if name in ("locate", "contains"):
                assert any(right in answer["told"] for right in ("[ 1 -1]", "[ True False]", "[true,false]"))
    assert asked > 50


def test_both_are_in_the_description(answers: list[dict[str, str]]) -> None:
    (described,) = (answer["told"] for answer in answers if answer["question"] == "openapi")
    assert {"DiamondSolid", "FogSolid", "SphereSolid"} <= {*described.split()}


def test_a_type_has_one_row() -> None:
    with pytest.raises(ValueError, match="a row for sphere already"):
        registry.register(registry.Row(solid=engine.Sphere, about=""))


def test_a_mesh_is_a_mesh() -> None:
    class Sponge(engine.Solid):
        __slots__ = ()
        type = "sponge"

    with pytest.raises(ValueError, match="must be a Mesh"):
        registry.register(registry.Row(solid=Sponge, about="", meets={3: "mesh"}))


def test_a_class_of_the_caller_has_the_row_that_it_inherits() -> None:
    class Room(engine.Aabb):
        __slots__ = ("number",)

    room, box = Room([0, 0], [2, 1]), engine.Aabb([0, 0], [2, 1])
    points, segments = [[1, 0.5], [2, 1], [3, 3]], [[[-1.0, 0.5], [5.0, 0.5]]]
    assert engine.locate(points, room).tolist() == engine.locate(points, box).tolist() == [1, 0, -1]
    assert engine.bounds(room).aabb.max.tolist() == [2, 1]
    assert engine.clip_segments(segments, room).end.tolist() == [[2.0, 0.5]]
    assert engine.collide(room, box).relation is engine.collide(box, box).relation
    assert engine.locate_scene(points, [room, box]).offsets.tolist() == [0, 2, 4, 4]


def test_every_public_solid_has_a_row() -> None:
    named = {value for value in vars(engine).values() if isinstance(value, type) and issubclass(value, engine.Solid)}
    assert {row.solid for row in engine.solid_types.values()} == named - {engine.Solid}
