"""Simulates a model, one run or many, with exact derivatives on request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.extras import require_extra
from daq.contracts.trace import Trace
from daq.contracts.with_arrays import WithArrays
from model.arrays import Floats
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.simulation.batch import BatchRun
from model.simulation.inputs import RunInputs, inputs_of
from model.simulation.period import OUT_DRIVE, OUT_ERROR, OUT_POSITION, OUT_POWER, OUT_READING, OUT_SPEED
from model.simulation.prepared import Options, Prepared, prepare

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
    out = _one(model, prepared, options).run()
    _check_finite(out, inputs)
    return _simulation(inputs, out[0])


def _one(model: Model, prepared: Prepared, options: Options) -> BatchRun:
    which = np.zeros(1, np.int64)
    return BatchRun(
        model, (prepared,), which, model.vector[None].copy(), prepared.initial[None], options.step, options.general
    )


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
    batch = _one(model, prepared, options)
    ((values, slopes),) = batch.derivatives([parameters])
    _check_finite(values, inputs)
    return Sensitivities(tuple(parameters), _simulation(inputs, np.ascontiguousarray(values)), slopes)


def simulate_many(
    model: Model,
    traces: Sequence[Trace | RunInputs],
    values: Mapping[str, Floats],
    options: Options | None = None,
    signals: Sequence[str] = ("reading",),
) -> list[Floats]:
    """Returns the model's responses to every trace with p values of some parameters, on all cores.

    The runs are those of `simulate`. Many of an arm of rods with rigid transmissions take a quarter of the time each
    (`BatchRun`). One signal of a million runs of 2 s takes 2.4 GB: simulate a few thousand at a time.

    Args:
        values: p values of each named parameter.
        signals: those that are returned, by their names in `Simulation`.

    Returns:
        per trace an array (p, signals, k, n); NaN where a run diverged.

    Raises:
        SpecError: for an unknown parameter or signal, or parameters with different numbers of values.
        TraceError: for a trace that cannot be simulated.
    """
    options = options or Options()
    inputs = [inputs_of(t, model.machine) if isinstance(t, Trace) else t for t in traces]
    prepared = [prepare(model, i, options) for i in inputs]
    vectors = _vectors(model, values)
    count = len(vectors)
    outputs = [_output(signal) for signal in signals]
    which = np.repeat(np.arange(len(inputs)), count)
    initials = np.concatenate([np.tile(p.initial, (count, 1, 1)) for p in prepared])
    every = np.tile(vectors, (len(inputs), 1))
    out = BatchRun(model, prepared, which, every, initials, options.step, options.general, outputs).run()
    return [out[t * count : (t + 1) * count, :, : len(i)] for t, i in enumerate(inputs)]


SIGNALS = {
    "position": OUT_POSITION,
    "velocity": OUT_SPEED,
    "reading": OUT_READING,
    "error": OUT_ERROR,
    "power": OUT_POWER,
    "drive": OUT_DRIVE,
}
"""Outputs of a run, by their names in `Simulation`."""


def _output(signal: str) -> int:
    if signal not in SIGNALS:
        raise SpecError(f"signal {signal!r}: not one of a simulation; those are {', '.join(SIGNALS)}")
    return SIGNALS[signal]


def _vectors(model: Model, values: Mapping[str, Floats]) -> Floats:
    """Returns flat vectors (p, size) of a model with the named parameters at these values (p each)."""
    counts = {name: len(own) for name, own in values.items()}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{name} {count}" for name, count in counts.items())
        raise SpecError(f"values of parameters: {told}; each must have as many")
    vectors = np.tile(model.vector, (next(iter(counts.values()), 1), 1))
    for name, own in values.items():
        vectors[:, list(model.parameter(name).slots)] = np.asarray(own)[:, None]
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
