"""What is left of a function does the same, and what nobody uses is gone."""

from __future__ import annotations

import pytest
from llvmlite import binding, ir

from engine.compiling.tidying import tidy
from engine.compiling.values import Parts, part

WORD = ir.IntType(64)
PAIR = ir.LiteralStructType([WORD, ir.LiteralStructType([WORD, WORD])])


@pytest.fixture
def function() -> ir.Function:
    return ir.Function(ir.Module(), ir.FunctionType(WORD, [WORD, WORD, PAIR.as_pointer()]), "f")


def steps(function: ir.Function) -> list[str]:
    return [step.opname for block in function.blocks for step in block.instructions]


def check(function: ir.Function) -> None:
    binding.parse_assembly(str(function.module)).verify()


def test_what_is_put_in_and_taken_out_is_not_written(function: ir.Function) -> None:
    builder = ir.IRBuilder(function.append_basic_block())
    a, b, _ = function.args
    whole = builder.insert_value(ir.Constant(PAIR, ir.Undefined), a, [0])
    whole = builder.insert_value(whole, Parts(PAIR.elements[1], [b, a]), [1])
    inner = builder.extract_value(whole, [1, 0])
    builder.mul(a, a)
    builder.ret(builder.add(inner, builder.extract_value(whole, 0)))
    tidy(function)
    assert steps(function) == ["add", "ret"]
    assert [value is given for value, given in zip(function.blocks[0].instructions[0].operands, (b, a))] == [True] * 2
    check(function)


def test_a_whole_is_put_together_where_it_is_stored(function: ir.Function) -> None:
    builder = ir.IRBuilder(function.append_basic_block())
    a, b, place = function.args
    whole = Parts(PAIR, [a, Parts(PAIR.elements[1], [b, a])])
    assert part(builder, whole, 1, 1) is a
    builder.store(whole, place)
    builder.store(whole, place)
    builder.ret(a)
    tidy(function)
    assert steps(function) == [*["insertvalue"] * 4, "store", "store", "ret"]
    check(function)


def test_a_join_of_ways_takes_a_whole_from_the_end_of_each(function: ir.Function) -> None:
    a, b, place = function.args
    first, left, right, last = (function.append_basic_block() for _ in range(4))
    builder = ir.IRBuilder(first)
    builder.cbranch(builder.icmp_signed("<", a, b), left, right)
    for block in (left, right):
        ir.IRBuilder(block).branch(last)
    builder = ir.IRBuilder(last)
    joined = builder.phi(PAIR)
    joined.add_incoming(Parts(PAIR, [a, Parts(PAIR.elements[1], [a, a])]), left)
    joined.add_incoming(Parts(PAIR, [b, Parts(PAIR.elements[1], [b, b])]), right)
    builder.store(joined, place)
    builder.ret(builder.extract_value(joined, 0))
    tidy(function)
    assert steps(function) == ["icmp", "br", *[*["insertvalue"] * 4, "br"] * 2, "phi", "store", "extractvalue", "ret"]
    check(function)


def test_calls_and_stores_stay_though_nobody_uses_them(function: ir.Function) -> None:
    builder = ir.IRBuilder(function.append_basic_block())
    a, b, place = function.args
    builder.call(function, [a, b, place])
    builder.load(builder.gep(place, [ir.IntType(32)(0), ir.IntType(32)(0)]))
    builder.ret(a)
    tidy(function)
    assert steps(function) == ["call", "ret"]
    check(function)
