"""Vectors of a known number of lanes for the kernels, written as one would write numbers.

The compiler turns a loop over eight floats into eight times one float, before the part of it that knows vectors sees
the loop; and what it does turn into vectors, it takes long to find. Here nothing has to be found. A vector that is
wider than the processor's is cut by the compiler.
"""

import operator
from collections.abc import Callable, Mapping
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core import typing as templates
from numba.core.typing.templates import infer_global
from numba.extending import intrinsic, lower_builtin, models, register_model

_ELEMENTS = {
    "float32": ir.FloatType(),
    "int32": ir.IntType(32),
    "uint8": ir.IntType(8),
    "uint16": ir.IntType(16),
    "bool": ir.IntType(1),
}
_ALIGN = {"uint8": 1, "uint16": 2}


class Lanes(types.Type):
    """``count`` numbers of one kind, of those above, in a register."""

    def __init__(self, kind: str, count: int) -> None:
        super().__init__(f"Lanes({kind}, {count})")
        self.kind, self.count = kind, count


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        super().__init__(manager, lanes, ir.VectorType(_ELEMENTS[lanes.kind], lanes.count))


def _spread(builder: Any, value: Any, given: Any, count: int) -> Any:
    """The value itself, or a vector that has it in every lane."""
    if isinstance(given, Lanes):
        return value
    vector = ir.VectorType(value.type, count)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)


def _define(operation: Callable[..., Any], emits: Mapping[str, Callable[..., Any]], compares: bool = False) -> None:
    """Let ``operation`` take two vectors of one kind, or one and a number; ``emits``: how, by kind."""

    class Template(templates.templates.AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            lanes = [arg for arg in args if isinstance(arg, Lanes)]
            if len(args) != 2 or not lanes or lanes[0].kind not in emits:
                return None
            if not all(arg in (lanes[0], getattr(types, lanes[0].kind)) for arg in args):
                return None
            return templates.signature(Lanes("bool" if compares else lanes[0].kind, lanes[0].count), *args)

    infer_global(operation)(Template)

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        count = signature.return_type.count
        kind = next(arg.kind for arg in signature.args if isinstance(arg, Lanes))
        both = [_spread(builder, arg, given, count) for arg, given in zip(args, signature.args, strict=True)]
        return emits[kind](builder, *both)

    for pair in ((Lanes, Lanes), (Lanes, types.Number), (types.Number, Lanes)):
        lower_builtin(operation, *pair)(lower)


def _compare(sign: str) -> dict[str, Callable[..., Any]]:
    return {
        "float32": lambda builder, a, b: builder.fcmp_ordered(sign, a, b),
        "int32": lambda builder, a, b: builder.icmp_signed(sign, a, b),
        "uint8": lambda builder, a, b: builder.icmp_unsigned(sign, a, b),
        "uint16": lambda builder, a, b: builder.icmp_unsigned(sign, a, b),
    }


def _arithmetic(name: str) -> dict[str, Callable[..., Any]]:
    whole = {kind: lambda builder, a, b: getattr(builder, name)(a, b) for kind in ("uint8", "uint16", "int32")}
    return whole | {"float32": lambda builder, a, b: getattr(builder, f"f{name}")(a, b)}


_define(operator.add, _arithmetic("add"))
_define(operator.sub, _arithmetic("sub"))
_define(operator.mul, _arithmetic("mul"))
_define(operator.truediv, {"float32": lambda builder, a, b: builder.fdiv(a, b)})
_define(operator.xor, {"int32": lambda builder, a, b: builder.xor(a, b)})
for _operation, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.eq, "==")):
    _define(_operation, _compare(_sign), compares=True)


def _load(kind: str) -> Any:
    def load(typing: Any, address: Any, count: Any) -> Any:
        if not isinstance(count, types.IntegerLiteral):
            return None
        lanes = Lanes(kind, count.literal_value)

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            place = builder.inttoptr(args[0], ir.VectorType(_ELEMENTS[kind], lanes.count).as_pointer())
            return builder.load(place, align=_ALIGN.get(kind, 4))

        return lanes(types.intp, count), codegen

    return intrinsic(prefer_literal=True)(load)


