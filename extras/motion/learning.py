"""Corrects the set points of a recorded attempt by its error: iterative learning, from trace to trace.

The response of the readings to set points is also needed. A model gives it, or a second-order loop is estimated from
the attempt itself. An approximate response is enough, since the next attempt shows the remaining error.

Near a motion a position loop responds like a mass on a damped spring with a dead time: gain one, two time constants, a
delay. Almost any motion determines these three parameters; it would not determine a free response of fifty periods.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import fftconvolve

from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec, Feedforward, TrackingError
from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from extras.motion.arm_in_loop import arm_in_loop
from extras.motion.best_set_points import Task, best_set_points, rounded_set_points
from extras.motion.inverse import require_same
from extras.motion.motion import Motion, Planner, and_rest, computed_experiment, gains_for, motion_of
from extras.motion.response import REACH, Response, response_of
from extras.motion.tracking import errors_of
from model.arrays import Floats
from model.machine_model.model import Model
from model.simulation.inputs import RunInputs, inputs_of

SLOWEST, FASTEST = 0.5, 60.0
"""Bounds (rad/s) of the loop's natural frequency; the upper one is that of a loop sampled about five times per
period."""
LEAST_DAMPING, MOST_DAMPING = 0.05, 5.0
MOST_DELAY = 5.0
"""Longest dead time, in periods."""
STARTS = ((8.0, 0.7, 1.0), (20.0, 0.4, 1.0), (8.0, 2.0, 1.0))
"""Natural frequency, damping and delay at which estimates start; the best result is used."""


@dataclass(frozen=True)
class SecondOrderLoop:
    """ω (rad/s), damping ratio and dead time (periods) of a loop, and the share of the motion that it explains."""

    frequency: float
    damping: float
    delay: float
    explained: float

    def response(self, count: int, period: float) -> Response:
        """Returns the same response in each of `count` periods."""
        pulse = _pulse_response((self.frequency, self.damping, self.delay), min(REACH, count), period)
        return response_of(np.tile(pulse, (count, 1)))


def estimated_loop(set_points: Floats, readings: Floats, period: float) -> SecondOrderLoop:
    """Returns the loop that best maps set points (k,) to readings (k,), both in the same unit.

    A constant offset, which gravity causes, is estimated too.
    """
    moved = set_points - set_points[0]
    count = len(moved)

    def left(values: Floats) -> Floats:
        pulse = _pulse_response(values, count, period)
        difference = fftconvolve(moved, pulse)[:count] - readings
        return np.asarray(difference - difference.mean())

    low, high = (SLOWEST, LEAST_DAMPING, 0.0), (FASTEST, MOST_DAMPING, MOST_DELAY)
    found = min((least_squares(left, start, bounds=(low, high)) for start in STARTS), key=lambda one: one.cost)
    spread = float(np.square(readings - readings.mean()).sum())
    explained = 1.0 - 2.0 * found.cost / spread if spread else 0.0
    frequency, damping, delay = found.x.tolist()
    return SecondOrderLoop(frequency, damping, delay, explained)


def _pulse_response(loop: Sequence[float] | Floats, count: int, period: float) -> Floats:
    """Returns (count,) readings after a set point that is one for one period and else zero, at the beginnings of
    periods."""
    frequency, damping, delay = loop
    edges = period * (np.arange(count + 1) - 1.0 - delay)
    return np.diff(_step_response(frequency, damping, np.maximum(edges, 0.0)))


def _step_response(frequency: float, damping: float, time: Floats) -> Floats:
    root = np.sqrt(complex(damping * damping - 1.0)) or 1e-6
    fast, slow = -frequency * (damping + root), -frequency * (damping - root)
    return np.asarray((1.0 + (fast * np.exp(slow * time) - slow * np.exp(fast * time)) / (slow - fast)).real)


CAUTION = 0.1
"""Weight of a set point's squared change relative to the squared error."""
LEAST_EXPLAINED = 0.9
"""Least share of a joint's motion that its estimated loop must explain."""
MOST_MISSING = 0.02
"""Largest share of missing samples; a few are interpolated by straight lines."""
WORSE = 1.1
"""Ratio to the error of the previous attempt above which learning counts as diverging; below, it is noise."""
FINEST = 0.3
"""Error (rms), in posture units, that rounding alone causes: nothing remains to be learned. An error of up to twice
that may grow by chance, which is no divergence."""


