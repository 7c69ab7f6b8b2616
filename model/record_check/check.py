"""Checks a record before anything is computed from it: which of its values are impossible, and where?

It uses only physics and statistics: a finite torque makes no jump, a controller's drive follows from set point and
position, drive and motion balance in the stated units. None of these depends on an effect of the arm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.joint_matching import matched
from daq.contracts.machine import DcMotor, Machine, NoController
from daq.contracts.quantity import Quantity
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.record_check.columns import column_findings
from model.record_check.drives import drive_findings
from model.record_check.finding import FindingKind, RecordFinding, at_times, doubts_in, number, times_of
from model.record_check.law import is_formed_as_recorded
from model.record_check.pieces import (
    SHORTEST,
    cut_off,
    free_part,
    in_pieces,
    measures_speed,
    never_returns,
    part_of,
    reading_of,
)
from model.record_check.readings import (
    FalseReadings,
    Jump,
    find_bursts,
    find_dead,
    find_gaps,
    find_jumps,
    is_bridged,
    noise_of,
    sort_jumps,
    unwrapped,
)
from model.record_check.speeds import speed_findings

FEWEST = 3
"""Least number of samples of a record that shows a motion."""
ON_EARTH = (9.76, 9.84)
"""Least and largest gravity on the ground, m/s²: on a mountain at the equator, and at a pole, rounded outwards."""
Loop = Literal["closed", "open"]
WITHIN_NOISE = 3.0
"""Multiple of its noise within which a model still explains a record: spikes that leave less need no note."""
OTHER_MAGNET = 5.0
"""Ratio of a motor's constants that no magnet has: at stall, data sheets of geared servos give down to 0.36."""
MOST_KEPT = 100
"""Times in a finding: a page does not need more."""
WILD_SHARE = 0.5
"""Distance between set point and position, as a share of the largest travel of any joint, that no controller leaves for
half of a record, except on a joint that is still on its way. A joint that is held may sag by more than its own travel.
"""
LOOP_SHARE = 0.125
"""Share of the time between rows that a simulated period may take. A set point is known to act within one whole time
between rows; a period holds a drive by half of itself."""
ON_ITS_WAY = 0.5
"""Share of its motion, weighted by the remaining distance, that a following joint makes towards its set point rather
than away from it. Set points with another zero or sign lie behind its motion as often as ahead of it."""
OUT_OF_REACH = 3.0
"""Distance, in a joint's own travels, that is too long even for a joint on its way: set points in another unit."""


def check_records(model: Model, traces: Sequence[Trace], *, torques: bool | None = None) -> tuple[RecordFinding, ...]:
    """Returns the faults of records and of their machine file, and what users should know; empty if there is nothing.

    Args:
        model: of the machine that made them. traces: as they were read.
        torques: whether torques will be balanced, so that a record may be cut at its gaps; None: as for a diagnosis, if
            the machine has no controller.
    """
    cut = isinstance(model.machine.controller, NoController) if torques is None else torques
    traces = [matched(trace, model.machine) for trace in traces]
    found = list(_on_machine(model.machine, traces))
    for trace in traces:
        if len(trace) < FEWEST:
            found.append(_short(trace))
        elif all(j in trace.joints for j in model.machine.modelled_joints):
            bursts = list(_on_bursts(trace))
            found += bursts or [
                *_on_gaps(trace, cut=cut),
                *_on_readings(trace, model.machine),
                *_on_columns(max(in_pieces(as_used([trace], model.machine)), key=len), model),
            ]
    return tuple(found)


def _on_columns(trace: Trace, model: Model) -> Iterator[RecordFinding]:
    speeds = list(speed_findings(trace, model.machine))
    columns = speeds or column_findings(trace, model)
    yield from columns
    if not doubts_in(columns):
        yield from drive_findings(trace, model)


def repaired(trace: Trace, machine: Machine) -> Trace:
    """Returns the trace with its encoders unwrapped and spikes replaced by neighbouring values; unchanged if there are
    none."""
    position = trace.position
    for joint in machine.modelled_joints:
        column, found = trace.column(joint), false_readings(trace, machine, joint)
        if measures_speed(machine, joint) or not (found.wraps or found.spikes):
            continue
        if position is trace.position:
            position = position.copy()
        whole = unwrapped(position[:, column], found.wraps, turns_of(machine, joint))
        position[:, column] = _without_spikes(whole, found)
    return trace if position is trace.position else replace(trace, position=position)


def as_used(traces: Sequence[Trace], machine: Machine, loop: Loop = "open") -> list[Trace]:
    """Returns traces in the form for all computations: the longest part without cut-off readings (`free_part`), which
    is repaired, unless the simulated controller reads it itself.

    Args:
        loop: `closed`: the machine's controller is simulated. `open`: the recorded drive is applied or balanced.
    """
    parts = [_free(matched(trace, machine), machine) for trace in traces]
    if loop == "closed" and not isinstance(machine.controller, NoController):
        return [_looped(trace, machine.controller.period) for trace in parts]
    return [repaired(trace, machine) for trace in parts]


