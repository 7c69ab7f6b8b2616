"""The numbers of a sampled PID or cascade, from recorded set points, positions and drive, without a model of the arm.

In every period the controller has used either the set point that was sent, or the one that it had before. What either
of them makes of the recorded positions is compared with the recorded drive.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import DcMotor, Machine, SampledPid, of_joint
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.thresholds import MOST_ROUNDS
from model.inverse_dynamics.drive_limits import AT_LIMIT, SEVERAL

CLEAR = 4.0
"""Distance of a drive from what a set point makes of it, in resolutions, beyond which it was another set point: a drive
may be rounded more coarsely than a file tells, and then lies near what either of two set points makes. A drive of less
tells no gain: rounding dominates."""

Memory = tuple[float, float, float, float, float]
"""What a controller remembers: sum and last of the errors, of the inner ones, position."""


@dataclass(frozen=True)
class Scale:
    """What a drive is of the one that the gains of the file form with empty integrators: `factor` times it, and `held`
    beside it, which the integrators held when the record began."""

    factor: float
    held: float


class ControllerLaw:
    """The law of one joint's controller, as `model.drives.controller` has it, period by period.

    winds_up: whether the error is summed at the output's limit as well, which the model's controller does not do and
    many others do.
    """

    def __init__(self, controller: SampledPid, joint: int, period: float, *, winds_up: bool) -> None:
        self.outer = controller.gains[joint - 1]
        inner = controller.velocity_gains
        self.inner = None if inner is None else inner[joint - 1]
        band = of_joint(controller.dead_band, joint)
        self.dead_band = -1.0 if band is None else band.value
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
        self, sent: Floats, position: Floats, drive: Floats, limited: NDArray[np.bool_], scale: Scale, line: float
    ) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Set points in use, the drive that the gains make of them, and where one was clearly lost.

        A set point counts as lost where the drive is further than `line` from what it would make, and nearer to what
        the one before makes; as clearly lost where it is further than `CLEAR` times that, and at what the one before
        makes.

        Args:
            sent, position: (k,) rad. drive: (k,) as recorded. limited: (k,) whether it is at its limit.
            scale: what the drive is of the one that the gains make. line: in the drive's unit.
        """
        used, formed, clear = np.empty_like(sent), np.empty_like(sent), np.zeros(len(sent), dtype=bool)
        factor = scale.factor
        memory = self._begin(float(sent[0] - position[0]), float(position[0]), scale)
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

    def _kept(self, before: Memory, after: Memory, *, limited: bool) -> Memory:
        """What the controller remembers of a period: at its limit not the error, unless it winds up."""
        return (before[0], *after[1:]) if limited and not self.winds_up else after

    def _begin(self, error: float, position: float, scale: Scale) -> Memory:
        """What the controller remembers before the first sample, whose error and position these are."""
        total = scale.held / (scale.factor * self._summed) if self.integrates else 0.0
        totals = (total, 0.0) if self.inner is None else (0.0, total)
        return totals[0], error, totals[1], 0.0, position

    def _output(self, error: float, position: float, memory: Memory) -> tuple[float, Memory]:
        """The output for an error, and the memory after it: sum and last of the errors, of the inner ones, position."""
        total, last, inner_total, inner_last, before = memory
        p, i, d = self.outer
        error = 0.0 if abs(error) <= self.dead_band else error
        total += error * self.period
        output = p * error + i * total + d * (error - last) / self.period
        if self.inner is None:
            return output, (total, error, inner_total, inner_last, position)
        p, i, d = self.inner
        inner = output - (position - before) / self.period
        inner_total += inner * self.period
        output = p * inner + i * inner_total + d * (inner - inner_last) / self.period
        return output, (total, error, inner_total, inner, position)


LEAST_AGREEMENT = 0.95
"""Least share of samples whose drive must be the controller's, to rounding, for a record to prove anything: below it
the controller is another than the machine file says."""
FINEST = 1e-3
"""Share of a joint's largest drive to which numbers of a record are trusted, where the file states no resolution."""
LEAST_SAMPLES = 20
"""Samples that the estimate of a gain needs."""
ROUNDED_SHARE = 0.5
"""Most values of a drive, as a share of its samples, with which a step may be read from them."""
LATER_STARTS = (1, 2, 3, 4, 5)
"""Samples from which what the integrators held is told, where the first does not tell it: a set point that was lost
near one of them makes it wrong."""
SHOWN_LIMIT = 3
"""Samples at the largest size of a drive that show a limit. A drive in steps comes there without one, too; then samples
count as hidden that are none, for as long as it stands there."""


