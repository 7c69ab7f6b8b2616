"""The mock moves as the model does with the mock's parameters translated, and not with others: signs, sides, scales."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from daq.contracts.effects import effect_names
from daq.contracts.machine import load_machine
from mock_controller.board import default_board
from mock_controller.hidden.experiment import Experiment, LoopParts, readings
from mock_controller.modifications import build_modifications
from mock_controller.plant import default_plant
from model.machine_model.model import Model, base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from model.trial.conventions import LEFT_OUT, TRANSLATIONS, true_parameters
from model.trial.truth import HiddenEffect, Truth
from tests.model.simulation.records import trace_of

MACHINE = load_machine("ma2000")
SOUND = base_model(MACHINE)

SIZES: dict[str, tuple[int | None, dict[str, float]]] = {
    "viscous_friction": (2, {"coefficient": 80.0}),
    "quadratic_drag": (2, {"coefficient": 20.0}),
    "coulomb_friction": (3, {"torque": 1.8}),
    "load_dependent_friction": (2, {"arm": 0.6}),
    "gravity_torque_friction": (2, {"share": 0.4}),
    "stribeck_friction": (1, {"torque": 5.0, "speed": 0.2}),
    "direction_dependent_friction": (3, {"torque": -3.0}),
    "direction_dependent_viscous_friction": (2, {"coefficient": -80.0}),
    "weakened_magnet": (2, {"loss": 0.3}),
    "motor_inductance": (3, {"inductance": 0.03}),
    "dead_zone": (1, {"width": 2.0}),
    "amplifier_threshold": (2, {"width": 4.0}),
    "supply_limit": (2, {"reduction": 12.0}),
    "torque_ripple": (3, {"amplitude": 0.9, "periods": 20.0, "phase": 0.0}),
    "gear_loss": (2, {"loss": 0.4}),
    "direction_dependent_gear_loss": (3, {"difference": 0.4}),
    "backlash": (2, {"play": 0.03, "stiffness": 2e4, "damping": 10.0}),
    "joint_compliance": (2, {"compliance": 1.5e-3, "damping": 4.0}),
    "link_mass": (3, {"mass": 1.5}),
    "centre_of_mass": (2, {"shift": 0.1}),
    "base_tilt": (None, {"about_x": 0.1, "about_y": 0.15}),
    "spring_torque": (2, {"stiffness": 20.0, "neutral": 0.79}),
    "constant_torque": (2, {"torque": 5.0}),
    "one_sided_spring": (2, {"stiffness": -20.0, "slack": 0.79}),
    "periodic_disturbance": (3, {"amplitude": 1.2, "frequency": 2.5, "phase": 0.0}),
    "potentiometer_gain": (3, {"error": -0.1}),
    "potentiometer_offset": (2, {"angle": 0.15}),
    "input_delay": (1, {"delay": 0.012}),
    "wrong_gain": (2, {"factor": 0.7}),
    "lost_set_points": (1, {"share": 0.4, "seed": 3}),
}
"""A joint and a strong size of every effect that has a translation."""
SHAPES = {
    "torque_ripple": lambda v: {"sine": v["amplitude"], "cosine": 0.0},
    "periodic_disturbance": lambda v: {"sine": v["amplitude"], "cosine": 0.0},
}
"""Parameters that no interval is counted for, needed to simulate; phases are zero here."""
DECIDES = {
    "stribeck_friction": "torque",
    "torque_ripple": "cycles",
    "spring_torque": "stiffness",
    "one_sided_spring": "stiffness",
}
"""The parameter that is varied, where there are several."""


@cache
def experiment() -> Experiment:
    """9 s of fast and slow moves, no settling: both arms begin at rest at the first set points."""
    rows = [np.array((500.0, 333.0, 500.0))] * 20
    for move, periods in (
        ((80, 80, -80), 33),
        ((0, 0, 0), 20),
        ((-80, -80, 80), 33),
        ((0, 0, 0), 20),
        ((12, 10, 14), 60),
        ((-12, -10, -14), 60),
        ((0, 0, 0), 10),
        ((60, 60, 60), 12),
        ((0, 0, 0), 30),
        ((-90, -60, -90), 25),
        ((0, 0, 0), 20),
        ((30, 120, 30), 60),
        ((0, 0, 0), 40),
    ):
        last = rows[-1]
        rows += [last + np.array(move) * k / periods for k in range(1, periods + 1)]
    return Experiment(tuple((*(round(v) for v in row), 500, 500, 500) for row in rows), settle=0)


@cache
def mock_moves(name: str | None) -> np.ndarray:
    """Readings (rad, periods × 3) of the mock's arm of the data files with an effect."""
    effects = ()
    if name is not None:
        joint, values = SIZES[name]
        effects = build_modifications([(name, values if joint is None else {"joint": joint, **values})])
    board = replace(default_board(), linearity=0.0, noise=0.0)
    counts = readings(LoopParts(default_plant(), board, effects, 0), experiment())[:, :3]
    own = [MACHINE.calibration(joint) for joint in (1, 2, 3)]
    return np.stack([c.angle_at_zero_rad + counts[:, k] * c.rad_per_count for k, c in enumerate(own)], axis=1)


