"""The only file that spells compiler options, and where compiled code is kept.

Decorators. `kernel`: an outer loop over arrays, called from Python, releases the interpreter lock, cached on disk.
`inline`: a small function that compiled code calls. `merged`: one for which no call is ever left; `called`: one for
which a call always is. `bare_kernel` and `allocating` are a kernel, and what it calls, without counted references.
Arithmetic is strict IEEE double: `fastmath` is off everywhere, and nothing is fused unless
`fma` (error_free.py) is called by name.

**The cache.** numba looks at the file of the kernel only, so a cached kernel would not notice that a helper in another
file changed. Each module therefore caches into a folder named by a hash of its own source and of every engine module
it imports, directly or not. The folder is taken from the first of these that can be written:

1. ``ENGINE_CACHE_DIR``;
2. ``XDG_CACHE_HOME`` or ``~/.cache``, then ``exact-geometry``;
3. a private folder of this user under the system's temporary folder.

Where none can be written, kernels are compiled anew in each process. ``ENGINE_CACHE_SEED`` names a filled, possibly
read-only folder (an image's) that is copied there first.
"""

from __future__ import annotations

import copy
import functools
import hashlib
import os
import re
import shutil
import sys
import tempfile
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba import config as numba_config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, UserProvidedCacheLocator
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder, compile_result
from numba.core.compiler_machinery import register_pass
from numba.core.environment import lookup_environment
from numba.core.lowering import Lower
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys
from numba.core.typed_passes import NativeLowering
from numba.core.types.misc import unliteral

KERNELS: list[Any] = []
"""Every kernel of the modules imported so far, for the tests of `engine.warm`."""

COMPLETE = "complete"
"""Name of the empty file that says of a cache folder that nothing is left to compile (cold_start.py)."""

_OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy"}
_ROOT = Path(__file__).resolve().parent
_IMPORT = re.compile(
    r"^[ \t]*(?:from\s+engine([.\w]*)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+engine([.\w]+))", re.MULTILINE
)


@functools.cache
def _source(module: str) -> str | None:
    """Return the source text of the dotted engine `module`, None if there is no such file."""
    base = _folder(module)
    for path in (base.with_suffix(".py"), base / "__init__.py"):
        if module != "engine" and path.is_file():
            return path.read_text("utf-8")
    return None


@functools.cache
def imported_modules(module: str) -> set[str]:
    """Return the engine modules that `module` names in its import lines (``engine/__init__`` is left out)."""
    found: set[str] = set()
    for match in _IMPORT.finditer(_source(module) or ""):
        package = "engine" + (match[1] or match[3] or "")
        candidates = [package]
        if _folder(package).is_dir():
            names = re.findall(r"\w+", re.sub(r"#.*|\bas\s+\w+", "", match[2] or ""))
            candidates += [f"{package}.{name}" for name in names]
        found.update(name for name in candidates if _source(name) is not None)
    return found


def _folder(module: str) -> Path:
    return _ROOT.joinpath(*module.split(".")[1:])


@functools.cache
def source_digest(module: str) -> str:
    """Return a hash of `module`, of all engine modules below it, of this file and of numba's version."""
    reached, waiting = set(), {module, "engine.jit"}
    while waiting:
        name = waiting.pop()
        reached.add(name)
        waiting |= imported_modules(name) - reached
    digest = hashlib.sha256(numba.__version__.encode())
    for name in sorted(reached):
        digest.update(f"\0{name}\0".encode() + _source_hash(name))
    return digest.hexdigest()[:20]


@functools.cache
def _source_hash(module: str) -> bytes:
    return hashlib.sha256(str(_source(module)).encode()).digest()