load_floats, load_ints = _load("float32"), _load("int32")
load_bytes, load_words = _load("uint8"), _load("uint16")
"""(address, count): the numbers that stand from an address on; ``count`` must be known when it compiles."""


@intrinsic(prefer_literal=True)
def spread(typing: Any, value: Any, count: Any) -> Any:
    """A vector that has a number in every lane; ``count`` must be known when it compiles."""
    kind = types.unliteral(value)
    if not isinstance(count, types.IntegerLiteral) or str(kind) not in _ELEMENTS:
        return None

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _spread(builder, args[0], kind, count.literal_value)

    return Lanes(str(kind), count.literal_value)(kind, count), codegen


@intrinsic
def store(typing: Any, address: Any, values: Any) -> Any:
    """Write a vector to an address."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = builder.inttoptr(args[0], args[1].type.as_pointer())
        builder.store(args[1], place, align=_ALIGN.get(values.kind, 4))
        return context.get_dummy_value()

    return types.void(types.intp, values), codegen


@intrinsic
def choose(typing: Any, where: Any, yes: Any, no: Any) -> Any:
    """Lane by lane ``yes`` where the bool is true, else ``no``; each of them a vector or a number."""
    kind = next((given.kind for given in (yes, no) if isinstance(given, Lanes)), str(yes))

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        both = [_spread(builder, args[i], signature.args[i], where.count) for i in (1, 2)]
        return builder.select(args[0], *both)

    return Lanes(kind, where.count)(where, yes, no), codegen


@intrinsic
def count_true(typing: Any, where: Any) -> Any:
    """In how many lanes the bool is true, as int32."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        count = builder.ctpop(builder.bitcast(args[0], ir.IntType(where.count)))
        if where.count == 32:
            return count
        return (builder.zext if where.count < 32 else builder.trunc)(count, ir.IntType(32))

    return types.int32(where), codegen


@intrinsic
def to_mask(typing: Any, where: Any) -> Any:
    """Bools as int32: -1 where true, else 0."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.sext(args[0], ir.VectorType(ir.IntType(32), where.count))

    return Lanes("int32", where.count)(where), codegen


def _between(given: str, made: str, cast: str) -> Any:
    def convert(typing: Any, values: Any) -> Any:
        if values.kind != given:
            return None

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return getattr(builder, cast)(args[0], ir.VectorType(_ELEMENTS[made], values.count))

        return Lanes(made, values.count)(values), codegen

    return intrinsic(convert)


cut_off, to_floats = _between("float32", "int32", "fptosi"), _between("int32", "float32", "sitofp")
"""float32 as int32, towards zero; int32 as float32."""


@intrinsic
def shift_down(typing: Any, values: Any, by: Any) -> Any:
    """The bits of int32 moved down by ``by`` (int32), and zeros after them, whatever the sign."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.lshr(args[0], _spread(builder, args[1], by, values.count))

    return values(values, types.int32), codegen


@intrinsic
def high_product(typing: Any, values: Any, factor: Any) -> Any:
    """The upper 32 of the 64 bits of a product with ``factor``, both without sign; the bits stand in int32."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        wide = ir.VectorType(ir.IntType(64), values.count)
        both = [builder.zext(one, wide) for one in (args[0], _spread(builder, args[1], factor, values.count))]
        upper = builder.lshr(builder.mul(*both), ir.Constant(wide, [32] * values.count))
        return builder.trunc(upper, args[0].type)

    return values(values, types.int32), codegen


def _unary(name: str) -> Any:
    def apply(typing: Any, values: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(args[0].type, [args[0].type])
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{values.count}f32")
            return builder.call(function, args)

        return values(values), codegen

    return intrinsic(apply)


square_root, magnitude, round_down = _unary("sqrt"), _unary("fabs"), _unary("floor")
"""Of every lane of a float32 vector."""


def _call(builder: Any, name: str, result: Any, args: Any) -> Any:
    kind = ir.FunctionType(result, [arg.type for arg in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)


def _binary(name: str) -> Any:
    def apply(typing: Any, a: Any, b: Any) -> Any:
        lanes = a if isinstance(a, Lanes) else b

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            both = [_spread(builder, arg, given, lanes.count) for arg, given in zip(args, signature.args, strict=True)]
            return _call(builder, f"llvm.{name}.v{lanes.count}i{_ELEMENTS[lanes.kind].width}", both[0].type, both)

        return lanes(a, b), codegen

    return intrinsic(apply)


least, add_clipped = _binary("umin"), _binary("uadd.sat")
"""Of uint8 or uint16, lane by lane, of two vectors or a vector and a number of its kind: the lower; the sum, and the
largest number where it is more."""


@intrinsic
def least_of(typing: Any, values: Any) -> Any:
    """The lowest number of a vector of uint8 or uint16."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        element = args[0].type.element
        return _call(builder, f"llvm.vector.reduce.umin.v{values.count}i{element.width}", element, args)

    return getattr(types, values.kind)(values), codegen


