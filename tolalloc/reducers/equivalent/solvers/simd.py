"""Eight samples side by side in one vector register, for compiled code.

A value of type ``Vector`` is eight doubles that go through the same operations. Every operation is written out as it is
rounded (a fused multiply-add only where `fma` stands), so the bits of a lane depend neither on its neighbours nor on
what the compiler finds profitable. Machines with shorter registers take the same steps in two or four parts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

from tolalloc.running.compiled import jit, processor

WIDTH = 8
"""Samples side by side."""

ALL = 2**WIDTH - 1
"""One bit for every lane."""

_MOVES_LANES = "+avx512f" in processor()["features"]
"""Whether one instruction of the processor moves chosen numbers of a register together, or apart."""

LOGARITHM_OF_TWO = float.fromhex("0x1.62e42fee00000p-1")
_LOGARITHM_LEFT = float.fromhex("0x1.a39ef35793c76p-33")
"""ln 2 in two parts, the first with so few digits that whole multiples of it are exact."""

_DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_ROOT_HALF = 0x3FE6A09E667F3BCD  # bits of √½
_TERMS = 11  # of the series in s²; the first left out is below 2e-18 of the logarithm
_SHIFT = 6755399441055744.0  # 1.5·2⁵²: in this range the last bits of a double are an integer


class Common(NamedTuple):
    """A table of which all samples take the same entries."""

    entries: Float[np.ndarray, "..."]


class Apart(NamedTuple):
    """A table of which each sample has its own entries, side by side in the last axis."""

    entries: Float[np.ndarray, "... lane"]


@jit
def aligned(rows, width):
    """Return zeros whose rows start where a register does: a load across two lines of the cache takes twice as long."""
    room = np.zeros(rows * width + WIDTH)
    first = (-(room.ctypes.data >> 3)) % WIDTH
    return room[first : first + rows * width].reshape(rows, width)


class _Vector(types.Type):  # type: ignore[misc]
    """Type of the doubles side by side."""

    def __init__(self) -> None:
        super().__init__(name="Vector")


vector = _Vector()


@register_model(_Vector)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc]
    """A Vector value is one vector to the compiler."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _DOUBLES)


def _address(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), _DOUBLES.as_pointer())


def _call(builder: Any, name: str, arguments: Any) -> Any:
    kind = ir.FunctionType(_DOUBLES, [_DOUBLES] * len(arguments))
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64"), arguments)


def _splat(builder, number):
    first = builder.insert_element(ir.Constant(_DOUBLES, ir.Undefined), number, ir.IntType(32)(0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))


@intrinsic
def load(typing, array, at):
    """Return the numbers of a contiguous array from the flat index ``at`` on."""

    def emit(context, builder, signature, arguments):
        return builder.load(_address(context, builder, signature.args[0], *arguments), align=8)

    return vector(array, types.intp), emit


def _entry(context, builder, kind, table, at):
    """Return an entry of a `Common` or an `Apart` table."""
    array = builder.extract_value(table, 0)
    if kind.instance_class is Apart:
        return builder.load(_address(context, builder, kind[0], array, builder.mul(at, at.type(WIDTH))), align=8)
    data = context.make_array(kind[0])(context, builder, array).data
    return _splat(builder, builder.load(builder.gep(data, [at])))


@intrinsic
def entry(typing, table, at):
    """Return the entry at a flat index of a table that is common to all lanes, or apart for each."""

    def emit(context, builder, signature, arguments):
        return _entry(context, builder, signature.args[0], *arguments)

    return vector(table, types.intp), emit


@intrinsic
def store(typing, array, at, value):
    """Write the numbers into a contiguous array from the flat index ``at`` on."""

    def emit(context, builder, signature, arguments):
        builder.store(arguments[2], _address(context, builder, signature.args[0], *arguments[:2]), align=8)

    return types.void(array, types.intp, vector), emit


@intrinsic
def spread(typing, number):
    """Return one number in all lanes."""

    def emit(context, builder, signature, arguments):
        return _splat(builder, arguments[0])

    return vector(types.float64), emit


def _binary(instruction: str) -> Any:
    @intrinsic
    def operation(typing, a, b):
        def emit(context, builder, signature, arguments):
            return getattr(builder, instruction)(*arguments)

        return vector(vector, vector), emit

    return operation


add, subtract, multiply, divide = (_binary(name) for name in ("fadd", "fsub", "fmul", "fdiv"))


@intrinsic
def fma(typing, a, b, c):
    """Return a·b + c, rounded once."""

    def emit(context, builder, signature, arguments):
        return _call(builder, "fma", arguments)

    return vector(vector, vector, vector), emit


