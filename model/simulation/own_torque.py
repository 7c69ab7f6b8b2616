"""Torques of effects of the user's own, as the compiled run calls them: by address.

An address is a number, so the run itself stays the one that is cached on disk, whatever effects it calls. Nothing of
the library of effects is imported here, so that an edit there compiles no run again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba.core import cgutils as builders
from numba.extending import intrinsic
from numba.np import arrayobj
from numpy.typing import NDArray

from model import layout as at
from model.dynamics.compilation import internal

# numba's tools for compiled code have no types of their own that hold here
cgutils: Any = builders
make_array: Any = arrayobj.make_array

ADDRESS, BEYOND = range(2)
"""Columns of a table of own effects: address of the compiled torque (0: not on this joint), and its first parameter's
place among the columns for own effects."""


@internal
def own_torque(
    own: NDArray[np.int64], joint: NDArray[Any], q: Any, speed: Any, volts: Any, load: Any, time: Any
) -> Any:
    """Torque (N·m) of a joint's effects of the user's own; `own` is that joint's table (e, 2)."""
    torque = 0.0 * (q + joint[0])
    for e in range(own.shape[0]):
        if own[e, ADDRESS] != 0:
            none = 0.0 * torque
            motion = (q + none, speed + none, volts + none, load + none, time + none)
            torque += called(own[e, ADDRESS], motion, joint[at.USER + own[e, BEYOND] :])
    return torque


@intrinsic
def _call(_typing: Any, address: Any, motion: Any, parameters: Any) -> Any:
    """The torque at an address for a tuple of MOTION numbers and an array of parameters, all of one type."""
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


called: Any = _call
