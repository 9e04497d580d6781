"""The compile cache: keyed by every source it depends on, never stale, never in the way, safe between processes."""

from __future__ import annotations

import importlib
import os
import pkgutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from numba import config as numba_config

import engine
from engine import jit

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")

HELPER = """
from engine.jit import inline

@inline
def step(x):
    return x + {step}
"""
KERNEL = """
from engine.deep.{middle} import step
from engine.jit import kernel

@kernel
def run(x):
    return step(x)
"""
USE = (
    "from engine.work import run; found = run(1.0); stats = run.dispatcher.stats; "
    "print(found, sum(stats.cache_hits.values()), stats.cache_path)"
)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a small package named `engine` whose kernel calls a helper two imports away."""
    package = tmp_path / "project" / "engine"
    (package / "deep").mkdir(parents=True)
    (package / "jit.py").write_text((ROOT / "engine" / "jit.py").read_text("utf-8"))
    for folder in (package, package / "deep"):
        (folder / "__init__.py").write_text("")
    (package / "deep" / "helper.py").write_text(HELPER.format(step=1.0))
    (package / "deep" / "middle.py").write_text("from engine.deep.helper import step as step\n")
    (package / "work.py").write_text(KERNEL.format(middle="middle"))
    return package.parent


def start(project: Path, code: str = USE, **variables: str) -> subprocess.Popen[str]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("ENGINE_", "XDG_", "NUMBA_"))}
    environment.update({"HOME": str(project / "nowhere"), "PYTHONPATH": str(project), **variables})
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env=environment,
        cwd=project,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def run(project: Path, code: str = USE, **variables: str) -> list[str]:
    """Return the words that a fresh process prints."""
    process = start(project, code, **variables)
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    return output.split()


def test_a_changed_helper_elsewhere_is_noticed(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    assert run(project, **cache)[:2] == ["2.0", "0"]
    os.utime(project / "engine" / "work.py", (1, 1))  # a copied checkout: other times, the same text
    assert run(project, **cache)[:2] == ["2.0", "1"]
    (project / "engine" / "deep" / "helper.py").write_text(HELPER.format(step=10.0))
    assert run(project, **cache)[:2] == ["11.0", "0"]


def test_the_digest_covers_what_is_imported_and_nothing_else(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def digests() -> tuple[str, str]:
        jit._source.cache_clear()
        jit._source_hash.cache_clear()
        return jit.source_digest.__wrapped__("engine.work"), jit.source_digest.__wrapped__("engine.deep.helper")

    monkeypatch.setattr(jit, "_ROOT", project / "engine")
    before = digests()
    (project / "engine" / "other.py").write_text("x = 1\n")
    assert digests() == before
    (project / "engine" / "deep" / "middle.py").write_text("from engine.deep import helper\nstep = helper.step\n")
    after = digests()
    assert after[0] != before[0]
    assert after[1] == before[1]
    (project / "engine" / "deep" / "helper.py").write_text(HELPER.format(step=2.0))
    last = digests()
    assert last[0] != after[0]
    assert last[1] != after[1]
    jit._source.cache_clear()
    jit._source_hash.cache_clear()


def test_every_import_form_is_read() -> None:
    found = jit.imported_modules("engine.predicates.orientation")
    assert {"engine.jit", "engine.types", "engine.predicates.expansion", "engine.predicates.error_free"} <= found
    assert "engine" not in found


def test_an_unwritable_home_falls_back(project: Path) -> None:
    home = project / "home"
    home.mkdir()
    (home / ".cache").write_text("a file where a folder should be")  # unwritable even for root
    temporary = project / "temporary"
    temporary.mkdir()
    words = run(project, HOME=str(home), TMPDIR=str(temporary))
    assert words[0] == "2.0"
    assert words[2].startswith(str(temporary))


def test_without_any_writable_place_it_runs_uncached(project: Path) -> None:
    blocked = project / "blocked"
    blocked.write_text("")
    code = (
        f"import tempfile; tempfile.tempdir = {str(blocked)!r}\n"
        "from engine.work import run; from engine.jit import cache_folder; print(run(1.0), cache_folder())"
    )
    assert run(project, code, HOME=str(blocked), ENGINE_CACHE_DIR=str(blocked)) == ["2.0", "None"]


def test_a_folder_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert jit._is_writable(tmp_path / "own")
    assert stat.S_IMODE((tmp_path / "own").stat().st_mode) == 0o700
    monkeypatch.setattr(os, "getuid", lambda: (tmp_path / "own").stat().st_uid + 1)
    assert not jit._is_writable(tmp_path / "own")


def test_a_seed_is_copied_and_used(project: Path) -> None:
    seed, cache = project / "seed", project / "cache"
    assert run(project, ENGINE_CACHE_DIR=str(seed))[1] == "0"
    for path in [seed, *seed.rglob("*")]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    words = run(project, ENGINE_CACHE_DIR=str(cache), ENGINE_CACHE_SEED=str(seed))
    assert words[:2] == ["2.0", "1"]
    assert words[2].startswith(str(cache))
    (project / "engine" / "deep" / "helper.py").write_text(HELPER.format(step=3.0))  # a read-only seed stays writable
    assert run(project, ENGINE_CACHE_DIR=str(cache), ENGINE_CACHE_SEED=str(seed))[:2] == ["4.0", "0"]


def test_processes_that_fill_one_cache_together(project: Path) -> None:
    """Each answers by its own code, before and after; an entry lost between them is only compiled again."""
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    expected = {"1.0": "2.0", "1j": "(1+1j)"}
    code = "from engine.work import run; print(run({0}))"
    for _ in range(2):
        processes = [(argument, start(project, code.format(argument), **cache)) for argument in expected]
        for argument, process in processes:
            assert process.communicate(timeout=120)[0].split() == [expected[argument]]


def test_code_of_another_signature_is_never_taken(project: Path) -> None:
    """Two processes read the empty index before either writes: both entries stay apart, the last index wins."""
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    code = (
        "from engine.work import run\n"
        "file = run.dispatcher._cache._cache_file\n"
        "file._load_index = lambda: {{}}\n"  # the index as it was before the other process wrote
        "print(run({0}))"
    )
    assert run(project, code.format("1j"), **cache) == ["(1+1j)"]
    assert run(project, code.format("1.0"), **cache) == ["2.0"]
    assert len(list((project / "cache").rglob("*.nbc"))) == 2
    assert run(project, **cache)[:2] == ["2.0", "1"]


def test_damaged_files_are_compiled_anew(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    run(project, **cache)
    for pattern in ("*.nbc", "*.nbi"):
        for file in (project / "cache").rglob(pattern):
            file.write_bytes(file.read_bytes()[:40])
        assert run(project, **cache)[:2] == ["2.0", "0"]
    assert run(project, **cache)[:2] == ["2.0", "1"]


def test_what_only_the_compiler_needs_is_not_imported(project: Path) -> None:
    """numba's own functions on arrays: a tenth of a second to import, a third to register."""
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    asked = "import sys; print('numba.np.arrayobj' in sys.modules)"
    assert run(ROOT, f"import engine; {asked}", **cache) == ["False"]
    run(project, **cache)
    assert run(project, f"{USE}; {asked}", **cache)[1::2] == ["1", "False"]


def test_no_compiled_function_calls_a_kernel() -> None:
    """The cache keeps of a kernel what Python calls, and nothing that a compiler could put into another function."""
    modules = [importlib.import_module(item.name) for item in pkgutil.walk_packages(engine.__path__, "engine.")]
    kernels = {id(kernel) for kernel in jit.KERNELS}
    for module in modules:
        for function in [getattr(item, "py_func", None) for item in vars(module).values()]:
            if function is not None:
                known = function.__globals__
                called = [name for name in function.__code__.co_names if id(known.get(name)) in kernels]
                assert not called, (function, called)
