"""The machine that the tests of trajectories plan for."""

import numpy as np

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.set_points import Plan

MA2000 = load_machine("ma2000")
PERIOD = 0.02
UNIT = 1.5 * np.pi / 1000
"""One posture unit of a major axis in rad."""


def planned(**fields: object) -> Plan:
    """The plan of an experiment from its own start."""
    spec = ExperimentSpec.model_validate(fields)
    return plan(spec, MA2000, start_angles(spec, MA2000))


def motion(**fields: object) -> Plan:
    """The same without settle and hold."""
    return planned(settle=0, hold=0, **fields)
