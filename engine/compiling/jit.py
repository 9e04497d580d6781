"""The only file that spells compiler options.

Decorators. `kernel`: an outer loop over arrays, called from Python, releases the interpreter lock, cached on disk
(kernel_cache.py). `inline`: a small function that compiled code calls. `merged`: one that is always inlined; `called`:
one that never is. None of them makes arrays, so none counts references: the caller owns the arguments.
`allocating_kernel` and `allocating` (a `called` one) are for what makes arrays. Arithmetic is
strict IEEE double: `fastmath` is off everywhere, and nothing is fused unless `fma` (error_free.py) is called by name.

What is not in numba's documentation stands in compiling/, in two parts that do not need each other: `compilers` makes
compiling three times as fast, `caches` keeps kernels on disk. Where this numba lacks what one of them takes from it, a
warning says so, and kernels are compiled, or cached, without that part: as right and as fast.

Calls compiled kernels without asking each argument for its type, which takes up to 3 us.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba import config as numba_config

_caches: Any = None
_compilers: Any = None
try:
    import engine.compiling.caches as _caches
except (ImportError, AttributeError) as error:
    warnings.warn(f"kernels are compiled again in each process: {error}", RuntimeWarning, stacklevel=1)
try:
    import engine.compiling.compilers as _compilers
except (ImportError, AttributeError) as error:
    warnings.warn(f"compiling takes three times as long: {error}", RuntimeWarning, stacklevel=1)

KERNELS: list[Any] = []
"""Every kernel of the modules imported so far, for the tests of `engine.warm`."""

_OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy"}


def _compiled(function: Callable[..., Any], compiler: str = "KernelCompiler", **options: Any) -> Any:
    """Return the callable of a decorated function."""
    more = {} if _compilers is None else {"pipeline_class": getattr(_compilers, compiler)}
    return numba.njit(**more, **options)(function)


def completion_markers() -> list[str]:
    """Return the names of the marker files of a complete cache, for each CPU whose kernels can run here."""
    return [] if _caches is None else _caches.marker_files()


class _Kernel:
    """A kernel whose dispatcher is made at its first call: making all of them is a third of the import time."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._options = _OPTIONS | {"no_cfunc_wrapper": True} | options

    @functools.cached_property
    def dispatcher(self) -> Any:
        """numba's dispatcher."""
        compiled = _compiled(self.py_func, **self._options)
        if _caches is not None:
            compiled._cache = _caches.KernelCache(self.py_func)
        return compiled

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*arguments)

    @property
    def signatures(self) -> list[Any]:
        """The argument types for which it is compiled so far."""
        return self.dispatcher.signatures if "dispatcher" in vars(self) else []


def kernel(function: Callable[..., Any]) -> Any:
    """Compile an outer loop: called from Python, releases the interpreter lock, cached on disk. It makes no arrays."""
    return _kernel(function, _nrt=False)


def as_kernel(function: Any) -> Any:
    """Compile a `called` function as a `kernel` too: what is loaded from the cache cannot be called by another."""
    return kernel(getattr(function, "py_func", function))


def allocating_kernel(function: Callable[..., Any]) -> Any:
    """Compile as `kernel` does, for one that makes arrays: it counts references to them, and returns some maybe."""
    return _kernel(function)


def _kernel(function: Callable[..., Any], **options: Any) -> Any:
    if numba_config.DISABLE_JIT:
        return function
    KERNELS.append(_Kernel(function, **options))
    return KERNELS[-1]


class _Inline:
    """A function for compiled callers only; its dispatcher is made when the first caller is compiled.

    If all callers come from the cache it never is: making a dispatcher takes half a millisecond, and there are
    hundreds. The wrappers that let Python call it are left out, a third of all compile time; a call from Python (a
    test, a debugger) compiles it a second time, with them.
    """

    def __init__(self, function: Callable[..., Any], compiler: str = "InnerCompiler", **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._compiler = compiler
        self._options = _OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False} | options

    @functools.cached_property
    def _dispatcher(self) -> Any:
        if _compilers is None:
            return numba.njit(**self._options)(self.py_func)
        options = {"nopython": True, **self._options}
        compiler = getattr(_compilers, self._compiler)
        return _compilers.InnerDispatcher(self.py_func, targetoptions=options, pipeline_class=compiler)

    @property
    def _numba_type_(self) -> Any:
        """numba's protocol for the type of any object: it does not know this class."""
        return self._dispatcher._numba_type_

    @functools.cached_property
    def _from_python(self) -> Any:
        return _compiled(self.py_func, "DirectCompiler", **_OPTIONS)

    def __call__(self, *arguments: Any) -> Any:
        return self._from_python(*arguments)


def inline(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call, and that makes no arrays; its code is part of the kernel's."""
    return function if numba_config.DISABLE_JIT else _Inline(function)


def merged(function: Callable[..., Any]) -> Any:
    """Compile as `inline` does, and always inline: for work that costs less than passing its arguments.

    An array is seven numbers or more there, and a tuple of arrays all of theirs.
    """
    return function if numba_config.DISABLE_JIT else _Inline(function, forceinline=True)


def called(function: Callable[..., Any]) -> Any:
    """Compile as `inline` does, and never inline: for long code, above all the rare exact path of a decision.

    What is inlined into several callers is compiled in each. `inline` functions below a merged one are inlined as well;
    these are not.
    """
    return function if numba_config.DISABLE_JIT else _Inline(function, "CalledCompiler", forceinline=False)


def allocating(function: Callable[..., Any]) -> Any:
    """Compile as `called` does, for a function that makes arrays."""
    return function if numba_config.DISABLE_JIT else _Inline(function, "CalledCompiler", forceinline=False, _nrt=True)


_entries: dict[Any, Any] = {}


def entry_of(kernel: Any, n_names: int = 0) -> Any:
    """Return the compiled entry point of a kernel, called without dispatch on types.

    n_names: length of the last argument, a tuple, if the kernel is compiled for several lengths.

    Caller guarantees that arguments have the types for which the kernel is compiled: arrays from `as_*` or of a solid.
    The kernel itself is returned if it was not called yet, or is compiled for other types as well; uncompiled it is
    wrapped to suppress warnings of overflow, which filters test.
    """
    key = (kernel, n_names) if n_names else kernel
    entry = _entries.get(key)
    if entry is None:
        if isinstance(kernel, FunctionType):
            entry = np.errstate(all="ignore")(kernel)
        else:
            made = kernel.dispatcher.overloads.items()
            fitting = [compiled for types, compiled in made if n_names in (0, getattr(types[-1], "count", 0))]
            if len(fitting) != 1:
                return kernel
            entry = fitting[0].entry_point
        _entries[key] = entry
    return entry
