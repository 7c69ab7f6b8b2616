"""What may differ between sound arms."""

from random import Random

import numpy as np
import pytest

from daq.contracts.machine import DcMotor, Machine, load_machine
from mock_controller.board import default_board
from mock_controller.board.sensor import LinearityCurve
from mock_controller.hidden.tolerances import (
    HARMONICS,
    deviating_board,
    deviating_plant,
    draw_deviations,
    harmonic_deviation,
    tolerances,
)
from mock_controller.plant import default_plant


def stated_by(machine: Machine) -> dict[str, float]:
    """Deviations that the machine file states, as fractions of its values (delay: s)."""
    found = {}

    def take(name: str, quantity: object, relative: bool = True) -> None:
        deviation, value = getattr(quantity, "deviation", None), getattr(quantity, "value", 0.0)
        if deviation is not None:
            found[name] = deviation / value if relative else deviation

    take("m_load", machine.load)
    take("computing_delay", machine.controller.delay, relative=False)  # type: ignore[union-attr]
    for number, joint in enumerate(machine.joints[:3], start=1):
        take(f"m{number}", joint.link.mass)
        take("r1" if number == 1 else f"a{number}", joint.link.radius if number == 1 else joint.geometry.a)  # type: ignore[union-attr]
        assert isinstance(joint.drive, DcMotor)
        for key in ("resistance", "torque_constant", "back_emf_constant", "rotor_inertia"):
            take(f"{key}_{number}", getattr(joint.drive, key))
        take(f"viscous_friction_{number}", joint.friction.viscous_motor_side)
        take(f"coulomb_arm_{number}", joint.friction.coulomb_arm)
    return found


def test_what_is_stated_is_what_the_machine_file_states() -> None:
    ours = {tolerance.name: tolerance.stated for tolerance in tolerances()}
    assert ours == pytest.approx(stated_by(load_machine("ma2000")), rel=0.06)


def test_arms_are_drawn_within_what_is_stated() -> None:
    assert all(0 < tolerance.drawn <= tolerance.stated for tolerance in tolerances())
    draws = [draw_deviations(Random(seed)) for seed in range(400)]
    for tolerance in tolerances():
        values = np.array([draw[tolerance.name] for draw in draws])
        assert np.abs(values).max() <= 2 * tolerance.drawn
        # A normal deviate within two standard deviations has one of 0.88.
        assert values.std() == pytest.approx(0.88 * tolerance.drawn, rel=0.15)
        assert abs(values.mean()) < 0.2 * tolerance.drawn


def test_no_deviations_are_the_very_same_numbers() -> None:
    nothing = dict.fromkeys((tolerance.name for tolerance in tolerances()), 0.0)
    assert deviating_plant(default_plant(), nothing) == default_plant()
    assert deviating_board(default_board(), nothing) == default_board()
    assert draw_deviations(Random(1), scale=0.0) == nothing


@pytest.mark.parametrize("tolerance", tolerances(), ids=lambda tolerance: tolerance.name)
def test_every_deviation_moves_the_constant_it_is_named_after(tolerance: object) -> None:
    name = tolerance.name  # type: ignore[attr-defined]
    plant, board = deviating_plant(default_plant(), {name: 0.1}), deviating_board(default_board(), {name: 2e-3})
    before = default_plant()
    if name == "computing_delay":
        assert board.timing.computing_delay == default_board().timing.computing_delay + 2000
        return
    assert board == default_board()
    key, _, joint = name.rpartition("_")
    if key == "coulomb_arm":
        arms = [0.0, 0.0, 0.0]
        arms[int(joint) - 1] = 0.1 * before.friction.effective_arm
        assert plant.friction.extra_arms == pytest.approx(tuple(arms))
        assert (plant.rigid_body, plant.joints) == (before.rigid_body, before.joints)
    elif joint.isdigit():
        number = int(joint) - 1
        assert getattr(plant.joints[number], key) == pytest.approx(1.1 * getattr(before.joints[number], key))
        assert [a == b for a, b in zip(plant.joints, before.joints, strict=True)] == [k != number for k in range(6)]
    else:
        assert getattr(plant.rigid_body, name) == pytest.approx(1.1 * getattr(before.rigid_body, name))
        assert plant.joints == before.joints


def test_harmonics_have_the_size_of_those_in_the_potentiometers_curves() -> None:
    limit = 0.0025 * 4096
    curves = [LinearityCurve(Random(seed), limit) for seed in range(300)]
    shares = np.fft.rfft([[curve.at(64.0 * cell) for cell in range(64)] for curve in curves], axis=1) / 32
    for harmonic in HARMONICS:
        both = np.concatenate([shares[:, harmonic].real, shares[:, harmonic].imag])
        spread = float(both.std())
        assert spread == pytest.approx(harmonic_deviation(0.0025, harmonic), rel=0.15)
