"""Eight samples side by side in one vector register, for compiled code.

A value of type ``Lanes`` is eight doubles that go through the same operations. Every operation is written out as it is
rounded (a fused multiply-add only where `fma` stands), so the bits of a lane depend neither on its neighbours nor on
what the compiler finds profitable. Machines with shorter registers take the same steps in two or four parts.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

WIDTH = 8

_DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)


class _Lanes(types.Type):  # type: ignore[misc]
    """Type of eight doubles in one register."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


lanes = _Lanes()


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    """A Lanes value is one vector to the compiler."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _DOUBLES)


def _address(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), _DOUBLES.as_pointer())


def _call(builder: Any, name: str, arguments: Any) -> Any:
    kind = ir.FunctionType(_DOUBLES, [_DOUBLES] * len(arguments))
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64"), arguments)


@intrinsic
def load(typing, array, at):
    """Return the eight numbers of a contiguous array from the flat index ``at`` on."""

    def emit(context, builder, signature, arguments):
        return builder.load(_address(context, builder, signature.args[0], *arguments), align=8)

    return lanes(array, types.intp), emit


@intrinsic
def store(typing, array, at, value):
    """Write eight numbers into a contiguous array from the flat index ``at`` on."""

    def emit(context, builder, signature, arguments):
        builder.store(arguments[2], _address(context, builder, signature.args[0], *arguments[:2]), align=8)

    return types.void(array, types.intp, lanes), emit


@intrinsic
def spread(typing, number):
    """Return one number in all lanes."""

    def emit(context, builder, signature, arguments):
        first = builder.insert_element(ir.Constant(_DOUBLES, ir.Undefined), arguments[0], ir.IntType(32)(0))
        return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))

    return lanes(types.float64), emit


def _binary(instruction: str) -> Any:
    @intrinsic
    def operation(typing, a, b):
        def emit(context, builder, signature, arguments):
            return getattr(builder, instruction)(*arguments)

        return lanes(lanes, lanes), emit

    return operation


add, subtract, multiply, divide = (_binary(name) for name in ("fadd", "fsub", "fmul", "fdiv"))


@intrinsic
def fma(typing, a, b, c):
    """Return a·b + c, rounded once."""

    def emit(context, builder, signature, arguments):
        return _call(builder, "fma", arguments)

    return lanes(lanes, lanes, lanes), emit


@intrinsic
def magnitude(typing, a):
    """Return the absolute values."""

    def emit(context, builder, signature, arguments):
        return _call(builder, "fabs", arguments)

    return lanes(lanes), emit


@intrinsic
def larger(typing, a, b):
    """Return the larger of both in every lane."""

    def emit(context, builder, signature, arguments):
        return builder.select(builder.fcmp_ordered(">", *arguments), *arguments)

    return lanes(lanes, lanes), emit


@intrinsic
def above(typing, a, b):
    """Return one bit per lane: whether a > b."""

    def emit(context, builder, signature, arguments):
        bits = builder.fcmp_ordered(">", *arguments)
        return builder.zext(builder.bitcast(bits, ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(lanes, lanes), emit


@intrinsic
def choose(typing, bits, a, b):
    """Return a in the lanes whose bit is set, b in the others."""

    def emit(context, builder, signature, arguments):
        mask = builder.bitcast(builder.trunc(arguments[0], ir.IntType(WIDTH)), _BITS)
        return builder.select(mask, arguments[1], arguments[2])

    return lanes(types.int64, lanes, lanes), emit
