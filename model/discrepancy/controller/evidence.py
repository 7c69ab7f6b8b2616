"""Evidence from the recorded controller's own numbers, which needs no model of the arm.

Of a sampled PID the record holds no error; its drive tells it (`sampled_controller`).
The board's record holds the set point that was sent, the position it read, the error it formed and the power it gave.
Up to rounding, the error must be set point − position and the power the gain times the error. A violation proves lost
set points or a wrong gain by itself, and its absence excludes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from daq.contracts.machine import BoardPid, Machine, NoController, SampledPid, of_joint
from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.discrepancy.controller.sampled import (
    CLEAR,
    LEAST_SAMPLES,
    controller_numbers,
    with_errors,
)
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, FoundValue, Step, Where
from model.discrepancy.grounds import ControllerEffect, ControllerProof
from model.drives.controller import POWER_MAX
from model.fitting.fit import INTERVAL
from model.machine_model.model import Model
from model.machine_model.nominal import gain_error
from model.machine_model.record_verdict import FAR_OFF

COUNTS_OF_ROUNDING = 1.5
"""Counts by which a recorded error may differ: set points are rounded to posture units, and those to counts."""
LEAST_SHARE = 1e-3
"""Share of wrong samples below which they may be due to the start of the record."""
LEAST_GAIN_DEVIATION = 0.01
"""Least relative deviation of a gain that is reported: rounding may explain a smaller one."""


@dataclass(frozen=True)
class ControllerFinding:
    """A violation: effect, joint, its parameter with a 95 % interval, and how many samples show it."""

    effect: ControllerEffect
    joint: int
    value: float
    low: float
    high: float
    samples: int
    of: int


@dataclass(frozen=True)
class JudgedController:
    """Violations of the controller's law, and the effects that its numbers prove or exclude."""

    findings: tuple[ControllerFinding, ...]
    settled: tuple[str, ...]

    @property
    def steps(self) -> tuple[Step, ...]:
        """A step for every violation."""
        return tuple(map(proved_step, self.findings))

    def with_findings(self, model: Model) -> Model:
        """The model with the gains that the records prove."""
        return with_findings(model, self.findings)


def judge_controller(model: Model, traces: Sequence[Trace]) -> JudgedController:
    """Holds the recorded drive against what the controller makes of set points and positions.

    Nothing is found where the machine file describes no controller, or where the traces do not hold what it needs.
    """
    told = with_errors(traces, model.machine)
    return JudgedController(check_controller(told, model.machine, model), settled_by_records(told, model.machine))


def check_controller(
    traces: Sequence[Trace], machine: Machine, model: Model | None = None
) -> tuple[ControllerFinding, ...]:
    """Violations on the modelled joints; none where the traces do not hold the controller's numbers.

    Args:
        traces: with the errors that the controller formed (`with_errors` of `sampled_controller`).
        model: its stated gain errors are what the power is compared with; None: the gains are as configured. A finding
            gives the whole error of a gain, the stated one included.
    """
    if isinstance(machine.controller, NoController):
        return ()
    found: list[ControllerFinding | None] = []
    for joint in machine.modelled_joints:
        stated = 0.0 if model is None else float(model.vector[at.slot(joint, at.GAIN_ERROR)])
        own = _JointRecords(tuple(traces), machine, joint)
        found += [_lost_set_points(own), _wrong_gain(own, stated)]
    return tuple(finding for finding in found if finding is not None)


def settled_by_records(traces: Sequence[Trace], machine: Machine) -> tuple[str, ...]:
    """Effects of the controller that its own numbers prove or exclude, so that no fit is needed for them.

    An effect counts only where it could be checked on every modelled joint and every trace holds what that needs. A
    gain is one number for all traces, so its samples may come from any of them.
    """
    if not traces or isinstance(machine.controller, NoController):
        return ()
    joints = [_JointRecords(tuple(traces), machine, joint) for joint in machine.modelled_joints]
    checks = {
        ControllerEffect.WRONG_GAIN: all(own.error_and_power is not None for own in joints),
        ControllerEffect.LOST_SET_POINTS: all(_is_conclusive(own.losses) for own in joints),
    }
    return tuple(effect.value for effect, judged in checks.items() if judged)


