"""Lists whose longest length is a setting: what is wrong is named where it stands, and not looked for without end."""

from __future__ import annotations

from typing import Annotated

import pytest
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from service.errors import faults_of_validation
from service.schemas.base import AtMost

ITEMS = TypeAdapter(Annotated[list[int], AtMost("max_poses", low=0)])


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


def test_a_list_is_checked_as_a_whole() -> None:
    assert ITEMS.validate_python([*range(1000)]) == [*range(1000)]
    assert ITEMS.validate_python([]) == []
    with pytest.raises(ValidationError) as caught:
        ITEMS.validate_python([0] * 999 + ["a"])
    assert [item["loc"] for item in caught.value.errors()] == [(999,)]
    with pytest.raises(ValidationError, match="valid list"):
        ITEMS.validate_python(1)


def test_few_of_many_wrong_items_are_listed() -> None:
    with pytest.raises(ValidationError) as caught:
        ITEMS.validate_python(["a"] * 100_000)
    assert 20 <= caught.value.error_count() <= 256


def test_too_many_wrong_fields_are_counted_alone() -> None:
    document = {f"a{i}": 1 for i in range(100_000)}
    with pytest.raises(ValidationError) as caught:
        Strict.model_validate(document)
    (fault,) = faults_of_validation(caught.value, document)
    assert (fault.path, fault.code) == ((), "invalid_request")
    assert "100000 things are wrong" in fault.detail
