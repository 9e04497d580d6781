"""Stores compiled kernels on disk, for families of CPUs."""

from __future__ import annotations

import functools
import hashlib
import inspect
import io
import pickle
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any, Final

import llvmlite.binding
from numba import config as numba_config
from numba.core.caching import NullCache
from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen, get_host_cpu_features
from numba.core.compiler import CompileResult, compile_result
from numba.core.environment import _rebuild_env
from numba.core.funcdesc import PythonFunctionDescriptor
from numba.core.runtime import rtsys
from numba.core.serialize import NumbaPickler
from numba.core.types import Type
from numba.core.types.abstract import _type_reconstructor  # type: ignore[attr-defined, unused-ignore]
from numba.core.typing import signature

from engine.compiling import require
from engine.compiling.kernel_cache import (
    COMPLETE,
    cache_folder,
    end_turn,
    read_cached,
    wait_for_turn,
    warn_of_compiling,
    write_cached,
)
from engine.compiling.sources import PREFIX, as_imported, matches_its_source, plain_name, source_digest

require(
    {
        NullCache: ("load_overload", "save_overload"),
        CompileResult: ("_find_referenced_environments",),
        CPUCodeLibrary: (
            "_set_compiled_object",
            "_get_compiled_object",
            "enable_object_caching",
            "_finalize_final_module",
        ),
        JITCPUCodegen: ("set_env", "create_library"),
    }
)

