"""Set points with which a model of the arm follows a motion: its closed loop inverted by simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Feedforward
from daq.contracts.machine import Machine
from daq.contracts.progress import Progress, silent
from model.arrays import Floats
from model.feedforward.arm_in_loop import ArmInLoop, arm_in_loop
from model.feedforward.best_set_points import Task, best_set_points, rounded_set_points
from model.feedforward.motion import Motion, Planner, computed_experiment, gains_for, motion_of
from model.feedforward.response import Response
from model.feedforward.tracking import errors_of
from model.machine_model.model import Model

MOST_STEPS = 12
"""Most Gauss–Newton steps."""
SETTLED = 0.01
"""Relative fall of the squared error below which another step is not worth its time."""
FIRST_CAUTION = 1e-3
"""Weight at first of a set point's squared change in a step, beside the squared error."""
LARGEST_CAUTION = 10.0
"""Weight at which a step is given up: it would change next to nothing."""
NOISE_SEED = 1
"""Seed of the sensor's noise in the run that gives the expected error."""


def feedforward(
    model: Model, asked: ExperimentSpec, machine: Machine, plan: Planner, progress: Progress = silent
) -> ExperimentSpec:
    """The experiment whose set points make the arm follow the motion of `asked`, as the model knows the arm.

    The arm is to be where that motion is at each period, without delay; where drive or limits do not allow that, the
    squared error is least. Set points are found by Gauss–Newton steps on the simulated closed loop, then rounded.

    Args:
        machine: the machine that will carry it out; its limits hold.

    Raises SpecError for a model of another machine, and for an experiment that no set points can be computed for; as
    the planner does.
    """
    require_same(model, machine)
    motion = motion_of(asked, machine, plan)
    gains = gains_for(motion, None)
    arm = arm_in_loop(model, motion.wanted[0], len(motion), gains)
    found = inverted(arm, motion, progress)
    expected, before = (errors_of(motion.joints, motion.miss(_shown(arm, one))) for one in (found, motion.wanted))
    source = Feedforward(asked=asked.as_asked, model=model.identity, expected=expected, before=before)
    return computed_experiment(motion, found, gains, source)


def require_same(model: Model, machine: Machine) -> None:
    """Raises SpecError for a model of another machine: of another name, or whose set points or readings mean something
    else. Masses and lengths may differ, since a fit finds them, and so may a load."""
    own = model.machine
    if own.name != machine.name:
        raise SpecError(f"the model {model.identity} is of {own.name}, the experiment is for {machine.name}")
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
    """Whole posture units (k, n) of the modelled joints with which the simulated arm follows the motion."""
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
    return rounded(motion, now, responses)


def rounded(motion: Motion, set_points: Floats, responses: Sequence[Response]) -> Floats:
    """Whole posture units (k, n) whose response is nearest to that of these set points."""
    found = np.floor(set_points + 0.5)
    for column in motion.columns:
        allowed, effective = motion.allowed[column], motion.effective[column]
        found[:, column] = rounded_set_points(set_points[:, column], responses[column], allowed, effective)
    return found


def _cost(motion: Motion, readings: Floats) -> float:
    return float(np.square((motion.wanted - readings)[:, motion.columns]).sum())


def _shown(arm: ArmInLoop, set_points: Floats) -> Floats:
    """Readings (k, n) as the board would make them, with the noise that the machine file states."""
    machine = arm.model.machine
    sensors = [machine.joint(joint).sensor for joint in machine.modelled_joints]
    counts = np.array([s.noise.value if s is not None and s.noise is not None else 0.0 for s in sensors])
    noise = counts * np.random.default_rng(NOISE_SEED).standard_normal(set_points.shape)
    return arm.rounded_readings(set_points, noise)
