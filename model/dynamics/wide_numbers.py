"""Numbers of several parts in compiled code: dual numbers with many derivatives, and lanes of many runs.

One source of the equations serves three kinds of numbers. Plain ones give a simulation. `Dual` has a value and `WIDTH`
derivatives: one run carries that many tangents, and every decision is taken once, on the value. `Lanes` holds the same
quantity of `WIDTH` runs: one instruction moves them all, and a decision becomes a choice for each run (`where`).

For Python, arrays of such numbers are arrays of floats with one dimension more; `seen_as` views them in compiled code.
`<`, `<=`, `>`, `>=` of `.real` parts decide inside `where`. `==` and `!=` compare with a null value: a dual number
differs from it where a derivative does, lanes differ where one of them does.
"""

# ruff: noqa: ARG001, ARG002, ARG005, PLW0108 (numba's implementations share an interface, and must be functions)

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import extending, types
from numba.core import cgutils, typeconv
from numba.core.typing import templates
from numba.np import arrayobj

# numba's tools for compiled code have no usable types
builders: Any = cgutils
arrays: Any = arrayobj
tools: Any = extending
conversions: Any = typeconv
typers: Any = templates
intrinsic, overload, lower_builtin = tools.intrinsic, tools.overload, tools.lower_builtin
infer_global, signature = typers.infer_global, typers.signature

WIDTH = 8
"""Derivatives of a dual number, and runs in lanes: as many doubles as the widest register holds."""

_DOUBLE = ir.DoubleType()
_VECTOR, _BITS = ir.VectorType(_DOUBLE, WIDTH), ir.VectorType(ir.IntType(1), WIDTH)
_PAIR = ir.LiteralStructType([_DOUBLE, _VECTOR])
_NONE = ir.Constant(_VECTOR, [0.0] * WIDTH)
_FUSED = ("contract",)
_OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract"}, "forceinline": True}


class Plain(NamedTuple):
    """Tag of runs in plain numbers."""

    tag: int


class Dual(NamedTuple):
    """Tag of runs in dual numbers."""

    tag: int


class Lanes(NamedTuple):
    """Tag of runs in lanes."""

    tag: int


PARTS: dict[type, int] = {Plain: 0, Dual: 1 + WIDTH, Lanes: WIDTH}
"""Doubles of a number in memory: the last dimension of its arrays in Python (0: there is none)."""


class _Wide(types.Type):
    def can_convert_from(self, _typing_context: Any, other: Any) -> Any:
        return conversions.Conversion.safe if isinstance(other, types.Float | types.Integer) else None

    def unify(self, _typing_context: Any, other: Any) -> Any:
        return self if isinstance(other, types.Float | types.Integer) else None


class _Mask(types.Type):
    """Decisions of lanes."""


def _named(kind: Any, name: str) -> Any:
    return kind(name)


DUAL, LANES, _MASK = _named(_Wide, "wide number, dual"), _named(_Wide, "wide number, lanes"), _named(_Mask, "mask")


@tools.register_model(_Mask)
class _MaskModel(tools.models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)