@intrinsic
def logarithm(typing, a):
    """Return the natural logarithms of positive normal numbers, each within two units in the last place.

    a = 2ᵏ·z with z between √½ and √2, ln z = 2·(s + s³/3 + s⁵/5 + …) with s = (z − 1)/(z + 1).
    """
    integers = ir.VectorType(ir.IntType(64), WIDTH)

    def whole(number):
        return ir.Constant(integers, [number] * WIDTH)

    def real(number):
        return ir.Constant(_DOUBLES, [number] * WIDTH)

    def emit(context, builder, signature, arguments):
        bits = builder.bitcast(arguments[0], integers)
        power = builder.ashr(builder.sub(bits, whole(_ROOT_HALF)), whole(52))
        z = builder.bitcast(builder.sub(bits, builder.shl(power, whole(52))), _DOUBLES)
        shifted = builder.bitcast(builder.add(power, whole(0x4338000000000000)), _DOUBLES)
        k = builder.fsub(shifted, real(_SHIFT))
        f = builder.fsub(z, real(1.0))
        s = builder.fdiv(f, builder.fadd(z, real(1.0)))
        square = builder.fmul(s, s)
        series = real(2.0 / (2 * _TERMS + 1))
        for term in range(_TERMS - 1, 0, -1):
            series = _call(builder, "fma", (series, square, real(2.0 / (2 * term + 1))))
        # ln z = 2s + s·(s²·series) = f − s·(f − s²·series), of which the last term is small beside f.
        rest = builder.fmul(s, builder.fsub(f, builder.fmul(square, series)))
        high, low = real(LOGARITHM_OF_TWO), real(_LOGARITHM_LEFT)
        return builder.fadd(builder.fmul(k, high), builder.fsub(f, builder.fsub(rest, builder.fmul(k, low))))

    return vector(vector), emit


@intrinsic
def magnitude(typing, a):
    """Return the absolute values."""

    def emit(context, builder, signature, arguments):
        return _call(builder, "fabs", arguments)

    return vector(vector), emit


@intrinsic
def root(typing, a):
    """Return the square roots."""

    def emit(context, builder, signature, arguments):
        return _call(builder, "sqrt", arguments)

    return vector(vector), emit


@intrinsic
def larger(typing, a, b):
    """Return the larger of both in every lane."""

    def emit(context, builder, signature, arguments):
        return builder.select(builder.fcmp_ordered(">", *arguments), *arguments)

    return vector(vector, vector), emit


