"""The exception tree is what its docstring draws, codes are unique, errors survive pickling."""

from __future__ import annotations

import pickle
import re

import pytest

from engine import errors

CLASSES = [value for value in vars(errors).values() if isinstance(value, type) and issubclass(value, Exception)]
LEAVES = [cls for cls in CLASSES if cls not in (errors.EngineError, errors.InvalidInputError)]


def test_the_docstring_lists_every_error_with_its_code() -> None:
    drawn = dict(re.findall(r"(\w+Error) +([a-z_]+)", errors.__doc__ or ""))
    assert drawn == {cls.__name__: cls.code for cls in LEAVES}


def test_codes_are_unique() -> None:
    codes = [cls.code for cls in CLASSES]
    assert len(set(codes)) == len(codes)


@pytest.mark.parametrize("cls", CLASSES)
def test_errors_survive_pickling(cls: type[errors.EngineError]) -> None:
    error = pickle.loads(pickle.dumps(cls("what broke", ("faces", 3))))
    assert (type(error), error.message, error.where) == (cls, "what broke", ("faces", 3))


def test_the_caller_can_put_the_outer_name_before_the_path() -> None:
    assert errors.NotClosedError("open", ("faces", 3)).at("solid").where == ("solid", "faces", 3)
