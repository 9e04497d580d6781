"""Imports only go down the floors, and the engine knows nothing of the service or its libraries."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FLOORS = {
    "engine.version": 0,
    "engine.errors": 0,
    "engine.types": 0,
    "engine.compiling": 1,
    "engine.running": 1,
    "engine.predicates": 3,
    "engine.lanes": 3,
    "engine.bounding": 4,
    "engine.solids": 5,
    "engine.arrangement": 6,
    "engine.containment": 6,
    "engine.segment_clipping": 7,
    "engine.polygon_clipping": 7,
    "engine.polygon_overlay": 7,
    "engine.collision": 7,
    "engine.textbook": 7,
    "engine.distance": 8,
    "engine.solid_cutting": 9,
    "engine.scenes": 9,
    "engine.layers": 10,
    "engine.registry": 10,
    "engine.compare": 11,
    "engine.distributed": 11,
    "engine.files": 11,
    "engine.warmup": 11,
    "engine.inspection": 12,
    "engine": 13,
    "engine.warm_command": 13,
    "engine.__main__": 14,
}
SPEAKS_LLVM = {"engine.predicates.error_free"}
"""Beside `engine.lanes` and `engine.compiling`: the only module that may."""
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
            lower = FLOORS[other] < FLOORS[own] or other == own
            assert lower, f"{module_name(path)} imports {name}: not below it"
        assert name.split(".")[0] not in SERVICE_LIBRARIES | {"service"}, f"{module_name(path)} imports {name}"


def test_only_lanes_compiling_and_error_free_speak_llvm() -> None:
    speakers = {module_name(path) for path in ENGINE_FILES if any(name.startswith(LLVM) for name in imports_of(path))}
    assert {name for name in speakers if not name.startswith(("engine.lanes.", "engine.compiling"))} == SPEAKS_LLVM


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