def _is_writable(folder: Path) -> bool:
    """Tell whether `folder` belongs to this user and a file can be made in it; make the folder if it is missing."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if hasattr(os, "getuid") and folder.stat().st_uid != os.getuid():
            return False  # compiled code is run as found: never from another user's folder
        with tempfile.TemporaryFile(dir=folder):
            return True
    except (OSError, RuntimeError):
        return False


def _candidates() -> Iterator[Path]:
    if named := os.environ.get("ENGINE_CACHE_DIR"):
        yield Path(named)
    with suppress(RuntimeError):  # no home folder at all
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "exact-geometry"
    user = os.getuid() if hasattr(os, "getuid") else "user"
    yield Path(tempfile.gettempdir()) / f"exact-geometry-{user}"


@functools.cache
def cache_folder() -> Path | None:
    """Return the folder that holds compiled code, None where nothing can be written."""
    folder = next((folder for folder in _candidates() if _is_writable(folder)), None)
    seed = os.environ.get("ENGINE_CACHE_SEED")
    if folder is not None and seed:
        with suppress(OSError):  # a disk that is full: what is missing gets compiled
            _copy_seed(Path(seed), folder)
    return folder


def _copy_seed(seed: Path, folder: Path) -> None:
    """Copy what `folder` lacks: data (.nbc), the indexes (.nbi) that name them, then the signs, each in one step."""
    for source in [file for part in ("*.nbc", "*.nbi", COMPLETE) for file in sorted(seed.rglob(part))]:
        target = folder / source.relative_to(seed)
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            part = target.with_name(f"{target.name}.{uuid.uuid4().hex}")
            shutil.copyfile(source, part)  # not its mode: a seed may be read-only
            part.replace(target)


class _CacheFile(IndexDataCacheFile):  # type: ignore[misc] # numba carries no types
    """numba's cache file, made safe between processes and for trouble with the disk.

    numba numbers the data files of a function and writes the index first: two processes that compile two signatures at
    once may end with an index that names the other's code, and a process killed in between leaves an index that names
    old code. Here every data file has a name of its own and is complete before an index names it; what two processes
    can lose is an entry of the index, which costs one more compilation. The folder is named by the sources, so the
    time stamp of the file, which a copied checkout changes, is left out.
    """

    def save(self, key: object, data: object) -> None:
        with suppress(OSError):  # disk full or read-only by now: the kernel is compiled, the call must not fail
            name = self._data_name_pattern.format(number=uuid.uuid4().int)
            self._save_data(name, data)
            self._save_index({**self._load_index(), key: name})

    def load(self, key: object) -> Any:
        try:
            return super().load(key)
        except Exception:  # damaged in any way: compile anew
            return None

    def _load_index(self) -> dict[object, str]:
        try:
            index: dict[object, str] = super()._load_index()
        except Exception:
            return {}
        return index


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc] # numba carries no types
    """Names the folder and the file of one kernel; numba's own would look for a folder that can be written first."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._py_file = function.__code__.co_filename
        self._lineno = function.__code__.co_firstlineno
        self._cache_path = str(folder / source_digest(function.__module__))


class _Implementation(CompileResultCacheImpl):  # type: ignore[misc]
    """How compiled code is written and read, at the place that `_Locator` names.

    Machine code alone. numba puts the code from before the last steps of compiling beside it, for callers that are
    compiled later, and parses that at each load: more than half of all loading. No compiled function calls a kernel (a
    test looks), and should one, numba says that the kernel is unfit for linking. The constants of a function that has
    none, and the annotated source, are left out too.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Locator(function, folder)
        name = f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}"
        self._filename_base = self.get_filename_base(name, getattr(sys, "abiflags", ""))

    def reduce(self, result: CompileResult) -> Any:
        """Return what is kept of a compiled kernel."""
        (name, _, (code, _)), fndesc, environment, signature, *_, reload, constants = super().reduce(result)
        constants = [item for item in constants if item.consts]
        return name, code, fndesc, environment, signature, reload, constants

    def rebuild(self, target_context: Any, payload: Any) -> CompileResult:
        """Return the kernel of which `payload` is kept, ready to be called."""
        name, code, fndesc, environment, signature, reload, constants = payload
        for prepare in reload:
            prepare()
        codegen = target_context.codegen()
        library = codegen.create_library(name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        codegen._engine._defined_symbols |= {fndesc.llvm_func_name, fndesc.llvm_cpython_wrapper_name}
        for item in constants:
            codegen.set_env(item.env_name, item)
        return compile_result(
            target_context=target_context,
            typing_context=target_context.typing_context,
            library=library,
            environment=environment,
            entry_point=target_context.get_executable(library, fndesc, environment),
            fndesc=fndesc,
            signature=signature,
            objectmode=False,
            lifted=(),
            reload_init=reload,
            referenced_envs=constants,
        )


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """The cache of one kernel, looked for at its first call: importing the engine reads no source but Python's."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._name, self._py_func, self._folder = repr(function), function, folder
        self.enable()

    @functools.cached_property
    def _impl(self) -> _Implementation:
        return _Implementation(self._py_func, self._folder)

    @functools.cached_property
    def _cache_path(self) -> str:
        path: str = self._impl.locator.get_cache_path()
        return path

    @functools.cached_property
    def _cache_file(self) -> _CacheFile:
        return _CacheFile(self._cache_path, self._impl.filename_base, source_stamp=None)

    def load_overload(self, signature: Any, target_context: Any) -> CompileResult | None:
        """Return the kernel for `signature`, None if it is not there.

        numba first brings in everything that it can compile, a third of a second; compiling does that by itself.
        """
        rtsys.initialize(target_context)
        return self._load_overload(signature, target_context)


