"""Simulations of a model, one run or many, and exact derivatives of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import BoardPid, NoController, SampledPid
from daq.contracts.trace import Trace
from model.dynamics.dual import DUAL_STEP
from model.machine_model import layout as at
from model.machine_model.model import Model
from model.simulation.engines import engine_for, is_rod_arm
from model.simulation.inputs import RunInputs, inputs_of
from model.simulation.period import (
    OUT_DRIVE,
    OUT_ERROR,
    OUT_POSITION,
    OUT_POWER,
    OUT_READING,
    OUT_SPEED,
    OUTPUTS,
)  # fmt: skip

Floats = NDArray[np.float64]
POSTURE_UNITS = 1000

LONGEST_STEP = 1e-3
"""s; with it readings are right to some 0.005 counts, contacts apart (docs/modelling.md has each effect)."""


@dataclass(frozen=True)
class Options:
    """How to simulate.

    Args:
        loop: `closed`: the model's controller follows the recorded set points; `open`: the recorded drive is applied.
        quantise: round readings and power as the board does. Without, both are left as they are.
        step: longest step of integration, s.
        noise: (k, n) added to the readings before rounding, in counts of the sensor; None for none.
        following: share of the difference between recorded and simulated reading that the simulated controller is
            given, where a reading was recorded. At 0 it reads the model alone: an output error in closed loop. At 1 it
            reads the record, noise and all: the recorded drive moves the model, and nothing brings it back.
        initial: (n, 2) position (rad) and speed (rad/s) at the start; None: as estimated from the record.
        general: use the recursive dynamics even where there is a closed form.
    """

    loop: Literal["closed", "open"] = "closed"
    quantise: bool = True
    step: float = LONGEST_STEP
    noise: Floats | None = None
    following: float = 0.0
    initial: Floats | None = None
    general: bool = False


@dataclass(frozen=True)
class Simulation:
    """Motion of a model, one row a control period, one column a joint.

    time (k,) s; position (k, n) rad, the joint's own angle; velocity rad/s; reading rad, what the model's sensor shows;
    error rad, set point − what the controller read; drive, motor volts commanded (before dead zone and supply limit);
    power, DAC counts; rows (m,) where the samples of the record lie on this grid.
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

    def at_samples(self, signal: Floats) -> Floats:
        """A signal (k, …) at the samples of the record, (m, …): picked, or interpolated between periods."""
        return at_rows(signal, self.rows)


def at_rows(signal: Floats, rows: Floats) -> Floats:
    """Rows of a signal at fractional positions, linearly interpolated."""
    low = np.floor(rows).astype(np.int64)
    share = rows - low
    if not share.any():
        return signal[low]
    high = np.minimum(low + 1, len(signal) - 1)
    share = share.reshape(-1, *([1] * (signal.ndim - 1)))
    return (1 - share) * signal[low] + share * signal[high]


def simulate(model: Model, trace: Trace | RunInputs, options: Options | None = None) -> Simulation:
    """The model's answer to the set points (or the drive) of a trace.

    Raises TraceError for a trace that cannot be simulated, SpecError when the motion does not stay finite.
    """
    options = options or Options()
    inputs = inputs_of(trace, model.machine) if isinstance(trace, Trace) else trace
    prepared = prepare(model, inputs, options)
    out = np.zeros((1, OUTPUTS, len(inputs), model.joint_count))
    engine = engine_for(model, general=options.general)
    engine.run(
        [prepared],
        np.zeros(1, np.int64),
        model.vector[None].copy(),
        prepared.initial[None],
        model.flags,
        options.step,
        out,
    )
    _check_finite(out, inputs)
    return _simulation(inputs, out[0])


@dataclass(frozen=True)
class Sensitivities:
    """A run without rounding and its derivatives: `jacobian` (p, OUTPUTS, k, n), parameter first."""

    names: tuple[str, ...]
    simulation: Simulation
    jacobian: Floats

    def of(self, output: int) -> Floats:
        """Derivatives (p, k, n) of one output, by its index in `model.simulation.period`."""
        return self.jacobian[:, output]

    @property
    def reading(self) -> Floats:
        """Derivatives (p, k, n) of what the controller reads, rad a unit of each parameter."""
        return self.jacobian[:, OUT_READING]


def sensitivities(
    model: Model, trace: Trace | RunInputs, names: Sequence[str], options: Options | None = None
) -> Sensitivities:
    """Exact derivatives of a run by parameters, in dual numbers and without rounding.

    `initial.joint2.position` and `initial.joint2.velocity` name the initial state. Raises as `simulate` does.
    """
    options = replace(options or Options(), quantise=False)
    inputs = inputs_of(trace, model.machine) if isinstance(trace, Trace) else trace
    prepared = prepare(model, inputs, options)
    vectors = np.tile(model.vector.astype(np.complex128), (len(names), 1))
    initials = np.tile(prepared.initial.astype(np.complex128), (len(names), 1, 1))
    for row, name in enumerate(names):
        _perturb(model, name, vectors[row], initials[row])
    out = np.zeros((len(names), OUTPUTS, len(inputs), model.joint_count), dtype=np.complex128)
    engine_for(model, general=options.general).run(
        [prepared], np.zeros(len(names), np.int64), vectors, initials, model.flags, options.step, out
    )
    _check_finite(out.real, inputs)
    return Sensitivities(tuple(names), _simulation(inputs, np.ascontiguousarray(out[0].real)), out.imag / DUAL_STEP)


