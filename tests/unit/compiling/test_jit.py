"""The compile cache: keyed by every source it depends on, never stale, never in the way, safe between processes."""

from __future__ import annotations

import compileall
import hashlib
import importlib
import os
import pkgutil
import re
import shutil
import stat
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from numba import config as numba_config

import engine
from engine.compiling import jit, kernel_cache, sources
from exact_geometry._renaming import renamed

ROOT = Path(__file__).resolve().parents[3]
pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")

COMPILER = [f"compiling/{path.name}" for path in (ROOT / "engine" / "compiling").glob("*.py")]
HELPER = """
from engine.compiling.jit import inline

@inline
def step(x):
    return x + {step}
"""
KERNEL = """
from engine.deep.{middle} import step
from engine.compiling.jit import kernel

@kernel
def run(x):
    return step(x)
"""
USE = (
    "from engine.work import run; found = run(1.0); stats = run.dispatcher.stats; "
    "print(found, sum(stats.cache_hits.values()), stats.cache_path)"
)


def make_project(folder: Path) -> Path:
    """Return a small package named `engine` whose kernel calls a helper two imports away."""
    package = folder / "project" / "engine"
    (package / "deep").mkdir(parents=True)
    (package / "compiling").mkdir()
    for name in COMPILER:
        (package / name).write_text((ROOT / "engine" / name).read_text("utf-8"))
    for folder in (package, package / "deep"):
        (folder / "__init__.py").write_text("")
    (package / "deep" / "helper.py").write_text(HELPER.format(step=1.0))
    (package / "deep" / "middle.py").write_text("from engine.deep.helper import step as step\n")
    (package / "work.py").write_text(KERNEL.format(middle="middle"))
    return package.parent


@pytest.fixture
def project(tmp_path: Path) -> Path:
    return make_project(tmp_path)


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


def logged_run(project: Path, code: str = USE, **variables: str) -> tuple[list[str], str]:
    """Return the words that a fresh process prints, and its log."""
    process = start(project, f"import logging; logging.basicConfig(); {code}", **variables)
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    return output.split(), errors


