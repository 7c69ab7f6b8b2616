"""The numbers of a sampled PID or cascade, from recorded set points, positions and drive, without a model of the arm.

In every period the controller has used either the set point that was sent, or the one that it had before. What either
of them makes of the recorded positions is compared with the recorded drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import DcMotor, Machine, SampledPid, of_joint
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.output_error.received_set_points import follow_received

LEAST_AGREEMENT = 0.95
"""Least share of samples whose drive must be the controller's, to rounding, for a record to prove anything: below it
the controller is another than the machine file says."""
FINEST = 1e-3
"""Share of a joint's largest drive to which numbers of a record are trusted, where the file states no resolution."""
LEAST_STEPS = 4.0
"""Least drive of a sample that is used for a gain, in resolutions: rounding dominates below it."""
CLEAR = 4.0
"""Distance of a drive from what a set point makes of it, in resolutions, beyond which it was another set point: a drive
may be rounded more coarsely than a file tells, and then lies near what either of two set points makes."""
LEAST_SAMPLES = 20
"""Samples that the estimate of a gain needs."""
ROUNDED_SHARE = 0.5
"""Most values of a drive, as a share of its samples, with which a step may be read from them."""
LATER_STARTS = (1, 2, 3, 4, 5)
"""Samples from which what the integrators held is told, where the first does not tell it: a set point that was lost
near one of them makes it wrong."""
REWEIGHTED = 20
"""Rounds of weights for a line of least absolute deviations."""


@dataclass(frozen=True)
class ControllerNumbers:
    """What a record tells of one joint's controller.

    sent: (k,) rad, set points in the steps that the controller takes. used: (k,) those that it worked with. formed:
    (k,) drive that the gains of the file make of them. drive: (k,) as recorded. limited: (k,) whether the drive is at
    its limit, where it tells nothing. free: (k,) whether it is away from it and large enough to measure a gain. lost:
    (k,) whether it clearly worked with the set point before. told: (k,) whether it is known which set point it worked
    with. factor: by which the drive is larger than the gains of
    the file make it.
    """

    sent: Floats
    used: Floats
    formed: Floats
    drive: Floats
    limited: NDArray[np.bool_]
    free: NDArray[np.bool_]
    lost: NDArray[np.bool_]
    told: NDArray[np.bool_]
    factor: float


def controller_numbers(trace: Trace, machine: Machine, joint: int) -> ControllerNumbers | None:
    """The numbers of one joint; None where the record does not hold set points and the drive of every period, or is of
    another controller."""
    controller = machine.controller
    if not isinstance(controller, SampledPid) or trace.set_point is None or trace.drive is None:
        return None
    period = trace.record.period or controller.period.value
    if trace.missing or len(trace) < LEAST_SAMPLES or np.abs(np.diff(trace.time) / period - 1).max() > 0.1:
        return None
    column = trace.column(joint)
    drive = trace.drive[:, column]
    stated = of_joint(controller.drive_resolution, joint)
    resolution = max(FINEST * float(np.abs(drive).max()), _shown_step(drive)) if stated is None else stated.value
    limited = np.abs(drive) >= min(_largest_output(machine, joint), _shown_limit(drive)) - 0.5 * resolution
    sent, position = _rounded(trace.set_point[:, column], controller, joint), trace.position[:, column]
    free = ~limited & (np.abs(drive) > LEAST_STEPS * resolution)

    def numbers_by(law: _Law, scale: _Scale, *, hidden: bool = False) -> tuple[float, ControllerNumbers]:
        follow = law.follow_hidden if hidden else law.follow
        used, formed, clear = follow(sent, position, drive, limited, scale, resolution)
        apart = np.abs(drive - scale.factor * formed)
        agreed = apart[~limited] <= (0.75 * resolution + 2 * FINEST * np.abs(drive))[~limited]
        near = apart <= _farthest(drive, resolution)
        large = ~limited & near & (np.abs(formed) > LEAST_STEPS * resolution)
        share = float(np.mean(agreed)) if agreed.size >= LEAST_SAMPLES else 0.0
        told = ~limited | hidden
        return share, ControllerNumbers(sent, used, formed, drive, limited, large, clear, told, scale.factor)

    found: list[tuple[float, ControllerNumbers]] = []
    laws = [_Law(controller, joint, period, winds_up=False)]
    if laws[0].integrates and limited.any():
        laws.append(_Law(controller, joint, period, winds_up=True))
    for law in laws:
        plain = law.follow(sent, position, drive, limited, _Scale(1.0, 0.0), np.inf)[1]
        # By the file from the first sample on, which is right however many set points were lost; and by a line.
        scales = [_Scale(1.0, float(drive[0] - plain[0]) if law.integrates else 0.0)]
        if int(free.sum()) >= LEAST_SAMPLES:
            scales.append(_scale(drive[free], plain[free], resolution, offset=law.integrates))
        found += [numbers_by(law, scale) for scale in scales if scale.factor > 0.0]
        if law.integrates and max(share for share, _ in found) < LEAST_AGREEMENT:
            # A record that begins in motion does not hold the change up to its first sample: by a later one, then.
            found += [numbers_by(law, _Scale(1.0, float(drive[k] - plain[k]))) for k in LATER_STARTS if not limited[k]]
        share, numbers = max(reversed(found), key=lambda one: one[0])
        if limited.any() and (share < LEAST_AGREEMENT or numbers.lost.any()):
            # At its limit a drive hides which set point was in use, and so what follows.
            found += [numbers_by(law, scale, hidden=True) for scale in scales if scale.factor > 0.0]
            share, numbers = max(reversed(found), key=lambda one: one[0])
        if share >= LEAST_AGREEMENT:
            return numbers
    return None


