"""Torques along a motion, control laws on the arm in continuous time, and what follows from published tables alone."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from extras.thesis.closed_loop import ClassicalPid, Partitioned, Sinusoid, control
from extras.thesis.driven_arm import DrivenArm, equation_of_motion
from extras.thesis.figures import influence_tables
from extras.thesis.tables import (
    BASIC,
    SYMBOLS,
    VISCOUS_AND_COULOMB,
    model_of,
    recomputed_fidelities,
)
from extras.thesis.torques import TorqueAnalysis, largest, torques_along
from model import layout as at
from model.dynamics import recursive
from model.machine_model.model import Model
from model.simulation.bodies import rod_arm_body
from model.simulation.chain_of_model import chain_of
from tests.model.fitting.imagined import arm

K = 12
RNG = np.random.default_rng(4)
MOTION = tuple(RNG.normal(size=(K, 3)) for _ in range(3))


@pytest.fixture(scope="module")
def model() -> Model:
    return arm()


@pytest.fixture(scope="module")
def analysis(model: Model) -> TorqueAnalysis:
    return torques_along(model, 0.02 * np.arange(K), *MOTION, "random")


def test_inertia_speed_and_gravity_add_up_to_the_inverse_dynamics(model: Model, analysis: TorqueAnalysis) -> None:
    inertial = np.zeros((K, 3))
    for torque in analysis.inertial:
        inertial[:, torque.at - 1] += torque.values
    rest = np.stack([np.add(s.values, g.whole) for s, g in zip(analysis.speed, analysis.gravity, strict=True)], axis=1)
    expected = [recursive.inverse_dynamics(chain_of(model), *(m[k] for m in MOTION)) for k in range(K)]
    np.testing.assert_allclose(inertial + rest, expected, atol=1e-10)


def test_gravity_by_link_adds_up(analysis: TorqueAnalysis) -> None:
    for gravity in analysis.gravity:
        np.testing.assert_allclose(np.sum(gravity.by_link, axis=0), gravity.whole, atol=1e-12)


def test_a_link_does_not_weigh_on_joints_beyond_it(analysis: TorqueAnalysis) -> None:
    assert largest(analysis.gravity[2].by_link[1]) < 1e-12
    assert largest(analysis.gravity[1].by_link[1]) > 0.1


def test_translation_rotation_and_rotor_add_up_to_each_element(model: Model, analysis: TorqueAnalysis) -> None:
    for element in analysis.inertia:
        parts = np.add(element.translation, element.rotation) + element.rotor
        np.testing.assert_allclose(parts, element.whole, atol=1e-12)
    rotor = model.parameter("joint1.motor.rotor_inertia").value * 600**2
    assert analysis.element(1, 1).rotor == pytest.approx(rotor)


def test_a_thin_rod_about_its_own_joint_is_one_quarter_rotation(model: Model) -> None:
    bare = model.with_values({"load.mass": 0.0})
    (still,) = (torques_along(bare, np.zeros(1), *np.zeros((3, 1, 3)), "rest"),)
    own = still.element(3, 3)
    assert own.rotation[0] / (own.rotation[0] + own.translation[0]) == pytest.approx(0.25)


# ---- control laws


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


# ---- what follows from the published tables alone


@pytest.mark.parametrize("index", range(4))
def test_published_sums_follow_from_the_tables_within_three_percent(index: int) -> None:
    found = recomputed_fidelities("source")[index]
    assert found.published == (0.2449, 0.4431, 0.5973, 0.9313)[index]
    assert found.ours == pytest.approx((0.2426, 0.4452, 0.5834, 0.9295)[index], abs=5e-4)
    assert abs(found.relative_difference) < 0.03


def test_three_sigma_taken_literally_gives_over_forty_percent_more() -> None:
    assert all(0.42 <= f.relative_difference <= 0.46 for f in recomputed_fidelities("three_sigma"))


def test_a_table_becomes_a_model_with_its_values() -> None:
    machine = load_machine("ma2000")
    model = model_of(VISCOUS_AND_COULOMB, machine)
    for symbol in SYMBOLS:
        assert model.parameter(symbol.parameter).value == VISCOUS_AND_COULOMB.values[symbol.name]
    assert model.published_inertia
    basic = model_of(BASIC, machine)
    assert not basic.effects
    assert basic.parameter("joint2.motor.back_emf_constant").value == 0.0334


def test_the_model_and_the_arm_of_chapter_8_have_the_same_bodies() -> None:
    model = model_of(VISCOUS_AND_COULOMB, load_machine("ma2000"))
    joints = model.vector[at.SHARED :].reshape(3, at.PER_JOINT).copy()
    body = rod_arm_body(model.vector[: at.SHARED].copy(), joints, model.flags.copy())
    arm = VISCOUS_AND_COULOMB.arm().vector()
    assert arm[: len(body)] == pytest.approx(body, rel=1e-9)


def test_tables_of_chapter_5_hold_but_for_the_waist() -> None:
    entries = {(e.table, e.joint): e for e in influence_tables()}
    wrong = {key for key, e in entries.items() if e.published_too_many or e.published_too_few}
    assert wrong == {("5.1", 1), ("5.2", 1)}
    assert entries["5.1", 1].published_too_many == ("m2", "c2x", "c2y", "c2z", "I2zz", "I3zz")
    assert entries["5.1", 1].published_too_few == ()
