"""The table of codes covers the engine's tree of errors and nothing else; pointers are escaped."""

from __future__ import annotations

import json

import httpx
import pytest

import engine
from service.errors import ENGINE_STATUS, STATUS, ServiceError, faults_of, pointer, problem
from tests.unit.service.asking import SPHERE, check_problem


def tree(kind: type[engine.EngineError]) -> set[type[engine.EngineError]]:
    return {kind}.union(*(tree(child) for child in kind.__subclasses__()))


def test_table_has_a_row_for_every_engine_error_and_no_other() -> None:
    own = {kind for kind in tree(engine.EngineError) if kind.__module__.startswith("engine.")}
    assert set(ENGINE_STATUS) == {kind.code for kind in own}


@pytest.mark.parametrize("kind", sorted(tree(engine.EngineError), key=lambda kind: kind.__name__))
def test_every_engine_error_becomes_a_problem_with_its_code(kind: type[engine.EngineError]) -> None:
    answer = problem(faults_of(kind("because", ("solid", "faces", 3))))
    body = json.loads(answer.body)
    assert (body["code"], body["detail"], body["status"]) == (kind.code, "because", answer.status_code)
    assert body["errors"] == [{"pointer": "/solid/faces/3", "detail": "because"}]
    assert 400 <= answer.status_code < 600
    assert answer.status_code != 500


def test_pointer_is_escaped() -> None:
    assert pointer(()) == ""
    assert pointer(("a/b", "~", 0, "")) == "/a~1b/~0/0/"


def test_only_internal_is_500() -> None:
    assert [code for code, status in STATUS.items() if status == 500] == ["internal"]
    assert faults_of(ZeroDivisionError())[0].code == "internal"
    assert faults_of(MemoryError())[0].code == "out_of_memory"


def test_a_message_with_half_a_surrogate_pair_is_still_sent() -> None:
    assert (
        json.loads(problem([*faults_of(ServiceError("invalid_request", "\ud800", ("\ud800",)))]).body)["detail"] == "?"
    )


@pytest.mark.anyio
async def test_thousands_of_unknown_fields_are_one_fault(client: httpx.AsyncClient) -> None:
    """An error was made of each, 60 MB of them held up everybody for 3.8 s and took 2 GB."""
    for body in (
        {"solid": SPHERE, "points": [], **{str(k): 0 for k in range(4000)}},
        {"solid": {**SPHERE, **{str(k): 0 for k in range(4000)}}, "points": []},
    ):
        problem = check_problem(await client.post("/v1/contains", json=body), 422, "unknown_field")
        assert len(problem["errors"]) == 1
        assert "400" in problem["detail"]
    few = {"solid": SPHERE, "points": [], **{str(k): 0 for k in range(30)}}
    assert len(check_problem(await client.post("/v1/contains", json=few), 422, "unknown_field")["errors"]) == 20
    more = {"solid": SPHERE, "points": [], **{str(k): 0 for k in range(5000)}}
    assert "names" in check_problem(await client.post("/v1/contains", json=more), 400, "not_json")["detail"]