def _largest_output(machine: Machine, joint: int) -> float:
    """The largest drive that the controller gives: as stated, else the largest voltage of its joint's motor."""
    controller, drive = machine.controller, machine.joint(joint).drive
    stated = of_joint(controller.output_limit, joint) if isinstance(controller, SampledPid) else None
    if stated is not None:
        return stated.value
    return abs(drive.dac_full_scale.value * drive.amplifier_gain.value) if isinstance(drive, DcMotor) else np.inf


def _shown_step(drive: Floats) -> float:
    """The step in which a recorded drive changes; 0 where its values are not all whole numbers of one."""
    values = np.unique(drive)
    if len(values) < 3 or len(values) > ROUNDED_SHARE * len(drive):
        return 0.0
    apart = np.diff(values)
    step = float(apart[apart > 1e-9 * np.abs(values).max()].min(initial=np.inf))
    whole = values / step
    return step if np.abs(whole - np.round(whole)).max() < 0.01 else 0.0


def _shown_limit(drive: Floats) -> float:
    """The largest drive of a record, where it stands there for several samples; else none."""
    size = np.abs(drive)
    at = size >= (1 - 1e-6) * size.max()
    runs = at[2:] & at[1:-1] & at[:-2]
    return float(size.max()) if runs.any() and size.max() > 0.0 else np.inf


@dataclass(frozen=True)
class _Scale:
    """What a drive is of the one that the gains of the file form with empty integrators: `factor` times it, and `held`
    beside it, which the integrators held when the record began."""

    factor: float
    held: float


def _scale(drive: Floats, formed: Floats, resolution: float, *, offset: bool) -> _Scale:
    """The straight line from the formed drive to the recorded one, but for samples whose set points were lost: of least
    absolute deviations first, then of least squares near that. offset: whether it may pass beside zero."""
    columns = np.column_stack([formed, np.full(len(formed), float(offset))])
    line: Floats = np.zeros(2)
    weight: Floats = np.ones(len(formed))
    for _ in range(REWEIGHTED):
        line = np.asarray(np.linalg.lstsq(columns * weight[:, None], drive * weight, rcond=None)[0])
        weight = 1 / np.sqrt(np.maximum(np.abs(drive - columns @ line), resolution))
    near = np.abs(drive - columns @ line) <= _farthest(drive, resolution)
    line = np.asarray(np.linalg.lstsq(columns[near], drive[near], rcond=None)[0])
    return _Scale(1.0 if abs(line[0] - 1.0) < FINEST else float(line[0]), float(line[1]))


def _farthest(drive: Floats, resolution: float) -> Floats:
    """Distance from the formed drive that rounding and a nearly right factor leave: a closer cut would choose those
    samples whose rounding suits it."""
    return 2 * resolution + 0.03 * np.abs(drive)


def with_errors(traces: Sequence[Trace], machine: Machine) -> tuple[Trace, ...]:
    """The traces with the errors that the controller formed, where they hold none and their drive tells them."""
    return tuple(_with_errors(trace, machine) for trace in traces)


def _with_errors(trace: Trace, machine: Machine) -> Trace:
    joints = [joint for joint in trace.joints if joint in machine.modelled_joints]
    if trace.error is not None or trace.set_point is None or not joints:
        return trace
    error = trace.set_point - trace.position
    for joint in joints:
        known = controller_numbers(trace, machine, joint)
        if known is None:
            return trace
        column = trace.column(joint)
        error[:, column] = known.used - trace.position[:, column]
    return replace(trace, error=error)