@dataclass(frozen=True)
class ControllerNumbers:
    """What a record tells of one joint's controller.

    sent: (k,) rad, set points in the steps that the controller takes. used: (k,) those that it worked with. formed:
    (k,) drive that the gains of the file make of them. drive: (k,) as recorded. limited: (k,) whether the drive is at
    its limit, where it tells nothing. free: (k,) whether it is away from it and large enough to measure a gain. lost:
    (k,) whether it clearly worked with the set point before. factor: by which the drive is larger than the gains of the
    file make it.
    """

    sent: Floats
    used: Floats
    formed: Floats
    drive: Floats
    limited: NDArray[np.bool_]
    free: NDArray[np.bool_]
    lost: NDArray[np.bool_]
    factor: float


class _Found(NamedTuple):
    """Numbers of a controller, and the share of samples whose drive is what they make."""

    share: float
    numbers: ControllerNumbers


@dataclass(frozen=True)
class _Recorded:
    """What a record holds of one joint's controller.

    sent: (k,) rad, set points in the steps that the controller takes. position: (k,) rad. drive: (k,) in its own unit.
    limited: (k,) whether the drive is at its limit. resolution: of the drive.
    """

    sent: Floats
    position: Floats
    drive: Floats
    limited: NDArray[np.bool_]
    resolution: float

    @property
    def free(self) -> NDArray[np.bool_]:
        """(k,) whether the drive is away from its limit, and large beside its rounding."""
        return ~self.limited & (np.abs(self.drive) > CLEAR * self.resolution)

    def numbers_by(self, law: ControllerLaw, scale: Scale) -> _Found:
        """The numbers by a law, and the share of samples whose drive is that law's."""
        drive, limited, resolution = self.drive, self.limited, self.resolution
        used, formed, clear = law.follow(self.sent, self.position, drive, limited, scale, resolution)
        apart = np.abs(drive - scale.factor * formed)
        agreed = apart[~limited] <= (0.75 * resolution + 2 * FINEST * np.abs(drive))[~limited]
        near = apart <= _farthest(drive, resolution)
        large = ~limited & near & (np.abs(formed) > CLEAR * resolution)
        share = float(np.mean(agreed)) if agreed.size >= LEAST_SAMPLES else 0.0
        numbers = ControllerNumbers(self.sent, used, formed, drive, limited, large, clear, scale.factor)
        return _Found(share, numbers)


def controller_numbers(trace: Trace, machine: Machine, joint: int) -> ControllerNumbers | None:
    """The numbers of one joint; None where the record does not hold set points and the drive of every period, or is of
    another controller."""
    controller = machine.controller
    if not isinstance(controller, SampledPid):
        return None
    period = trace.record.period or controller.period.value
    recorded = _recorded(trace, machine, controller, joint, period)
    if recorded is None:
        return None
    for law in _laws(controller, joint, period, reaches_limit=bool(recorded.limited.any())):
        found = _by_law(law, recorded)
        if found.share >= LEAST_AGREEMENT:
            return found.numbers
    return None


def _recorded(trace: Trace, machine: Machine, controller: SampledPid, joint: int, period: float) -> _Recorded | None:
    """What a trace holds of a joint; None where it lacks set points, drive or periods, of `period` s each."""
    if trace.set_point is None or trace.drive is None:
        return None
    if trace.missing or len(trace) < LEAST_SAMPLES or np.abs(np.diff(trace.time) / period - 1).max() > 0.1:
        return None
    column = trace.column(joint)
    drive = trace.drive[:, column]
    stated = of_joint(controller.drive_resolution, joint)
    resolution = max(FINEST * float(np.abs(drive).max()), _shown_step(drive)) if stated is None else stated.value
    limited = np.abs(drive) >= _largest_output(machine, joint, drive) - 0.5 * resolution
    sent = _rounded(trace.set_point[:, column], controller, joint)
    return _Recorded(sent, trace.position[:, column], drive, limited, resolution)


