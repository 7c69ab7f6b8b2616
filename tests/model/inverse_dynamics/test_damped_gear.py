"""The damping of a gear that gives is found with its compliance, and the numbers of the file that have an effect."""

import numpy as np
import pytest

from model.discrepancy.inverse_dynamics.candidates import _has_effect
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs

STIFFNESS = 60.0


@pytest.mark.parametrize("damping", [0.15, 1.5])
def test_the_damping_of_a_gear_that_gives_fits_best_where_it_is(damping: float) -> None:
    """Twist follows torque late by compliance times damping: 2.5 and 25 ms."""
    trace = rigs.geared_trace(3, {"stiffness": STIFFNESS, "damping": damping}, 8.0)
    sound = base_model(rigs.geared_machine())
    model = sound.with_effect("joint_compliance", (1,), {"compliance": 1 / STIFFNESS})
    balance = TorqueBalance(model, recorded_motions([trace], model.machine, 12.0))
    (name,) = (p.name for p in model.parameters if p.effect == "joint_compliance" and p.part == "damping")

    def left(value: float) -> float:
        return float(np.sqrt(np.mean(np.concatenate(balance.residual({name: value})) ** 2)))

    tried = {factor * damping: left(factor * damping) for factor in (0.0, 0.3, 1.0, 3.0)}
    assert min(tried, key=lambda value: tried[value]) == damping, tried


def test_a_number_has_an_effect_of_the_library_where_that_does_the_same() -> None:
    motor = base_model(rigs.bench_machine())
    constant = motor.parameter("joint1.motor.torque_constant")
    assert _has_effect(motor, constant, lower=True), "a weakened magnet"
    assert not _has_effect(motor, constant, lower=False), "no effect makes a magnet stronger"
    assert not _has_effect(motor, motor.parameter("joint1.motor.rotor_inertia"), lower=True)
    arm = base_model(rigs.geared_machine())
    assert _has_effect(arm, arm.parameter("link1.centre_x"), lower=False), "a shifted centre of mass"
    assert not _has_effect(arm, arm.parameter("link1.centre_y"), lower=False)