class _Law:
    """The law of one joint's controller, as `model.drives.controller` has it, period by period.

    winds_up: whether the error is summed at the output's limit as well, which the model's controller does not do and
    many others do.
    """

    def __init__(self, controller: SampledPid, joint: int, period: float, *, winds_up: bool) -> None:
        self.outer = controller.gains[joint - 1]
        inner = controller.velocity_gains
        self.inner = None if inner is None else inner[joint - 1]
        self.period = period
        self.winds_up = winds_up

    @property
    def integrates(self) -> bool:
        """Whether the controller sums up errors, of which a record does not hold the beginning."""
        return self._summed != 0.0

    @property
    def _summed(self) -> float:
        """I of the loop that forms the drive."""
        return (self.outer if self.inner is None else self.inner)[1]

    def follow(
        self, sent: Floats, position: Floats, drive: Floats, limited: NDArray[np.bool_], scale: _Scale, line: float
    ) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Set points in use, the drive that the gains make of them, and where one was clearly lost.

        A set point counts as lost where the drive is further than `line` from what it would make, and nearer to what
        the one before makes; as clearly lost where it is further than `CLEAR` times that, and at what the one before
        makes.
        """
        used, formed, clear = np.empty_like(sent), np.empty_like(sent), np.zeros(len(sent), dtype=bool)
        factor = scale.factor
        memory: Any = self._begin(float(sent[0] - position[0]), float(position[0]), scale)
        for k in range(len(sent)):
            wanted = float(sent[k])
            output, after = self._output(wanted - position[k], float(position[k]), memory)
            miss = abs(drive[k] - factor * output)
            if k > 0 and not limited[k] and miss > line:
                other, held = self._output(used[k - 1] - position[k], float(position[k]), memory)
                left = abs(drive[k] - factor * other)
                clear[k] = miss > CLEAR * line and left <= line
                if left < 0.5 * miss:
                    wanted, output, after = float(used[k - 1]), other, held
            used[k], formed[k] = wanted, output
            memory = self._kept(memory, after, limited=bool(limited[k]))
        return used, formed, clear

    def follow_hidden(
        self, sent: Floats, position: Floats, drive: Floats, limited: NDArray[np.bool_], scale: _Scale, line: float
    ) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """The same as `follow`, where a drive at its limit hides set points: they are told by what follows."""
        begin = self._begin(float(sent[0] - position[0]), float(position[0]), scale)

        def step(error: Floats, at: float, memory: Any, *, limited: bool) -> Any:
            output, after = self._output(error, at, memory)
            return output, self._kept(memory, after, limited=limited)

        path = follow_received(sent, position, drive, limited, step, begin, scale.factor, line)
        miss, left = (np.abs(drive - scale.factor * formed) for formed in (path.of_sent, path.formed))
        return path.used, path.formed, ~limited & (path.used != sent) & (miss > CLEAR * line) & (left <= line)

    def _kept(self, before: Any, after: Any, *, limited: bool) -> Any:
        """What the controller remembers of a period: at its limit not the error, unless it winds up."""
        return (before[0], *after[1:]) if limited and not self.winds_up else after

    def _begin(self, error: float, position: float, scale: _Scale) -> tuple[float, float, float, float, float]:
        """What the controller remembers before the first sample, whose error and position these are."""
        total = scale.held / (scale.factor * self._summed) if self.integrates else 0.0
        totals = (total, 0.0) if self.inner is None else (0.0, total)
        return totals[0], error, totals[1], 0.0, position

    def _output(self, error: Any, position: Any, memory: Any) -> tuple[Any, tuple[Any, ...]]:
        """The output for an error, and the memory after it: sum and last of the errors, of the inner ones, position.

        Numbers, or arrays by age of the set point (`received_set_points`).
        """
        total, last, inner_total, inner_last, before = memory
        p, i, d = self.outer
        total += error * self.period
        output = p * error + i * total + d * (error - last) / self.period
        if self.inner is None:
            return output, (total, error, inner_total, inner_last, position + 0.0 * before)
        p, i, d = self.inner
        inner = output - (position - before) / self.period
        inner_total += inner * self.period
        output = p * inner + i * inner_total + d * (inner - inner_last) / self.period
        return output, (total, error, inner_total, inner, position + 0.0 * before)


def _rounded(set_points: Floats, controller: SampledPid, joint: int) -> Floats:
    resolution = of_joint(controller.set_point_resolution, joint)
    if resolution is None:
        return set_points
    return np.asarray(resolution.value * np.floor(set_points / resolution.value + 0.5))
