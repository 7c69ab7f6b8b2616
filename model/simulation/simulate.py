"""Simulates a model, one run or many, with exact derivatives on request."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.extras import require_extra
from daq.contracts.trace import Trace
from daq.contracts.with_arrays import WithArrays
from model.arrays import Floats
from model.dynamics.dual import DUAL_STEP
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.simulation.batch import BatchRun, seed
from model.simulation.inputs import RunInputs, inputs_of
from model.simulation.period import OUT_DRIVE, OUT_ERROR, OUT_POSITION, OUT_POWER, OUT_READING, OUT_SPEED
from model.simulation.prepared import Options, prepare

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Simulation(WithArrays):
    """Motion of a model, one row per control period, one column per joint.

    time (k,) s; position (k, n) rad, the joint's true angle; velocity rad/s; reading rad, of the model's sensor; error
    rad, set point − reading of the controller; drive, commanded motor volts (before dead zone and supply limit); power,
    DAC counts; rows (m,) positions of the record's samples on this grid.
    """

    joints: tuple[int, ...]
    time: Floats
    position: Floats
    velocity: Floats
    reading: Floats
    error: Floats
    drive: Floats
    power: Floats
    rows: Floats

    def __repr__(self) -> str:
        """Returns one line, for notebooks."""
        joints = ", ".join(map(str, self.joints))
        return f"<Simulation: {len(self.time)} periods to {self.time[-1]:.1f} s, joints {joints}>"

    def to_xarray(self) -> xr.Dataset:
        """Signals over `time` (s) and `joint`, one row a control period. Raises MissingExtraError."""
        require_extra("tables", "to_xarray()", "xarray")
        import xarray as xr

        signals = ("position", "velocity", "reading", "error", "drive", "power")
        found = {name: (("time", "joint"), getattr(self, name)) for name in signals}
        return xr.Dataset(found, {"time": ("time", self.time, {"units": "s"}), "joint": list(self.joints)})

    def at_samples(self, signal: Floats) -> Floats:
        """Returns a signal (k, …) at the samples of the record, (m, …); interpolated between periods where needed."""
        return at_rows(signal, self.rows)


def at_rows(signal: Floats, rows: Floats) -> Floats:
    """Returns a signal at fractional rows, linearly interpolated."""
    low = np.floor(rows).astype(np.int64)
    share = rows - low
    if not share.any():
        return signal[low]
    high = np.minimum(low + 1, len(signal) - 1)
    share = share.reshape(-1, *([1] * (signal.ndim - 1)))
    return (1 - share) * signal[low] + share * signal[high]


def simulate(model: Model, trace: Trace | RunInputs, options: Options | None = None) -> Simulation:
    """Returns the model's response to the set points (or the drive) of a trace.

    Raises TraceError for a trace that cannot be simulated, SpecError if the motion does not stay finite.
    """
    options = options or Options()
    inputs = inputs_of(trace, model.machine) if isinstance(trace, Trace) else trace
    prepared = prepare(model, inputs, options)
    which = np.zeros(1, np.int64)
    vectors, initials = model.vector[None].copy(), prepared.initial[None]
    out = BatchRun(model, (prepared,), which, vectors, initials, options.step, options.general).run()
    _check_finite(out, inputs)
    return _simulation(inputs, out[0])


@dataclass(frozen=True)
class Sensitivities:
    """A run without rounding and its derivatives: `jacobian` (p, OUTPUTS, k, n), in the order of `parameters`."""

    parameters: tuple[Parameter, ...]
    simulation: Simulation
    jacobian: Floats

    def of(self, output: int) -> Floats:
        """Returns derivatives (p, k, n) of one output, by its index in `model.simulation.period`."""
        return self.jacobian[:, output]

    @property
    def reading(self) -> Floats:
        """Returns derivatives (p, k, n) of the controller's reading, rad per unit of each parameter."""
        return self.jacobian[:, OUT_READING]


def sensitivities(
    model: Model, trace: Trace | RunInputs, parameters: Sequence[Parameter], options: Options | None = None
) -> Sensitivities:
    """Returns a run with exact derivatives by parameters of the model or its initial state, without rounding.

    Dual numbers carry the derivatives. Raises as `simulate` does.
    """
    options = replace(options or Options(), quantise=False)
    inputs = inputs_of(trace, model.machine) if isinstance(trace, Trace) else trace
    prepared = prepare(model, inputs, options)
    which = np.zeros(len(parameters), np.int64)
    vectors = np.tile(model.vector.astype(np.complex128), (len(parameters), 1))
    initials = np.tile(prepared.initial.astype(np.complex128), (len(parameters), 1, 1))
    for parameter, vector, initial in zip(parameters, vectors, initials, strict=True):
        seed(parameter, vector, initial)
    out = BatchRun(model, (prepared,), which, vectors, initials, options.step, options.general).run()
    _check_finite(out.real, inputs)
    plain = _simulation(inputs, np.ascontiguousarray(out[0].real))
    return Sensitivities(tuple(parameters), plain, out.imag / DUAL_STEP)


def simulate_many(
    model: Model, traces: Sequence[Trace | RunInputs], vectors: NDArray[Any], options: Options | None = None
) -> list[NDArray[Any]]:
    """Simulates every trace with every parameter set, on all cores.

    Args:
        vectors: (p, layout size) flat vectors, such as `parameter_vectors` makes; real, or dual numbers (complex128).

    Returns:
        per trace an array (p, OUTPUTS, k, n) in the order of `model.simulation.period`; NaN where a run diverged.
    """
    options = options or Options()
    inputs = [inputs_of(t, model.machine) if isinstance(t, Trace) else t for t in traces]
    prepared = [prepare(model, i, options) for i in inputs]
    count = len(vectors)
    which = np.repeat(np.arange(len(inputs)), count)
    initials = np.concatenate([np.tile(p.initial.astype(vectors.dtype), (count, 1, 1)) for p in prepared])
    every = np.ascontiguousarray(np.tile(vectors, (len(inputs), 1)))
    out = BatchRun(model, prepared, which, every, initials, options.step, options.general).run()
    return [out[t * count : (t + 1) * count, :, : len(i)] for t, i in enumerate(inputs)]


def parameter_vectors(model: Model, names: Sequence[str], values: NDArray[Any]) -> NDArray[Any]:
    """Returns flat vectors (p, size) with the named parameters at `values` (p, len(names)), real or dual."""
    values = np.atleast_2d(values)
    vectors = np.tile(model.vector.astype(values.dtype), (len(values), 1))
    for column, name in enumerate(names):
        vectors[:, list(model.parameter(name).slots)] = values[:, column, None]
    return vectors


def _check_finite(out: Floats, inputs: RunInputs) -> None:
    if not np.isfinite(out).all():
        raise SpecError(
            f"the simulation of {inputs.name or 'the record'} does not stay finite: the control loop is unstable"
        )


def _simulation(inputs: RunInputs, out: Floats) -> Simulation:
    return Simulation(
        joints=inputs.joints,
        time=inputs.time,
        position=out[OUT_POSITION],
        velocity=out[OUT_SPEED],
        reading=out[OUT_READING],
        error=out[OUT_ERROR],
        drive=out[OUT_DRIVE],
        power=out[OUT_POWER],
        rows=inputs.rows,
    )