def model_moves(model: Model) -> np.ndarray:
    own = [MACHINE.calibration(joint) for joint in (1, 2, 3)]
    wanted = np.array(
        [[c.posture_to_rad(posture) for c, posture in zip(own, row, strict=False)] for row in experiment().set_points]
    )
    start = np.stack([wanted[0], np.zeros(3)], axis=1)
    return simulate(model, trace_of(wanted), Options(quantise=False, initial=start)).reading


def with_effect(name: str, share: float = 1.0) -> Model:
    """The model with the effect as translated, what decides it moved to `share` of its distance from absent."""
    joint, values = SIZES[name]
    hidden = HiddenEffect(
        effect=name, known_as=name, joints=(joint,) if joint else (), parameters=(values,), strength=1
    )
    names = [f"{kind}_{j}" for kind in ("viscous_friction", "coulomb_arm") for j in (1, 2, 3)]
    truth = Truth(
        seed=0, kind="single", load="nominal", load_kg=None, effects=(hidden,), deviations=dict.fromkeys(names, 0.0)
    )
    found = true_parameters(hidden, joint, truth, MACHINE)
    found.update(SHAPES.get(name, lambda _: {})(values))
    present = any(use.name == name for use in SOUND.effects)
    model = SOUND if present else SOUND.with_effect(name, (joint,) if joint else ())
    own = {p.name.rpartition(".")[2]: p for p in model.parameters if p.effect == name and joint in (None, *p.joints)}
    decides = DECIDES.get(name, next(iter(found)))
    null = own[decides].null
    absent = own[decides].value if present else (null if null is not None else 0.0)
    found[decides] = absent + share * (found[decides] - absent)
    return model.with_values({own[last].name: value for last, value in found.items()})


@cache
def sound_moves() -> np.ndarray:
    return model_moves(SOUND)


def apart(name: str, model: Model) -> float:
    """How far what the effect changes in the model is from what it changes in the mock, whose noise is the same."""
    in_mock, in_model = mock_moves(name) - mock_moves(None), model_moves(model) - sound_moves()
    return float(np.sqrt(np.mean((in_mock - in_model) ** 2)))


def test_every_effect_is_translated_or_left_out_with_a_reason() -> None:
    assert set(TRANSLATIONS) | {key for key in LEFT_OUT if ":" not in key} == set(effect_names())
    assert not set(TRANSLATIONS) & set(LEFT_OUT)
    assert set(SIZES) == set(TRANSLATIONS)


def test_lost_set_points_are_the_model_s_on_average() -> None:
    assert apart("lost_set_points", with_effect("lost_set_points")) < 0.9 * apart("lost_set_points", SOUND)


@pytest.mark.parametrize("name", [name for name in SIZES if name != "lost_set_points"])
def test_the_translated_effect_moves_the_model_as_it_moves_the_mock(name: str) -> None:
    right, absent = apart(name, with_effect(name)), apart(name, SOUND)
    assert right < 0.6 * absent
    assert right < apart(name, with_effect(name, 0.7))
    assert right < apart(name, with_effect(name, 1.3))
