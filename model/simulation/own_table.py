"""Compiles users' effects once per process, checks them, and passes them to the run as a table of addresses."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
from numba.core import types
from numba.core.errors import NumbaError
from numba.cpython.unsafe import tuple as tuples
from numba.np.unsafe import ndarray
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from model.dynamics.dual import DUAL_STEP
from model.effects.effect import Effect
from model.effects.library import effect
from model.effects.own import ARGUMENTS
from model.machine_model.model import Model

# numba's tools for compiled code have no usable types
pointer_to: Any = types.CPointer
carray: Any = vars(numba)["carray"]
to_fixed_tuple: Any = ndarray.to_fixed_tuple
tuple_setitem: Any = tuples.tuple_setitem

MOTION = len(ARGUMENTS)

TRIALS = 40
AGREEING = 0.85
"""Least share of trials in which derivatives must be right; a few trials may hit a corner."""
STEP = 1e-6
TOLERANCE = 1e-4
SPANS = (2.0, 3.0, 20.0, 20.0, 5.0)
"""Trials draw position (rad), speed (rad/s), drive (V) and load (N·m) from ± these, time (s) from 0 on."""


def own_table(model: Model, dtype: Any) -> NDArray[np.int64]:
    """Returns a table (n, e, 2) of the model's user effects, for runs in real or in dual numbers.

    Raises SpecError if a torque cannot be compiled, is not zero at its null value, or has wrong derivatives.
    """
    columns = model.own_columns
    table = np.zeros((model.joint_count, len(columns), 2), dtype=np.int64)
    for row, (name, beyond) in enumerate(columns.items()):
        address = _checked(effect(name))[int(np.issubdtype(dtype, np.complexfloating))]
        for use in model.effects:
            for joint in use.joints if use.name == name else ():
                table[joint - 1, row] = address, beyond
    return table


@cache
def _checked(kind: Effect) -> tuple[int, int]:
    """Returns the addresses of an effect's torque in real and in dual numbers."""
    assert kind.torque is not None
    real, dual = (
        _compiled(kind, number, dtype)
        for number, dtype in ((types.float64, np.float64), (types.complex128, np.complex128))
    )
    _check_values(kind, real, dual)
    return real.address, dual.address


_kept: list[Any] = []
"""Compiled torques; kept so that their addresses stay valid as long as the process runs."""


def _compiled(kind: Effect, number: Any, dtype: Any) -> Any:
    assert kind.torque is not None
    names = (*ARGUMENTS, *(p.name for p in kind.parameters))
    order = tuple(names.index(argument) for argument in inspect.signature(kind.torque).parameters)
    count, taken = len(kind.parameters), len(order)
    body: Callable[..., Any] = numba.njit(error_model="numpy")(kind.torque)

    def at_pointers(motion: Any, parameters: Any, result: Any) -> None:
        every = to_fixed_tuple(carray(motion, MOTION, dtype), MOTION) + to_fixed_tuple(
            carray(parameters, count, dtype), count
        )
        chosen = every[:taken]
        for k in range(taken):
            chosen = tuple_setitem(chosen, k, every[order[k]])
        carray(result, 1, dtype)[0] = body(*chosen)

    pointer = pointer_to(number)
    try:
        compiled = numba.cfunc(types.void(pointer, pointer, pointer), error_model="numpy")(at_pointers)
    except NumbaError as error:
        reason = next((line for line in str(error).splitlines() if line.strip() and "Failed in" not in line), "")
        numbers = "real" if dtype is np.float64 else "dual"
        raise SpecError(
            f"effect {kind.name}: its torque cannot be compiled in {numbers} numbers: {reason.strip()}; "
            "compare `.real` parts, and see model.effects.own_math"
        ) from error
    _kept.append(compiled)
    return compiled


def _check_values(kind: Effect, real: Any, dual: Any) -> None:
    """Rejects a torque that is not zero at its null value, or whose dual parts are not its derivatives."""
    rng = np.random.default_rng(1)
    names = (*ARGUMENTS, *(p.name for p in kind.parameters))
    wrong = np.zeros(len(names))
    for _ in range(TRIALS):
        point = _trial(kind, rng)
        for k in range(len(names)):
            step = STEP * max(1.0, abs(point[k]))
            above, below = point.copy(), point.copy()
            above[k] += step
            below[k] -= step
            slope = (_value(real, above) - _value(real, below)) / (2 * step)
            seeded = point.astype(np.complex128)
            seeded[k] += 1j * DUAL_STEP
            exact = _value(dual, seeded)
            if not np.isclose(exact.real, _value(real, point), rtol=1e-9, atol=1e-12):
                raise SpecError(
                    f"effect {kind.name}: its torque differs in real and in dual numbers; does it depend "
                    "on its arguments alone?"
                )
            wrong[k] += not np.isclose(exact.imag / DUAL_STEP, slope, rtol=TOLERANCE, atol=TOLERANCE)
        _check_null(kind, real, point)
    for k, name in enumerate(names):
        if wrong[k] > (1 - AGREEING) * TRIALS:
            raise SpecError(
                f"effect {kind.name}: the derivative of its torque by {name} is wrong in dual numbers; "
                "use magnitude, sign, larger, smaller and clamped of model.effects.own_math for abs, min and max"
            )


def _check_null(kind: Effect, real: Any, point: NDArray[np.float64]) -> None:
    still = point.copy()
    for k, p in enumerate(kind.parameters):
        if isinstance(p.null, float | int):
            still[MOTION + k] = p.null
    if (left := _value(real, still)) != 0.0:
        raise SpecError(
            f"effect {kind.name}: its torque is {left:.3g} N·m where its parameters are at null; it must be 0"
        )


def _trial(kind: Effect, rng: np.random.Generator) -> NDArray[np.float64]:
    """Returns the arguments of a trial: random motion, parameters near their starting values."""
    motion = rng.uniform(-1.0, 1.0, MOTION) * np.array(SPANS)
    motion[-1] = abs(motion[-1])
    values = []
    for p in kind.parameters:
        numbers = (p.null if p.start is None else p.start, p.deviation, p.low, p.high)
        begin, size, low, high = (float(v) for v in numbers if isinstance(v, float | int))
        values.append(np.clip(begin + size * rng.uniform(-2.0, 2.0), low, high))
    return np.array([*motion, *values])


def _value(compiled: Any, point: NDArray[Any]) -> Any:
    motion, parameters, result = point[:MOTION].copy(), point[MOTION:].copy(), np.zeros(1, dtype=point.dtype)
    pointers = (
        a.ctypes.data_as(t) for a, t in zip((motion, parameters, result), compiled.ctypes.argtypes, strict=True)
    )
    compiled.ctypes(*pointers)
    return result[0]