_V2 = ("cx16", "popcnt", "sse3", "sse4.1", "sse4.2", "ssse3")
_V3 = (*_V2, "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
_V4 = (*_V3, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl")
BASELINES: Final = {"x86-64-v4": _V4, "x86-64-v3": _V3, "x86-64-v2": _V2, "generic": ()}
"""Families of CPUs whose kernels a host may load, and the features that it needs for that."""


@functools.cache
def cpus() -> list[tuple[str, str]]:
    """Return the CPUs whose kernels are loaded, as numba names them (name, features), first the one compiled for.

    Only the one that ``NUMBA_CPU_NAME`` names, else the host and the families that it belongs to.
    """
    name, features = numba_config.CPU_NAME, numba_config.CPU_FEATURES
    own = (
        llvmlite.binding.get_host_cpu_name() if name is None else name,
        get_host_cpu_features() if features is None else features,
    )
    if name is not None:
        return [own]
    able = llvmlite.binding.get_host_cpu_features()
    return [own, *((family, "") for family, needed in BASELINES.items() if all(map(able.get, needed)))]


def marker_files() -> list[str]:
    """Return the names of the empty files that mark a complete cache for each of `cpus`."""
    return [f"{COMPLETE}-{name}-{hashlib.sha256(features.encode()).hexdigest()[:8]}" for name, features in cpus()]


class KernelCache(NullCache):  # type: ignore[misc]
    """The cached machine code of one kernel: a file for each kind of arguments and CPU.

    numba also stores the bitcode before the last compiler steps, for callers that are compiled later, and parses it at
    each load: more than half of all loading. No compiled function calls a kernel (a test looks), and should one, numba
    says that the kernel is unfit for linking. Empty constants and the annotated source are left out too. numba's own
    files (an index, numbered data, both named by times of sources) may end with another's code if two processes write,
    or one is killed.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    @property
    def cache_path(self) -> str:
        return f"{cache_folder()}/{source_digest(self._function.__module__)}"

    def _name(self, kinds: Any, cpu: tuple[str, str]) -> str:
        key = hashlib.sha256(repr((kinds, *_fields(kinds), cpu)).encode()).hexdigest()[:20]
        return f"{source_digest(self._function.__module__)}/{self._function.__qualname__}-{key}.nbc"

    def load_overload(self, kinds: Any, target_context: Any) -> CompileResult | None:
        """Return the kernel for arguments of these types and this CPU, else for a family that it belongs to; None if
        neither is cached.

        numba first imports everything that it can compile, a third of a second; compiling does that by itself.
        """
        rtsys.initialize(target_context)
        names = [self._name(kinds, cpu) for cpu in cpus()] if source_digest(self._function.__module__) else []
        content = next(filter(None, map(read_cached, names)), None)
        if content is None and names and wait_for_turn(names[0]):
            content = read_cached(names[0])
        if content:
            return self._rebuilt(kinds, target_context, *_Unpickler(io.BytesIO(content)).load())
        warn_of_compiling(self._function.__module__)
        return None

    def _rebuilt(
        self, kinds: Any, context: Any, name: str, code: bytes, result: Any, constants: Any, reload: Any
    ) -> CompileResult:
        """Return a stored kernel, ready to be called."""
        for prepare in reload:
            prepare()
        described = PythonFunctionDescriptor(
            native=True,
            modname=self._function.__module__,
            qualname=self._function.__qualname__,
            unique_name=name,
            doc="",
            typemap=None,
            restype=result,
            calltypes=None,
            args=inspect.getfullargspec(self._function).args,
            kws=(),
            mangler=lambda *_, **__: name,
            argtypes=kinds,
            env_name=constants[-1][2],
        )
        codegen = context.codegen()
        library = codegen.create_library(name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        codegen._engine._defined_symbols |= {name, described.llvm_cpython_wrapper_name}
        environments = [_rebuild_env(as_imported(home), values, at) for home, values, at in constants]
        for environment in environments:
            codegen.set_env(environment.env_name, environment)
        return compile_result(
            target_context=context,
            typing_context=context.typing_context,
            library=library,
            environment=environments[-1],
            entry_point=context.get_executable(library, described, environments[-1]),
            fndesc=described,
            signature=signature(result, *kinds),
            objectmode=False,
            lifted=(),
            reload_init=reload,
            referenced_envs=environments,
        )

    def save_overload(self, kinds: Any, made: CompileResult) -> None:
        """Store the machine code of the kernel compiled for arguments of these types; numba calls this. Nothing is
        stored for code with dynamic globals, or where the code that runs may not be that of the sources on disk, of
        which the file's name has a digest."""
        module = self._function.__module__
        if not made.library.has_dynamic_globals and source_digest(module) and matches_its_source(module):
            others = [each for each in made._find_referenced_environments() if each.consts]
            environments = [each for each in others if each is not made.environment] + [made.environment]
            constants = [(plain_name(each.globals["__name__"]), each.consts, each.env_name) for each in environments]
            name, code, result = made.fndesc.mangled_name, made.library._get_compiled_object(), made.fndesc.restype
            _Pickler(content := io.BytesIO()).dump((name, code, result, constants, made.reload_init))
            write_cached(self._name(kinds, cpus()[0]), content.getvalue())
        end_turn()


def _fields(kinds: Any) -> Iterator[Any]:
    """Yield the names of fields of each named tuple within types: their order may change while the types do not."""
    for kind in kinds:
        yield from (*getattr(kind, "fields", ()), *_fields(getattr(kind, "types", ())))


class _Pickler(NumbaPickler):  # type: ignore[misc]
    """Writes a kernel, with the same bytes whatever name the engine is imported by, and whatever was compiled before
    it: a type has a number in its process."""

    def persistent_id(self, item: Any) -> Any:
        is_ours = isinstance(item, type) and item.__module__.startswith(f"{PREFIX}engine.")
        return (plain_name(item.__module__), item.__qualname__) if is_ours else None

    def reducer_override(self, item: Any) -> Any:
        made: Any = item.__reduce__() if isinstance(item, Type) else None
        if made is None or made[0] is not _type_reconstructor:
            return super().reducer_override(item)
        *by, state = made[1]
        return _type_reconstructor, (*by, {name: value for name, value in state.items() if name != "_code"})


class _Unpickler(pickle.Unpickler):
    """Reads a kernel, whatever name the engine was imported by when it was compiled."""

    def persistent_load(self, name: Any) -> Any:
        return functools.reduce(getattr, name[1].split("."), import_module(as_imported(name[0])))
