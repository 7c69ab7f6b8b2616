"""Reports the fields of records, their meaning for an answer, and gaps of records and machine file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from daq.contracts.frozen import FrozenRecord
from daq.contracts.joint_matching import matched
from daq.contracts.machine import Machine, NoController
from daq.contracts.machine_form import defaults_of
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.record_check.finding import number, times_of
from model.record_check.pieces import cut_off, free_part
from model.record_check.readings import find_gaps, noise_of

FEW_LEVELS = 16
"""Number of different values up to which a signal counts as coarse: four bits."""
DEFAULTS_SHOWN = 4
"""Values that a machine file leaves out, in the table."""
LEAST_TRAVEL = 20.0
"""Travel of a joint, in its noise or in steps of its sensor, below which it determines nothing."""
UNEVEN = 0.2
"""Spread of the times between rows (middle 80 %), as a share of the usual one, from which they are uneven."""
REPEATED = 0.1
"""Share of rows that repeat the previous row from which a record is slower than its times suggest."""
Weight = Literal["fine", "known", "lacking"]
"""fine: in order. known: an answer is less precise. lacking: an answer needs it."""


class FieldReport(FrozenRecord):
    """One field of a record, or of the machine file if `record` is empty.

    Args:
        joint: from 1, with its name; None: of all. there: content of the field.
        means: consequence for the answer; empty if there is none.
    """

    record: str = ""
    joint: int | None = None
    name: str = ""
    field: str
    there: str
    means: str = ""
    weight: Weight = "fine"

    @property
    def place(self) -> str:
        """Returns the joint for a table."""
        return "" if self.joint is None else f"{self.joint} {self.name}".strip()


def field_reports(model: Model, traces: Sequence[Trace]) -> tuple[FieldReport, ...]:
    """Returns every field of records and machine file that an answer uses, records first.

    Raises TraceError if the names of joints are not the machine's.
    """
    machine = model.machine
    found: list[FieldReport] = []
    for read in traces:
        found += _Record(matched(read, machine), machine).reports()
    return (*found, *_on_machine(machine))


class _Record:
    """The fields of one record."""

    def __init__(self, trace: Trace, machine: Machine) -> None:
        self._trace, self._machine = trace, machine
        self._joints = [joint for joint in machine.modelled_joints if joint in trace.joints]

    def reports(self) -> Iterator[FieldReport]:
        """Yields one report per field, times first."""
        if len(self._trace) < 3:
            yield self._of("time", None, times_of(len(self._trace), "row"), "Nothing can be computed.", "lacking")
            return
        yield self._time()
        for joint in self._machine.modelled_joints:
            if joint not in self._trace.joints:
                means = "The model moves this joint: select its column."
                yield self._of("position", joint, "missing", means, "lacking")
        yield from self._repeated()
        for joint in self._joints:
            yield self._position(joint)
            yield self._velocity(joint)
            yield self._set_point(joint)
            yield self._drive(joint)

    def _of(self, field: str, joint: int | None, there: str, means: str = "", weight: Weight = "fine") -> FieldReport:
        name = "" if joint is None else self._machine.joint(joint).name
        called = self._trace.called
        return FieldReport(record=called, joint=joint, name=name, field=field, there=there, means=means, weight=weight)

    def _time(self) -> FieldReport:
        steps = np.diff(self._trace.time)
        usual = float(np.median(steps))
        low, high = np.quantile(steps, [0.1, 0.9])
        gaps = find_gaps(self._trace.time)
        there = f"{len(self._trace)} rows in {number(float(np.sum(steps)))} s, usually {number(usual)} s apart"
        there += f", {times_of(len(gaps), 'gap')}" if gaps else ""
        there += f", only where {where}" if (where := self._trace.record.where) else ""
        if high - low > UNEVEN * usual:
            means = "Uneven times blur speeds and accelerations: stamp at the device."
            return self._of("time", None, f"{there} ({number(float(low))} to {number(float(high))} s)", means, "known")
        return self._of("time", None, there)

    def _repeated(self) -> Iterator[FieldReport]:
        trace = self._trace
        rows = np.concatenate([s for s in (trace.position, trace.drive) if s is not None], axis=1)
        same = (np.diff(rows, axis=0) == 0.0).all(axis=1)
        moving = np.abs(np.diff(trace.position, axis=0)).max(axis=1) > 0.0
        begin, end = np.flatnonzero(moving)[[0, -1]] if moving.any() else (0, 0)
        inside = same[begin : end + 1]
        if moving.any() and float(np.mean(inside)) > REPEATED:
            says = f"{np.mean(inside):.0%} of the rows repeat the previous row"
            means = "The source is slower than the record: keep a row only where it changes."
            yield self._of("rows", None, says, means, "known")

    def _position(self, joint: int) -> FieldReport:
        reading = self._trace.position[:, self._trace.column(joint)]
        unit = self._machine.joint(joint).units.position
        travel, step = float(np.ptp(reading)), _step_of(reading)
        noise = max(noise_of(reading), step / np.sqrt(12.0))
        turns = int(np.count_nonzero(np.diff(np.sign(_moves(reading, 3.0 * noise + step)))))
        there = f"{number(float(reading.min()))} to {number(float(reading.max()))} {unit}, "
        there += f"steps of {number(step)} {unit}, {times_of(turns, 'reversal')}"
        if travel < LEAST_TRAVEL * max(noise, step):
            means = "It hardly moves: its inertia and friction stay as the machine file states them."
            return self._of("position", joint, there, means, "known")
        part = free_part(self._trace, self._machine)
        if part is not None and cut_off(self._trace, self._machine, joint):
            begin, end = self._trace.time[part.start], self._trace.time[part.stop - 1]
            means = f"It stands at the end of its way: rows from {begin:.2f} to {end:.2f} s are used."
            return self._of("position", joint, there, means, "known")
        if turns == 0:
            means = "It moves in one direction only: friction, an offset and weight look alike."
            return self._of("position", joint, there, means, "known")
        return self._of("position", joint, there)

    def _velocity(self, joint: int) -> FieldReport:
        if self._trace.velocity is None:
            sensor = self._machine.joint(joint).sensor
            if sensor is not None and sensor.measures == "velocity":
                return self._of("velocity", joint, "missing", "The machine file's sensor measures it.", "lacking")
            return self._of("velocity", joint, "missing; computed from positions")
        return self._levels("velocity", joint, self._trace.velocity, self._machine.joint(joint).units.position + "/s")

    def _set_point(self, joint: int) -> FieldReport:
        has_loop = not isinstance(self._machine.controller, NoController)
        if self._trace.set_point is None:
            if not has_loop:
                return self._of("set point", joint, "missing; the drive moves the model")
            means = "The controller cannot be simulated; torques are compared."
            lacks: Weight = "lacking" if self._trace.drive is None else "known"
            return self._of("set point", joint, "missing", means, lacks)
        asked = self._trace.set_point[:, self._trace.column(joint)]
        unit = self._machine.joint(joint).units.position
        return self._of("set point", joint, f"{number(float(asked.min()))} to {number(float(asked.max()))} {unit}")

    def _drive(self, joint: int) -> FieldReport:
        drive, units = self._trace.drive, self._machine.joint(joint).drive_units
        if drive is None:
            if self._trace.set_point is None or isinstance(self._machine.controller, NoController):
                means = f"Without it nothing can be computed: record it, in {' or '.join(units)}."
                return self._of("drive", joint, "missing", means, "lacking")
            means = "Set points alone show less: friction and loads appear only in the tracking error."
            return self._of("drive", joint, "missing", means, "known")
        stated = self._trace.record.drive_unit
        if stated is not None and stated not in units:
            means = f"The machine file's drive is in {' or '.join(units)}."
            return self._of("drive", joint, f"in {stated}", means, "lacking")
        if stated is None and self._trace.record.source == "imported":
            means = f"Its unit is assumed to be {units[0]}: state drive_unit."
            return self._levels("drive", joint, drive, "without a stated unit", means)
        return self._levels("drive", joint, drive, stated or "V")

    def _levels(self, field: str, joint: int, signal: Floats, unit: str, means: str = "") -> FieldReport:
        values = signal[:, self._trace.column(joint)]
        count = len(np.unique(values))
        there = f"{number(float(values.min()))} to {number(float(values.max()))} {unit}"
        if count == 1:
            return self._of(field, joint, f"{there}, constant", "It contains no information.", "known")
        if count <= FEW_LEVELS:
            there = f"{there}, only {count} different values"
            means = means or "Small torques and frictions are lost in its steps."
        return self._of(field, joint, there, means, "known" if means else "fine")


def _moves(reading: Floats, least: float) -> Floats:
    """Returns the steps between the turning points of a reading, without motions smaller than `least`."""
    points = [float(reading[0])]
    for value in reading.tolist():
        if len(points) > 1 and (value - points[-1]) * (points[-1] - points[-2]) > 0.0:
            points[-1] = value
        elif abs(value - points[-1]) > least:
            points.append(value)
    return np.diff(points)


def _step_of(reading: Floats) -> float:
    """Returns the smallest change of a reading; 0 if it never changes."""
    moved = np.abs(np.diff(reading))
    return float(moved[moved > 0.0].min(initial=np.inf)) if moved.any() else 0.0


def _on_machine(machine: Machine) -> Iterator[FieldReport]:
    """Yields what the machine file does not state."""
    for number_, joint in ((j, machine.joint(j)) for j in machine.modelled_joints):
        if not joint.count:
            yield FieldReport(
                joint=number_,
                name=joint.name,
                field="sensor",
                there="not stated",
                means="Its noise is estimated from the record.",
                weight="known",
            )
    if left_out := list(defaults_of(machine)):
        there = ", ".join(left_out[:DEFAULTS_SHOWN]) + (", …" if len(left_out) > DEFAULTS_SHOWN else "")
        yield FieldReport(field="defaults", there=there, means="Assumed, because the file leaves them out.")
    if isinstance(machine.controller, NoController):
        yield FieldReport(field="controller", there="none", means="Torques are compared; no control loop is simulated.")
