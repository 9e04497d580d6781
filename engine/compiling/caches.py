"""Stores compiled kernels on disk, for families of CPUs."""

from __future__ import annotations

import functools
import hashlib
import io
import pickle
from collections.abc import Callable
from typing import Any, Final

import llvmlite.binding
from numba import config as numba_config
from numba.core.caching import NullCache
from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen, get_host_cpu_features
from numba.core.compiler import CompileResult, compile_result
from numba.core.environment import _rebuild_env
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from engine.compiling import require
from engine.compiling.kernel_cache import COMPLETE, cache_folder, read_cached, warn_of_compiling, write_cached
from engine.compiling.sources import as_imported, matches_its_source, source_digest

require(
    {
        NullCache: ("load_overload", "save_overload"),
        CompileResult: ("_reduce",),
        CPUCodeLibrary: ("_set_compiled_object", "enable_object_caching", "_finalize_final_module"),
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

    def _name(self, types: Any, cpu: tuple[str, str]) -> str:
        key = hashlib.sha256(repr((types, cpu)).encode()).hexdigest()[:20]
        return f"{source_digest(self._function.__module__)}/{self._function.__qualname__}-{key}.nbc"

    def load_overload(self, types: Any, target_context: Any) -> CompileResult | None:
        """Return the kernel for `types` and this CPU, else for a family that it belongs to; None if neither is cached.

        numba first imports everything that it can compile, a third of a second; compiling does that by itself.
        """
        rtsys.initialize(target_context)
        for cpu in cpus() if source_digest(self._function.__module__) else ():
            content = read_cached(self._name(types, cpu))
            if content:
                try:
                    parts = _Unpickler(io.BytesIO(content)).load()
                except (ImportError, AttributeError):  # case: the class of an argument has moved to another module
                    continue
                return _rebuilt(target_context, *parts)
        warn_of_compiling(self._function.__module__)
        return None

    def save_overload(self, types: Any, result: CompileResult) -> None:
        """Store the machine code of the kernel compiled for arguments of these types; numba calls this. Nothing is
        stored for code with dynamic globals, or where the code that runs may not be that of the sources on disk, of
        which the file's name has a digest."""
        module = self._function.__module__
        if not result.library.has_dynamic_globals and source_digest(module) and matches_its_source(module):
            (name, _, (code, _)), fndesc, environment, signature, *_, reload, constants = result._reduce()
            constants = [item for item in constants if item.consts]
            content = dumps((name, code, fndesc, environment, signature, reload, constants))
            write_cached(self._name(types, cpus()[0]), content)


class _Unpickler(pickle.Unpickler):
    """Reads a kernel that was compiled while the engine was imported by this name or its other one."""

    def find_class(self, module: str, name: str) -> Any:
        return _rebuilt_env if name == "_rebuild_env" else super().find_class(as_imported(module), name)


def _rebuilt_env(module: str, *more: Any) -> Any:
    return _rebuild_env(as_imported(module), *more)


def _rebuilt(
    context: Any, name: str, code: bytes, fndesc: Any, environment: Any, signature: Any, reload: Any, constants: Any
) -> CompileResult:
    """Return a stored kernel, ready to be called."""
    for prepare in reload:
        prepare()
    codegen = context.codegen()
    library = codegen.create_library(name)
    library.enable_object_caching()
    library._set_compiled_object(code)
    library._finalize_final_module()
    codegen._engine._defined_symbols |= {fndesc.llvm_func_name, fndesc.llvm_cpython_wrapper_name}
    for item in constants:
        codegen.set_env(item.env_name, item)
    return compile_result(
        target_context=context,
        typing_context=context.typing_context,
        library=library,
        environment=environment,
        entry_point=context.get_executable(library, fndesc, environment),
        fndesc=fndesc,
        signature=signature,
        objectmode=False,
        lifted=(),
        reload_init=reload,
        referenced_envs=constants,
    )
