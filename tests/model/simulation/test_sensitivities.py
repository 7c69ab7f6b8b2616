"""Exact derivatives against wide finite differences of the same loop without rounding."""

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.machine_model.parameter import initial_position
from model.simulation.prepared import Options
from model.simulation.simulate import sensitivities, simulate
from tests.model.simulation.records import ramp_inputs

SMOOTH = Options(quantise=False, step=2.5e-4)

CASES = {
    "load.mass": 1e-3,
    "link3.length": 1e-4,
    "joint2.motor.back_emf_constant": 1e-5,
    "joint2.viscous_friction.coefficient": 1e-6,
    "joint3.load_dependent_friction.arm": 1e-4,
    "controller.delay": 2e-4,
}


@pytest.mark.parametrize("name", CASES)
def test_dual_numbers_give_the_slope_of_finite_differences(name: str) -> None:
    model = base_model(load_machine("ma2000"))
    inputs = ramp_inputs(model.machine)
    exact = sensitivities(model, inputs, [model.parameter(name)], SMOOTH).reading[0]
    value, width = model.parameter(name).value, CASES[name]
    ends = [simulate(model.with_values({name: value + w}), inputs, SMOOTH).reading for w in (-width, width)]
    difference = (ends[1] - ends[0]) / (2 * width)
    assert np.abs(exact).max() > 0
    assert np.abs(exact - difference).max() < 0.01 * np.abs(exact).max()


def test_effects_at_their_null_value_have_derivatives_too() -> None:
    model = base_model(load_machine("ma2000")).with_effect("spring_torque", (2,)).with_effect("input_delay", (3,))
    spring, delay = model.parameter("joint2.spring_torque.stiffness"), model.parameter("joint3.input_delay.time")
    inputs = ramp_inputs(model.machine)
    found = sensitivities(model, inputs, [spring, delay, initial_position(1)], SMOOTH)
    stiffer = simulate(model.with_values({spring.name: 0.05}), inputs, SMOOTH).reading
    slope = (stiffer - found.simulation.reading) / 0.05
    assert np.abs(found.reading[0] - slope).max() < 0.02 * np.abs(slope).max()
    assert np.abs(found.reading[1][:, 2]).max() > 10 * np.abs(found.reading[1][:, 0]).max()
    assert found.reading[2][0] == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize("general", [False, True], ids=["closed form", "recursive"])
def test_friction_under_gravity_has_its_derivative_where_there_is_none_yet(general: bool) -> None:
    """The term is left out at a share of zero; a dual part alone is enough to have it."""
    options = Options(quantise=False, step=2.5e-4, general=general)
    model = base_model(load_machine("ma2000")).with_effect("gravity_torque_friction", (2, 3))
    shares = [model.parameter(f"joint{j}.gravity_torque_friction.share") for j in (2, 3)]
    inputs = ramp_inputs(model.machine)
    found = sensitivities(model, inputs, shares, options)
    for share, slope in zip(shares, found.reading, strict=True):
        more = simulate(model.with_values({share.name: 1e-4}), inputs, options).reading
        difference = (more - found.simulation.reading) / 1e-4
        assert np.abs(slope).max() > 1e-3
        assert np.abs(slope - difference).max() < 0.02 * np.abs(slope).max()