@tools.register_model(_Wide)
class _WideModel(tools.models.PrimitiveModel):  # type: ignore[misc]
    """In registers a vector, with the value beside it; in memory the same without an alignment of its own."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR if kind == LANES else _PAIR)

    def get_data_type(self) -> Any:
        return ir.LiteralStructType([_VECTOR] if self._fe_type == LANES else [_DOUBLE, _VECTOR], packed=True)

    def as_data(self, builder: Any, value: Any) -> Any:
        stored = ir.Constant(self.get_data_type(), ir.Undefined)
        parts = [value] if self._fe_type == LANES else _split(builder, value)
        for place, part in enumerate(parts):
            stored = builder.insert_value(stored, part, place)
        return stored

    def from_data(self, builder: Any, value: Any) -> Any:
        first = builder.extract_value(value, 0)
        return first if self._fe_type == LANES else _joined(builder, first, builder.extract_value(value, 1))


def _split(builder: Any, dual: Any) -> tuple[Any, Any]:
    return builder.extract_value(dual, 0), builder.extract_value(dual, 1)


def _joined(builder: Any, value: Any, vector: Any) -> Any:
    return builder.insert_value(builder.insert_value(ir.Constant(_PAIR, ir.Undefined), value, 0), vector, 1)


def _spread(builder: Any, value: Any) -> Any:
    """Returns a vector with the value in every place."""
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.IntType(32)(0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), everywhere)


def _product(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    terms = [b.fmul(_spread(b, value), d, flags=_FUSED) for value, d in ((y, dx), (x, dy)) if d is not _NONE]
    return b.fmul(x, y, flags=_FUSED), b.fadd(*terms, flags=_FUSED) if len(terms) == 2 else terms[0]


def _quotient(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    ratio, inverse = b.fdiv(x, y, flags=_FUSED), b.fdiv(_DOUBLE(1.0), y, flags=_FUSED)
    change = dx if dy is _NONE else b.fsub(dx, b.fmul(_spread(b, ratio), dy, flags=_FUSED), flags=_FUSED)
    return ratio, b.fmul(change, _spread(b, inverse), flags=_FUSED)


def _sum(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    return b.fadd(x, y, flags=_FUSED), (dx if dy is _NONE else dy if dx is _NONE else b.fadd(dx, dy, flags=_FUSED))


def _difference(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    return b.fsub(x, y, flags=_FUSED), (dx if dy is _NONE else b.fsub(dx, dy, flags=_FUSED))


_ARITHMETIC: dict[Any, tuple[str, Callable[..., tuple[Any, Any]]]] = {
    operator.add: ("fadd", _sum),
    operator.sub: ("fsub", _difference),
    operator.mul: ("fmul", _product),
    operator.truediv: ("fdiv", _quotient),
}
_IN_PLACE = {
    operator.iadd: operator.add,
    operator.isub: operator.sub,
    operator.imul: operator.mul,
    operator.itruediv: operator.truediv,
}
_ORDER = {operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">="}
_EQUALITY = {operator.eq: "==", operator.ne: "!="}


def _operands(context: Any, builder: Any, kinds: Any, values: Any) -> list[Any]:
    """Returns pairs (value, derivatives) of dual operands, or vectors of lanes."""
    if LANES in kinds:
        return [v if kind == LANES else _spread(builder, v) for kind, v in zip(kinds, values, strict=True)]
    return [_split(builder, v) if kind == DUAL else (v, _NONE) for kind, v in zip(kinds, values, strict=True)]


def _define_arithmetic(symbol: Any) -> None:
    name, rule = _ARITHMETIC[_IN_PLACE.get(symbol, symbol)]

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        left, right = _operands(context, builder, sig.args, values)
        if sig.return_type == LANES:
            return getattr(builder, name)(left, right, flags=_FUSED)
        if name == "fmul":  # 0 · x, by which sources make a zero of their kind of number
            for one, other in ((left, right), (right, left)):
                if isinstance(one[0], ir.Constant) and one[0].constant == 0.0 and one[1] is _NONE:
                    return _joined(builder, builder.fmul(one[0], other[0]), _NONE)
        return _joined(builder, *rule(builder, *left, *right))

    _define(symbol, lower, lambda wide: wide)


def _define_order(symbol: Any) -> None:
    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.fcmp_ordered(_ORDER[symbol], *_operands(context, builder, sig.args, values))

    _define(symbol, lower, lambda wide: _MASK if wide == LANES else None)


def _define_equality(symbol: Any) -> None:
    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        left, right = _operands(context, builder, sig.args, values)
        if LANES in sig.args:
            unequal = _any(builder, builder.fcmp_unordered("!=", left, right))
        else:
            moved = [_any(builder, builder.fcmp_unordered("!=", d, _NONE)) for _, d in (left, right) if d is not _NONE]
            unequal = builder.fcmp_unordered("!=", left[0], right[0])
            for one in moved:
                unequal = builder.or_(unequal, one)
        return unequal if symbol is operator.ne else builder.not_(unequal)

    _define(symbol, lower, lambda _wide: types.boolean)


def _any(builder: Any, bits: Any) -> Any:
    whole = builder.bitcast(bits, ir.IntType(WIDTH))
    return builder.icmp_unsigned("!=", whole, ir.IntType(WIDTH)(0))


def _define(symbol: Any, lower: Callable[..., Any], result: Callable[[Any], Any]) -> None:
    """Types and lowers a binary operator of wide numbers, with each other and with plain ones."""

    @infer_global(symbol)
    class _Template(typers.AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            wide = next((a for a in args if isinstance(a, _Wide)), None)
            if wide is None or len(args) != 2 or result(wide) is None:
                return None
            taken = [a if a == wide else types.float64 for a in args]
            if any(a != wide and not isinstance(a, types.Float | types.Integer) for a in args):
                return None
            return signature(result(wide), *taken)

    for pair in ((_Wide, _Wide), (_Wide, types.Float), (types.Float, _Wide)):
        lower_builtin(symbol, *pair)(lower)


for _symbol in (*_ARITHMETIC, *_IN_PLACE):
    _define_arithmetic(_symbol)
for _symbol in _ORDER:
    _define_order(_symbol)
for _symbol in _EQUALITY:
    _define_equality(_symbol)


@infer_global(operator.neg)
@infer_global(operator.pos)
class _Sign(typers.AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(args[0], args[0]) if isinstance(args[0], _Wide) else None


@lower_builtin(operator.neg, _Wide)
def _negative(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    if sig.return_type == LANES:
        return builder.fneg(values[0])
    return _joined(builder, *(builder.fneg(part) for part in _split(builder, values[0])))


@infer_global(operator.and_)
@infer_global(operator.or_)
class _Both(typers.AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(_MASK, _MASK, _MASK) if tuple(args) == (_MASK, _MASK) else None


lower_builtin(operator.and_, _MASK, _MASK)(lambda _context, builder, _sig, values: builder.and_(*values))
lower_builtin(operator.or_, _MASK, _MASK)(lambda _context, builder, _sig, values: builder.or_(*values))


@typers.infer_getattr
class _Parts(typers.AttributeTemplate):  # type: ignore[misc]
    key = _Wide

    def resolve_real(self, wide: Any) -> Any:
        """The value of a dual number; lanes themselves."""
        return wide if wide == LANES else types.float64


@tools.lower_getattr(_Wide, "real")
def _real(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return value if kind == LANES else builder.extract_value(value, 0)


@tools.lower_cast(types.Float, _Wide)
@tools.lower_cast(types.Integer, _Wide)
def _widened(context: Any, builder: Any, origin: Any, wide: Any, value: Any) -> Any:
    number = context.cast(builder, value, origin, types.float64)
    return _spread(builder, number) if wide == LANES else _joined(builder, number, _NONE)


@intrinsic
def chained(typingctx: Any, value: Any, slope: Any, x: Any) -> Any:
    """Returns the dual number f(x) from f's value and slope at the value of x."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        _, moved = _split(builder, values[2])
        return _joined(builder, values[0], builder.fmul(_spread(builder, values[1]), moved, flags=_FUSED))

    return DUAL(types.float64, types.float64, DUAL), generate