def with_findings(model: Model, findings: Sequence[ControllerFinding]) -> Model:
    """The model with the gains that the records prove: in place of the gain error that it states for a joint, or as a
    further effect. An error that several joints share is set for all of them. A gain beyond the bounds of the effect,
    as of gains in another unit, stays out of the model: its step tells it.
    """
    for finding in findings:
        if finding.effect is ControllerEffect.WRONG_GAIN and _is_allowed(model, finding):
            place = at.slot(finding.joint, at.GAIN_ERROR)
            stated = [p.name for p in model.parameters if place in p.slots]
            model = (
                model.with_values({stated[0]: finding.value})
                if stated
                else model.with_effect(finding.effect.value, (finding.joint,), {finding.effect.part: finding.value})
            )
    return model


def _is_allowed(model: Model, finding: ControllerFinding) -> bool:
    """Whether the effect's bounds allow the gain error of a finding."""
    place = at.slot(finding.joint, at.GAIN_ERROR)
    found = next((p for p in model.parameters if place in p.slots), None)
    if found is None:
        wider = model.with_effect(finding.effect.value, (finding.joint,))
        found = next(p for p in wider.parameters if place in p.slots)
    return found.low <= finding.value <= found.high


def with_used_set_points(trace: Trace) -> Trace:
    """The trace with the set points that the controller worked with, position + error, where they were lost."""
    if trace.error is None:
        return trace
    return replace(trace, set_point=trace.position + trace.error)


@dataclass(frozen=True)
class _Losses:
    """Counts of a joint's samples. moved: the set point changed; lost: of these, it was lost; wrong: the error is not
    set point − position; samples: all; clear: of the wrong ones, those that a drive's rounding cannot imitate."""

    moved: int
    lost: int
    wrong: int
    samples: int
    clear: int

    @property
    def violated(self) -> bool:
        """Whether the recorded error is wrong too often for an accident."""
        return self.clear >= max(2.0, LEAST_SHARE * self.samples)


@dataclass(frozen=True)
class _JointRecords:
    """What traces hold of the controller of one joint."""

    traces: tuple[Trace, ...]
    machine: Machine
    joint: int

    @cached_property
    def losses(self) -> _Losses | None:
        """None where a trace does not hold set points and errors."""
        tolerance = COUNTS_OF_ROUNDING * self.machine.joint(self.joint).count
        if not tolerance:
            return None
        moved = lost = total = clear = 0
        for trace in self.traces:
            if trace.error is None or trace.set_point is None:
                return None
            column = trace.column(self.joint)
            used = trace.position[:, column] + trace.error[:, column]
            numbers = controller_numbers(trace, self.machine, self.joint)
            sent = trace.set_point[:, column] if numbers is None else numbers.sent
            changed = np.abs(np.diff(sent, prepend=sent[0])) > 2 * tolerance
            wrong = np.abs(sent - used) > tolerance
            clear += int((wrong if numbers is None else wrong & numbers.lost).sum())
            if numbers is not None:
                changed &= ~numbers.limited
            moved += int(changed.sum())
            lost += int((wrong & changed).sum())
            total += int(wrong.sum())
        return _Losses(moved, lost, total, sum(len(t) for t in self.traces), clear)

    @cached_property
    def error_and_power(self) -> tuple[Floats, Floats] | None:
        """The power that P alone would give, and the recorded one, of all traces; None where one of them does not hold
        them, or all together hold too few."""
        pairs = [self._error_and_power(trace) for trace in self.traces]
        known = [pair for pair in pairs if pair is not None]
        if len(known) < len(pairs) or sum(len(wanted) for wanted, _ in known) < LEAST_SAMPLES:
            return None
        return np.concatenate([wanted for wanted, _ in known]), np.concatenate([power for _, power in known])

    @property
    def rounding(self) -> float:
        """Step of what the controller gives out: DAC counts, or the drive's unit; 0 where nothing is stated."""
        if not isinstance(self.machine.controller, SampledPid):
            return 1.0
        stated = of_joint(self.machine.controller.drive_resolution, self.joint)
        return 0.0 if stated is None else stated.value

    def _error_and_power(self, trace: Trace) -> tuple[Floats, Floats] | None:
        """The same of one trace, in DAC counts, where neither is at its limit; None where the trace does not hold them,
        or I or D act. Of a sampled PID, the drives, whatever acts."""
        controller, sensor = self.machine.controller, self.machine.joint(self.joint).sensor
        if isinstance(controller, SampledPid):
            numbers = controller_numbers(trace, self.machine, self.joint)
            return None if numbers is None else (np.round(numbers.formed[numbers.free], 6), numbers.drive[numbers.free])
        if not isinstance(controller, BoardPid) or sensor is None or trace.power_raw is None or trace.error is None:
            return None
        gains = (trace.record.gains or {}).get(self.joint, controller.gains[self.joint - 1])
        if any(gains[1:]):
            return None
        column = trace.column(self.joint)
        unit = sensor.direction * sensor.count
        wanted = gains[0] * controller.dac_counts_per_adc_count.value * trace.error[:, column] / unit
        power = trace.power_raw[:, column].astype(np.float64)
        free = (np.abs(power) < POWER_MAX - 1) & (np.abs(wanted) > CLEAR)
        return wanted[free], power[free]


