"""The planned and checked motion of an experiment, for programs that compare experiments before any is run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.safety.check_plan import check_plan
from daq.trajectories.planner import plan, start_angles


def motion_of(spec: ExperimentSpec, machine: Machine) -> NDArray[np.float64]:
    """Set points (k, joints) of an experiment, rad, whether or not it may be carried out. Raises SpecError."""
    return plan(spec, machine, start_angles(spec, machine)).angles


def planned(spec: ExperimentSpec, machine: Machine) -> NDArray[np.float64]:
    """Set points (k, joints) of an experiment, rad. Raises SpecError, SafetyError where it may not be carried out."""
    motion = plan(spec, machine, start_angles(spec, machine))
    violations = check_plan(motion, machine, machine.limits)
    if violations:
        raise SafetyError(str(violations[0]))
    return motion.angles
