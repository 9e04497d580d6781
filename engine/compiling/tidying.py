"""What a function does, said once: parts of a tuple are what was put in, and what nobody uses is left out.

All that is written is printed, read again and simplified by LLVM, each of which takes longer than to look here.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from llvmlite.ir import instructions as steps

from engine.compiling.values import Parts, known_part

_PURE = (
    *(steps.InsertValue, steps.ExtractValue, steps.GEPInstr, steps.CastInstr, steps.CompareInstr, steps.SelectInstr),
    *(steps.LoadInstr, steps.AllocaInstr, steps.PhiInstr),
)
_ARITHMETIC = frozenset(
    [
        *("add", "sub", "mul", "sdiv", "udiv", "srem", "urem", "and", "or", "xor", "shl", "lshr", "ashr"),
        *("fadd", "fsub", "fmul", "fdiv", "fneg"),
    ]
)


def tidy(function: Any) -> None:
    """Leave out of a function, all of which is written, what is taken apart again, and what nobody uses."""
    _Seeing(function).look()
    needed, left = set(), []
    for block in function.blocks:
        left += [step for step in block.instructions if not _is_pure(step)]
    while left:
        step = left.pop()
        if id(step) not in needed:
            needed.add(id(step))
            left += [used for used in _operands(step) if isinstance(used, ir.Instruction)]
    for block in function.blocks:
        block.instructions = [step for step in block.instructions if id(step) in needed]


def _is_pure(step: Any) -> bool:
    return isinstance(step, _PURE) or step.opname in _ARITHMETIC


def _operands(step: Any) -> list[Any]:
    return [value for value, _ in step.incomings] if isinstance(step, steps.PhiInstr) else step.operands


class _Seeing:
    """Replaces what each step of a function uses by what it is seen to be."""

    def __init__(self, function: Any) -> None:
        self._function = function
        self._seen: dict[int, Any] = {}

    def look(self) -> None:
        for block in self._function.blocks:
            written: list[Any] = []
            made: dict[int, Any] = {}
            for step in block.instructions:
                if isinstance(step, steps.PhiInstr):
                    step.incomings = [(self._seen_as(value), origin) for value, origin in step.incomings]
                else:
                    seen = [self._seen_as(value) for value in step.operands]
                    if any(new is not old or isinstance(new, Parts) for new, old in zip(seen, step.operands)):
                        _use(step, [self._whole(value, block, written, made) for value in seen])
                written.append(step)
            block.instructions = written
        self._join_phis()

    def _seen_as(self, value: Any) -> Any:
        if not isinstance(value, steps.ExtractValue):
            return value
        if (key := id(value)) not in self._seen:
            seen = self._seen_as(value.aggregate)
            for index in value.indices:
                seen = known_part(seen, index)
                seen = None if seen is None else self._seen_as(seen)
                if seen is None:
                    break
            self._seen[key] = value if seen is None else seen
        return self._seen[key]

    def _whole(self, value: Any, block: Any, written: list[Any], made: dict[int, Any]) -> Any:
        """Return a value that LLVM knows: put together here if it is not."""
        if not isinstance(value, Parts):
            return value
        if id(value) not in made:
            whole = ir.Constant(value.type, ir.Undefined)
            for index, inner in enumerate(value.parts):
                inner = self._whole(self._seen_as(inner), block, written, made)
                whole = steps.InsertValue(block, whole, inner, [index])
                written.append(whole)
            made[id(value)] = whole
        return made[id(value)]

    def _join_phis(self) -> None:
        """Put together what a join of ways uses, at the end of the way that it comes by."""
        for block in self._function.blocks:
            for step in block.instructions:
                if isinstance(step, steps.PhiInstr) and any(isinstance(value, Parts) for value, _ in step.incomings):
                    step.incomings = [(self._at_end(value, origin), origin) for value, origin in step.incomings]

    def _at_end(self, value: Any, block: Any) -> Any:
        *written, last = block.instructions
        whole = self._whole(value, block, written, {})
        block.instructions = [*written, last]
        return whole


def _use(step: Any, operands: list[Any]) -> None:
    """Let a step use other values; some kinds hold theirs a second time, and print that."""
    step.operands = operands
    if isinstance(step, steps.InsertValue):
        step.aggregate, step.value = operands
    elif isinstance(step, steps.ExtractValue):
        [step.aggregate] = operands
    elif isinstance(step, steps.GEPInstr):
        step.pointer, *step.indices = operands