def learn(
    trace: Trace,
    machine: Machine,
    plan: Planner,
    model: Model | None = None,
    share: float = 1.0,
) -> ExperimentSpec:
    """Returns an experiment with the corrected set points of a recorded attempt at a motion.

    Args:
        trace: of the plain experiment, or of one with computed set points.
        model: gives the response to set points; None: estimated from the trace.
        share: of the correction that is applied.

    Raises TraceError for an unsuitable trace, and if the error is larger than that of the attempt that the trace itself
    learned from; SpecError as `feedforward` does.
    """
    if model is not None:
        require_same(model, machine)
    asked = asked_of(trace, machine)
    motion = motion_of(asked, machine, plan)
    inputs = inputs_of(trace, machine)
    if len(inputs) != len(motion):
        raise TraceError(
            f"{_called(trace)}: has {len(inputs)} periods, but the motion has {len(motion)}: repeat the run"
        )
    sent, reached = motion.scale.postures(inputs.set_points), motion.scale.postures(_bridged(inputs, trace))
    before = errors_of(motion.joints, motion.miss(reached))
    _require_converging(trace, before, motion)
    responses = _responses(motion, inputs, sent, reached, trace, model)
    found, predicted = sent.copy(), reached.copy()
    wanted, now, shown = (and_rest(one).T for one in (motion.wanted, sent, reached))
    for column, joint in zip(motion.columns, motion.joints, strict=True):
        allowed, count = motion.allowed[column], len(motion)
        came_late = np.abs(np.diff(now[column])).max() > allowed.step + 0.5
        if before[joint].rms <= FINEST * abs(motion.scale.unit[column]) and not came_late:
            continue
        task = Task(wanted[column], wanted[column], now[column], shown[column], CAUTION)
        corrected = now[column] + share * (best_set_points(task, responses[column], allowed) - now[column])
        rounded = rounded_set_points(corrected, responses[column], allowed, motion.effective[column])
        found[:, column] = rounded[:count]
        predicted[:, column] += responses[column].applied(rounded - now[column])[:count]
    source = Feedforward(
        asked=asked.without_feedforward,
        model=None if model is None else model.identity,
        learned_from=trace.record.trace_id,
        expected=errors_of(motion.joints, motion.miss(predicted)),
        before=before,
    )
    return computed_experiment(motion, found, gains_for(motion, trace.record.gains), source)


def _require_converging(trace: Trace, reached: Mapping[int, TrackingError], motion: Motion) -> None:
    """Raises TraceError if a learned attempt has a larger error than the one that it was learned from."""
    spec = trace.record.spec
    if spec is None or spec.feedforward is None or spec.feedforward.learned_from is None:
        return
    for column, joint in zip(motion.columns, motion.joints, strict=True):
        before, now = spec.feedforward.before.get(joint), reached[joint].rms
        if before is None or now <= 2 * FINEST * abs(motion.scale.unit[column]) or now <= WORSE * before.rms:
            continue
        raise TraceError(
            f"{_called(trace)}: learning does not converge: the error of joint {joint} grew from "
            f"{math.degrees(before.rms):.3f}° to {math.degrees(now):.3f}°; learn from "
            f"{spec.feedforward.learned_from} again, with a smaller share of the correction"
        )


def asked_of(trace: Trace, machine: Machine) -> ExperimentSpec:
    """Returns the experiment whose motion a trace attempted. Raises TraceError unless it is a whole attempt on this
    machine."""
    record, called = trace.record, _called(trace)
    if record.spec is None or record.machine is None:
        raise TraceError(f"{called}: does not state its experiment: learn from a trace that `daq run` recorded")
    if record.machine.name != machine.name or record.machine.controller != machine.controller:
        raise TraceError(f"{called}: is of {record.machine.name}, or of a controller other than that of {machine.name}")
    if record.outcome != "complete":
        raise TraceError(f"{called}: ended as {record.outcome or 'unfinished'}: learn from a complete one")
    if record.every != 1:
        raise TraceError(f"{called}: has a sample only every {record.every} periods: learning needs every period")
    for kind, what in (("pause", "its set points paused"), ("missed_set_point", "the controller missed set points")):
        if any(event.kind == kind for event in trace.events):
            raise TraceError(f"{called}: {what}, so it does not show the effect of its set points: repeat the run")
    if trace.missing > MOST_MISSING * len(trace):
        raise TraceError(f"{called}: lacks {trace.missing} of {len(trace) + trace.missing} samples: repeat the run")
    return record.spec.wanted_motion


def _called(trace: Trace) -> str:
    return f"trace {trace.record.trace_id}"


def _bridged(inputs: RunInputs, trace: Trace) -> Floats:
    """Returns readings (k, n) rad of every period, with straight lines where samples are missing."""
    readings = inputs.readings.copy()
    periods = np.arange(len(readings))
    for column in readings.T:
        known = ~np.isnan(column)
        if not known.any():
            raise TraceError(f"{_called(trace)}: has no readings")
        column[~known] = np.interp(periods[~known], periods[known], column[known])
    return readings


def _responses(
    motion: Motion, inputs: RunInputs, sent: Floats, reached: Floats, trace: Trace, model: Model | None
) -> dict[int, Response]:
    if model is not None:
        arm = arm_in_loop(model, sent[0], len(motion) + REACH, trace.record.gains)
        return dict(enumerate(arm.responses(and_rest(sent))))
    found = {}
    for column, joint in zip(motion.columns, motion.joints, strict=True):
        loop = estimated_loop(sent[:, column], reached[:, column], inputs.period)
        if loop.explained < LEAST_EXPLAINED:
            raise TraceError(
                f"{_called(trace)}: joint {joint} does not follow its set points ({100 * loop.explained:.0f} % of its "
                "motion is explained): nothing can be learned from it; is it blocked, or is the motion too small?"
            )
        found[column] = loop.response(len(motion) + REACH, inputs.period)
    return found
