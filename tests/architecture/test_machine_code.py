"""Strict arithmetic, read from what the compiler made: no relaxed floating point, nothing fused unless by name."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numba import config as numba_config

from engine.predicates.orientation import orient3d_batch
from tests.unit.predicates.batches import (
    orient2d_batch,
    orient2d_filter_batch,
    orient3d_filter_batch,
    side_of_plane_batch,
)

pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")

FLOAT_INSTRUCTION = re.compile(r"= (?:tail |musttail )?(fadd|fsub|fmul|fdiv|fneg|frem|fcmp|call) ([^\n]*)")
RELAXED = re.compile(r"\b(fast|nnan|ninf|nsz|arcp|contract|afn|reassoc)\b")
FUSED = re.compile(r"\bvf?n?m(?:add|sub|addsub|subadd)\d*[ps][sd]\b|\bfn?m(?:add|sub|la|ls)\b", re.IGNORECASE)

SIDES = np.empty(1, np.int8)
FLAT = [np.zeros((1, 2))] * 3
SPACE = [np.zeros((1, 3))] * 4
FILTERS = [(orient2d_filter_batch, FLAT), (orient3d_filter_batch, SPACE)]
EXACT = [(orient2d_batch, FLAT), (orient3d_batch, SPACE), (side_of_plane_batch, [np.zeros((1, 4)), SPACE[0]])]


def name_of(value: Any) -> str:
    return getattr(value, "__name__", "inputs")


def code_of(kernel: Any, inputs: list[Any]) -> tuple[str, str]:
    """Return the LLVM code and the assembly of a kernel for these inputs, compiled here."""
    known = getattr(kernel, "dispatcher", kernel)
    fresh = type(known)(py_func=known.py_func, targetoptions=known.targetoptions)
    fresh(*inputs, SIDES)
    return "\n".join(fresh.inspect_llvm().values()), "\n".join(fresh.inspect_asm().values())


@pytest.mark.parametrize(("kernel", "inputs"), FILTERS, ids=name_of)
def test_filters_hold_no_fused_instruction(kernel: Any, inputs: list[Any]) -> None:
    llvm, assembly = code_of(kernel, inputs)
    assert "fmul" in llvm
    assert "mulsd" in assembly or "mulpd" in assembly or "fmul" in assembly  # the pattern below reads real assembly
    assert not FUSED.search(assembly)
    assert "llvm.fma" not in llvm
    assert "llvm.fmuladd" not in llvm


@pytest.mark.parametrize(("kernel", "inputs"), [*FILTERS, *EXACT], ids=name_of)
def test_no_relaxed_floating_point(kernel: Any, inputs: list[Any]) -> None:
    llvm, _ = code_of(kernel, inputs)
    instructions = FLOAT_INSTRUCTION.findall(llvm)
    assert len(instructions) > 10
    relaxed = [" ".join(found) for found in instructions if RELAXED.search(found[1].split("@")[0].split("%")[0])]
    assert not relaxed
    assert "llvm.fmuladd" not in llvm  # unlike llvm.fma it may or may not round in between


def test_the_patterns_find_what_they_look_for() -> None:
    assert FUSED.search("\tvfmadd213sd %xmm0, %xmm1, %xmm2")
    assert FUSED.search("\tvfnmsub231pd (%rax), %ymm1, %ymm2")
    assert FUSED.search("\tfmla v0.2d, v1.2d, v2.2d")
    assert not FUSED.search("\tvmulsd %xmm0, %xmm1, %xmm2\n\tvaddsd %xmm0, %xmm1, %xmm2")
    (operation, rest), *_ = FLOAT_INSTRUCTION.findall("  %.5 = fmul contract double %a, %b")
    assert operation == "fmul"
    assert RELAXED.search(rest)
