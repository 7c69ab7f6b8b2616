"""The design check judges a step by its size, as the runner does; its margin is for the lag of smooth motions."""

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Ramp, Step
from daq.contracts.machine import load_machine
from daq.safety.planned import planned
from daq.trajectories.presets import PRESETS
from model.design.information import _falls_behind, check_followed, imagined_trace
from model.machine_model.model import base_model

MA2000 = load_machine("ma2000")
MODEL = base_model(MA2000)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_can_be_judged(name: str) -> None:
    check_followed(MODEL, imagined_trace(MODEL, PRESETS[name].spec, lambda spec: planned(spec, MA2000)))


def test_a_step_of_any_allowed_size_can_be_judged_and_a_ramp_that_leaves_the_arm_cannot() -> None:
    for size in (0.05, 0.09, 0.11, 0.13):
        spec = ExperimentSpec(trajectory=Step(amplitude=size), joints=(3,))
        check_followed(MODEL, imagined_trace(MODEL, spec, lambda one: planned(one, MA2000)))
    quick = ExperimentSpec(trajectory=Ramp(amplitude=0.8, duration=0.7), joints=(2,))
    with pytest.raises(SpecError, match=r"joint 2 would fall \d+ counts behind; set points pause at 127"):
        check_followed(MODEL, imagined_trace(MODEL, quick, lambda spec: planned(spec, MA2000)))


@pytest.mark.parametrize(
    ("error", "change", "behind"),
    [
        ([0, 114, 100, 80, 60, 5], [0, 114, 0, 0, 0, 0], None),  # a step, dying away
        ([5, 119, 100, 80, 60, 5], [0, 114, 0, 0, 0, 0], None),
        ([10, 124, 100, 60], [0, 114, 0, 0], 1),  # ten counts behind may be 17 on a slower arm
        ([0, 114, 100, 105, 60], [0, 114, 0, 0, 0], 3),  # grows again
        ([0, 30, 60, 80], [0, 20, 20, 20], 3),  # smooth: the margin holds
        ([0, 114, 70, 80], [0, 114, 0, 0], 3),  # had died away
    ],
)
def test_set_points_count_as_outrunning_the_arm_when_its_error_grows_beyond_the_limit(
    error: list[float], change: list[float], behind: int | None
) -> None:
    assert _falls_behind(np.array(error, float), np.array(change, float), 28.0, 127) == behind