@intrinsic
def above(typing, a, b):
    """Return one bit per lane: whether a > b."""

    def emit(context, builder, signature, arguments):
        bits = builder.fcmp_ordered(">", *arguments)
        return builder.zext(builder.bitcast(bits, ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(vector, vector), emit


@intrinsic
def choose(typing, bits, a, b):
    """Return a in the lanes whose bit is set, b in the others."""

    def emit(context, builder, signature, arguments):
        return builder.select(_mask(builder, arguments[0]), arguments[1], arguments[2])

    return vector(types.int64, vector, vector), emit


def _mask(builder: Any, bits: Any) -> Any:
    return builder.bitcast(builder.trunc(bits, ir.IntType(WIDTH)), _BITS)


def _places(builder: Any, data: Any, at: Any, bits: Any) -> Any:
    """Yield each lane, and where its number stands if the chosen ones stand one after another."""
    for lane in range(WIDTH):
        yield ir.IntType(32)(lane), builder.gep(data, [at])
        at = builder.add(at, builder.and_(builder.lshr(bits, bits.type(lane)), bits.type(1)))


def _move_lanes(builder: Any, name: str, value: Any, bits: Any) -> Any:
    kind = ir.FunctionType(_DOUBLES, [_DOUBLES, _DOUBLES, _BITS])
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.x86.avx512.mask.{name}.v{WIDTH}f64")
    return builder.call(function, [value, ir.Constant(_DOUBLES, [0.0] * WIDTH), _mask(builder, bits)])


@intrinsic
def compress(typing, array, at, bits, value):
    """Write the lanes whose bit is set into a contiguous array, one after another from the flat index ``at`` on.

    What stands behind them is lost, as far as all lanes would reach.
    """

    def emit(context, builder, signature, arguments):
        kind, (array, at, bits, value) = signature.args[0], arguments
        if _MOVES_LANES:
            together = _move_lanes(builder, "compress", value, bits)
            builder.store(together, _address(context, builder, kind, array, at), align=8)
            return
        for lane, place in _places(builder, context.make_array(kind)(context, builder, array).data, at, bits):
            builder.store(builder.extract_element(value, lane), place)

    return types.void(array, types.intp, types.int64, vector), emit


@intrinsic
def expand(typing, array, at, bits):
    """Return numbers that stand one after another from a flat index on in the lanes whose bit is set, 0 elsewhere."""

    def emit(context, builder, signature, arguments):
        kind, (array, at, bits) = signature.args[0], arguments
        if _MOVES_LANES:
            together = builder.load(_address(context, builder, kind, array, at), align=8)
            return _move_lanes(builder, "expand", together, bits)
        apart = ir.Constant(_DOUBLES, [0.0] * WIDTH)
        for lane, place in _places(builder, context.make_array(kind)(context, builder, array).data, at, bits):
            apart = builder.insert_element(apart, builder.load(place), lane)
        return builder.select(_mask(builder, bits), apart, ir.Constant(_DOUBLES, [0.0] * WIDTH))

    return vector(array, types.intp, types.int64), emit


@intrinsic
def count_bits(typing, bits):
    """Return how many bits are set."""

    def emit(context, builder, signature, arguments):
        return builder.ctpop(arguments[0])

    return types.int64(types.int64), emit


@intrinsic
def newton_step(typing, discs, stiffness, contact, gradient, step, least):
    """Solve (S + contact stiffness)·step = −gradient in every lane; return one bit per lane with a vanishing pivot.

    ``discs`` has one entry per disc, ``contact`` six rows per disc: the lower triangle of its 3×3 block by rows. A
    pivot not above ``least`` of the largest diagonal entry is replaced by that. The factorisation LDLᵀ is written out
    for the number of coordinates at hand, every factor a value of its own; loops through memory take three times as
    long.

    LDLᵀ·step = −gradient, own derivation of the replaced pivot; [N/m, N, m].
    """
    size = 3 * len(discs)

    def emit(context, builder, signature, arguments):
        kinds = dict(zip(("discs", "stiffness", "contact", "gradient", "step", "least"), signature.args, strict=True))
        given = dict(zip(kinds, arguments, strict=True))

        def at(name, row):
            return _address(context, builder, kinds[name], given[name], ir.IntType(64)(row * WIDTH))

        def multiply_subtract(value, a, b):
            return _call(builder, "fma", (builder.fneg(a), b, value))

        entry = {}
        for i in range(size):
            for j in range(i + 1):
                place = ir.IntType(64)(i * size + j)
                own = _entry(context, builder, kinds["stiffness"], given["stiffness"], place)
                if i // 3 == j // 3:
                    row = 6 * (i // 3) + (i % 3) * (i % 3 + 1) // 2 + j % 3
                    own = builder.fadd(own, builder.load(at("contact", row), align=8))
                entry[i, j] = own
        smallest = entry[0, 0]
        for i in range(1, size):
            smallest = builder.select(builder.fcmp_ordered(">", entry[i, i], smallest), entry[i, i], smallest)
        smallest = builder.fmul(smallest, _splat(builder, given["least"]))
        value: dict[int, Any] = {}
        inverse: dict[int, Any] = {}
        factor: dict[tuple[int, int], Any] = {}
        singular = ir.Constant(_BITS, [0] * WIDTH)
        for i in range(size):
            for j in range(i):
                for m in range(j):
                    entry[i, j] = multiply_subtract(entry[i, j], entry[i, m], factor[j, m])
                factor[i, j] = builder.fmul(entry[i, j], inverse[j])
            pivot, value[i] = entry[i, i], builder.fneg(builder.load(at("gradient", i), align=8))
            for j in range(i):
                pivot = multiply_subtract(pivot, entry[i, j], factor[i, j])
                value[i] = multiply_subtract(value[i], factor[i, j], value[j])
            regular = builder.fcmp_ordered(">", pivot, smallest)
            singular = builder.or_(singular, builder.not_(regular))
            pivot = builder.select(regular, pivot, smallest)
            inverse[i] = builder.fdiv(ir.Constant(_DOUBLES, [1.0] * WIDTH), pivot)
        for i in reversed(range(size)):
            value[i] = builder.fmul(value[i], inverse[i])
            for m in range(i + 1, size):
                value[i] = multiply_subtract(value[i], factor[m, i], value[m])
            builder.store(value[i], at("step", i), align=8)
        return builder.zext(builder.bitcast(singular, ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(discs, stiffness, contact, gradient, step, least), emit
