"""Control laws on the arm in continuous time."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from extras.thesis.closed_loop import ClassicalPid, Partitioned, Sinusoid, control
from extras.thesis.driven_arm import DrivenArm, equation_of_motion
from extras.thesis.tables import VISCOUS_AND_COULOMB
from model.dynamics import recursive

START = (np.pi, np.pi / 4, 0.0)
STILL = Sinusoid(START, (0.0, 0.0, 0.0), 3.0, (0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def plant() -> DrivenArm:
    return VISCOUS_AND_COULOMB.arm(published_inertia=False)


def test_the_equation_of_motion_is_that_of_the_recursive_dynamics(plant: DrivenArm) -> None:
    bare = replace(plant.without_friction(), back_emf=(0.0, 0.0, 0.0))
    chain = plant.body.chain().arrays()
    rng = np.random.default_rng(2)
    q, v = rng.uniform(-2, 2, 3), rng.normal(size=3)
    d, rest = equation_of_motion(q, v, bare.vector())
    np.testing.assert_allclose(d, recursive.mass_matrix(chain, q)[np.triu_indices(3)], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(
        rest, recursive.velocity_torques(chain, q, v) + recursive.gravity_torques(chain, q), rtol=1e-9, atol=1e-10
    )


def test_friction_and_back_emf_oppose_motion(plant: DrivenArm) -> None:
    q, v = np.array(START), np.array([1.0, -2.0, 0.5])
    with_all = equation_of_motion(q, v, plant.vector())[1]
    without = equation_of_motion(q, v, replace(plant.without_friction(), back_emf=(0.0, 0.0, 0.0)).vector())[1]
    assert ((with_all - without) * np.sign(v) > 0).all()
    emf = plant.gear[0] ** 2 * plant.torque_constant[0] * plant.back_emf[0] / plant.resistance[0]
    friction = plant.gear[0] ** 2 * plant.viscous[0]
    coulomb = plant.friction_arm * 9.81 * 0.5 * (plant.body.mass_2 + plant.body.mass_3 + plant.body.load)
    assert (with_all - without)[0] == pytest.approx(emf + friction + coulomb, rel=1e-9)


def test_with_the_right_model_errors_decay_with_the_chosen_poles(plant: DrivenArm) -> None:
    # s³ + 7 s² + 11 s + 5 has its roots at −1, −1 and −5; the error starts at e0 with no rate and no integral
    frictionless = plant.without_friction()
    start = (START[0] + 0.3, START[1], START[2] - 0.2)
    motion = control(frictionless, Partitioned(frictionless), STILL, start, 3.0)
    t = motion.time
    # partial fractions of the solution with those initial values
    basis = np.stack([np.exp(-t), t * np.exp(-t), np.exp(-5 * t)], axis=1)
    at_zero = np.array([[1, 0, 1], [-1, 1, -5], [1, -2, 25]])
    shape = basis @ np.linalg.solve(at_zero, [1.0, 0.0, -11.0])
    np.testing.assert_allclose(motion.position[:, 0] - START[0], 0.3 * shape, atol=1e-6)
    np.testing.assert_allclose(motion.position[:, 2] - START[2], -0.2 * shape, atol=1e-6)
    np.testing.assert_allclose(motion.position[:, 1], START[1], atol=1e-9)


def test_half_the_step_gives_the_same_motion(plant: DrivenArm) -> None:
    wanted = Sinusoid(START, (0.5, 0.5, 0.5), 3.0, (0.0, 0.0, 0.0))
    coarse = control(plant, ClassicalPid(), wanted, START, 1.0)
    fine = control(plant, ClassicalPid(), wanted, START, 1.0, step=1e-4, every=100)
    np.testing.assert_allclose(coarse.position, fine.position, atol=1e-5)


def test_pid_holds_the_arm_against_gravity(plant: DrivenArm) -> None:
    motion = control(plant, ClassicalPid(), STILL, START, 2.0)
    np.testing.assert_allclose(motion.position[-1], START, atol=2e-3)
    assert motion.volts[-1, 1] != 0


def test_an_unstable_loop_is_an_error_not_a_number(plant: DrivenArm) -> None:
    with pytest.raises(SpecError, match="unstable"):
        control(plant, ClassicalPid(amplifier=-1e4), STILL, (3.0, 0.5, 0.1), 5.0)
    with pytest.raises(SpecError, match="must be positive"):
        control(plant, ClassicalPid(), STILL, START, 0.0)