class _InnerLibrary(JITCodeLibrary):  # type: ignore[misc] # numba carries no types
    """Code of a function that only compiled code calls: linked into its callers, which are optimised as a whole.

    Neither what numba does to a whole library, half of the compiler's time, nor machine code: both would be thrown
    away. Each function by itself is simplified as ever, before it is linked.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _InnerCodegen(JITCPUCodegen):  # type: ignore[misc]
    """numba's own generator of code, all of its state shared, but for the kind of library that it makes."""

    _library_class = _InnerLibrary

    def __init__(self, shared: JITCPUCodegen) -> None:
        self.__dict__.update(vars(shared))

    def set_env(self, env_name: str, env: Any) -> None:
        """Leave that to the kernels: inner code stands nowhere that could be told of its constants."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):  # type: ignore[misc]
    """Writes a kernel; what numba itself compiles to be called from there becomes inner libraries."""

    _name = "engine_kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        context, codegen = state.targetctx, state.targetctx.codegen()
        state.library = self._library(state.func_id.func_qualname, codegen)
        state.targetctx = copy.copy(context)
        state.targetctx._internal_codegen = _InnerCodegen(codegen)
        done: bool = super().run_pass(state)
        state.targetctx = context
        self._set_constants(state.library)
        return done

    def _library(self, name: str, codegen: JITCPUCodegen) -> JITCodeLibrary:
        library = codegen.create_library(name)
        library.enable_object_caching()
        return library

    def _set_constants(self, library: JITCodeLibrary) -> None:
        """Tell the machine code where the constants of all functions in it are."""
        for name in [variable.name for variable in library._final_module.global_variables]:
            if (environment := lookup_environment(name)) is not None:
                library.codegen.set_env(name, environment)


@register_pass(mutates_CFG=True, analysis_only=False)
class _InnerLowering(_KernelLowering):
    _name = "engine_inner_lowering"

    def _library(self, name: str, codegen: JITCPUCodegen) -> JITCodeLibrary:
        return _InnerLibrary(_InnerCodegen(codegen), name)

    def _set_constants(self, library: JITCodeLibrary) -> None:
        pass


class _CalledLower(Lower):  # type: ignore[misc]
    """Writes a function that the compiler may not copy into its callers."""

    def setup_function(self, fndesc: Any) -> None:
        super().setup_function(fndesc)
        self.function.attributes.add("noinline")


@register_pass(mutates_CFG=True, analysis_only=False)
class _CalledLowering(_InnerLowering):
    _name = "engine_called_lowering"

    @property
    def lowering_class(self) -> type[Lower]:
        return _CalledLower


class _KernelCompiler(CompilerBase):  # type: ignore[misc]
    """numba's own steps, but for how a function is written."""

    lowering: type[NativeLowering] = _KernelLowering

    def define_pipelines(self) -> list[Any]:
        steps = DefaultPassBuilder.define_nopython_pipeline(self.state)
        steps.passes = [(self.lowering if step is NativeLowering else step, text) for step, text in steps.passes]
        steps.finalize()
        return [steps]


