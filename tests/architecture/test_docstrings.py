"""Public docstrings have the sections of numpydoc, and name what they describe."""

from __future__ import annotations

import dataclasses
import enum
import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest

import engine
from engine import layers

SECTIONS = ("Parameters", "Returns", "Raises", "Notes", "References", "Examples")
CALLS = ("warm", "release", "default_workers")
"""They answer no question of geometry: nothing to raise, nothing to cite."""
PUBLIC = {
    name: getattr(engine, name) for name in engine.__all__ if name not in ("layers", "solid_types", "__version__")
}
PUBLIC |= {f"layers.{name}": getattr(layers, name) for name in layers.__all__}
FUNCTIONS = {name: item for name, item in PUBLIC.items() if inspect.isfunction(item)}
CLASSES = {
    name: item
    for name, item in PUBLIC.items()
    if inspect.isclass(item) and not issubclass(item, (Exception, enum.Enum))
}


def sections_of(item: Any) -> dict[str, str]:
    """Return the sections of a docstring by their titles; the text before the first is ""."""
    parts = re.split(r"^(\w[\w ]*)\n-{3,}\n", inspect.getdoc(item) or "", flags=re.MULTILINE)
    return dict(zip(["", *parts[1::2]], parts[::2], strict=True))


def named_in(section: str) -> set[str]:
    """Return the names that a section of parameters or attributes describes."""
    heads = [line.partition(" : ")[0] for line in section.splitlines() if line and not line.startswith(" ")]
    return {name.strip("* ") for head in heads for name in head.split(",")}


def parameters_of(function: Any) -> set[str]:
    return {name for name in inspect.signature(function).parameters if name not in ("self", "cls")}


def methods_of(kind: type) -> Iterator[tuple[str, Any]]:
    for name, value in vars(kind).items():
        function = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
        if not name.startswith("_") and inspect.isfunction(function) and not is_internal(function):
            yield name, function


def is_internal(function: Any) -> bool:
    """Of methods that only the engine calls: those that pickles, kernels and caches use."""
    return function.__name__ in (
        "of_arrays",
        "of_checked",
        "restored",
        "prepared",
        "cached",
        "attach",
        "detach",
        "take",
    )


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_function_has_every_section(name: str) -> None:
    sections, function = sections_of(FUNCTIONS[name]), FUNCTIONS[name]
    assert len(sections[""].strip().split("\n\n")[0].splitlines()) == 1, "the first sentence stands on one line"
    wanted = [title for title in SECTIONS if name not in CALLS or title in ("Notes", "Examples")]
    assert [title for title in wanted if not sections.get(title, "").strip()] == []
    assert named_in(sections.get("Parameters", "")) == parameters_of(function)
    assert ">>>" in sections["Examples"]


@pytest.mark.parametrize("name", CLASSES)
def test_a_public_class_names_its_parameters_or_fields(name: str) -> None:
    kind, sections = CLASSES[name], sections_of(CLASSES[name])
    named = named_in(sections.get("Parameters", "") + "\n" + sections.get("Attributes", ""))
    if dataclasses.is_dataclass(kind) and "Parameters" not in sections:
        fields = {field.name for field in dataclasses.fields(kind) if not field.name.startswith("_")}
        assert fields <= named, fields - named
    elif "Parameters" in sections:
        assert parameters_of(kind) <= named, parameters_of(kind) - named
    for method, function in methods_of(kind):
        parts = sections_of(function)
        assert named_in(parts.get("Parameters", "")) == parameters_of(function), method
        if inspect.signature(function).return_annotation not in ("None", None):
            assert parts.get("Returns"), method
