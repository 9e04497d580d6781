"""Compiler pipelines of kernels and inner functions: once for each kind of arguments, optimised once."""

from __future__ import annotations

import copy
import functools
import gc
import hashlib
import threading
import types
import warnings
from collections.abc import Callable
from typing import Any

import llvmlite.binding
import numba
import numpy as np
from numba import njit
from numba.core.bytecode import FunctionIdentity
from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.cpu import CPUContext
from numba.core.environment import lookup_environment
from numba.core.funcdesc import default_mangler
from numba.core.lowering import Lower
from numba.core.registry import CPUDispatcher
from numba.core.targetconfig import ConfigStack
from numba.core.typed_passes import NativeLowering, NopythonRewrites
from numba.core.types import Dispatcher
from numba.core.types.misc import unliteral
from numba.core.typing import Context
from numba.core.untyped_passes import InlineClosureLikes

from engine.compiling import require
from engine.compiling.sources import plain_name

require(
    {
        JITCodeLibrary: ("_finalize_final_module", "_finalize_dynamic_globals", "add_linking_library", "finalize"),
        CPUCodeLibrary: (
            "enable_object_caching",
            "_optimize_functions",
            "_optimize_final_module",
            "_get_module_for_linking",
        ),
        JITCPUCodegen: ("set_env", "create_library", "_library_class", "_module_pass_manager"),
        CompilerBase: ("compile_extra", "define_pipelines"),
        ConfigStack: ("top_or_none",),
        Context: ("resolve_function_type", "resolve_getattr"),
        CPUDispatcher: ("get_call_template",),
        NativeLowering: ("run_pass", "lowering_class"),
        CPUContext: ("codegen", "mangler"),
        FunctionIdentity: ("from_function",),
        Lower: ("setup_function",),
    }
)


class _Lower(Lower):  # type: ignore[misc] # numba carries no types
    """Lowers a function that no exception of C++ passes: tables for those are left out."""

    def setup_function(self, descriptor: Any) -> None:
        super().setup_function(descriptor)
        self.function.attributes.add("nounwind")


class _CalledLower(_Lower):
    """Lowers a function that may not be inlined into its callers."""

    def setup_function(self, descriptor: Any) -> None:
        super().setup_function(descriptor)
        self.function.attributes.add("noinline")


class _Library(JITCodeLibrary):  # type: ignore[misc]
    """Unoptimised code; the kernel that links it optimises it together with all that it calls.

    Optimising inner functions separately, again with each of their callers, was a quarter of all compiling.
    """

    def __init__(self, codegen: JITCPUCodegen, name: str) -> None:
        super().__init__(codegen, name)
        self.below: dict[_InnerLibrary, None] = {}  # what is called, directly or not, before its callers

    def add_linking_library(self, library: JITCodeLibrary) -> None:
        if isinstance(library, _InnerLibrary):
            self.below |= library.below
            self.below[library] = None
        else:
            super().add_linking_library(library)

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout


