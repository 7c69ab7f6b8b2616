"""A motion that an arm shall follow, and the experiment with the computed set points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Feedforward, Gain, Path
from daq.contracts.machine import BoardPid, Machine, NoController
from daq.contracts.trace import Floats
from extras.motion.posture_units import Allowed, Scale, allowed_postures, effective_postures, scale_of
from extras.motion.response import REACH

Planner = Callable[[ExperimentSpec], Floats]
"""Computes the set points (k, joints of the machine) of an experiment in rad, one row per control period.

It raises a DaqError of one line for an experiment that the machine's limits do not allow. The caller supplies it, since
planning belongs to `daq`.
"""

LONGEST = 600.0
"""Longest motion (s) for which set points are computed: the runs that estimate its response fill 250 MB."""
DIGITS = 9
"""Decimals of the times and angles of a computed path: far more than a posture unit needs, and half the file size."""


@dataclass(frozen=True)
class Motion:
    """A planned motion on a machine.

    planned: (k, joints of the machine) rad. wanted: (k, n) posture units of the modelled joints, not rounded. columns:
    of the modelled joints that the experiment moves. allowed: set points of each modelled joint within its limits.
    effective: for each, the value of a posture unit for the controller.
    """

    asked: ExperimentSpec
    machine: Machine
    period: float
    planned: Floats
    wanted: Floats
    scale: Scale
    columns: tuple[int, ...]
    allowed: tuple[Allowed, ...]
    effective: tuple[Floats, ...]

    def __len__(self) -> int:
        return len(self.planned)

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints whose set points are computed."""
        return tuple(self.machine.modelled_joints[column] for column in self.columns)

    def miss(self, readings: Floats) -> Floats:
        """Returns wanted − read (k, j) of those joints in rad, for readings (k, n) in posture units."""
        return np.asarray((self.wanted - readings)[:, self.columns] * self.scale.unit[list(self.columns)])


def motion_of(asked: ExperimentSpec, machine: Machine, plan: Planner) -> Motion:
    """Returns the motion of an experiment with plain set points.

    Raises SpecError for an experiment with computed set points, without modelled joints, or too long, and for a machine
    that takes no set points; otherwise as the planner does.
    """
    if asked.feedforward is not None:
        raise SpecError("the experiment's set points are already computed: name the original experiment")
    if isinstance(machine.controller, NoController):
        raise SpecError(f"machine {machine.name} has no controller that takes set points")
    modelled, period = machine.modelled_joints, machine.controller.period.value
    columns = tuple(column for column, joint in enumerate(modelled) if joint in asked.joints)
    if not columns:
        names = ", ".join(map(str, modelled))
        raise SpecError(
            f"joints {list(asked.joints)}: set points are computed only for joints {names} of {machine.name}"
        )
    planned = np.asarray(plan(asked), dtype=np.float64)
    if len(planned) * period > LONGEST:
        raise SpecError(f"a motion of {len(planned) * period:.0f} s: set points are computed for at most {LONGEST:g} s")
    scale = scale_of(machine, modelled)
    return Motion(
        asked,
        machine,
        period,
        planned,
        scale.postures(planned[:, [joint - 1 for joint in modelled]]),
        scale,
        columns,
        tuple(allowed_postures(machine, joint, period) for joint in modelled),
        tuple(effective_postures(machine, joint) for joint in modelled),
    )


def and_rest(signal: Floats) -> Floats:
    """Extends a signal (k, n) by its last value for REACH periods."""
    return np.pad(signal, ((0, REACH), (0, 0)), mode="edge")


def with_rest(motion: Motion) -> Motion:
    """Returns the motion with a rest after its end.

    Without one, the optimisation would ignore the later effect of the last set points.
    """
    return replace(motion, planned=and_rest(motion.planned), wanted=and_rest(motion.wanted))


def gains_for(motion: Motion, present: Mapping[int, Gain] | None) -> dict[int, Gain]:
    """Returns P, I and D of the joints whose set points are computed: those of the motion, else `present` ones, else
    the machine's."""
    controller = motion.machine.controller
    if not isinstance(controller, BoardPid):
        return {}
    own = {joint: controller.gains[joint - 1] for joint in motion.joints}
    known = {**own, **(present or {}), **motion.asked.gains}
    return {joint: known[joint] for joint in motion.joints}


def computed_experiment(
    motion: Motion, set_points: Floats, gains: Mapping[int, Gain], feedforward: Feedforward
) -> ExperimentSpec:
    """Returns the experiment that sends these set points (k, n), whole posture units of the modelled joints.

    The path includes rests and repeats. Joints that are not modelled keep the set points of the motion itself.

    Args:
        gains: those for which the set points were computed.
    """
    asked = motion.asked
    angles = motion.planned.copy()
    own = motion.scale.angles(set_points)
    for column in motion.columns:
        angles[:, motion.machine.modelled_joints[column] - 1] = own[:, column]
    rows = np.round(angles[:, [joint - 1 for joint in asked.joints]], DIGITS)
    times = np.round(motion.period * np.arange(len(angles)), DIGITS)
    path = Path(times=tuple(times.tolist()), positions=tuple(map(tuple, rows.tolist())))
    return asked.model_copy(
        update={
            "trajectory": path,
            "gains": {**asked.gains, **gains},
            "settle": 0.0,
            "hold": 0.0,
            "repeats": 1,
            "feedforward": feedforward,
        }
    )