@intrinsic
def part(typingctx: Any, x: Any, k: Any) -> Any:
    """Returns the derivative k of a dual number."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.extract_element(builder.extract_value(values[0], 1), values[1])

    return types.float64(DUAL, types.int64), generate


@intrinsic
def with_part(typingctx: Any, x: Any, value: Any, slope: Any, k: Any) -> Any:
    """Returns a dual number with a new value and a new derivative k."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        dual, value, slope, place = values
        return _joined(builder, value, builder.insert_element(builder.extract_value(dual, 1), slope, place))

    return DUAL(DUAL, types.float64, types.float64, types.int64), generate


@intrinsic
def _viewed(typingctx: Any, wide: Any, array: Any) -> Any:
    kind = LANES if wide.instance_class is Lanes else DUAL
    found = types.Array(kind, array.ndim - 1, "C")

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        seen, own = (
            arrays.make_array(sig.args[1])(context, builder, values[1]),
            arrays.make_array(found)(context, builder),
        )
        size = context.get_abi_sizeof(context.get_data_type(kind))
        shape = [builder.extract_value(seen.shape, place) for place in range(found.ndim)]
        strides = [builder.extract_value(seen.strides, place) for place in range(found.ndim)]
        data = builder.bitcast(seen.data, context.get_data_type(kind).as_pointer())
        bytes_each = context.get_constant(types.intp, size)
        arrays.populate_array(own, data, shape, strides, bytes_each, meminfo=seen.meminfo, parent=None)
        context.nrt.incref(builder, found, own._getvalue())
        return own._getvalue()

    return found(wide, array), generate


