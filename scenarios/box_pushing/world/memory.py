"""Access of kernels to Box2D: the memory of bodies, and ``b2World::Step``.

numba is imported with this module, so that nothing imports it before a kernel is compiled.
"""

from typing import Any

from llvmlite import ir
from numba import config as config
from numba import types
from numba.extending import intrinsic

Made = Any
"""Types, values and builders of code, of which numba has no types."""
FLOAT = ir.FloatType()
POINTER = ir.IntType(8).as_pointer()


@intrinsic
def load(context: Made, address: Made) -> Made:
    """Return the single-precision number at an address."""

    def generate(_: Made, builder: Made, __: Made, arguments: Made) -> Made:
        return builder.load(builder.inttoptr(arguments[0], FLOAT.as_pointer()))

    return types.float32(types.int64), generate


@intrinsic
def store(context: Made, address: Made, value: Made) -> Made:
    """Write a single-precision number to an address."""

    def generate(_: Made, builder: Made, __: Made, arguments: Made) -> Made:
        builder.store(arguments[1], builder.inttoptr(arguments[0], FLOAT.as_pointer()))

    return types.void(types.int64, types.float32), generate


@intrinsic
def set_bits(context: Made, address: Made, bits: Made) -> Made:
    """Set bits of the 16 at an address."""

    def generate(_: Made, builder: Made, __: Made, arguments: Made) -> Made:
        at = builder.inttoptr(arguments[0], ir.IntType(16).as_pointer())
        builder.store(builder.or_(builder.load(at), arguments[1]), at)

    return types.void(types.int64, types.int16), generate


@intrinsic
def call(
    context: Made, function: Made, world: Made, seconds: Made, velocities: Made, positions: Made
) -> Made:
    """Call ``b2World::Step`` of a world, both by address."""

    def generate(_: Made, builder: Made, __: Made, arguments: Made) -> Made:
        whole = ir.IntType(32)
        signature = ir.FunctionType(ir.VoidType(), [POINTER, FLOAT, whole, whole])
        step = builder.inttoptr(arguments[0], signature.as_pointer())
        builder.call(step, [builder.inttoptr(arguments[1], POINTER), *arguments[2:]])

    of = (types.int64, types.int64, types.float32, types.int32, types.int32)
    return types.void(*of), generate