def simulate_many(
    model: Model, traces: Sequence[Trace | RunInputs], vectors: NDArray[Any], options: Options | None = None
) -> list[NDArray[Any]]:
    """Every trace with every parameter set, on all cores.

    Args:
        vectors: (p, layout size) flat vectors, such as `parameter_vectors` makes; real, or dual numbers (complex128).

    Returns:
        per trace an array (p, OUTPUTS, k, n) in the order of `model.simulation.period`; NaN where a run diverged.
    """
    options = options or Options()
    inputs = [inputs_of(t, model.machine) if isinstance(t, Trace) else t for t in traces]
    prepared = [prepare(model, i, options) for i in inputs]
    count, longest = len(vectors), max(len(i) for i in inputs)
    which = np.repeat(np.arange(len(inputs)), count)
    out = np.zeros((len(which), OUTPUTS, longest, model.joint_count), dtype=vectors.dtype)
    initials = np.concatenate([np.tile(p.initial.astype(vectors.dtype), (count, 1, 1)) for p in prepared])
    every = np.ascontiguousarray(np.tile(vectors, (len(inputs), 1)))
    engine = engine_for(model, general=options.general)
    engine.run(prepared, which, every, initials, model.flags, options.step, out)
    return [out[t * count : (t + 1) * count, :, : len(i)] for t, i in enumerate(inputs)]


def parameter_vectors(model: Model, names: Sequence[str], values: NDArray[Any]) -> NDArray[Any]:
    """Flat vectors (p, size) with the named parameters at `values` (p, len(names)), real or dual."""
    values = np.atleast_2d(values)
    vectors = np.tile(model.vector.astype(values.dtype), (len(values), 1))
    for column, name in enumerate(names):
        vectors[:, list(model.parameter(name).slots)] = values[:, column, None]
    return vectors


@dataclass(frozen=True)
class Prepared:
    """Inputs in the units that compiled code reads."""

    set_points: Floats
    recorded: Floats
    noise: Floats
    readings: Floats
    following: float
    initial: Floats
    first_drive: Floats
    gains: Floats
    settings: NDArray[np.int64]
    period: float


def prepare(model: Model, inputs: RunInputs, options: Options) -> Prepared:
    """Inputs of a run as compiled code reads them.

    Raises TraceError when the record lacks what moves the model in this loop, SpecError for other joints or noise.
    """
    machine = model.machine
    if inputs.joints != machine.modelled_joints:
        raise SpecError(f"inputs are for joints {inputs.joints}, the model moves joints {machine.modelled_joints}")
    settings = np.zeros(at.SETTINGS, dtype=np.int64)
    controller = machine.controller
    if options.loop == "closed" and not isinstance(controller, NoController) and not inputs.has_set_points:
        raise TraceError(f"trace {inputs.name}: has no set points; simulate it in open loop from its drive")
    if options.loop == "open" and not inputs.has_drive:
        raise TraceError(f"trace {inputs.name}: has no drive, which a simulation in open loop needs")
    settings[at.QUANTISE] = int(options.quantise)
    settings[at.PUBLISHED_LOADS] = int(is_rod_arm(machine))
    set_points = inputs.set_points
    if options.loop == "closed" and isinstance(controller, BoardPid):
        settings[at.CONTROLLER] = at.BOARD_PID
        set_points = _counts(model, set_points)
    elif options.loop == "closed" and isinstance(controller, SampledPid):
        settings[at.CONTROLLER] = at.SAMPLED_PID if controller.velocity_gains is None else at.CASCADE
    elif options.loop == "closed" and not isinstance(controller, NoController):
        raise SpecError(f"controller {controller.kind!r} cannot be simulated")
    noise = inputs.noise if options.noise is None else np.ascontiguousarray(options.noise)
    initial = inputs.initial if options.initial is None else np.ascontiguousarray(options.initial)
    if noise.shape != set_points.shape:
        raise SpecError(f"noise has shape {noise.shape}; {set_points.shape} is needed")
    return Prepared(
        set_points, inputs.drive, noise, inputs.readings, options.following, initial, inputs.first_drive, inputs.gains,
        settings, inputs.period,
    )  # fmt: skip


def _counts(model: Model, set_points: Floats) -> Floats:
    """Set points in ADC counts as the board takes them: rounded to posture units, then to counts (half up)."""
    counts = np.empty_like(set_points)
    for k, joint in enumerate(model.machine.modelled_joints):
        own = model.machine.calibration(joint)
        posture = np.floor((set_points[:, k] - own.angle_at_zero_rad) / own.rad_per_posture_unit + 0.5)
        sensor = model.machine.joint(joint).sensor
        bits = 12 if sensor is None else sensor.bits
        counts[:, k] = np.floor(posture * 2**bits / POSTURE_UNITS + 0.5)
    return counts


def _perturb(model: Model, name: str, vector: NDArray[Any], initial: NDArray[Any]) -> None:
    if name.startswith("initial."):
        _, joint, what = name.split(".")
        initial[int(joint.removeprefix("joint")) - 1, ("position", "velocity").index(what)] += 1j * DUAL_STEP
        return
    vector[list(model.parameter(name).slots)] += 1j * DUAL_STEP


def _check_finite(out: Floats, inputs: RunInputs) -> None:
    if not np.isfinite(out).all():
        raise SpecError(f"the simulation of {inputs.name or 'the record'} does not stay finite: the loop is unstable")


def _simulation(inputs: RunInputs, out: Floats) -> Simulation:
    return Simulation(
        inputs.joints, inputs.time, out[OUT_POSITION], out[OUT_SPEED], out[OUT_READING], out[OUT_ERROR],
        out[OUT_DRIVE], out[OUT_POWER], inputs.rows,
    )  # fmt: skip
