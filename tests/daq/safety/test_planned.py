"""Experiments that are compared before any is run are planned and checked like those that are run."""

import math

import numpy as np
import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.safety.planned import planned
from daq.trajectories.planner import plan, start_angles
from tests.daq.safety.arms import MA2000


def test_the_set_points_are_those_of_the_plan() -> None:
    spec = ExperimentSpec()
    assert np.array_equal(planned(spec, MA2000), plan(spec, MA2000, start_angles(spec, MA2000)).angles)


def test_an_experiment_outside_the_limits_is_refused_by_its_first_violation() -> None:
    with pytest.raises(SafetyError, match=r"joint \d: .*°/s .*allowed are up to"):
        planned(ExperimentSpec(trajectory=Ramp(amplitude=math.radians(40), duration=0.2)), MA2000)
