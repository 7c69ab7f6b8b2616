"""What models make of the records of a bench of servos. The bench's plant shares no code with them."""

import math
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.experiment import ExperimentSpec, Multisine
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from mock_controller.servos.bench import Options
from model.arrays import Floats
from model.machine_model.model import Model, base_model
from model.simulation.inputs import inputs_of
from model.simulation.simulate import simulate
from tests.daq.servo_bench import PAN_TILT, pan_tilt, recorded

KNOWN = PAN_TILT.with_name("pan_tilt_known.toml")

COUNT = math.tau / 4096


def motion(seed: int, duration: float = 8.0, share: float = 1.0) -> ExperimentSpec:
    amplitude: dict[int, float] = {1: 0.3 * share, 2: 0.2 * share}
    trajectory = Multisine(amplitude=amplitude, duration=duration, lowest=0.2, highest=1.5, tones=8, seed=seed)
    return ExperimentSpec(trajectory=trajectory, joints=(1, 2), settle=0.3, hold=0.3)


def left(model: Model, trace: Trace) -> Floats:
    """Rms distance (counts) of the simulated positions from the recorded ones, by joint."""
    simulation = simulate(model, trace)
    apart = (simulation.at_samples(simulation.position) - trace.position) / COUNT
    return np.asarray(np.sqrt(np.mean(apart**2, axis=0)))


def test_a_record_is_an_input_for_each_tick_of_the_servos_loop(tmp_path: Path) -> None:
    trace = recorded(Options(torque=True), motion(1, 0.5, 0.1), tmp_path)
    inputs = inputs_of(trace, pan_tilt())
    assert inputs.period == 0.001
    assert len(inputs) == 20 * (len(trace) - 1) + 1
    assert not inputs.drive_of_every_period


def test_the_simulation_is_neither_ahead_of_the_record_nor_behind_it(tmp_path: Path) -> None:
    trace = recorded(Options(torque=True), motion(1), tmp_path)
    simulation = simulate(base_model(load_machine(str(KNOWN))), trace)
    apart = simulation.at_samples(simulation.reading) - trace.position
    speed = simulation.at_samples(simulation.velocity)
    lead = np.sum(apart * speed, axis=0) / np.sum(speed**2, axis=0)
    assert np.abs(lead).max() < 2e-4  # s; a label one tick beside the truth is 1e-3
    assert np.sqrt(np.mean(apart**2, axis=0)).max() < 0.45 * COUNT


@pytest.mark.slow
def test_the_model_with_the_numbers_of_the_data_sheet_comes_within_a_degree(tmp_path: Path) -> None:
    assert left(base_model(pan_tilt()), recorded(Options(torque=True), motion(1), tmp_path)).max() < 10
