"""A simulated controller that is given part of what the recorded one has read."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.simulation.inputs import inputs_of, readings_on_grid
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.fitting import imagined
from tests.model.simulation.records import ramp_inputs


def test_with_all_of_the_record_the_recorded_drive_moves_the_model() -> None:
    arm = imagined.arm()
    record = imagined.trace(arm.with_effect("coulomb_friction", (2,), {"torque": 3.0}), seconds=4.0)
    # The record's arm reads and drives in whole counts: the controller here has to do the same to drive alike.
    closed = simulate(arm, record, Options(following=1.0))
    opened = simulate(arm, record, Options(loop="open"))
    assert np.array_equal(closed.drive, record.drive)
    assert np.abs(closed.position - opened.position).max() < 1e-12
    assert np.abs(closed.position - simulate(arm, record).position).max() > 0.01, "in closed loop it is another motion"


@pytest.mark.parametrize("following", [0.3, 0.8])
def test_a_model_that_is_the_arm_keeps_to_the_noise_of_one_reading(following: float) -> None:
    arm = imagined.arm()
    record = imagined.trace(arm, seconds=6.0)
    unit = np.array([arm.machine.calibration(j).rad_per_count for j in (1, 2, 3)])
    left = [
        np.std((record.position - simulate(arm, record, Options(quantise=False, following=share)).reading) / unit)
        for share in (0.0, following)
    ]
    reading = np.hypot(0.3, 12**-0.5)
    assert left[1] < left[0]
    assert left[1] < 1.0 + (1.0 - following) * 0.5 * reading, "what it is not given goes round the loop"


@pytest.mark.parametrize("following", [0.5, 0.8])
def test_a_constant_torque_shows_as_many_times_larger_as_the_loop_is_softer(following: float) -> None:
    """In a steady state the controller makes up for the torque by its reading's share of the error."""
    model = base_model(load_machine("ma2000"))
    inputs = ramp_inputs(model.machine, amplitude=0.0, duration=4.0)
    sagging = model.with_effect("spring_torque", (2,), {"stiffness": 4.0, "rest": 2.0})
    free = sagging.without_effect("spring_torque", (2,))
    frictionless = {f"joint{j}.load_dependent_friction.arm": 0.0 for j in (1, 2, 3)}
    arm, missing = sagging.with_values(frictionless), free.with_values(frictionless)
    shown = simulate(arm, inputs, Options(quantise=False))
    recorded = replace(inputs, readings=shown.reading)
    alone, led = (
        shown.reading[-1, 1] - simulate(missing, recorded, Options(quantise=False, following=share)).reading[-1, 1]
        for share in (0.0, following)
    )
    assert abs(alone) > 1e-4
    assert led / alone == pytest.approx(1.0 / (1.0 - following), rel=0.1)


def test_readings_lie_on_the_grid_and_gaps_stay_gaps() -> None:
    measured = np.array([[0.0], [1.0], [2.0], [6.0], [7.0]])
    found = readings_on_grid(measured, np.array([0.0, 1.0, 2.0, 6.0, 7.0]), 8)[:, 0]
    assert np.array_equal(found, [0.0, 1.0, 2.0, np.nan, np.nan, np.nan, 6.0, 7.0], equal_nan=True)
    between = readings_on_grid(measured[:3], np.array([0.0, 0.9, 1.8]), 2)[:, 0]
    assert between == pytest.approx([0.0, 1.0 + 1.0 / 9.0])


def test_where_nothing_was_read_the_simulation_is_left_to_itself() -> None:
    arm = imagined.arm()
    inputs = inputs_of(imagined.trace(arm, seconds=4.0), arm.machine)
    gap = replace(inputs, readings=np.full_like(inputs.readings, np.nan))
    alone, led = (simulate(arm, gap, Options(following=share)).position for share in (0.0, 0.8))
    assert np.array_equal(alone, led)
