"""Computes set points with which a model of the arm follows a motion: inverts its closed loop by simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Feedforward, TrackingError
from daq.contracts.machine import Machine
from daq.contracts.progress import Progress, silent
from extras.motion.arm_in_loop import ArmInLoop, arm_in_loop
from extras.motion.best_set_points import Task, best_set_points, rounded_set_points
from extras.motion.motion import Motion, Planner, computed_experiment, gains_for, motion_of, with_rest
from extras.motion.response import Response
from extras.motion.tracking import errors_of
from model.arrays import Floats, Mask
from model.machine_model.model import Model

MOST_STEPS = 12
"""Most Gauss–Newton steps."""
SETTLED = 0.01
"""Relative fall of the squared error below which the steps end."""
FIRST_CAUTION = 1e-3
"""Initial weight of a set point's squared change in a step, relative to the squared error."""
LARGEST_CAUTION = 10.0
"""Weight at which a step is given up, because it would change almost nothing."""
DRAWS = 4
"""Draws of the sensor's noise over which the error with rounding is averaged."""
AT_REST = 1e-9
"""Change of a motion in a period, in posture units, that counts as rest."""
MOST_RESTS = 40
"""Largest number of rests for which held set points are compared with rounded ones."""
MOST_CORRECTIONS = 8
"""Most corrections of rounded set points."""
LEAST_SHARE = 0.2
"""Share of a correction below which a joint's set points are left unchanged."""
CAUTION = 0.1
"""Weight of a set point's squared change in such a correction, relative to the squared error."""


def feedforward(
    model: Model, asked: ExperimentSpec, machine: Machine, plan: Planner, progress: Progress = silent
) -> ExperimentSpec:
    """Returns an experiment with set points that make the modelled arm follow the motion of `asked`.

    The arm shall be at the motion's position in each period, without delay. If drive or limits do not allow that, the
    squared error is least. Gauss–Newton steps on the simulated closed loop find the set points, which are then rounded.

    Args:
        machine: the machine that will run it; its limits hold.

    Raises SpecError for a model of another machine, and for an experiment for which set points cannot be computed;
    otherwise as the planner does.
    """
    require_same(model, machine)
    motion = motion_of(asked, machine, plan)
    gains = gains_for(motion, None)
    longer = with_rest(motion)
    found = inverted(arm_in_loop(model, motion.wanted[0], len(longer), gains), longer, progress)[: len(motion)]
    arm = arm_in_loop(model, motion.wanted[0], len(motion), gains)
    expected, before = (_expected(arm, motion, one) for one in (found, motion.wanted))
    source = Feedforward(asked=asked.without_feedforward, model=model.identity, expected=expected, before=before)
    return computed_experiment(motion, found, gains, source)


def require_same(model: Model, machine: Machine) -> None:
    """Raises SpecError for a model of another machine: another name, or other set points or readings.

    Masses, lengths and loads may differ, since a fit changes them.
    """
    own = model.machine
    if own.name != machine.name:
        raise SpecError(f"the model {model.identity} is of {own.name}, but the experiment is for {machine.name}")
    sensors = [[joint.sensor for joint in one.joints] for one in (own, machine)]
    different = (
        "other joints"
        if own.modelled_joints != machine.modelled_joints or len(own.joints) != len(machine.joints)
        else "another controller"
        if own.controller != machine.controller
        else "other sensors"
        if sensors[0] != sensors[1]
        else ""
    )
    if different:
        raise SpecError(
            f"the model {model.identity} is of a {machine.name} with {different}; fit one to this machine's traces"
        )


def inverted(arm: ArmInLoop, motion: Motion, progress: Progress = silent) -> Floats:
    """Returns whole posture units (k, n) of the modelled joints with which the simulated arm follows the motion."""
    now, caution = motion.wanted.copy(), FIRST_CAUTION
    (reached,) = arm.readings([now])
    cost = _cost(motion, reached)
    responses = arm.responses(now)
    for step in range(MOST_STEPS):
        progress(step / MOST_STEPS, f"set points, step {step + 1}")
        while caution <= LARGEST_CAUTION:
            tried = now.copy()
            for column in motion.columns:
                wanted = motion.wanted[:, column]
                task = Task(wanted, wanted, now[:, column], reached[:, column], caution)
                tried[:, column] = best_set_points(task, responses[column], motion.allowed[column])
            (shown,) = arm.readings([tried])
            after = _cost(motion, shown)
            if after < cost:
                break
            caution *= 10.0
        else:
            break
        fall = 1.0 - after / cost if cost else 0.0
        now, reached, cost, caution = tried, shown, after, max(caution / 10.0, FIRST_CAUTION)
        responses = arm.responses(now)
        if fall < SETTLED:
            break
    return _with_rounding(arm, motion, now, responses)


