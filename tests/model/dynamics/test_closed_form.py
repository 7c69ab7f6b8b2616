"""The generated closed form is that of its sources and describes the arm of the recursions."""

from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest

from model.dynamics import effective_inertia, recursive, three_joint
from model.dynamics.dual import DUAL_STEP
from model.dynamics.linear_solve import solve_symmetric
from model.dynamics.rod_arm import PUBLISHED_INERTIA, SIZE, RodArm, effective_from_rods
from model.kinematics.chain import Chain, FloatArray, Joint
from model.simulation.dynamics_of_run import accelerations as closed_form_accelerations
from tests.model.dynamics.chains import (
    OFFSET_ARM,
    TABLE_7_9,
    dual,
    effective_parameters,
    random_chain,
    random_link,
    random_state,
)

UPPER = np.triu_indices(3)


def general_arm(seed: int) -> Chain:
    """Links of any shape on the closed form's geometry."""
    rng = np.random.default_rng(seed)
    joints = (
        Joint(alpha=np.pi / 2, d=0.3, rotor_inertia=0.3),
        Joint(a=0.3, d=0.07, rotor_inertia=0.2),
        Joint(a=0.2, d=-0.04, alpha=0.6, rotor_inertia=0.1),
    )
    links = tuple(random_link(rng) for _ in joints)
    return Chain(joints, links, gravity=np.array([1.0, -2.0, -9.0]), load=0.7, load_position=rng.normal(size=3))


@numba.njit
def torques(q: FloatArray, v: FloatArray, p: FloatArray):  # type: ignore[no-untyped-def]
    level = three_joint.mass_matrix_and_bias(q[1], q[2], v[0], v[1], v[2], p)
    gravity = three_joint.gravity_torques(q[0], q[1], q[2], p)
    tilted = three_joint.horizontal_gravity_torques(q[0], q[1], q[2], p)
    return level, gravity, tilted


@numba.njit
def accelerations(q: FloatArray, v: FloatArray, torque: FloatArray, p: FloatArray):  # type: ignore[no-untyped-def]
    tilted = three_joint.horizontal_gravity_torques(q[0], q[1], q[2], p)
    t1, t2, t3 = torque[0] - tilted[0], torque[1] - tilted[1], torque[2] - tilted[2]
    return closed_form_accelerations(q[1], q[2], v[0], v[1], v[2], t1, t2, t3, p)


