"""Simulates traces with one or more models, and computes how much of the motion each leaves unexplained."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.comparison.agreement import JointAgreement, ModelAgreement, TraceAgreement, pooled
from model.fitting.judged import noise_left
from model.fitting.records import Record, Signal, noise_floor, records_of
from model.fitting.simulated import SimulatedProblem
from model.machine_model.model import Model
from model.record_check.check import as_used, check_records, require_computable
from model.simulation.prepared import Options
from model.simulation.simulate import simulate


@dataclass(frozen=True)
class TraceSignals:
    """One trace beside its simulations, or recorded efforts beside predictions of them.

    time (m,) s; measured, set_point (or None) and each of `simulated` (m, n) in `units`, one column per joint.
    """

    trace: str
    held_out: bool | None
    joints: tuple[int, ...]
    units: tuple[str, ...]
    time: Floats
    measured: Floats
    simulated: tuple[Floats, ...]
    set_point: Floats | None
    signal: Signal | Literal["effort"] = "position"

    @property
    def quantity(self) -> str:
        """What is measured, in a word."""
        if self.signal == "effort":
            return "force" if set(self.units) == {"N"} else "torque"
        return "position" if self.signal == "position" else "speed"

    @property
    def words(self) -> tuple[str, str]:
        """Verbs for the record and the models: efforts are recorded, and predicted from a motion."""
        return ("recorded", "predicted") if self.signal == "effort" else ("measured", "simulated")


@dataclass(frozen=True)
class Comparison:
    """`models` in numbers and `signals` trace by trace, both in the given order."""

    models: tuple[ModelAgreement, ...]
    signals: tuple[TraceSignals, ...]


def compare(
    models: Sequence[tuple[str, Model]],
    traces: Sequence[Trace],
    held_out: Collection[str] | None = None,
    *,
    signal: Signal = "position",
    options: Options | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> Comparison:
    """Simulates every trace with every model, driven by the controller or by the recorded drive.

    Args:
        models: labels and models, all of the same machine's joints.
        held_out: identities of traces not fitted to; None if nothing was fitted.
        options: of the simulation; by default in closed loop and without rounding.

    Raises:
        TraceError, SpecError: for traces that cannot be simulated, or models that move different joints.
        CancelledError: when cancelled.
    """
    cancel, options = cancel or Never(), options or Options(quantise=False)
    if not models:
        raise SpecError("no model: at least one is needed")
    machine = models[0][1].machine
    for label, model in models:
        if model.machine.modelled_joints != machine.modelled_joints:
            raise SpecError(
                f"{label} moves joints {list(model.machine.modelled_joints)}, {models[0][0]} moves "
                f"{list(machine.modelled_joints)}: they cannot be compared"
            )
    require_computable(check_records(models[0][1], traces, torques=False))
    traces = as_used(traces, machine, options.loop)
    records = records_of(traces, machine, signal)
    floor = noise_floor(records, machine, signal)
    simulated: list[list[Floats]] = []
    for number, record in enumerate(records):
        row = []
        for place, (label, model) in enumerate(models):
            stop_if(cancel)
            text = f"{label}: trace {number + 1} of {len(records)}"
            progress((number + place / len(models)) / len(records), text)
            found = simulate(model, record.inputs, options)
            row.append(found.at_samples(found.velocity if signal == "velocity" else found.reading))
        simulated.append(row)
    progress(1.0, "done")
    units = _units(models[0][1], signal)
    agreements = []
    for place, (label, model) in enumerate(models):
        own = tuple(
            _agreement(
                record,
                simulated[k][place],
                _noise(model, record, floor, signal, options),
                model,
                signal,
                _role(record, held_out),
            )
            for k, record in enumerate(records)
        )
        agreements.append(
            ModelAgreement(
                label=label,
                model=model.identity,
                effects=tuple(u.name for u in model.effects),
                traces=own,
                in_sample=pooled([t for t in own if not t.held_out]),
                held_out=pooled([t for t in own if t.held_out]),
            )
        )
    signals = tuple(
        _signals(trace, record, tuple(row), units, _role(record, held_out), signal)
        for trace, record, row in zip(traces, records, simulated, strict=True)
    )
    return Comparison(tuple(agreements), signals)


def _role(record: Record, held_out: Collection[str] | None) -> bool | None:
    return None if held_out is None else record.name in held_out


def _units(model: Model, signal: Signal) -> tuple[str, ...]:
    kinds = [model.machine.joint(j).kind for j in model.machine.modelled_joints]
    return tuple(("rad" if k == "revolute" else "m") + ("/s" if signal == "velocity" else "") for k in kinds)


def _noise(model: Model, record: Record, floor: Floats, signal: Signal, options: Options) -> Floats:
    """Returns (n,) what noise leaves of all samples of a record, and rounding of a simulation that rounds too."""
    every = replace(record, runs=(slice(0, len(record.measured)),))
    left = noise_left(SimulatedProblem(model, (every,), (), floor, signal, options.loop, options.step), np.zeros(0)).rms
    if not options.quantise or signal != "position":
        return left
    joints = model.machine.modelled_joints
    return np.hypot(left, [model.machine.joint(j).count / math.sqrt(12.0) for j in joints])


def _agreement(
    record: Record, simulated: Floats, floor: Floats, model: Model, signal: Signal, held_out: bool | None
) -> TraceAgreement:
    left, units = record.measured - simulated, _units(model, signal)
    joints = []
    for column, joint in enumerate(model.machine.modelled_joints):
        square = float(np.mean(left[:, column] ** 2))
        motion = float(np.var(record.measured[:, column]))
        joints.append(
            JointAgreement(
                joint=joint,
                unit=units[column],
                rmse=float(np.sqrt(square)),
                largest=float(np.abs(left[:, column]).max()),
                floor=float(floor[column]),
                count=(model.machine.joint(joint).count or None) if signal == "position" else None,
                share=math.sqrt(square / motion) if motion > 9 * floor[column] ** 2 else None,
            )
        )
    return TraceAgreement(trace=record.name, held_out=held_out, samples=record.samples, joints=tuple(joints))


def _signals(
    trace: Trace,
    record: Record,
    simulated: tuple[Floats, ...],
    units: tuple[str, ...],
    held_out: bool | None,
    signal: Signal,
) -> TraceSignals:
    joints = record.inputs.joints
    wanted = None
    if trace.set_point is not None and signal == "position":
        wanted = trace.set_point[:, [trace.column(j) for j in joints]]
    return TraceSignals(record.name, held_out, joints, units, trace.time, record.measured, simulated, wanted, signal)
