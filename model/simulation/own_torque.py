"""Calls the torques of users' effects from the compiled run, by address.

An address is a number, so the run that is cached on disk is the same for all effects. This module imports nothing of
the library of effects; otherwise each edit of the library would compile the runs again.
"""

# ruff: noqa: ARG001 (implementations share an interface)

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import extending
from numba.core import cgutils as builders
from numba.np import arrayobj
from numpy.typing import NDArray

from model import layout as at
from model.dynamics.compilation import inlined, internal
from model.dynamics.dual import DUAL_STEP
from model.dynamics.wide_numbers import DUAL, WIDTH, part, with_part

# numba's tools for compiled code have no usable types
cgutils: Any = builders
make_array: Any = arrayobj.make_array
intrinsic: Any = extending.intrinsic

ADDRESS, BEYOND = range(2)
"""Columns of a table of own effects: address of the compiled torque (0: not on this joint), and the index of its first
parameter among the columns for own effects.
"""


@internal
def own_torque(
    own: NDArray[np.int64], joint: NDArray[Any], q: Any, speed: Any, volts: Any, load: Any, time: Any
) -> Any:
    """Returns the torque (N·m) of a joint's user effects; `own` is that joint's table (e, 2)."""
    torque = 0.0 * (q + joint[0])
    for e in range(own.shape[0]):
        if own[e, ADDRESS] != 0:
            none = 0.0 * torque
            motion = (q + none, speed + none, volts + none, load + none, time + none)
            torque += called(own[e, ADDRESS], motion, joint[at.USER + own[e, BEYOND] :])
    return torque


@intrinsic
def _call(_typing: Any, address: Any, motion: Any, parameters: Any) -> Any:
    """Calls the torque at an address with a tuple of MOTION numbers and an array of parameters, all of one type."""
    number = motion.dtype

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        where, moving, values = arguments
        pointer = cgutils.voidptr_t
        kind = ir.FunctionType(ir.VoidType(), [pointer] * 3)
        result = cgutils.alloca_once(builder, context.get_data_type(number))
        sent = cgutils.alloca_once_value(builder, moving)
        data = make_array(parameters)(context, builder, values).data
        function = builder.inttoptr(where, kind.as_pointer())
        builder.call(function, [builder.bitcast(p, pointer) for p in (sent, data, result)])
        return context.unpack_value(builder, number, result)

    return number(address, motion, parameters), generate


def called(address: int, motion: Any, parameters: Any) -> Any:
    """Returns the torque at an address for a tuple of MOTION numbers and an array of parameters, all of one kind."""
    raise NotImplementedError("only compiled code can call an address")


@extending.overload(called, strict=False)
def _called(address: Any, motion: Any, parameters: Any) -> Any:
    if motion.dtype != DUAL:

        def alone(address: Any, motion: Any, parameters: Any) -> Any:
            return _call(address, motion, parameters)

        return alone

    def by_each_tangent(address: Any, motion: Any, parameters: Any) -> Any:
        """Users' torques are compiled for duals of one derivative, in complex numbers."""
        sent = np.empty(parameters.shape[0], np.complex128)
        result = 0.0 * motion[0]
        for k in range(WIDTH):
            for i in range(parameters.shape[0]):
                sent[i] = one_of(parameters[i], k)
            q, speed, volts, load, time = motion
            each = (one_of(q, k), one_of(speed, k), one_of(volts, k), one_of(load, k), one_of(time, k))
            found = _call(address, each, sent)
            result = with_part(result, found.real, found.imag / DUAL_STEP, k)
        return result

    return by_each_tangent


@inlined
def one_of(x: Any, k: int) -> complex:
    """Returns a dual number's value with its derivative k, as a dual number of one derivative."""
    return complex(x.real, part(x, k) * DUAL_STEP)