def proved_step(finding: ControllerFinding) -> Step:
    """A step that a finding proves. Nothing is fitted, so it has no errors; its evidence is the number of samples."""
    part, effect = finding.effect.part, finding.effect.value
    name = f"joint{finding.joint}.{effect}.{part}"
    value = FoundValue(
        value=finding.value, low=finding.low, high=finding.high, unit="1", part=part, joints=(finding.joint,)
    )
    evidence = float(finding.samples)
    proof = Candidate(
        effect=effect, joints=(finding.joint,), evidence=evidence, parameters={name: value}, refitted=False
    )
    return Step(
        effect=effect,
        joints=(finding.joint,),
        parameters={name: value},
        evidence=evidence,
        margin=evidence,
        candidates=(proof,),
        rmse_fit=(),
        where=Where(joint=finding.joint, phase=None, summary=UNWRITTEN, cells=(), dependences=()),
        reason=UNWRITTEN,
        proof=ControllerProof(samples=finding.samples, of=finding.of),
        adopted=True,
    )


def _is_conclusive(losses: _Losses | None) -> bool:
    """Whether the counts prove or exclude lost set points. Errors that are wrong although no set point moved have
    another cause, and hide what was lost."""
    return losses is not None and (losses.moved > 0 or not losses.violated)


def _lost_set_points(own: _JointRecords) -> ControllerFinding | None:
    losses = own.losses
    if losses is None or not losses.violated or not losses.moved:
        return None
    share, (low, high) = losses.lost / losses.moved, _share_interval(losses.lost, losses.moved)
    return ControllerFinding(ControllerEffect.LOST_SET_POINTS, own.joint, share, low, high, losses.wrong, losses.moved)


def _wrong_gain(own: _JointRecords, stated: float) -> ControllerFinding | None:
    """The ratio of power to P times error, where only P acts and the power is not at its limit, if it differs from the
    stated gain error."""
    if own.error_and_power is None:
        return None
    wanted, power = own.error_and_power
    squares = float(wanted @ wanted)
    relative = float(power @ wanted) / squares - 1.0
    spread = float(np.mean((power - (1 + relative) * wanted) ** 2))
    # Equal errors are rounded alike: only different ones are independent.
    values, counts = np.unique(wanted, return_counts=True)
    deviation = float(np.sqrt(max(spread, own.rounding**2 / 12) * np.sum((counts * values) ** 2)) / squares)
    known = gain_error(own.machine, own.joint)
    within = max(
        LEAST_GAIN_DEVIATION * (1 + stated), 5 * deviation, FAR_OFF * ((known.deviation if known else 0.0) or 0.0)
    )
    if abs(relative - stated) < within:
        return None
    half, used = 2 * deviation, len(wanted)
    return ControllerFinding(
        ControllerEffect.WRONG_GAIN, own.joint, relative, relative - half, relative + half, used, used
    )


def _share_interval(count: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson)."""
    z, share = INTERVAL, count / of
    middle = (share + z**2 / (2 * of)) / (1 + z**2 / of)
    half = z * np.sqrt(share * (1 - share) / of + z**2 / (4 * of**2)) / (1 + z**2 / of)
    return float(max(0.0, middle - half)), float(min(1.0, middle + half))