@intrinsic(prefer_literal=True)
def slide(typing: Any, values: Any, after: Any, by: Any) -> Any:
    """The lanes of ``values`` from ``by`` on, and then as many of the vector ``after`` as make it whole."""
    if not isinstance(by, types.IntegerLiteral):
        return None
    first = by.literal_value

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        lanes = ir.Constant(ir.VectorType(ir.IntType(32), values.count), list(range(first, first + values.count)))
        return builder.shuffle_vector(args[0], args[1], lanes)

    return values(values, after, by), codegen


@intrinsic
def sum_of(typing: Any, values: Any) -> Any:
    """The sum of a vector of float32, halves onto halves: in one order on every processor."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        total, count = args[0], values.count
        while count > 1:
            count //= 2
            parts = []
            for first in (0, count):
                lanes = ir.Constant(ir.VectorType(ir.IntType(32), count), list(range(first, first + count)))
                parts.append(builder.shuffle_vector(total, ir.Constant(total.type, ir.Undefined), lanes))
            total = builder.fadd(*parts)
        return builder.extract_element(total, ir.Constant(ir.IntType(32), 0))

    return types.float32(values), codegen


@intrinsic
def widen(typing: Any, values: Any) -> Any:
    """A vector of uint8 as uint16."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.zext(args[0], ir.VectorType(ir.IntType(16), values.count))

    return Lanes("uint16", values.count)(values), codegen


@intrinsic
def narrow(typing: Any, values: Any, shift: Any) -> Any:
    """A vector of uint16, divided by 2 ** ``shift`` (uint16) and cut off, as uint8."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        shifted = builder.lshr(args[0], _spread(builder, args[1], shift, values.count))
        return builder.trunc(shifted, ir.VectorType(ir.IntType(8), values.count))

    return Lanes("uint8", values.count)(values, types.uint16), codegen


@intrinsic
def first_true(typing: Any, where: Any) -> Any:
    """The number of the first lane that is true, as int64; the number of lanes (at most 64) where none is."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        mask = builder.bitcast(args[0], ir.IntType(where.count))
        at = builder.cttz(mask, ir.Constant(ir.IntType(1), 0))
        return builder.zext(at, ir.IntType(64)) if where.count < 64 else at

    return types.int64(where), codegen


@intrinsic(prefer_literal=True)
def differing_bits(typing: Any, code: Any, address: Any, count: Any) -> Any:
    """In how many bits a uint64 differs from each of the ``count`` that stand from an address on, as uint8."""
    if not isinstance(count, types.IntegerLiteral):
        return None
    lanes = Lanes("uint8", count.literal_value)

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        vector = ir.VectorType(ir.IntType(64), lanes.count)
        others = builder.load(builder.inttoptr(args[1], vector.as_pointer()), align=8)
        differing = builder.xor(others, _spread(builder, args[0], None, lanes.count))
        bits = _call(builder, f"llvm.ctpop.v{lanes.count}i64", vector, [differing])
        return builder.trunc(bits, ir.VectorType(ir.IntType(8), lanes.count))

    return lanes(types.uint64, types.intp, count), codegen
