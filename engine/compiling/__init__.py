"""All that the engine takes from numba's inside; where a name is missing, importing this fails and says which.

`compilers` are the steps by which kernels and inner functions are compiled, `caches` keep them on disk. A function is
written in LLVM's language by `lowering`, its operations by `operations`, its calls by `conventions`; `tidying` leaves
out what nobody uses.
"""

import numba
from numba.core.caching import NullCache
from numba.core.callconv import CPUCallConv
from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompilerBase, CompileResult
from numba.core.cpu import CPUContext
from numba.core.lowering import Lower
from numba.core.registry import CPUDispatcher
from numba.core.targetconfig import ConfigStack
from numba.core.typed_passes import NativeLowering
from numba.core.typing import Context

_ASKED_FOR = {
    JITCodeLibrary: ("_finalize_final_module", "_finalize_dynamic_globals", "add_linking_library", "add_ir_module"),
    CPUCodeLibrary: (
        *("_set_compiled_object", "enable_object_caching", "_optimize_functions", "_optimize_final_module"),
        *("_get_module_for_linking", "finalize"),
    ),
    JITCPUCodegen: ("set_env", "create_library", "_library_class", "_module_pass_manager"),
    NullCache: ("load_overload", "save_overload"),
    CompileResult: ("_reduce",),
    CompilerBase: ("compile_extra",),
    ConfigStack: ("top_or_none",),
    Context: ("resolve_function_type", "resolve_getattr"),
    CPUDispatcher: ("get_call_template",),
    NativeLowering: ("run_pass", "lowering_class"),
    CPUContext: (
        *("call_conv", "declare_function", "insert_user_function", "get_function", "get_getattr", "make_tuple"),
        *("pair_first", "pair_second", "enable_nrt", "enable_boundscheck"),
    ),
    CPUCallConv: ("_return_errcode_raw", "_get_return_argument", "_get_arg_packer", "call_function", "return_value"),
    Lower: (
        *("lower", "lower_block", "lower_assign", "lower_getitem", "lower_setitem", "pre_block", "post_block"),
        *("_find_singly_assigned_variable", "_disable_sroa_like_opt", "_cast_var", "getvar", "loadvar", "call_conv"),
        "setup_function",
    ),
}
for _owner, _names in _ASKED_FOR.items():
    for _name in _names:
        if not hasattr(_owner, _name):
            raise ImportError(f"numba {numba.__version__} has no {_owner.__name__}.{_name}")
