"""How a function of ours is written in LLVM's language: a third of what numba writes.

Most of the time of compiling goes by how much there is to write, read again and simplify. numba writes for the general
case: an array is handed over as seven numbers or more, each index first copies all of them to memory, each call asks
whether the other has raised, each variable has a place in memory that is zeroed when it ends. Here

- a C array is handed over as its data and shape, and a function that cannot raise is not asked (conventions.py);
- an index by whole numbers, a loop over a `range`, `len`, `min` and `max` are written directly (operations.py);
- a variable that is set once, and before each use, is its value (`PlainLower`);
- parts of a tuple are taken from where they were put in, and what nobody uses is left out (tidying.py).

All else, arithmetic above all, is what numba writes.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core.analysis import compute_cfg_from_blocks, compute_use_defs
from numba.core.cpu import CPUContext
from numba.core.ir import Assign, Del
from numba.core.lowering import Lower

from engine.compiling.conventions import CANNOT_RAISE, Convention, PlainConvention, PlainDescriptor, calling, declare
from engine.compiling.operations import WAYS, getitem, setitem
from engine.compiling.values import NITEMS, SHAPE, Parts, is_plain, part


class PlainContext(CPUContext):  # type: ignore[misc]
    """numba's knowledge of how each operation is written; a copy of its own becomes one by its class alone.

    counts_from_the_first: whether the function to be written is of `FROM_THE_FIRST`.
    """

    counts_from_the_first = False

    @property
    def call_conv(self) -> Convention:
        return Convention(self)

    def declare_function(self, module: Any, descriptor: Any) -> Any:
        if isinstance(descriptor, PlainDescriptor):
            return declare(PlainConvention(self), module, descriptor)
        return super().declare_function(module, descriptor)

    def insert_user_function(self, function: Any, descriptor: Any, libraries: Any = ()) -> None:
        if isinstance(descriptor, PlainDescriptor):
            call = calling(descriptor, libraries)
            self._defns[function].append(call, call.signature)  # type: ignore[attr-defined]
        else:
            super().insert_user_function(function, descriptor, libraries)

    def get_function(self, function: Any, signature: Any, _firstcall: bool = True) -> Any:
        """Return our way of writing an operation, else numba's."""
        if function in ("static_getitem", "static_setitem") and isinstance(signature.args[0], types.Array):
            raise NotImplementedError(function)  # numba has none either, and looks for new ones first
        usual, choose = super().get_function, WAYS.get(getattr(function, "typing_key", function))
        way = None if choose is None else choose(self, signature)
        if way is None:
            return usual(function, signature, _firstcall)

        def write(builder: Any, values: Any, location: Any = None) -> Any:
            written = way(builder, *values)
            return usual(function, signature)(builder, values) if written is NotImplemented else written

        return write

    def get_getattr(self, kind: Any, name: str) -> Any:
        if is_plain(kind) and name in ("shape", "size"):
            place = SHAPE if name == "shape" else NITEMS
            return lambda context, builder, kind, value, name: part(builder, value, place)
        return super().get_getattr(kind, name)

    def make_tuple(self, builder: Any, kind: Any, values: Any) -> Any:
        return Parts(self.get_value_type(kind), list(values))

    def pair_first(self, builder: Any, value: Any, kind: Any) -> Any:
        return part(builder, value, 0)

    def pair_second(self, builder: Any, value: Any, kind: Any) -> Any:
        return part(builder, value, 1)


class PlainLower(Lower):  # type: ignore[misc]
    """Writes one function. Most of what numba does at each step is for debuggers, and for references to arrays."""

    _disable_sroa_like_opt = False

    def _find_singly_assigned_variable(self) -> None:
        # case: a generator, which keeps between two values what has a place in memory, and nothing else
        self._as_usual = self.context.enable_nrt or self.func_ir.func_id.is_generator
        if self._as_usual:
            super()._find_singly_assigned_variable()
        else:
            self._singly_assigned_vars = _values(self.blocks)
            self._blk_local_varmap: dict[str, Any] = {}

    def lower_block(self, block: Any) -> None:
        self.pre_block(block)
        for step in block.body:
            self.loc = step.loc
            if self._as_usual or not isinstance(step, (Assign, Del)):
                self.lower_inst(step)
            elif isinstance(step, Assign):
                self._assign(step)
        self.post_block(block)

    def _assign(self, step: Any) -> None:
        """Set a variable, of which nobody counts references."""
        name = step.target.name
        value = self.lower_assign(self.typeof(name), step)
        if name in self._singly_assigned_vars:
            self._blk_local_varmap[name] = value
        else:
            self.builder.store(value, self.getvar(name))

    def lower_getitem(self, kind: Any, step: Any, value: Any, index: Any, signature: Any) -> Any:
        way = getitem(self.context, signature)
        if way is None:
            return super().lower_getitem(kind, step, value, index, signature)
        at = self._cast_var(index, signature.args[1])
        found = way(self.builder, self.loadvar(value.name), at)
        return self.context.cast(self.builder, found, signature.return_type, kind)

    def lower_setitem(self, target: Any, index: Any, value: Any, signature: Any) -> Any:
        way = setitem(self.context, signature)
        if way is None:
            return super().lower_setitem(target, index, value, signature)
        at, item = self._cast_var(index, signature.args[1]), self._cast_var(value, signature.args[2])
        return way(self.builder, self.loadvar(target.name), at, item)


class InnerLower(PlainLower):
    """Writes a function that compiled code calls."""

    def init(self) -> None:
        super().init()
        if not self.context.enable_nrt and not isinstance(self.fndesc.restype, types.Optional):
            self.fndesc.__class__ = PlainDescriptor

    @property
    def call_conv(self) -> Any:
        return PlainConvention(self.context) if isinstance(self.fndesc, PlainDescriptor) else super().call_conv

    def lower(self) -> None:
        super().lower()
        if isinstance(self.fndesc, PlainDescriptor) and not getattr(self.function, "may_raise", False):
            CANNOT_RAISE.add(self.fndesc.mangled_name)


class CalledLower(InnerLower):
    """Writes a function that the compiler may not copy into its callers."""

    def setup_function(self, descriptor: Any) -> None:
        super().setup_function(descriptor)
        self.function.attributes.add("noinline")


def _values(blocks: dict[int, Any]) -> set[str]:
    """Return the variables that are set once, and that every way to a use of them passes there.

    Blocks are written in the order of their numbers: that of the one where it is set comes before those of its uses.
    """
    known = compute_use_defs(blocks)
    places: dict[str, list[int]] = {}
    for number, block in blocks.items():
        for step in block.find_insts(Assign):
            places.setdefault(step.target.name, []).append(number)
    uses: dict[str, list[int]] = {}
    for number, names in known.usemap.items():
        for name in names:
            uses.setdefault(name, []).append(number)
    before = compute_cfg_from_blocks(blocks).dominators()
    return {
        name
        for name, [first, *again] in places.items()
        if not again and all(first < use and first in before[use] for use in uses.get(name, ()))
    }
