"""Numbers of all lanes of a tile at once, for compiled code: one value is a few vector registers.

numba has no such type, and its loops over lanes meet in memory only: whether two blocks of a tile
are the same is not known, so no value can stay in a register from one loop to the next. Here a
column of a tile [rows, columns, LANES] is one value, `take`n and `put` as a whole; arithmetic and
comparisons are those of floats. Of an array [rows, columns], for a single world, a column is a
float, and the same functions serve.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

LANES = 16

_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)
_BITS = ir.VectorType(ir.IntType(1), LANES)
_CONTRACT = ("contract",)  # as all of the twin's arithmetic


class _Doubles(types.Type):  # type: ignore[misc]  # numba has no annotations
    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, types.Float) else None


class _Bits(types.Type):  # type: ignore[misc]
    """Which lanes."""


DOUBLES, BITS = _Doubles(f"Doubles({LANES})"), _Bits(f"Bits({LANES})")


def _model(kind: Any, of: Any) -> None:
    class Model(models.PrimitiveModel):  # type: ignore[misc]
        def __init__(self, manager: Any, fe_type: Any) -> None:
            super().__init__(manager, fe_type, of)

    register_model(kind)(Model)


_model(_Doubles, _DOUBLES)
_model(_Bits, _BITS)


def _spread(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    """A float in all lanes."""
    value = context.cast(builder, value, fromty, types.float64)
    one = builder.insert_element(ir.Constant(_DOUBLES, ir.Undefined), value, ir.IntType(32)(0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, one, zeros)


lower_cast(types.Float, _Doubles)(_spread)


def _operator(symbol: Any, result: Any, arity: int, emit: Any) -> None:
    class Template(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            fit = all(a is DOUBLES or isinstance(a, types.Float) for a in args)
            if len(args) == arity and fit and DOUBLES in args:
                return signature(result, *[DOUBLES] * arity)
            return None

    infer_global(symbol)(Template)
    lower_builtin(symbol, *[DOUBLES] * arity)(lambda c, builder, s, args: emit(builder, *args))


_operator(operator.add, DOUBLES, 2, lambda b, x, y: b.fadd(x, y, flags=_CONTRACT))
_operator(operator.sub, DOUBLES, 2, lambda b, x, y: b.fsub(x, y, flags=_CONTRACT))
_operator(operator.mul, DOUBLES, 2, lambda b, x, y: b.fmul(x, y, flags=_CONTRACT))
_operator(operator.truediv, DOUBLES, 2, lambda b, x, y: b.fdiv(x, y, flags=_CONTRACT))
_operator(operator.neg, DOUBLES, 1, lambda b, x: b.fneg(x))
_operator(operator.lt, BITS, 2, lambda b, x, y: b.fcmp_ordered("<", x, y))
_operator(operator.le, BITS, 2, lambda b, x, y: b.fcmp_ordered("<=", x, y))
_operator(operator.gt, BITS, 2, lambda b, x, y: b.fcmp_ordered(">", x, y))
_operator(operator.ge, BITS, 2, lambda b, x, y: b.fcmp_ordered(">=", x, y))


def _of(*kinds: Any) -> Any:
    """What an operation on these gives: lanes if any of them is."""
    return DOUBLES if DOUBLES in kinds else types.float64


def _column(context: Any, builder: Any, kind: Any, args: Any) -> Any:
    """A pointer to a column, as a vector or a float."""
    array = context.make_array(kind)(context, builder, args[0])
    indices = [*args[1:3], *[ir.Constant(args[1].type, 0)] * (kind.ndim - 2)]
    at = cgutils.get_item_pointer(context, builder, kind, array, indices)
    return builder.bitcast(at, _DOUBLES.as_pointer()) if kind.ndim == 3 else at


@intrinsic  # type: ignore[untyped-decorator]
def take(typingctx: Any, array: Any, row: Any, column: Any) -> Any:
    """Column `column` of row `row` of an array; of one [rows, columns]: a float."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _column(context, builder, sig.args[0], args)
        return builder.load(at, align=8)

    kind = DOUBLES if array.ndim == 3 else types.float64
    return signature(kind, array, types.intp, types.intp), emit


@intrinsic  # type: ignore[untyped-decorator]
def put(typingctx: Any, array: Any, row: Any, column: Any, value: Any) -> Any:
    """The reverse of `take`."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _column(context, builder, sig.args[0], args)
        builder.store(args[3], at, align=8)
        return context.get_dummy_value()

    kind = DOUBLES if array.ndim == 3 else types.float64
    return signature(types.void, array, types.intp, types.intp, kind), emit


@intrinsic  # type: ignore[untyped-decorator]
def where(typingctx: Any, which: Any, value: Any, other: Any) -> Any:
    """`value` where `which` holds, else `other`."""
    kind = DOUBLES if which is BITS else types.float64
    return signature(kind, which, kind, kind), lambda c, builder, s, args: builder.select(*args)


@intrinsic  # type: ignore[untyped-decorator]
def anywhere(typingctx: Any, which: Any) -> Any:
    """Whether it holds in any lane."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if sig.args[0] is not BITS:
            return args[0]
        bits = builder.bitcast(args[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return signature(types.boolean, which), emit


def _unary(emit: Any) -> Any:
    def function(typingctx: Any, value: Any) -> Any:
        kind = _of(value)
        return signature(kind, kind), lambda c, builder, s, args: emit(builder, *args)

    return intrinsic(function)


def _binary(emit: Any) -> Any:
    def function(typingctx: Any, value: Any, other: Any) -> Any:
        kind = _of(value, other)
        return signature(kind, kind, kind), lambda c, builder, s, args: emit(builder, *args)

    return intrinsic(function)


def _library(name: str, builder: Any, *args: Any) -> Any:
    """Call LLVM's own function `name` for this type."""
    kind = args[0].type
    suffix = f"v{LANES}f64" if kind == _DOUBLES else "f64"
    of = ir.FunctionType(kind, [kind] * len(args))
    function = cgutils.get_or_insert_function(builder.module, of, f"llvm.{name}.{suffix}")
    return builder.call(function, args)


# lane by lane: the larger, the smaller, the square root, without the sign, with the sign of another
most = _binary(lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y))
least = _binary(lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y))
root = _unary(lambda b, x: _library("sqrt", b, x))
magnitude = _unary(lambda b, x: _library("fabs", b, x))
signed = _binary(lambda b, x, y: _library("copysign", b, x, y))