class _InnerCompiler(_KernelCompiler):
    lowering = _InnerLowering


class _CalledCompiler(_KernelCompiler):
    lowering = _CalledLowering


class _InnerDispatcher(CPUDispatcher):  # type: ignore[misc]
    """Compiles a function once for ``int``, not again for each number that a caller spells out."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        plain = {name: unliteral(kind) for name, kind in kws.items()}
        return super().get_call_template(tuple(map(unliteral, args)), plain)


class _Kernel:
    """A kernel whose dispatcher is made when it is first called: to make all of them is a third of the import."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._options = _OPTIONS | options

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What numba makes of it."""
        compiled = numba.njit(pipeline_class=_KernelCompiler, **self._options)(self.py_func)
        folder = cache_folder()
        if folder is not None:
            compiled._cache = _KernelCache(self.py_func, folder)
        return compiled

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*arguments)

    @property
    def signatures(self) -> list[Any]:
        """The types of arguments that it is compiled for by now."""
        return self.dispatcher.signatures if "dispatcher" in vars(self) else []


def kernel(function: Callable[..., Any]) -> Any:
    """Compile an outer loop: called from Python, releases the interpreter lock, cached on disk."""
    return _kernel(function)


def bare_kernel(function: Callable[..., Any]) -> Any:
    """Compile as `kernel` does, without counting references to arrays, there and in all that it calls.

    Nothing below may make an array, or assign a part of one to another, unless it is `allocating`.
    """
    return _kernel(function, _nrt=False)


def _kernel(function: Callable[..., Any], **options: Any) -> Any:
    if numba_config.DISABLE_JIT:
        return function
    KERNELS.append(_Kernel(function, **options))
    return KERNELS[-1]


class _Inline:
    """A function for compiled callers only; the compiler is told of it when it first compiles a caller.

    Where all callers come from the cache it never is: making a dispatcher takes half a millisecond, and there are
    hundreds. The wrappers that let Python call it are left out, a third of all compile time; a call from Python (a
    test, a debugger) compiles it a second time, with them.
    """

    def __init__(
        self, function: Callable[..., Any], compiler: type[CompilerBase] = _InnerCompiler, **options: Any
    ) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._compiler = compiler
        self._options = _OPTIONS | {"nopython": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True} | options

    @functools.cached_property
    def _dispatcher(self) -> CPUDispatcher:
        return _InnerDispatcher(self.py_func, targetoptions=self._options, pipeline_class=self._compiler)

    @property
    def _numba_type_(self) -> Any:
        """What numba asks any object for: it knows nothing of this class."""
        return self._dispatcher._numba_type_

    @functools.cached_property
    def _from_python(self) -> Any:
        return numba.njit(pipeline_class=_KernelCompiler, **_OPTIONS)(self.py_func)

    def __call__(self, *arguments: Any) -> Any:
        return self._from_python(*arguments)


def inline(function: Callable[..., Any]) -> Any:
    """Compile a small function that kernels call; it lives in the caller's cached code."""
    return function if numba_config.DISABLE_JIT else _Inline(function)


def merged(function: Callable[..., Any]) -> Any:
    """Compile as `inline` does, and never leave a call: for work that costs less than counting the arrays it is handed.

    The compiler counts references to arrays at every call that it leaves; merged calls let it drop most of that.
    """
    return function if numba_config.DISABLE_JIT else _Inline(function, forceinline=True)


def called(function: Callable[..., Any]) -> Any:
    """Compile as `inline` does, and always leave a call: for long code, the rare exact path of a decision above all.

    The compiler works on everything below a function again with each of its callers, and what it copies there grows
    from one to the next. `inline` functions below a merged one are merged as well; these are not.
    """
    return function if numba_config.DISABLE_JIT else _Inline(function, _CalledCompiler, forceinline=False)


def allocating(function: Callable[..., Any]) -> Any:
    """Compile as `called` does, for a function below a bare kernel that makes arrays of its own and returns none."""
    return function if numba_config.DISABLE_JIT else _Inline(function, _CalledCompiler, forceinline=False, _nrt=True)