def _looped(trace: Trace, period: Quantity) -> Trace:
    """Returns the trace with the period at which its loop is simulated.

    Where the loop's own period is only assumed, as inside a servo, it is as many of these as take `LOOP_SHARE` of the
    time between rows: what a faster loop does in between is not seen.
    """
    usual = float(np.median(np.diff(trace.time))) if len(trace) > 1 else 0.0
    periods = int(LOOP_SHARE * usual / period.value)
    if not period.assumed or trace.record.period is not None or periods < 2:
        return trace
    return replace(trace, record=trace.record.model_copy(update={"period": periods * period.value}))


def _free(trace: Trace, machine: Machine) -> Trace:
    part = free_part(trace, machine) if len(trace) >= FEWEST else None
    return trace if part is None or part == slice(0, len(trace)) else part_of(trace, part)


def require_computable(findings: Sequence[RecordFinding]) -> None:
    """Raises TraceError with one line for the first finding that rules out any computation."""
    for finding in findings:
        if finding.consequence == "fatal":
            raise TraceError(finding.line)


def false_readings(trace: Trace, machine: Machine, joint: int) -> FalseReadings:
    """Returns the jumps in the readings of a joint's sensor."""
    by_speed, reading = measures_speed(machine, joint), reading_of(trace, machine, joint)
    jumps = find_jumps(trace.time, reading, 0.0 if by_speed else _step(machine, joint))
    if by_speed:  # between two samples a speed may reach another, or leave a constant one: only a spike is false
        return replace(sort_jumps(reading, jumps, ()), stuck=(), others=())
    found = sort_jumps(reading, jumps, turns_of(machine, joint))
    told = {jump.row for _, jump in found.stuck} | {last for _, last in cut_off(trace, machine, joint)}
    dead = [one for one in find_dead(reading, _step(machine, joint)) if one[1].row not in told]
    return replace(found, stuck=(*found.stuck, *dead))


def turns_of(machine: Machine, joint: int) -> tuple[float, ...]:
    """Returns whole turns of a joint and of its sensor, rad (m), by which a reading may wrap."""
    own = machine.joint(joint)
    sensor = () if own.sensor is None or own.sensor.measures != "position" else (own.sensor.range.value,)
    return (*((2 * math.pi,) if own.kind == "revolute" else ()), *sensor)


def _step(machine: Machine, joint: int) -> float:
    return machine.joint(joint).count


def _without_spikes(reading: Floats, found: FalseReadings) -> Floats:
    rows = np.arange(len(reading))
    false = np.zeros(len(reading), dtype=bool)
    for spike in found.spikes:
        false[spike.row + 1 : spike.back + 1] = True
    return np.interp(rows, rows[~false], reading[~false])


def _on_machine(machine: Machine, traces: Sequence[Trace]) -> Iterator[RecordFinding]:
    magnitude = math.hypot(*machine.gravity)
    if magnitude != 0.0 and not ON_EARTH[0] <= magnitude <= ON_EARTH[1]:
        yield RecordFinding(
            kind="gravity-magnitude",
            consequence="note",
            value=magnitude,
            allowed=9.81,
            unit="m/s²",
            says=f"the machine file's gravity is {magnitude:.4g} m/s² and not 9.81 m/s², as on the ground.",
            advice="State it in m/s², along the axes of the base.",
        )
    for joint in machine.modelled_joints:
        drive = machine.joint(joint).drive
        back_emf = drive.back_emf_constant.value if isinstance(drive, DcMotor) else 0.0
        ratio = drive.torque_constant.value / back_emf if isinstance(drive, DcMotor) and back_emf else 1.0
        if not 1 / OTHER_MAGNET < ratio < OTHER_MAGNET:
            yield RecordFinding(
                kind="motor-constants",
                consequence="note",
                joint=joint,
                value=ratio,
                allowed=1.0,
                unit="1",
                says=f"the machine file's torque_constant is {number(ratio)} times its back_emf_constant. In N·m/A and "
                "V·s/rad, one magnet gives both the same number.",
                advice="Check their units, and on which side of the gear they are.",
            )
        if not machine.joint(joint).count and all(joint in trace.joints for trace in traces):
            sizes = [noise_of(trace.position[:, trace.column(joint)]) for trace in traces if len(trace) > 2]
            unit = machine.joint(joint).units.position
            size = float(np.median(sizes)) if sizes else 0.0
            lacking = "`sensor`" if machine.joint(joint).sensor is None else "`sensor.bits`"
            yield RecordFinding(
                kind="no-sensor",
                consequence="note",
                joint=joint,
                value=size,
                unit=unit,
                says=f"the machine file states no {lacking}: the record shows noise of {number(size)} {unit}.",
                advice=f"State {lacking} under joint {joint} if it is known.",
            )


