"""Where a record begins in motion, from readings alone; and where it does not, whatever moves it then."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.machine import Machine, NoController, load_machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import base_model
from model.simulation.inputs import inputs_of
from model.simulation.simulate import simulate
from model.simulation.start_speed import speed_at_start
from tests.model.imported import imported

AXIS = load_machine(str(Path(__file__).parents[3] / "examples" / "single_axis.toml"))
DRIVEN = AXIS.model_copy(update={"controller": NoController(kind="none")})
COUNT = 2 * np.pi / 2**14
PERIOD = 0.005


def trace_of(position: Floats, drive: Floats | None = None) -> Trace:
    record = imported(period=PERIOD)
    drive = np.zeros(len(position)) if drive is None else drive
    time = PERIOD * np.arange(len(position))
    return Trace(record, (1,), time, position[:, None], drive=drive[:, None])


def read(position: Floats, seed: int = 1) -> Floats:
    noise = 0.5 * COUNT * np.random.default_rng(seed).standard_normal(len(position))
    return np.asarray(np.round((position + noise) / COUNT) * COUNT)


TIME = PERIOD * np.arange(400)


@pytest.mark.parametrize("rate", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("seed", range(5))
def test_a_motion_that_the_record_begins_in_is_told(rate: float, seed: int) -> None:
    swing = 0.5 * np.sin(2 * np.pi * rate * TIME + 0.3)
    truth = 0.5 * 2 * np.pi * rate * np.cos(0.3)
    (speed,) = speed_at_start(trace_of(read(swing, seed)), DRIVEN)
    assert speed == pytest.approx(truth, rel=0.15)


@pytest.mark.parametrize("seed", range(20))
def test_a_record_that_begins_at_rest_begins_at_rest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    still = np.zeros(400)
    swing = 0.5 * (1 - np.cos(2 * np.pi * rng.uniform(0.3, 2.5) * TIME))
    pushed = 0.5 * (1 - np.exp(-TIME / 0.03) * (1 + TIME / 0.03))  # a fast servo's step at the first sample
    accelerated = 20.0 * np.minimum(TIME, 0.05) ** 2
    for motion in (still, swing, pushed, accelerated):
        assert speed_at_start(trace_of(read(motion, seed)), DRIVEN) == [0.0]


def test_what_a_controller_leads_begins_at_rest_and_what_a_tachometer_says_is_believed() -> None:
    moving = trace_of(0.5 * np.sin(6.0 * TIME))
    assert inputs_of(moving, DRIVEN).initial[0, 1] == pytest.approx(3.0, rel=0.05)
    led = replace(moving, set_point=moving.position.copy())
    assert inputs_of(led, AXIS).initial[0, 1] == 0.0
    told = replace(moving, velocity=np.full((400, 1), 2.0))
    assert inputs_of(told, DRIVEN).initial[0, 1] == 2.0


def test_a_swing_that_nothing_drives_is_simulated_from_its_own_speed() -> None:
    """A record that the model itself made, cut where it moves: the rest of it follows."""
    free = free_swing(DRIVEN)
    begin = int(np.abs(np.diff(free)).argmax())
    cut = free[begin : begin + 100]
    error = simulate(base_model(DRIVEN), trace_of(cut)).position[:, 0] - cut
    assert np.abs(error).max() < 0.02 * np.ptp(cut)


def free_swing(machine: Machine) -> Floats:
    still = trace_of(np.full(500, 0.8))
    return np.asarray(simulate(base_model(machine), still).position[:, 0])
