"""The noise floor of the time-domain form is what is left where the model is right."""

from dataclasses import replace

import numpy as np
import pytest

from model.validation.acceleration_model import expected_accelerations
from model.validation.measured_motion import smooth
from model.validation.noise_floor import noise_floor
from model.validation.time_domain import vary_in_time
from tests.model.validation.synthetic import arm, multisine_trace, swinging_trace

SEEDS = range(7001, 7042)
DRAWS = 12


def test_what_a_right_model_leaves_is_its_noise_floor() -> None:
    """The median over seeds that the floor was not drawn with, on every joint."""
    model, sizes = arm(), []
    first = swinging_trace(model, 4.0, SEEDS[0], held=True)
    floor, simulated = noise_floor(model, first, smooth(model, first))
    assert simulated
    for seed in SEEDS:
        seen = smooth(model, swinging_trace(model, 4.0, seed, held=True))
        left = np.where(seen.usable, seen.acceleration - expected_accelerations(model, seen.motion, ())[0], 0.0)
        sizes.append(np.sqrt((left**2).sum(axis=0) / seen.usable.sum(axis=0)))
    assert np.median(sizes, axis=0) / floor == pytest.approx(np.ones(3), abs=0.1)


def test_noise_of_the_readings_comes_through_as_the_formula_says() -> None:
    """Many readings of one motion without friction that turns: the spread of their residuals."""
    model = arm()
    model = model.with_values({p.name: 0.0 for p in model.parameters if p.effect == "load_dependent_friction"})
    trace = multisine_trace(model, 6.0, seed=3)
    rng, deviation = np.random.default_rng(9), 1.5 * np.pi / 4096 * np.hypot(0.3, 1 / np.sqrt(12))
    residuals = []
    for _ in range(DRAWS):
        noise = deviation * rng.standard_normal(trace.position.shape)
        seen = smooth(model, replace(trace, position=trace.position + noise), 0.05)
        residuals.append(seen.acceleration - expected_accelerations(model, seen.motion, ())[0])
    spread = np.array(residuals)[:, 20:-20].var(axis=0, ddof=1).mean(axis=0)
    assert np.sqrt(spread) == pytest.approx(seen.noise, rel=0.1)


def test_a_wrong_model_lies_above_its_noise_floor() -> None:
    model = arm()
    trace = multisine_trace(model.with_effect("coulomb_friction", (1,), {"torque": 2.0}), 6.0, 4)
    first, second, _ = vary_in_time(model, trace, ("load.mass",)).joints
    assert first.in_floors > 3
    assert second.in_floors < 1.5


def test_where_the_model_cannot_be_simulated_the_floor_is_that_of_the_readings_and_is_said_to_be() -> None:
    """A joint that its spring drives away faster than the motor can hold it, for as long as numbers last."""
    model, trace = arm(), multisine_trace(arm(), 60.0)
    model = model.with_effect("spring_torque", (1,), {"stiffness": -80.0})
    model = model.with_effect("weakened_magnet", (1,), {"loss": 0.95})
    seen = smooth(model, trace)
    floor, simulated = noise_floor(model, trace, seen)
    assert not simulated
    assert np.array_equal(floor, seen.noise)
    assert any("readings alone" in note for note in vary_in_time(model, trace, ("load.mass",)).notes)