def _with_rounding(arm: ArmInLoop, motion: Motion, smooth: Floats, responses: Sequence[Response]) -> Floats:
    """Returns rounded set points, corrected for the rounding of readings and powers.

    A drive of whole counts and stick-slip friction may hold a joint off the motion, or keep it oscillating. Their mean
    effect over draws of the noise is corrected, joint by joint, as long as the squared error falls.
    """
    shares = dict.fromkeys(motion.columns, 1.0)
    held = np.zeros(smooth.shape, dtype=np.bool_)
    found = rounded(motion, smooth, responses, held)
    costs = _costs(motion, arm.rounded_readings(found, DRAWS))
    for rest in _rests(motion):
        tried_held = held | rest
        tried = rounded(motion, smooth, responses, tried_held)
        after = _costs(motion, arm.rounded_readings(tried, DRAWS))
        for column in motion.columns:
            if after[column] < costs[column]:
                found[:, column], held[:, column] = tried[:, column], tried_held[:, column]
                costs[column] = after[column]
    shown = arm.rounded_readings(found, DRAWS)
    costs = _costs(motion, shown)
    for _ in range(MOST_CORRECTIONS):
        tried = found.copy()
        for column in [one for one, share in shares.items() if share >= LEAST_SHARE]:
            wanted, now, response = motion.wanted[:, column], found[:, column], responses[column]
            task = Task(wanted, wanted, now, shown[:, :, column].mean(axis=0), CAUTION)
            best = now + shares[column] * (best_set_points(task, response, motion.allowed[column]) - now)
            allowed, effective = motion.allowed[column], motion.effective[column]
            tried[:, column] = rounded_set_points(best, response, allowed, effective, held[:, column])
        if (tried == found).all():
            break
        after = _costs(motion, arm.rounded_readings(tried, DRAWS))
        for column in motion.columns:
            if after[column] < costs[column]:
                found[:, column] = tried[:, column]
            else:
                shares[column] /= 2
        shown = arm.rounded_readings(found, DRAWS)
        costs = _costs(motion, shown)
    return found


def _rests(motion: Motion) -> list[Mask]:
    """Returns stretches (k, n) in which joints are to rest: the first of each joint, then the second, and so on."""
    still = np.ones(motion.wanted.shape, dtype=np.bool_)
    still[1:] = np.abs(np.diff(motion.wanted, axis=0)) < AT_REST
    begins = still.copy()
    begins[1:] &= ~still[:-1]
    number = np.where(still, begins.cumsum(axis=0), 0)
    return [number == one for one in range(1, min(int(number.max()), MOST_RESTS) + 1)]


def _costs(motion: Motion, shown: Floats) -> Floats:
    """Returns (n,) the squared error of each joint over draws of readings (r, k, n)."""
    return np.asarray(np.square(motion.wanted - shown).sum(axis=(0, 1)))


def rounded(motion: Motion, set_points: Floats, responses: Sequence[Response], held: Mask | None = None) -> Floats:
    """Returns whole posture units (k, n) whose response is nearest to that of these set points."""
    found = np.floor(set_points + 0.5)
    for column in motion.columns:
        allowed, effective = motion.allowed[column], motion.effective[column]
        own = None if held is None else held[:, column]
        found[:, column] = rounded_set_points(set_points[:, column], responses[column], allowed, effective, own)
    return found


def _cost(motion: Motion, readings: Floats) -> float:
    return float(np.square((motion.wanted - readings)[:, motion.columns]).sum())


def _expected(arm: ArmInLoop, motion: Motion, set_points: Floats) -> dict[int, TrackingError]:
    """Returns tracking errors over draws of the sensor's noise."""
    shown = arm.rounded_readings(set_points, DRAWS)
    return errors_of(motion.joints, np.concatenate([motion.miss(one) for one in shown]))