def _on_readings(trace: Trace, machine: Machine) -> Iterator[RecordFinding]:
    for joint in machine.modelled_joints:
        yield from _on_jumps(trace, machine, joint)
        yield from _on_bounds(trace, machine, joint)
    yield from _on_units(trace, machine)


def _short(trace: Trace) -> RecordFinding:
    return RecordFinding(
        kind="short",
        consequence="fatal",
        record=trace.called,
        value=float(len(trace)),
        allowed=float(FEWEST),
        unit="1",
        says=f"{times_of(len(trace), 'sample')}; at least {FEWEST} are needed.",
    )


def _on_bursts(trace: Trace) -> Iterator[RecordFinding]:
    """Finds time stamps of arrival, which shift each reading by up to a burst; other findings from times would
    follow."""
    found = find_bursts(trace.time)
    if found is not None:
        yield RecordFinding(
            kind="bursts",
            consequence="doubt",
            record=trace.called,
            value=found[0],
            allowed=found[1],
            unit="s",
            says=f"its times come in bursts, {number(1e3 * found[0])} ms or a multiple of it apart: they are stamps of "
            "arrival at a buffer, not of measurement.",
            advice="Stamp at the device, or set the latency timer of a USB serial adapter (FTDI: 16 ms) to 1 ms. For "
            f"evenly sampled rows, write row number times period ({number(found[1])} s on average) as times.",
        )


def _on_gaps(trace: Trace, *, cut: bool) -> Iterator[RecordFinding]:
    """cut: for a balance of torques (`in_pieces`). Simulations run through the whole record."""
    gaps = find_gaps(trace.time)
    if not gaps:
        return
    usual = float(np.median(np.diff(trace.time)))
    long = [gap for gap in gaps if not is_bridged(gap[1], usual)]
    shown = long or gaps
    longest = max(length for _, length in shown)
    advice = (
        f"For torques the record is cut there; pieces under {SHORTEST:g} s are left out"
        if cut
        else "Use a piece without any"
    )
    starts = [float(trace.time[row]) for row, _ in shown]
    yield RecordFinding(
        kind="gap",
        consequence="doubt" if long and not cut else "note",
        record=trace.called,
        times=tuple(starts[:MOST_KEPT]),
        count=len(shown),
        value=longest,
        allowed=usual,
        unit="s",
        says=f"{times_of(len(shown), 'gap')} {at_times(starts)}, the longest of {number(longest)} s, where samples are "
        f"{number(usual)} s apart.",
        advice=f"{advice}: the torques and set points in between are not known." if long else "",
    )


def _on_jumps(trace: Trace, machine: Machine, joint: int) -> Iterator[RecordFinding]:
    found = false_readings(trace, machine, joint)
    told = _Jumps(trace, joint, machine.joint(joint).units.position + ("/s" if measures_speed(machine, joint) else ""))
    driven = not isinstance(machine.controller, NoController)
    if found.wraps:
        advice = "Unwrap the encoder before the controller, or in the file." if driven else "It is unwrapped."
        says = f"its reading jumps by a whole turn {told.place(found.wraps)}."
        yield told.finding("wraps", found.wraps, says, advice, doubt=driven)
    if found.spikes:
        noise = noise_of(trace.position[:, trace.column(joint)], _step(machine, joint))
        alone = math.sqrt(sum(jump.size**2 for jump in found.spikes) / len(trace))
        doubt = measures_speed(machine, joint) or alone > WITHIN_NOISE * noise
        says = f"{times_of(len(found.spikes), 'spike')} {told.place(found.spikes)}, of {told.size(found.spikes)}."
        yield told.finding("spikes", found.spikes, says, "Look for lost bytes or a loose connector.", doubt=doubt)
    if found.others:
        says = f"its reading jumps {told.place(found.others)}, by {told.size(found.others)}."
        advice = "Were samples cut out, did the encoder slip, or was it set to zero? Use a piece without this."
        yield told.finding("jump", found.others, says, advice)
    for since, jump in found.stuck:
        begin, end = float(trace.time[since]), float(trace.time[jump.row])
        then = f", then jumps by {number(abs(jump.size))} {told.unit}"
        if not jump.size:
            then = f", the record's {'end' if since else 'beginning'}, and moves at speed right beside"
        says = f"its reading stands still from {begin:.2f} to {end:.2f} s ({number(end - begin)} s){then}."
        advice = "The sensor or its cable was stuck: use a piece without this."
        yield told.finding("stuck", [replace(jump, row=since - 1)], says, advice)