class _InnerLibrary(_Library):
    """Code of a function that only compiled code calls, without machine code of its own."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def own_module(self) -> Any:
        """Return the module that a kernel links, without the libraries it calls."""
        return super()._get_module_for_linking()

    def _get_module_for_linking(self) -> Any:
        """Return one linked module, for callers compiled by stock numba."""
        module = self.own_module().clone()
        for library in reversed(self.below):
            module.link_in(library.own_module(), preserve=True)
        return module


class _KernelLibrary(_Library):
    """Machine code that Python calls, with everything that it calls."""

    def finalize(self) -> None:
        for library in reversed(self.below):  # callers first: the linker drops unreferenced functions
            if hasattr(library, "_reload_init"):  # since numba 0.63
                self._reload_init.update(library._reload_init)
            self._final_module.link_in(library.own_module(), preserve=True)
        super().finalize()

    def _optimize_final_module(self) -> None:
        """Run all passes once: numba runs cheap ones before, for reference counts, of which hardly any are here.

        What is linked in becomes private: a function with one call is inlined whatever its size, and an unused
        argument, such as most arrays of a table, is not passed. It gets a name of its own, since the linker would take
        it for stock numba's version of the same function, and finds no address. Constants, and the addresses of those
        that are empty, become private too: no name of them is in the object file.
        """
        module, named = self._final_module, set()
        for number, function in enumerate(module.functions):
            if function.linkage == llvmlite.binding.Linkage.linkonce_odr:
                function.linkage, function.name = "private", f"inner.{number}"
            else:
                named.add(f"{_CONSTANTS}{function.name[3:]}")
        for number, variable in enumerate(module.global_variables):
            constants = lookup_environment(variable.name)
            is_ours = constants is not None and not constants.consts and variable.name not in named
            if is_ours or variable.linkage == llvmlite.binding.Linkage.internal:
                variable.linkage, variable.name = "private", f"constant.{number}"
        passes, builder = self._codegen._module_pass_manager()
        passes.run(module, builder)


_CONSTANTS = "_ZN08NumbaEnv"
"""What the names of addresses of constants begin with, in place of "_ZN"."""


def _short_name(name: str, kinds: Any, *, abi_tags: Any = (), uid: Any = None) -> str:
    """Return the name of compiled code: the same under both names of the engine, with a hash of its types.

    All types spelt out were half of an object file.
    """
    text = repr((*kinds, *abi_tags)).encode()
    return str(default_mangler(plain_name(name), (), abi_tags=[hashlib.sha256(text).hexdigest()[:12]], uid=uid))


class _InnerCodegen(JITCPUCodegen):  # type: ignore[misc]
    """numba's code generator, with all of its state shared, that makes inner libraries."""

    _library_class = _InnerLibrary

    def __init__(self, shared: JITCPUCodegen) -> None:
        self.__dict__.update(vars(shared))

    def set_env(self, env_name: str, env: Any) -> None:
        """Do nothing: inner libraries have no native environment."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):  # type: ignore[misc]
    """numba's lowering of a kernel; what numba compiles for it on the way becomes an `_InnerLibrary`: code to be linked
    in, without machine code of its own."""

    _name = "engine_kernel_lowering"
    lowering_class = _Lower

    def run_pass(self, state: Any) -> bool:
        context, codegen = state.targetctx, state.targetctx.codegen()
        state.library = self._library(state.func_id.func_qualname, codegen)
        state.targetctx = copy.copy(context)
        state.targetctx.mangler = _short_name
        state.targetctx._internal_codegen = _InnerCodegen(codegen)
        done: bool = super().run_pass(state)
        state.targetctx = context
        self._set_constants(state.library)
        return done

    def _library(self, name: str, codegen: JITCPUCodegen) -> JITCodeLibrary:
        library = _KernelLibrary(codegen, name)
        library.enable_object_caching()
        return library

    def _set_constants(self, library: JITCodeLibrary) -> None:
        """Set the address of the constants of all functions in the machine code."""
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


@register_pass(mutates_CFG=True, analysis_only=False)
class _CalledLowering(_InnerLowering):
    _name = "engine_called_lowering"
    lowering_class = _CalledLower


class _Typing(Context):  # type: ignore[misc]
    """numba's typing context, with all of its state shared, that memoises the types of built-in functions.

    numba compiles those that it writes in Python (`max`, `np.empty`) with options of the first caller; of ours, one
    matters there: `_typing`.
    """

    def __init__(self, shared: Context) -> None:
        self.__dict__.update(vars(shared))
        self._shared = shared
        self._known: dict[Any, Any] = {}

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        if kws or isinstance(func, (Dispatcher, str)):  # "static_getitem" takes numbers, slices
            return self._shared.resolve_function_type(func, args, kws)
        return self._memoized((func, args), self._shared.resolve_function_type, func, args, kws)

    def resolve_getattr(self, typ: Any, attr: str) -> Any:
        return self._memoized((attr, typ), self._shared.resolve_getattr, typ, attr)

    def _memoized(self, key: Any, compute: Callable[..., Any], *arguments: Any) -> Any:
        if key not in self._known:
            self._known[key] = compute(*arguments)
        return self._known[key]


@functools.cache
def _typing(shared: Context, counts: bool) -> _Typing:
    """Return the typing context for functions that count references, or that do not."""
    return _Typing(shared)


def forget_paths() -> None:
    """Compile from now on as if sources were files of no folder. Code that raises holds the name of its file, and where
    numba is installed stood in kernels that sort. For a process that only compiles."""
    identify = FunctionIdentity.from_function

    def without_path(function: Any) -> Any:
        identity = identify(function)
        identity.filename = f"{plain_name(identity.modname)}.py"
        return identity

    FunctionIdentity.from_function = without_path


def _check_result(context: Any, result: Any, name: str) -> None:
    """Raise TypeError for a result with arrays, if only one side would count references to them."""
    if context.data_model_manager[result].contains_nrt_meminfo():
        raise TypeError(f"{name} returns {result}: that needs an allocating function below an allocating kernel")


class KernelCompiler(CompilerBase):  # type: ignore[misc]
    """numba's own pipeline, but for the library that a function is lowered into."""

    lowering: type[NativeLowering] = _KernelLowering

    def __init__(self, typing: Context, *more: Any) -> None:
        super().__init__(typing, *more)
        self.state.typingctx = _typing(typing, bool(self.state.flags.nrt))

    def compile_extra(self, function: Any) -> Any:
        """Compile, with the garbage collector relaxed (10 % of compile time).

        Raises: TypeError if a kernel that does not count references returns arrays: Python would free them; if one
        returns a named tuple: its machine code would look for the class by the module's name of today.
        """
        usual = gc.get_threshold()
        gc.set_threshold(50_000, 20, 50)
        try:
            made = super().compile_extra(function)
        finally:
            gc.set_threshold(*usual)
        result = made.signature.return_type
        if type(self) is KernelCompiler and not self.state.flags.nrt:
            _check_result(self.state.targetctx, result, function.__qualname__)
        if type(self) is KernelCompiler and hasattr(result, "instance_class"):
            raise TypeError(f"{function.__qualname__} returns {result}: another process may import its class elsewhere")
        return made

    def define_pipelines(self) -> list[Any]:
        """Drop the passes for whole-array expressions, and for closures in a function that has none."""
        if not compiles_correctly():
            return [DefaultPassBuilder.define_nopython_pipeline(self.state)]
        steps = DefaultPassBuilder.define_nopython_pipeline(self.state)
        has_inner = any(isinstance(item, types.CodeType) for item in self.state.func_id.code.co_consts)
        without = {NopythonRewrites} if has_inner else {NopythonRewrites, InlineClosureLikes}
        retained = [item for item in steps.passes if item[0] not in without]
        steps.passes = [(self.lowering if step is NativeLowering else step, text) for step, text in retained]
        steps.finalize()
        return [steps]


