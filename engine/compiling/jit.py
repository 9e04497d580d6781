"""The only file that spells compiler options.

Decorators. `kernel`: an outer loop over arrays, called from Python, releases the interpreter lock, cached on disk
(kernel_cache.py). `inline`: a small function that compiled code calls. `merged`: one for which no call is ever left;
`called`: one for which a call always is. None of them makes arrays, so none counts references to any: what it was
handed, its caller keeps. `allocating_kernel` and `allocating` (a `called` one) are for what makes arrays. Arithmetic is
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


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Return what Python calls."""
    more = {} if _compilers is None else {"pipeline_class": _compilers.KernelCompiler}
    return numba.njit(**more, **options)(function)


def complete_signs() -> list[str]:
    """Return the names of the files that say that all is compiled for a CPU, each CPU whose kernels can be run here."""
    return [] if _caches is None else _caches.signs()


class _Kernel:
    """A kernel whose dispatcher is made when it is first called: to make all of them is a third of the import."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._options = _OPTIONS | {"no_cfunc_wrapper": True} | options

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What numba makes of it."""
        compiled = _compiled(self.py_func, **self._options)
        if _caches is not None:
            compiled._cache = _caches.KernelCache(self.py_func)
        return compiled

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*arguments)

    @property
    def signatures(self) -> list[Any]:
        """The types of arguments that it is compiled for by now."""
        return self.dispatcher.signatures if "dispatcher" in vars(self) else []


def kernel(function: Callable[..., Any]) -> Any:
    """Compile an outer loop: called from Python, releases the interpreter lock, cached on disk. It makes no arrays."""
    return _kernel(function, _nrt=False)


def allocating_kernel(function: Callable[..., Any]) -> Any:
    """Compile as `kernel` does, for one that makes arrays: it counts references to them, and returns some maybe."""
    return _kernel(function)


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
        """What numba asks any object for: it knows nothing of this class."""
        return self._dispatcher._numba_type_

    @functools.cached_property
    def _from_python(self) -> Any:
        return _compiled(self.py_func, **_OPTIONS)

    def __call__(self, *arguments: Any) -> Any:
        return self._from_python(*arguments)


def inline(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call, and that makes no arrays; it lives in the kernel's cached code."""
    return function if numba_config.DISABLE_JIT else _Inline(function)


def merged(function: Callable[..., Any]) -> Any:
    """Compile as `inline` does, and never leave a call: for work that costs less than handing over its arguments.

    An array is seven numbers or more there, and a tuple of arrays all of theirs.
    """
    return function if numba_config.DISABLE_JIT else _Inline(function, forceinline=True)


def called(function: Callable[..., Any]) -> Any:
    """Compile as `inline` does, and always leave a call: for long code, the rare exact path of a decision above all.

    What is copied into several callers is worked on in each. `inline` functions below a merged one are merged as well;
    these are not.
    """
    return function if numba_config.DISABLE_JIT else _Inline(function, "CalledCompiler", forceinline=False)


def allocating(function: Callable[..., Any]) -> Any:
    """Compile as `called` does, for a function that makes arrays."""
    return function if numba_config.DISABLE_JIT else _Inline(function, "CalledCompiler", forceinline=False, _nrt=True)


_entries: dict[Any, Any] = {}


def entry_of(kernel: Any, n_names: int = 0) -> Any:
    """Return what calls a kernel directly.

    n_names: where it is compiled for tuples of several lengths as its last argument, the length of this one.

    Caller guarantees that arguments are of the types that the kernel is compiled for: arrays from `as_*` or of a solid,
    and its own. The kernel itself where it is not called yet, or compiled for others as well; uncompiled it is kept
    from warning of what overflows: filters look at that.
    """
    key = (kernel, n_names) if n_names else kernel
    entry = _entries.get(key)
    if entry is None:
        if isinstance(kernel, FunctionType):
            entry = np.errstate(all="ignore")(kernel)
        else:
            made = kernel.dispatcher.overloads.items()
            fitting = [found for types, found in made if n_names in (0, getattr(types[-1], "count", 0))]
            if len(fitting) != 1:
                return kernel
            entry = fitting[0].entry_point
        _entries[key] = entry
    return entry