def seen_as(tag: Any, array: Any) -> Any:
    """Returns an array of the numbers that a tag names: a view of a C-contiguous array of floats."""
    return array


@overload(seen_as, jit_options=_OPTIONS, strict=False)
def _seen_as(tag: Any, array: Any) -> Any:
    if tag.instance_class is Plain:
        return lambda tag, array: array
    return lambda tag, array: _viewed(tag, array)


def where(condition: Any, yes: Any, no: Any) -> Any:
    """Returns one of two numbers, in lanes for each run. Both are computed."""
    return yes if condition else no


@intrinsic
def _chosen(typingctx: Any, condition: Any, yes: Any, no: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.select(*values)

    return LANES(_MASK, LANES, LANES), generate


@overload(where, jit_options=_OPTIONS, strict=False)
def _where(condition: Any, yes: Any, no: Any) -> Any:
    if condition == _MASK:
        return lambda condition, yes, no: _chosen(condition, yes, no)
    return lambda condition, yes, no: yes if condition else no


def _each(name: str) -> Any:
    """Returns a function of lanes by the processor's or the library's function `name`."""

    @intrinsic
    def function(typingctx: Any, x: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            kind = ir.FunctionType(_VECTOR, [_VECTOR])
            known = builders.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
            return builder.call(known, values)

        return LANES(LANES), generate

    return function


_floor, _exp, _sqrt = map(_each, ("floor", "exp", "sqrt"))


def whole(x: Any) -> Any:
    """Returns the largest whole number up to the value of x, without derivatives."""
    return np.floor(x.real)


@overload(whole, jit_options=_OPTIONS, strict=False)
def _whole(x: Any) -> Any:
    if x == LANES:
        return lambda x: _floor(x)
    return lambda x: np.floor(x.real)


def exponential(x: Any) -> Any:
    """Returns eˣ."""
    return np.exp(x)


@overload(exponential, jit_options=_OPTIONS, strict=False)
def _exponential(x: Any) -> Any:
    if x == LANES:
        return lambda x: _exp(x)
    if x == DUAL:

        def dual(x: Any) -> Any:
            value = np.exp(x.real)
            return chained(value, value, x)

        return dual
    return lambda x: np.exp(x)


def root(x: Any) -> Any:
    """Returns √x."""
    return np.sqrt(x)


@overload(root, jit_options=_OPTIONS, strict=False)
def _root(x: Any) -> Any:
    if x == LANES:
        return lambda x: _sqrt(x)
    if x == DUAL:

        def dual(x: Any) -> Any:
            value = np.sqrt(x.real)
            return chained(value, 0.5 / value, x)

        return dual
    return lambda x: np.sqrt(x)


def first(x: Any) -> Any:
    """Returns the value of a number; of lanes that of the first run, for what all runs share."""
    return x.real


@intrinsic
def _first_lane(typingctx: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.extract_element(values[0], ir.IntType(32)(0))

    return types.float64(LANES), generate


@overload(first, jit_options=_OPTIONS, strict=False)
def _first(x: Any) -> Any:
    return (lambda x: _first_lane(x)) if x == LANES else (lambda x: x.real)