class DirectCompiler(KernelCompiler):
    """Compiles an inner function for calls from Python, which is not cached: it may return named tuples."""


class InnerCompiler(KernelCompiler):
    lowering = _InnerLowering


class CalledCompiler(KernelCompiler):
    lowering = _CalledLowering


class InnerDispatcher(CPUDispatcher):  # type: ignore[misc]
    """Compiles a function once for ``int``, not again for each integer literal.

    Nor again for callers that count references and callers that do not: its effect on the counts of its arguments is
    neutral either way. Arrays that it returned, counted by one side alone, would be freed while in use, or never.

    Raises: TypeError if a function that returns arrays, and its caller, do not both count.
    """

    def __repr__(self) -> str:
        """Return its name, part of the names of those it is passed to."""
        return f"{plain_name(self.py_func.__module__)}.{self.py_func.__qualname__}"

    def get_call_template(self, args: Any, kws: Any) -> Any:
        plain = {name: unliteral(kind) for name, kind in kws.items()}
        template = super().get_call_template(tuple(map(unliteral, args)), plain)
        if self.targetoptions["_nrt"] != bool(ConfigStack.top_or_none().nrt):
            for made in self.overloads.values():
                _check_result(self.targetctx, made.signature.return_type, self.py_func.__qualname__)
        return template


_canary = threading.local()


@functools.cache
def compiles_correctly() -> bool:
    """Return whether a small kernel, compiled by our pipeline, answers as Python does; log a warning if not.

    Called before the first function is compiled. If the answer is no, stock numba's pipeline is used.
    """
    if getattr(_canary, "is_checked", False):
        return True
    _canary.is_checked = True
    try:
        options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
        inner = InnerDispatcher(
            _step,
            targetoptions={"nopython": True, **options, "no_cpython_wrapper": True},
            pipeline_class=CalledCompiler,
        )
        run = types.FunctionType(_sum_of_steps.__code__, {**globals(), "_step": inner}, _sum_of_steps.__name__)
        rows, places = np.array([[1.0, -2.0], [0.1, 0.7], [1e300, 5e-324]]), np.arange(3)
        given = rows.copy()
        expected, made = _sum_of_steps(rows, places), njit(pipeline_class=KernelCompiler, **options)(run)(given, places)
        if made == expected and given.tobytes() == rows.tobytes():
            return True
        reason = f"{made!r} instead of {expected!r}"
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
    finally:
        _canary.is_checked = False
    text = f"numba {numba.__version__} does not compile as expected ({reason}): its own, slower steps are taken"
    warnings.warn(text, RuntimeWarning, stacklevel=1)
    return False


def _step(rows: Any, place: Any, scale: float) -> tuple[float, int]:
    row = rows[place]
    return scale * row[0] + abs(row[-1]), int(place) + 1


def _sum_of_steps(rows: Any, places: Any) -> tuple[float, int]:
    total, last = 0.0, -1
    for place in places:
        value, last = _step(rows, place, 0.5)
        total = max(total, value) if last & 1 else total - value
        rows[last - 1, 0] = total
    for row in rows:
        row[0] *= 0.5
    return total, last