@pytest.mark.parametrize("chain", [TABLE_7_9.chain(), OFFSET_ARM.chain(), *map(general_arm, range(5))])
def test_closed_form_agrees_with_the_recursion(chain: Chain) -> None:
    arrays, p = chain.arrays(), effective_parameters(chain)
    for seed in range(10):
        q, v, torque = random_state(seed, 3)
        level, gravity, tilted = torques(q, v, p)
        np.testing.assert_allclose(level[:6], recursive.mass_matrix(arrays, q)[UPPER], atol=1e-13)
        np.testing.assert_allclose(gravity, recursive.gravity_torques(arrays, q), atol=1e-12)
        whole = np.asarray(level[6:]) + tilted
        np.testing.assert_allclose(whole, recursive.velocity_torques(arrays, q, v) + np.asarray(gravity), atol=1e-12)
        free = recursive.forward_dynamics(arrays, q, v, torque)
        np.testing.assert_allclose(accelerations(q, v, torque, p), free, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("arm", [TABLE_7_9, OFFSET_ARM])
def test_rods_have_the_effective_parameters_of_their_chain(arm: RodArm) -> None:
    np.testing.assert_allclose(effective_from_rods(arm.vector()), effective_parameters(arm.chain()), atol=1e-15)


@pytest.mark.parametrize(
    ("mass", "load", "length", "excess"),
    [
        (0.2321, 1.0, 0.137, 0.22),  # table 7.2
        (0.64424, 1.11327, 0.32245, 0.13),  # table 7.3
        (0.229105, 1.017110, 0.129856, 0.22),  # table 7.5
        (0.286792, 1.219998, 0.167525, 0.22),  # table 7.7
        (0.290461, 1.250307, 0.168410, 0.22),  # table 7.9
    ],
)
def test_published_inertia_exceeds_the_exact_one(mass: float, load: float, length: float, excess: float) -> None:
    arm = replace(TABLE_7_9, mass_3=mass, load=load, length_3=length)
    exact = effective_from_rods(arm.vector())[effective_inertia.I3_ZZ]
    published = effective_from_rods(replace(arm, published_inertia=True).vector())[effective_inertia.I3_ZZ]
    assert exact == pytest.approx(mass * length**2 / 3 + load * length**2)
    assert published / exact - 1 == pytest.approx(excess, abs=0.005)


def test_published_inertia_changes_link_3_alone() -> None:
    exact = effective_from_rods(OFFSET_ARM.vector())
    published = effective_from_rods(replace(OFFSET_ARM, published_inertia=True).vector())
    changed = {effective_inertia.NAMES[i] for i in np.flatnonzero(exact != published)}
    assert changed == {"I3_ZZ", "I3_YY_XX"}


def test_sensitivities_to_physical_parameters_are_exact() -> None:
    rods = replace(OFFSET_ARM, published_inertia=True).vector()
    q, v, torque = random_state(4, 3)
    for parameter in range(SIZE):
        if parameter == PUBLISHED_INERTIA:
            continue
        stepped = rods.astype(complex)
        stepped[parameter] += 1j * DUAL_STEP
        motion = accelerations(
            q.astype(complex), v.astype(complex), torque.astype(complex), effective_from_rods(stepped)
        )
        exact = np.imag(motion) / DUAL_STEP
        wide = central_difference(rods, parameter, q, v, torque)
        np.testing.assert_allclose(exact, wide, rtol=1e-6, atol=1e-6)


def central_difference(
    rods: FloatArray, parameter: int, q: FloatArray, v: FloatArray, torque: FloatArray
) -> FloatArray:
    step = 1e-5
    sides = []
    for sign in (1, -1):
        moved = rods.copy()
        moved[parameter] += sign * step
        sides.append(np.asarray(accelerations(q, v, torque, effective_from_rods(moved))))
    return (sides[0] - sides[1]) / (2 * step)


def test_recursion_gives_the_same_sensitivity_to_a_mass() -> None:
    chain = random_chain(2, 4)
    q, v, torque = (x.astype(complex) for x in random_state(2, 4))
    arrays = dual(chain.arrays())
    arrays.inertial[2, 0] += 1j * DUAL_STEP
    exact = recursive.forward_dynamics(arrays, q, v, torque).imag / DUAL_STEP
    sides = []
    for sign in (1, -1):
        moved = chain.arrays()
        moved.inertial[2, 0] += sign * 1e-5
        sides.append(recursive.forward_dynamics(moved, q.real.copy(), v.real.copy(), torque.real.copy()))
    np.testing.assert_allclose(exact, (sides[0] - sides[1]) / 2e-5, rtol=1e-6, atol=1e-7)


def test_the_layout_of_the_effective_parameters_is_that_of_their_names() -> None:
    assert len(effective_inertia.NAMES) == effective_inertia.SIZE
    for index, name in enumerate(effective_inertia.NAMES):
        assert getattr(effective_inertia, name) == index


@pytest.mark.slow
def test_generating_again_gives_the_committed_module() -> None:
    from model.generation.derivation import derive, in_effective_parameters
    from model.generation.expressions import routines
    from model.generation.printing import python_module

    generated = routines(in_effective_parameters(derive()))
    assert python_module(generated) == Path(three_joint.__file__).read_text(encoding="utf-8")


# ---- What other engines do not show: the inertia is symmetric to the bit, and a solution carries derivatives

CHAINS = [*(random_chain(11, n) for n in range(1, 7)), TABLE_7_9.chain(), OFFSET_ARM.chain()]


@pytest.mark.parametrize("chain", CHAINS)
def test_inertia_is_symmetric_and_positive(chain: Chain) -> None:
    for seed in range(5):
        q, _, _ = random_state(seed, chain.joint_count)
        matrix = recursive.mass_matrix(chain.arrays(), q)
        np.testing.assert_array_equal(matrix, matrix.T)
        assert np.linalg.eigvalsh(matrix)[0] > 0


@pytest.mark.parametrize("size", range(1, 7))
def test_symmetric_solve_carries_derivatives(size: int) -> None:
    rng = np.random.default_rng(size)
    factor, slope = rng.normal(size=(2, size, size))
    matrix, change = factor @ factor.T + np.eye(size), slope + slope.T
    right = rng.normal(size=size)
    solution = solve_symmetric(matrix + 1j * DUAL_STEP * change, right.astype(complex))
    expected = np.linalg.solve(matrix, right)
    np.testing.assert_allclose(solution.real, expected, rtol=1e-10)
    np.testing.assert_allclose(solution.imag / DUAL_STEP, -np.linalg.solve(matrix, change @ expected), rtol=1e-8)
