"""Vectors of a known number of lanes for the kernels, written as one would write numbers.

The compiler turns a loop over eight floats into eight times one float, before the part of it that knows vectors sees
the loop; and what it does turn into vectors, it takes long to find. Here nothing has to be found. A vector that is
wider than the processor's is cut by the compiler.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core import typing as templates
from numba.core.typing.templates import infer_global
from numba.extending import intrinsic, lower_builtin, models, register_model

_ELEMENTS = {"float32": ir.FloatType(), "int32": ir.IntType(32), "bool": ir.IntType(1)}


class Lanes(types.Type):
    """``count`` numbers of one kind, float32, int32 or bool, in a register."""

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


def _define(operation: Callable[..., Any], kind: str, result: str, emit: Callable[..., Any]) -> None:
    """Let ``operation`` take two vectors of ``kind``, or one and a number."""

    class Template(templates.templates.AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            lanes = [arg for arg in args if isinstance(arg, Lanes)]
            if len(args) == 2 and lanes and all(arg in (lanes[0], getattr(types, kind)) for arg in args):
                return templates.signature(Lanes(result, lanes[0].count), *args) if lanes[0].kind == kind else None
            return None

    infer_global(operation)(Template)
    number = types.Float if kind == "float32" else types.Integer

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        count = signature.return_type.count
        both = [_spread(builder, arg, given, count) for arg, given in zip(args, signature.args, strict=True)]
        return emit(builder, *both)

    for pair in ((Lanes, Lanes), (Lanes, number), (number, Lanes)):
        lower_builtin(operation, *pair)(lower)


_define(operator.add, "float32", "float32", lambda builder, a, b: builder.fadd(a, b))
_define(operator.sub, "float32", "float32", lambda builder, a, b: builder.fsub(a, b))
_define(operator.mul, "float32", "float32", lambda builder, a, b: builder.fmul(a, b))
_define(operator.truediv, "float32", "float32", lambda builder, a, b: builder.fdiv(a, b))
_define(operator.lt, "float32", "bool", lambda builder, a, b: builder.fcmp_ordered("<", a, b))
_define(operator.gt, "float32", "bool", lambda builder, a, b: builder.fcmp_ordered(">", a, b))
_define(operator.eq, "int32", "bool", lambda builder, a, b: builder.icmp_signed("==", a, b))


def _load(kind: str) -> Any:
    def load(typing: Any, address: Any, count: Any) -> Any:
        if not isinstance(count, types.IntegerLiteral):
            return None
        lanes = Lanes(kind, count.literal_value)

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            place = builder.inttoptr(args[0], ir.VectorType(_ELEMENTS[kind], lanes.count).as_pointer())
            return builder.load(place, align=4)

        return lanes(types.intp, count), codegen

    return intrinsic(prefer_literal=True)(load)


load_floats, load_ints = _load("float32"), _load("int32")
"""(address, count): the numbers that stand from an address on; ``count`` must be known when it compiles."""


@intrinsic(prefer_literal=True)
def spread(typing: Any, value: Any, count: Any) -> Any:
    """A vector that has a float32 or int32 in every lane; ``count`` must be known when it compiles."""
    kind = types.unliteral(value)
    if not isinstance(count, types.IntegerLiteral) or str(kind) not in _ELEMENTS:
        return None

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _spread(builder, args[0], kind, count.literal_value)

    return Lanes(str(kind), count.literal_value)(kind, count), codegen


@intrinsic
def store(typing: Any, address: Any, values: Any) -> Any:
    """Write a vector of float32 or int32 to an address."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[1], builder.inttoptr(args[0], args[1].type.as_pointer()), align=4)
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
        return builder.zext(count, ir.IntType(32)) if where.count < 32 else count

    return types.int32(where), codegen


@intrinsic
def to_mask(typing: Any, where: Any) -> Any:
    """Bools as int32: -1 where true, else 0."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.sext(args[0], ir.VectorType(ir.IntType(32), where.count))

    return Lanes("int32", where.count)(where), codegen


def _unary(name: str) -> Any:
    def apply(typing: Any, values: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(args[0].type, [args[0].type])
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{values.count}f32")
            return builder.call(function, args)

        return values(values), codegen

    return intrinsic(apply)


square_root, magnitude = _unary("sqrt"), _unary("fabs")
"""Of every lane of a float32 vector."""