def test_a_changed_helper_elsewhere_is_noticed(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    assert run(project, **cache)[:2] == ["2.0", "0"]
    os.utime(project / "engine" / "work.py", (1, 1))  # a copied checkout: other times, the same text
    assert run(project, **cache)[:2] == ["2.0", "1"]
    (project / "engine" / "deep" / "helper.py").write_text(HELPER.format(step=10.0))
    assert run(project, **cache)[:2] == ["11.0", "0"]


def edit_in_place(file: Path, text: str) -> None:
    """Write a text of the same size, with the time of the one before: Python takes its bytecode for that of the new."""
    status = file.stat()
    assert len(text) == status.st_size
    file.write_text(text)
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


@pytest.mark.full
def test_bytecode_of_another_source_leaves_no_kernel(project: Path) -> None:
    cache, helper = {"ENGINE_CACHE_DIR": str(project / "cache")}, project / "engine" / "deep" / "helper.py"
    for path in project.rglob("*.py"):
        os.utime(path, (1, 1))
    run(project, "import engine.work", PYTHONDONTWRITEBYTECODE="", **cache)
    edit_in_place(helper, HELPER.format(step=2.0))
    words, logged = logged_run(project, **cache)
    assert words[:2] == ["2.0", "0"]  # as Python has it: the old code
    assert logged.count("bytecode is not that of the source") == 1
    shutil.rmtree(helper.parent / "__pycache__")
    assert run(project, **cache)[:2] == ["3.0", "0"]
    assert run(project, **cache)[:2] == ["3.0", "1"]


@pytest.mark.full
def test_a_source_that_is_edited_while_it_runs_leaves_no_kernel(project: Path) -> None:
    cache, helper = {"ENGINE_CACHE_DIR": str(project / "cache")}, project / "engine" / "deep" / "helper.py"
    edit = f"import engine.work; open({str(helper)!r}, 'w').write({HELPER.format(step=5.0)!r}); {USE}"
    words, logged = logged_run(project, edit, **cache)
    assert words[:2] == ["2.0", "0"]
    assert logged.count("has changed since it was imported") == 1
    assert run(project, **cache)[:2] == ["6.0", "0"]
    assert run(project, **cache)[:2] == ["6.0", "1"]


def zipped(project: Path) -> Path:
    """Return the zip file of the project's sources as they are."""
    (project / "lib.zip").unlink(missing_ok=True)
    with zipfile.ZipFile(project / "lib.zip", "w") as file:
        for path in (project / "engine").rglob("*.py"):
            file.write(path, path.relative_to(project))
    return project / "lib.zip"


@pytest.mark.full
def test_an_engine_in_a_zip_file_is_kept_by_its_sources(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache"), "PYTHONPATH": str(zipped(project)), "PYTHONSAFEPATH": "1"}
    assert run(project, **cache)[:2] == ["2.0", "0"]
    assert run(project, **cache)[:2] == ["2.0", "1"]
    (project / "engine" / "deep" / "helper.py").write_text(HELPER.format(step=10.0))
    zipped(project)
    assert run(project, **cache)[:2] == ["11.0", "0"]
    assert run(project, **cache)[:2] == ["11.0", "1"]


@pytest.mark.full
def test_an_engine_without_sources_is_never_kept(project: Path) -> None:
    cache, bare = {"ENGINE_CACHE_DIR": str(project / "cache"), "PYTHONSAFEPATH": "1"}, project / "bare"
    for step, expected in ((1.0, "2.0"), (10.0, "11.0")):
        (project / "engine" / "deep" / "helper.py").write_text(HELPER.format(step=step))
        shutil.rmtree(bare, ignore_errors=True)
        shutil.copytree(project / "engine", bare / "engine", ignore=shutil.ignore_patterns("__pycache__"))
        assert compileall.compile_dir(bare, legacy=True, quiet=1)
        for path in bare.rglob("*.py"):
            path.unlink()
        words, logged = logged_run(project, PYTHONPATH=str(bare), **cache)
        assert words[:2] == [expected, "0"]
        assert logged.count("a source cannot be read") == 1
    assert not list((project / "cache").rglob("*.nbc"))


@pytest.mark.full
def test_files_that_were_swapped_are_noticed(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    both = "from engine.work import run; print(run(1.0), run(1j), sum(run.dispatcher.stats.cache_hits.values()))"
    assert run(project, both, **cache) == ["2.0", "(1+1j)", "0"]
    one, other = (project / "cache").rglob("*.nbc")
    for source, target in ((one, "aside"), (other, one.name), (one.with_name("aside"), other.name)):
        source.rename(source.with_name(target))
    words, logged = logged_run(project, both, **cache)
    assert words == ["2.0", "(1+1j)", "0"]
    assert logged.count("is damaged, or another file") == 1  # one line for all of a kind
    assert run(project, both, **cache) == ["2.0", "(1+1j)", "2"]


OTHERS = [
    pytest.param(what, mode, owner, id=f"{what}-{mode:o}-{owner}")
    for what in ("cache", "folder", "file")
    for mode, owner in ((0o777, None), (0o775, None), (0o664, None), (0o644, 12345))
    if what == "file" or mode != 0o664
]


@pytest.mark.some(1)
@pytest.mark.parametrize(("what", "mode", "owner"), OTHERS)
def test_what_others_can_write_is_not_loaded(project: Path, what: str, mode: int, owner: int | None) -> None:
    if owner is not None and os.getuid():
        pytest.skip("only root gives files away")
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    run(project, **cache)
    (file,) = (project / "cache").rglob("*.nbc")
    changed = {"cache": project / "cache", "folder": file.parent, "file": file}[what]
    changed.chmod(mode if changed == file else mode | 0o111)
    if owner is not None:
        os.chown(changed, owner, owner)
    words, logged = logged_run(project, **cache)
    assert words[:2] == ["2.0", "0"]
    assert logged.count("not used") == logged.count("chmod go-w") == 1
    if what == "file":  # replaced by one of our own
        assert run(project, **cache)[:2] == ["2.0", "1"]


def test_a_seed_can_be_read_by_users_of_an_image(project: Path) -> None:
    (project / "seed").mkdir(mode=0o755)
    run(project, f"import os; os.umask(0o022); {USE}", ENGINE_CACHE_DIR=str(project / "seed"))
    for path in (project / "seed").rglob("*"):
        assert stat.S_IMODE(path.stat().st_mode) == (0o755 if path.is_dir() else 0o644)


def test_where_new_files_are_the_group_s_to_write_the_cache_is_ours_all_the_same(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    for hits in ("0", "1"):
        assert run(project, f"import os; os.umask(0o002); {USE}", **cache)[:2] == ["2.0", hits]


def test_the_digest_covers_what_is_imported_and_nothing_else(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def digests() -> tuple[str, str]:
        sources.read_source.cache_clear()
        sources._AT_IMPORT.clear()
        return sources.source_digest.__wrapped__("engine.work"), sources.source_digest.__wrapped__("engine.deep.helper")

    monkeypatch.setattr(sources, "_ROOT", project / "engine")
    monkeypatch.setattr(sources, "_AT_IMPORT", {})
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
    sources.read_source.cache_clear()


def test_a_kernel_elsewhere_is_kept_under_its_own_source_and_what_that_imports() -> None:
    """Or a test would be answered by what was compiled before the engine changed."""
    digest, named = sources.read_source(__name__)
    assert digest == hashlib.sha256(Path(__file__).read_bytes()).digest()
    assert "engine.compiling.kernel_cache" in named


def test_every_import_form_is_read() -> None:
    found = sources.read_source("engine.predicates.orientation")[1]
    assert {
        "engine.compiling.jit",
        "engine.types",
        "engine.predicates.expansion",
        "engine.predicates.error_free",
    } <= found
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
        "from engine.work import run; from engine.compiling.kernel_cache import cache_folder\n"
        "print(run(1.0), cache_folder())"
    )
    assert run(project, code, HOME=str(blocked), ENGINE_CACHE_DIR=str(blocked)) == ["2.0", "None"]


def test_a_folder_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert kernel_cache._is_writable(tmp_path / "own")
    assert stat.S_IMODE((tmp_path / "own").stat().st_mode) == 0o700
    if os.getuid():
        monkeypatch.setattr(os, "getuid", lambda: (tmp_path / "own").stat().st_uid + 1)
    else:  # what is root's is everybody's to load
        os.chown(tmp_path / "own", 12345, 12345)
    assert not kernel_cache._is_writable(tmp_path / "own")


@pytest.fixture(scope="module")
def made_seed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a seed of the project, made for a family of CPUs."""
    project = make_project(tmp_path_factory.mktemp("seed"))
    folder = project / "seed"
    family = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    assert run(project, ENGINE_CACHE_DIR=str(folder), **family)[1] == "0"
    kernel_cache.seal(folder, Path(f"{folder}.tar.xz"))
    return folder


@pytest.fixture
def seed(project: Path, made_seed: Path) -> Path:
    shutil.copy(f"{made_seed}.tar.xz", project)
    return shutil.copytree(made_seed, project / "seed")


def started(project: Path, seed: Path, **more: str) -> tuple[list[str], str]:
    """Return the words of a process that has an empty cache and this seed, and its log."""
    cache = {"ENGINE_CACHE_DIR": str(project / "cache"), "ENGINE_CACHE_SEED": str(seed), **more}
    return logged_run(project, **cache)


PASSING = """
from typing import NamedTuple
from engine.compiling.compilers import forget_paths
from engine.compiling.jit import allocating_kernel, inline
from engine.deep.middle import step

forget_paths()

class Place(NamedTuple):
    x: float

@inline
def applied(function, place):
    if place.x > 1e300:
        raise ValueError("too large")
    return function(place.x)

@allocating_kernel
def run(places, keys):
    keys.sort()
    return applied(step, places[0]), keys
"""


def move_below(project: Path) -> None:
    """Put the engine where a wheel has it: the same sources are `exact_geometry.engine`."""
    for path in (project / "engine").rglob("*.py"):
        path.write_text(renamed(path.read_text()))
    (project / "exact_geometry").mkdir()
    (project / "exact_geometry" / "__init__.py").touch()
    (project / "engine").rename(project / "exact_geometry" / "engine")


def test_the_same_sources_give_the_same_bytes_wherever_they_are(tmp_path: Path) -> None:
    """And by whatever name they are imported: what raises had the path of its file within, or that of numba's, who
    passes a function its address, names of symbols and classes that of their module."""
    use = USE.replace("run(1.0)", "run((Place(1.0),), np.arange(3))[0]").replace("import run", "import Place, run")
    made = []
    for place in ("here", "there/and further", "below"):
        (tmp_path / place).mkdir(parents=True)
        project = make_project(tmp_path / place)
        (project / "engine" / "work.py").write_text(PASSING)
        if place == "below":
            move_below(project)
            use = use.replace("engine.", "exact_geometry.engine.")
        cache = {"PYTHONHASHSEED": "0", "ENGINE_CACHE_DIR": str(project / "cache")}
        for hits in ("0", "1"):
            assert run(project, f"import numpy as np; {use}", **cache)[:2] == ["2.0", hits]
        made.append({path.name: path.read_bytes() for path in (project / "cache").rglob("*.nbc")})
    assert made[0] == made[1] == made[2] != {}
    (content,) = made[0].values()
    assert b"site-packages" not in content


@pytest.fixture
def own_seed(project: Path, seed: Path) -> Path:
    """Return the seed within the package, as a wheel has it."""
    return Path(shutil.move(seed, project / "engine" / "kernels" / "some name"))


def test_the_kernels_of_a_wheel_are_used_unless_they_are_switched_off(project: Path, own_seed: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    assert logged_run(project, **cache) == ([*run(project, **cache)], "")
    assert run(project, **cache)[:2] == ["2.0", "1"]
    assert run(project, **cache, ENGINE_CACHE_SEED="")[:2] == ["2.0", "0"]


def test_the_kernels_of_a_wheel_are_those_of_both_names(project: Path, own_seed: Path) -> None:
    """They were compiled as `engine`; in the wheel the same sources are `exact_geometry.engine`."""
    move_below(project)
    use = USE.replace("from engine", "from exact_geometry.engine")
    words, logged = logged_run(project, use, ENGINE_CACHE_DIR=str(project / "cache"))
    assert words[:2] == ["2.0", "1"], logged
    assert logged == ""


@pytest.mark.some(2)
@pytest.mark.parametrize("kind", ["older", "options", "damaged", "writable"])
def test_kernels_of_a_wheel_that_do_not_fit_are_left_with_one_line(project: Path, own_seed: Path, kind: str) -> None:
    made_by, (file,) = own_seed / "MADE_BY", own_seed.rglob("*.nbc")
    match kind:
        case "older":
            made_by.write_text(re.sub(r"numba [\d.]+", "numba 0.61.0", made_by.read_text()))
        case "options":
            made_by.write_text(made_by.read_text().replace("USING_SVML=False", "USING_SVML=True"))
        case "damaged":
            file.write_bytes(file.read_bytes()[:-1])
        case "writable":
            file.chmod(0o666)
    words, logged = logged_run(project, ENGINE_CACHE_DIR=str(project / "cache"))
    assert words[:2] == ["2.0", "0"]
    assert len(logged.splitlines()) == 1
    words_of = {"older": "made with numba 0.61.0; here is", "options": "made with USING_SVML=True; here is USING_SVML="}
    assert (words_of | {"damaged": "it is damaged", "writable": "chmod go-w"})[kind] in logged
    assert "llvmlite" not in logged  # nor what is equal


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives files away")
def test_kernels_of_whom_the_sources_belong_to_are_trusted(project: Path, own_seed: Path) -> None:
    for path in [project / "engine", *(project / "engine").rglob("*")]:
        os.chown(path, 12345, 12345)
        path.chmod(path.stat().st_mode | 0o020)  # as umask 002 leaves them
    assert run(project, ENGINE_CACHE_DIR=str(project / "cache"))[:2] == ["2.0", "1"]


@pytest.mark.some(2)
@pytest.mark.parametrize("kind", ["edited", "bytecode", "zip"])
def test_kernels_of_a_wheel_never_answer_for_other_sources(project: Path, own_seed: Path, kind: str) -> None:
    helper = project / "engine" / "deep" / "helper.py"
    edit_in_place(helper, HELPER.format(step=3.0))
    if kind == "bytecode":
        subprocess.run([sys.executable, "-m", "compileall", "-q", "-b", project / "engine"], check=True)
        for path in (project / "engine").rglob("*.py"):
            path.unlink()
    around = {"PYTHONPATH": str(zipped(project)), "PYTHONSAFEPATH": "1"} if kind == "zip" else {}
    assert run(project, ENGINE_CACHE_DIR=str(project / "cache"), **around)[:2] == ["4.0", "0"]


def test_an_archive_is_unpacked_where_new_files_are_the_group_s_to_write(project: Path, seed: Path) -> None:
    use = f"import os; os.umask(0o002); {USE}"
    cache = {"ENGINE_CACHE_DIR": str(project / "cache"), "ENGINE_CACHE_SEED": f"{seed}.tar.xz"}
    assert run(project, use, **cache)[:2] == ["2.0", "1"]


@pytest.mark.full
@pytest.mark.parametrize("kind", ["folder", "archive"])
def test_a_seed_of_the_family_is_used_by_each_of_its_cpus(project: Path, seed: Path, kind: str) -> None:
    for path in [seed, *seed.rglob("*")]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    named = seed if kind == "folder" else Path(f"{seed}.tar.xz")
    assert started(project, named)[0][:2] == ["2.0", "1"]
    elsewhere = project / "elsewhere"  # the same sources in another folder: another machine
    shutil.copytree(project / "engine", elsewhere / "engine")
    assert started(project, named, PYTHONPATH=str(elsewhere))[0][:2] == ["2.0", "1"]
    pinned = {"NUMBA_CPU_NAME": "x86-64-v2", "NUMBA_CPU_FEATURES": "", "ENGINE_CACHE_DIR": str(project / "pinned")}
    assert started(project, named, **pinned)[0][:2] == ["2.0", "0"]  # asked for by name: not what others are given
    (project / "engine" / "deep" / "helper.py").write_text(HELPER.format(step=3.0))
    assert started(project, named)[0][:2] == ["4.0", "0"]


@pytest.mark.some(2)
@pytest.mark.parametrize("kind", ["code", "owner", "others", "tools", "archive", "intruder", "absent"])
def test_a_seed_that_is_not_as_it_was_made_is_not_run(project: Path, seed: Path, kind: str) -> None:
    written = seed / "MADE_BY"
    named = seed
    (file,) = seed.rglob("*.nbc")
    match kind:
        case "code":
            content = bytearray(file.read_bytes())
            content[-20] ^= 1
            file.write_bytes(content)
        case "owner":
            file.chmod(0o666)
        case "others":
            seed.chmod(0o777)
        case "tools":
            written.write_text(written.read_text().replace("numba 0", "numba 1"))
        case "archive":
            named = Path(f"{seed}.tar.xz")
            named.write_bytes(named.read_bytes()[:-200])
        case "intruder":
            named = Path(f"{seed}.tar.xz")
            with tarfile.open(named, "w:xz") as tar:
                tar.add(written, "../MADE_BY")
        case "absent":
            named = project / "nowhere"
    words, logged = started(project, named)
    assert words[:2] == ["2.0", "0"]
    assert "not used" in logged


@pytest.mark.some(1)
@pytest.mark.parametrize("option", ["NUMBA_OPT=1", "NUMBA_SLP_VECTORIZE=1", "NUMBA_LOOP_VECTORIZE=0"])
def test_code_of_another_option_is_not_taken(project: Path, option: str) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    assert run(project, **cache)[1] == "0"
    name, _, value = option.partition("=")
    assert run(project, **cache, **{name: value})[1] == "0"
    assert run(project, **cache)[1] == "1"


def test_where_numba_lacks_a_name_kernels_are_compiled_without_a_cache(project: Path) -> None:
    lacking = "from numba.core.compiler import CompileResult as c; del c._find_referenced_environments\n"
    process = start(project, f"{lacking}{USE}", ENGINE_CACHE_DIR=str(project / "cache"))
    output, errors = process.communicate(timeout=120)
    assert output.split()[:2] == ["2.0", "0"]
    assert "CompileResult._find_referenced_environments" in errors
    assert not list((project / "cache").rglob("*.nbc"))


def test_a_full_disk_ends_in_answers(project: Path) -> None:
    """No file may grow: each write fails as on a disk without room, and leaves nothing behind."""
    resource = pytest.importorskip("resource")
    full = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, {resource.RLIM_INFINITY}))\n"
    assert run(project, f"{full}{USE}", ENGINE_CACHE_DIR=str(project / "cache"))[:2] == ["2.0", "0"]
    assert not [path for path in (project / "cache").rglob("*") if path.is_file()]
    assert run(project, ENGINE_CACHE_DIR=str(project / "cache"))[:2] == ["2.0", "0"]


def test_inner_functions_are_compiled_once_for_all_literals(project: Path) -> None:
    (project / "engine" / "work.py").write_text(KERNEL.format(middle="middle").replace("step(x)", "step(1) + step(x)"))
    count = "from engine.deep.helper import step; print(len(step._dispatcher.overloads))"
    code = f"from engine.work import run; run(2); {count}"
    assert run(project, code, ENGINE_CACHE_DIR=str(project / "cache")) == ["1"]


@pytest.mark.full
def test_processes_that_fill_one_cache_together(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    expected = {"1.0": "2.0", "1j": "(1+1j)"}
    code = "from engine.work import run; print(run({0}))"
    for _ in range(2):
        processes = [(argument, start(project, code.format(argument), **cache)) for argument in expected]
        for argument, process in processes:
            assert process.communicate(timeout=120)[0].split() == [expected[argument]]
    assert len(list((project / "cache").rglob("*.nbc"))) == 2
    assert run(project, **cache)[:2] == ["2.0", "1"]


def test_a_damaged_file_is_compiled_anew(project: Path) -> None:
    cache = {"ENGINE_CACHE_DIR": str(project / "cache")}
    run(project, **cache)
    (file,) = (project / "cache").rglob("*.nbc")
    file.write_bytes(file.read_bytes()[:-1])
    assert run(project, **cache)[:2] == ["2.0", "0"]
    assert run(project, **cache)[:2] == ["2.0", "1"]


def test_a_kernel_is_compiled_anew_where_the_fields_of_an_argument_are_others(project: Path) -> None:
    """The source of the kernel does not name the module of that class, and its types stay: the key had neither."""
    cache, package = {"ENGINE_CACHE_DIR": str(project / "cache")}, project / "engine"
    (package / "work.py").write_text(
        "from engine.compiling.jit import kernel\n\n@kernel\ndef run(p):\n    return p[0].x - p[0].y\n"
    )
    use = "from engine.{} import Place; " + USE.replace("run(1.0)", "run((Place(x=3.0, y=1.0),))")
    cases = ("here", "x y", 0), ("here", "x y", 1), ("here", "y x", 0), ("there", "x y", 1)
    for number, (module, fields, hits) in enumerate(cases):
        for path in (package / "here.py", package / "there.py"):
            path.unlink(missing_ok=True)
        text = f"from collections import namedtuple\n\nPlace = namedtuple('Place', '{fields}')\n"
        text += "#" * number  # of another size: bytecode is taken for a file of the same second and size
        (package / f"{module}.py").write_text(text)
        assert run(project, use.format(module), **cache)[:2] == ["2.0", str(hits)]


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


COUNTING = """
from typing import NamedTuple
import numpy as np
from engine.compiling.jit import allocating, allocating_kernel, inline, kernel

class Place(NamedTuple):
    x: float

@inline
def kept(values):
    return values, 1

@allocating
def doubled(values):
    return np.append(values, values)

@kernel
def not_counting(values, out):
    out[0] = kept(values)[0][1]

@allocating_kernel
def counting(values):
    return doubled(values)

@allocating_kernel
def counts_more_than_it_is_given(values):
    return np.sum(kept(values)[0])

@kernel
def counts_less_than_it_is_given(values, out):
    out[0] = doubled(values)[0]

@kernel
def gives_what_it_does_not_count(values):
    return values

@kernel
def makes(values, out):
    out[0] = np.append(values, values)[0]

@kernel
def names(values):
    return Place(values[0])
"""


@pytest.mark.full
def test_who_makes_arrays_counts_them_and_nobody_else(project: Path) -> None:
    """Counted by one side alone they were freed while in use: `Scene.clip_segments` as the first question crashed."""
    (project / "engine" / "counts.py").write_text(COUNTING)
    begin = (
        "import numpy as np; from engine import counts; values, out = np.array([[1.0, 2.0], [3.0, 4.0]]), np.zeros(2); "
    )
    well = "counts.not_counting(values[1], out); print(*out, *counts.counting(values[0]))"
    assert run(project, begin + well) == ["4.0", "0.0", "1.0", "2.0", "1.0", "2.0"]
    for call, told in {
        "counts_more_than_it_is_given(values[0])": "kept returns Tuple",
        "counts_less_than_it_is_given(values[0], out)": "doubled returns array",
        "gives_what_it_does_not_count(values[0])": "gives_what_it_does_not_count returns array",
        "names(values[0])": "names returns Place(float64 x 1): another process may import its class elsewhere",
        "makes(values[0], out)": "Only accept returning of array passed into the function as argument",
    }.items():
        with start(project, f"{begin}counts.{call}") as process:
            assert told in process.communicate(timeout=120)[1]


BESIDE = """
import numba
import numpy as np
from engine.compiling.jit import allocating_kernel, called

@called
def twice(x):
    return x + x

@allocating_kernel
def ours(x):
    return np.full(2, twice(x))

@numba.njit
def theirs(x):
    return np.full(3, twice(x))
"""


@pytest.mark.some(1)
@pytest.mark.parametrize("order", ["ours, theirs", "theirs, ours"])
def test_kernels_stand_beside_what_others_compile_of_the_same_functions(project: Path, order: str) -> None:
    """Ours, and numba's own: the linker once took a function within our kernel for theirs, and found no address."""
    (project / "engine" / "beside.py").write_text(BESIDE)
    code = f"from engine.beside import ours, theirs; print(*[value for each in ({order}) for value in each(1.0)])"
    assert run(project, code) == ["2.0"] * 5
