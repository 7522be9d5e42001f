"""Numbers of all lanes of a tile at once, for compiled code: one value is a few vector registers.

numba has no such type, and its loops over lanes meet in memory only: whether two blocks of a tile
are the same is not known, so no value can stay in a register from one loop to the next. Here a
column of a tile [rows, columns, LANES] is one value, `take`n and `put` as a whole; arithmetic and
comparisons are those of floats. An array of singles has SINGLES, one of doubles DOUBLES; the two
meet only as `shortened` or `lengthened`. Of an array [rows, columns], for a single world, a column
is a float, and the same functions serve.
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

LANES = 32

_CONTRACT = ("contract",)  # as all of the twin's arithmetic


class _Lanes(types.Type):  # type: ignore[misc]  # numba has no annotations
    """A number per lane."""

    def __init__(self, name: str, number: Any, of: Any) -> None:
        self.number, self.vector = number, ir.VectorType(of, LANES)
        super().__init__(f"{name}({LANES})")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, types.Float) else None


class _Singles(_Lanes):
    pass


class _Doubles(_Lanes):
    pass


class _Bits(_Lanes):
    """Which lanes."""

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        return None


SINGLES = _Singles("Singles", types.float32, ir.FloatType())
DOUBLES = _Doubles("Doubles", types.float64, ir.DoubleType())
BITS = _Bits("Bits", types.boolean, ir.IntType(1))


def _register(kind: Any) -> None:
    class Model(models.PrimitiveModel):  # type: ignore[misc]
        def __init__(self, manager: Any, fe_type: Any) -> None:
            super().__init__(manager, fe_type, kind.vector)

    register_model(type(kind))(Model)


def _spread(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    """A float in all lanes."""
    value = context.cast(builder, value, fromty, toty.number)
    undefined = ir.Constant(toty.vector, ir.Undefined)
    one = builder.insert_element(undefined, value, ir.IntType(32)(0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, one, zeros)


for _kind in (SINGLES, DOUBLES, BITS):
    _register(_kind)
for _kind in (SINGLES, DOUBLES):
    lower_cast(types.Float, type(_kind))(_spread)


def _operator(symbol: Any, compares: bool, arity: int, emit: Any) -> None:
    class Template(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            kind = _of(*args)
            fit = all(a is kind or isinstance(a, types.Float) for a in args)
            if len(args) == arity and fit and isinstance(kind, _Lanes):
                return signature(BITS if compares else kind, *[kind] * arity)
            return None

    infer_global(symbol)(Template)
    for kind in (SINGLES, DOUBLES):
        lower_builtin(symbol, *[kind] * arity)(lambda c, builder, s, args: emit(builder, *args))


def _of(*kinds: Any) -> Any:
    """What an operation on these gives: lanes if any of them is."""
    return next((kind for kind in kinds if kind in (SINGLES, DOUBLES)), types.float64)


_operator(operator.add, False, 2, lambda b, x, y: b.fadd(x, y, flags=_CONTRACT))
_operator(operator.sub, False, 2, lambda b, x, y: b.fsub(x, y, flags=_CONTRACT))
_operator(operator.mul, False, 2, lambda b, x, y: b.fmul(x, y, flags=_CONTRACT))
_operator(operator.truediv, False, 2, lambda b, x, y: b.fdiv(x, y, flags=_CONTRACT))
_operator(operator.neg, False, 1, lambda b, x: b.fneg(x))
_operator(operator.lt, True, 2, lambda b, x, y: b.fcmp_ordered("<", x, y))
_operator(operator.le, True, 2, lambda b, x, y: b.fcmp_ordered("<=", x, y))
_operator(operator.gt, True, 2, lambda b, x, y: b.fcmp_ordered(">", x, y))
_operator(operator.ge, True, 2, lambda b, x, y: b.fcmp_ordered(">=", x, y))


def _kept(array: Any) -> Any:
    """What a column of this array is taken as."""
    if array.ndim < 3:
        return array.dtype
    return SINGLES if array.dtype is types.float32 else DOUBLES


def _column(context: Any, builder: Any, kind: Any, args: Any) -> Any:
    """A pointer to a column, as a vector or a float."""
    array = context.make_array(kind)(context, builder, args[0])
    indices = [*args[1:3], *[ir.Constant(args[1].type, 0)] * (kind.ndim - 2)]
    at = cgutils.get_item_pointer(context, builder, kind, array, indices)
    return builder.bitcast(at, _kept(kind).vector.as_pointer()) if kind.ndim == 3 else at


@intrinsic  # type: ignore[untyped-decorator]
def take(typingctx: Any, array: Any, row: Any, column: Any) -> Any:
    """Column `column` of row `row` of an array; of one [rows, columns]: a float."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _column(context, builder, sig.args[0], args)
        return builder.load(at, align=4)

    return signature(_kept(array), array, types.intp, types.intp), emit


@intrinsic  # type: ignore[untyped-decorator]
def put(typingctx: Any, array: Any, row: Any, column: Any, value: Any) -> Any:
    """The reverse of `take`."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _column(context, builder, sig.args[0], args)
        builder.store(args[3], at, align=4)
        return context.get_dummy_value()

    return signature(types.void, array, types.intp, types.intp, _kept(array)), emit


@intrinsic  # type: ignore[untyped-decorator]
def shortened(typingctx: Any, value: Any) -> Any:
    """Doubles as singles; what is one number stays a double."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.fptrunc(args[0], SINGLES.vector) if sig.args[0] is DOUBLES else args[0]

    return signature(SINGLES if value is DOUBLES else value, value), emit


@intrinsic  # type: ignore[untyped-decorator]
def lengthened(typingctx: Any, value: Any) -> Any:
    """The reverse of `shortened`."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.fpext(args[0], DOUBLES.vector) if sig.args[0] is SINGLES else args[0]

    return signature(DOUBLES if value is SINGLES else value, value), emit


@intrinsic  # type: ignore[untyped-decorator]
def where(typingctx: Any, which: Any, value: Any, other: Any) -> Any:
    """`value` where `which` holds, else `other`; of two constants, singles."""
    kind = _of(value, other)
    if which is BITS and not isinstance(kind, _Lanes):
        kind = SINGLES
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
    suffix = (
        kind.intrinsic_name
        if isinstance(kind, ir.DoubleType)
        else f"v{LANES}{kind.element.intrinsic_name}"
    )
    of = ir.FunctionType(kind, [kind] * len(args))
    function = cgutils.get_or_insert_function(builder.module, of, f"llvm.{name}.{suffix}")
    return builder.call(function, args)


# lane by lane: the larger, the smaller, the square root, without the sign, with the sign of another
most = _binary(lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y))
least = _binary(lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y))
root = _unary(lambda b, x: _library("sqrt", b, x))
magnitude = _unary(lambda b, x: _library("fabs", b, x))
signed = _binary(lambda b, x, y: _library("copysign", b, x, y))
