"""Plans and checks the motion of an experiment, to compare experiments before any is run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.safety.check_plan import check_plan
from daq.trajectories.planner import plan, start_angles


def motion_of(spec: ExperimentSpec, machine: Machine) -> NDArray[np.float64]:
    """Returns the set points (k, joints) of an experiment, rad, even if its plan is not allowed. Raises SpecError."""
    return plan(spec, machine, start_angles(spec, machine)).angles


def planned(spec: ExperimentSpec, machine: Machine) -> NDArray[np.float64]:
    """Returns the set points (k, joints) of an experiment, rad. Raises SpecError; SafetyError if the plan is not
    allowed."""
    motion = plan(spec, machine, start_angles(spec, machine))
    violations = check_plan(motion, machine, machine.limits)
    if violations:
        raise SafetyError(str(violations[0]))
    return motion.angles