def _on_bounds(trace: Trace, machine: Machine, joint: int) -> Iterator[RecordFinding]:
    """Finds readings that are cut off at the end of a sensor's range, or of an amplifier's or a converter's."""
    reading = reading_of(trace, machine, joint)
    bounds = cut_off(trace, machine, joint)
    if not bounds:
        return
    times = [float(trace.time[first]) for first, _ in bounds]
    longest = max(float(trace.time[last] - trace.time[first]) for first, last in bounds)
    unit = machine.joint(joint).units.position + ("/s" if measures_speed(machine, joint) else "")
    value = float(reading[bounds[0][0]])
    part, for_good = free_part(trace, machine), never_returns(trace, machine, joint)
    advice = "Is the sensor at the end of its range, or the joint at a stop? Use a piece without this."
    if for_good:
        advice = "It never moves again: is the sensor dead, or the joint at a stop? Use the record up to there."
    elif part is not None:
        advice = (
            f"Used: {trace.time[part.start]:.2f} to {trace.time[part.stop - 1]:.2f} s, the longest part without this."
        )
    yield RecordFinding(
        kind="saturated",
        consequence="doubt" if part is None or for_good else "note",
        record=trace.called,
        joint=joint,
        times=tuple(times[:MOST_KEPT]),
        count=len(bounds),
        value=value,
        unit=unit,
        says=f"its reading reaches {number(value)} {unit} at full speed and stands there, {at_times(times)}, for "
        f"up to {number(longest)} s.",
        advice=advice,
    )


@dataclass(frozen=True)
class _Jumps:
    """Findings of jumps in the readings of one joint, in `unit`."""

    trace: Trace
    joint: int
    unit: str

    def times(self, jumps: Sequence[Jump]) -> list[float]:
        """Returns the time, s, of the first false sample of each jump."""
        return [float(self.trace.time[jump.row + 1]) for jump in jumps]

    def place(self, jumps: Sequence[Jump]) -> str:
        """Returns the times in words."""
        return at_times(self.times(jumps))

    def size(self, jumps: Sequence[Jump]) -> str:
        """Returns the sizes in words."""
        largest, usual = max(abs(jump.size) for jump in jumps), jumps[0].usual
        return f"up to {number(largest)} {self.unit}, where {number(usual)} {self.unit} can be noise or motion"

    def finding(
        self, kind: FindingKind, jumps: Sequence[Jump], says: str, advice: str, *, doubt: bool = True
    ) -> RecordFinding:
        """Returns the finding of jumps of one kind."""
        return RecordFinding(
            kind=kind,
            consequence="doubt" if doubt else "note",
            record=self.trace.called,
            joint=self.joint,
            times=tuple(self.times(jumps)[:MOST_KEPT]),
            count=len(jumps),
            value=max(abs(jump.size) for jump in jumps),
            allowed=jumps[0].usual,
            unit=self.unit,
            says=says,
            advice=advice,
        )


def _on_units(trace: Trace, machine: Machine) -> Iterator[RecordFinding]:
    """Finds set points and positions in different units: they differ by a factor or an offset throughout.

    They are compared with the travel of the record's motion, whatever the size of an encoder's count.
    """
    if trace.set_point is None or not np.ptp(trace.set_point, axis=0).any():
        return  # without moving set points nothing states how far it should have gone
    kinds = {j: machine.joint(j).kind for j in machine.modelled_joints}
    signals = (trace.set_point, trace.position)
    travels = {j: max(float(np.ptp(s[:, trace.column(j)])) for s in signals) for j in kinds}
    for joint, kind in kinds.items():
        if measures_speed(machine, joint):
            continue
        column = trace.column(joint)
        way = trace.set_point[:, column] - trace.position[:, column]
        apart = float(np.median(np.abs(way)))
        position = trace.position[:, column]
        most = WILD_SHARE * max(travels[j] for j in kinds if kinds[j] == kind)
        if _approach(position, way) >= ON_ITS_WAY:
            most = OUT_OF_REACH * float(np.ptp(position))
        if apart > most and not is_formed_as_recorded(trace, machine, joint):
            larger = float(np.abs(trace.set_point[:, column]).max()), float(np.abs(trace.position[:, column]).max())
            unit = machine.joint(joint).units.position
            yield RecordFinding(
                kind="units-differ",
                consequence="fatal",
                record=trace.called,
                joint=joint,
                value=apart,
                allowed=most,
                unit=unit,
                says=f"set points (to {larger[0]:.4g}) and positions (to {larger[1]:.4g}) are {apart:.3g} {unit} apart "
                f"throughout; both must be in {unit} from the same zero.",
            )


def _approach(position: Floats, way: Floats) -> float:
    """Returns how much of a motion is towards the set point rather than away, from −1 to 1. way: (k,) remaining
    distance."""
    work = way[:-1] * np.diff(position)
    whole = float(np.abs(work).sum())
    return float(work.sum()) / whole if whole > 0.0 else 0.0
