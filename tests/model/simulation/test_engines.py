"""The compiled runs: each other's equals, deterministic, convergent."""

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.machine_model.model import Model, base_model
from model.simulation.prepared import Options
from model.simulation.simulate import parameter_vectors, simulate, simulate_many
from tests.model.simulation.records import ramp_inputs

COUNT = 2 * np.pi * 0.75 / 4096


@pytest.fixture(scope="module")
def model() -> Model:
    return base_model(load_machine("ma2000"))


def loaded(model: Model) -> Model:
    """A model with an effect of every kind that acts on rigid joints."""
    return (
        model.with_effect("coulomb_friction", (1, 2), {"torque": 0.4})
        .with_effect("stribeck_friction", (3,), {"torque": 0.5})
        .with_effect("stiction", (1,), {"breakaway": 0.6})
        .with_effect("base_tilt", values={"about_x": 0.05, "about_y": -0.03})
        .with_effect("motor_inductance", (2,), {"inductance": 0.01})
        .with_effect("gear_loss", (2,), {"loss": 0.1})
        .with_effect("torque_ripple", (1,), {"sine": 0.5})
        .with_effect("input_delay", (3,), {"time": 0.0055})
        .with_effect("centre_of_mass", (2,), {"shift": 0.02})
        .with_effect("payload", values={"mass": 0.2})
    )


def test_closed_form_and_recursive_runs_agree_with_every_effect(model: Model) -> None:
    inputs = ramp_inputs(model.machine, back=True)
    fast = simulate(loaded(model), inputs, Options(quantise=False))
    general = simulate(loaded(model), inputs, Options(quantise=False, general=True))
    assert np.abs(fast.position - general.position).max() < 1e-10
    assert np.ptp(fast.position, axis=0).min() > 0.3


def test_flexible_closed_form_and_recursive_runs_agree(model: Model) -> None:
    inputs = ramp_inputs(model.machine, back=True)
    flexible = model.with_effect("backlash", (3,), {"gap": 0.02}).with_effect(
        "joint_compliance", (1,), {"compliance": 1e-3}
    )
    fast = simulate(flexible, inputs, Options(quantise=False))
    general = simulate(flexible, inputs, Options(quantise=False, general=True))
    assert np.abs(fast.position - general.position).max() < 1e-9
    assert np.abs(fast.position - simulate(model, inputs, Options(quantise=False)).position).max() > COUNT


def test_steps_of_one_millisecond_follow_the_arm_as_its_machine_file_has_it(model: Model) -> None:
    inputs = ramp_inputs(model.machine)
    exact = simulate(model, inputs, Options(quantise=False, step=1e-3 / 16)).position
    error = np.abs(simulate(model, inputs, Options(quantise=False)).position - exact).max()
    assert error < 1e-3 * COUNT
    assert np.abs(simulate(model, inputs, Options(quantise=False, step=4e-3)).position - exact).max() > 5 * error


def test_runs_repeat_to_the_bit_and_do_not_depend_on_their_neighbours(model: Model) -> None:
    inputs = ramp_inputs(model.machine)
    once = simulate(model, inputs)
    vectors = parameter_vectors(model, ["load.mass"], np.linspace(1.0, 1.5, 9)[:, None])
    vectors[4] = model.vector
    (many,) = simulate_many(model, [inputs], vectors)
    assert np.array_equal(many[4, 0], once.position)
    assert np.array_equal(simulate(model, inputs).power, once.power)
    assert not np.array_equal(many[0, 0], many[8, 0])


def test_traces_of_different_length_run_together(model: Model) -> None:
    short, long = ramp_inputs(model.machine, duration=1.0), ramp_inputs(model.machine, back=True)
    first, second = simulate_many(model, [short, long], model.vector[None])
    assert np.array_equal(first[0, 0], simulate(model, short).position)
    assert np.array_equal(second[0, 0], simulate(model, long).position)