def _laws(controller: SampledPid, joint: int, period: float, *, reaches_limit: bool) -> Iterator[ControllerLaw]:
    """Laws that a joint's controller may have: the model's, and one that winds up where a record can tell them
    apart."""
    law = ControllerLaw(controller, joint, period, winds_up=False)
    yield law
    if law.integrates and reaches_limit:
        yield ControllerLaw(controller, joint, period, winds_up=True)


def _by_law(law: ControllerLaw, recorded: _Recorded) -> _Found:
    """The numbers by a law, with what its integrators held in the beginning for which the drive agrees best."""
    drive, limited = recorded.drive, recorded.limited
    plain = law.follow(recorded.sent, recorded.position, drive, limited, Scale(1.0, 0.0), np.inf)[1]
    scales = _scales(law, recorded, plain)
    found = [recorded.numbers_by(law, scale) for scale in scales]
    if law.integrates and max(one.share for one in found) < LEAST_AGREEMENT:
        # A record that begins in motion does not hold the change up to its first sample: by a later one, then.
        later = [Scale(1.0, float(drive[k] - plain[k])) for k in LATER_STARTS if not limited[k]]
        found += [recorded.numbers_by(law, scale) for scale in later]
    return max(reversed(found), key=lambda one: one.share)


def _scales(law: ControllerLaw, recorded: _Recorded, plain: Floats) -> list[Scale]:
    """What the drive is of the one that the law forms with empty integrators: by the file from the first sample on,
    which is right however many set points were lost; and by a line.

    Args:
        plain: (k,) the drive that the law forms so.
    """
    drive, free = recorded.drive, recorded.free
    scales = [Scale(1.0, float(drive[0] - plain[0]) if law.integrates else 0.0)]
    if int(free.sum()) >= LEAST_SAMPLES:
        scales.append(_line(drive[free], plain[free], recorded.resolution, offset=law.integrates))
    return [scale for scale in scales if scale.factor > 0.0]


def _largest_output(machine: Machine, joint: int, recorded: Floats) -> float:
    """The largest drive that the controller gives: as stated, else the largest voltage of its joint's motor, or less
    where the recorded drive (k,) comes to the same largest size several times, as at a limit below that."""
    controller, drive = machine.controller, machine.joint(joint).drive
    stated = of_joint(controller.output_limit, joint) if isinstance(controller, SampledPid) else None
    if stated is not None:
        return stated.value
    most = drive.largest_output if isinstance(drive, DcMotor) else np.inf
    sizes = np.abs(recorded)
    shown = sizes.any() and int((sizes >= (1 - AT_LIMIT) * sizes.max()).sum()) >= SHOWN_LIMIT
    return min(most, float(sizes.max())) if shown else most


def _shown_step(drive: Floats) -> float:
    """The step in which a recorded drive changes; 0 where its values are not all whole numbers of one."""
    values = np.unique(drive)
    if len(values) < SEVERAL or len(values) > ROUNDED_SHARE * len(drive):
        return 0.0
    apart = np.diff(values)
    step = float(apart[apart > 1e-9 * np.abs(values).max()].min(initial=np.inf))
    whole = values / step
    return step if np.abs(whole - np.round(whole)).max() < 0.01 else 0.0


def _line(drive: Floats, formed: Floats, resolution: float, *, offset: bool) -> Scale:
    """The straight line from the formed drive to the recorded one, but for samples whose set points were lost: of least
    absolute deviations first, then of least squares near that. offset: whether it may pass beside zero."""
    columns = np.column_stack([formed, np.full(len(formed), float(offset))])
    line: Floats = np.zeros(2)
    weight: Floats = np.ones(len(formed))
    for _ in range(MOST_ROUNDS):
        line = np.asarray(np.linalg.lstsq(columns * weight[:, None], drive * weight, rcond=None)[0])
        weight = 1 / np.sqrt(np.maximum(np.abs(drive - columns @ line), resolution))
    near = np.abs(drive - columns @ line) <= _farthest(drive, resolution)
    line = np.asarray(np.linalg.lstsq(columns[near], drive[near], rcond=None)[0])
    return Scale(1.0 if abs(line[0] - 1.0) < FINEST else float(line[0]), float(line[1]))


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


def _rounded(set_points: Floats, controller: SampledPid, joint: int) -> Floats:
    resolution = of_joint(controller.set_point_resolution, joint)
    if resolution is None:
        return set_points
    return np.asarray(resolution.value * np.floor(set_points / resolution.value + 0.5))
