"""Imports only go down the floors, and the engine knows nothing of the service or its libraries."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FLOORS = {
    "engine.version": 0,
    "engine.arrays": 0,
    "engine.errors": 0,
    "engine.types": 0,
    "engine.jit": 0,
    "engine.parallel": 0,
    "engine.cold_start": 1,
    "engine.predicates": 1,
    "engine.lanes": 1,
    "engine.bounding": 2,
    "engine.solids": 3,
    "engine.arrangement": 4,
    "engine.containment": 4,
    "engine.segment_clipping": 5,
    "engine.polygon_clipping": 5,
    "engine.polygon_overlay": 5,
    "engine.collision": 5,
    "engine.textbook": 5,
    "engine.distributed": 6,
    "engine.files": 6,
    "engine.warmup": 6,
    "engine": 7,
    "engine.__main__": 8,
}
SAME_FLOOR_ALLOWED = {("engine.parallel", "engine.errors"), ("engine.parallel", "engine.arrays")}
SPEAKS_LLVM = {"engine.jit", "engine.predicates.error_free"}
"""Beside `engine.lanes`: the only modules that may."""
LLVM = ("llvmlite", "numba.core", "numba.extending", "numba.types")
SERVICE_LIBRARIES = {"fastapi", "httpx", "pydantic", "pydantic_core", "pydantic_settings", "starlette", "uvicorn"}


def imports_of(path: Path) -> list[str]:
    """Return every dotted name that `path` imports, submodules written as ``from package import module`` included."""
    names = []
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return names


def unit_of(name: str) -> str:
    """Return the floor's entry that the dotted engine `name` belongs to."""
    for length in (2, 1):
        unit = ".".join(name.split(".")[:length])
        if unit in FLOORS:
            return unit
    raise AssertionError(f"{name} stands on no floor: add it to FLOORS")


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


ENGINE_FILES = sorted((ROOT / "engine").rglob("*.py"))


@pytest.mark.parametrize("path", ENGINE_FILES, ids=lambda path: module_name(path))
def test_engine_imports_only_go_down(path: Path) -> None:
    own = unit_of(module_name(path))
    for name in imports_of(path):
        if name.split(".")[0] == "engine":
            other = unit_of(name)
            lower = FLOORS[other] < FLOORS[own] or other == own or (own, other) in SAME_FLOOR_ALLOWED
            assert lower, f"{module_name(path)} imports {name}: not below it"
        assert name.split(".")[0] not in SERVICE_LIBRARIES | {"service"}, f"{module_name(path)} imports {name}"


def test_only_lanes_jit_and_error_free_speak_llvm() -> None:
    speakers = {module_name(path) for path in ENGINE_FILES if any(name.startswith(LLVM) for name in imports_of(path))}
    assert {name for name in speakers if not name.startswith("engine.lanes.")} == SPEAKS_LLVM


@pytest.mark.parametrize("path", sorted((ROOT / "service").rglob("*.py")), ids=lambda path: module_name(path))
def test_service_sees_only_public_names(path: Path) -> None:
    import engine

    for name in imports_of(path):
        if name.split(".")[0] == "engine":
            parts = name.split(".")
            assert len(parts) == 1 or (len(parts) == 2 and parts[1] in engine.__all__), (
                f"{module_name(path)} imports {name}: not a public name of engine"
            )


def test_public_names_are_sorted_and_exist() -> None:
    import engine

    assert list(engine.__all__) == sorted(engine.__all__)
    assert all(hasattr(engine, name) for name in engine.__all__)
