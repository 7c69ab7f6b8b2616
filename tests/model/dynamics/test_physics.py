"""Laws of mechanics that hold whatever the formulas: energy, passivity, symmetry, gravity as a gradient."""

import numpy as np
import pytest

from model.dynamics import recursive
from model.dynamics.dual import DUAL_STEP
from model.dynamics.linear_solve import solve_symmetric
from model.kinematics.chain import Chain, ChainArrays, FloatArray
from tests.model.dynamics.chains import OFFSET_ARM, TABLE_7_9, dual, random_chain, random_state

CHAINS = [*(random_chain(11, n) for n in range(1, 7)), TABLE_7_9.chain(), OFFSET_ARM.chain()]


def free_motion(
    arrays: ChainArrays, q: FloatArray, v: FloatArray, step: float, steps: int
) -> tuple[FloatArray, FloatArray]:
    """Fourth-order Runge-Kutta with no torque at any joint."""
    none = np.zeros_like(q)

    def slope(q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        return v, recursive.forward_dynamics(arrays, q, v, none)

    for _ in range(steps):
        k1, l1 = slope(q, v)
        k2, l2 = slope(q + step / 2 * k1, v + step / 2 * l1)
        k3, l3 = slope(q + step / 2 * k2, v + step / 2 * l2)
        k4, l4 = slope(q + step * k3, v + step * l3)
        q = q + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        v = v + step / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
    return q, v


@pytest.mark.parametrize("chain", CHAINS)
def test_free_motion_keeps_its_energy(chain: Chain) -> None:
    arrays = chain.arrays()
    q, v, _ = random_state(1, chain.joint_count)
    kinetic = recursive.kinetic_energy(arrays, q, v)
    before = kinetic + recursive.potential_energy(arrays, q)
    q, v = free_motion(arrays, q, v, 1e-4, 2000)
    after = recursive.kinetic_energy(arrays, q, v) + recursive.potential_energy(arrays, q)
    assert abs(recursive.kinetic_energy(arrays, q, v) - kinetic) > 1e-3  # energy was exchanged
    assert after == pytest.approx(before, abs=1e-9 * (1 + abs(before) + kinetic))


@pytest.mark.parametrize("chain", CHAINS)
def test_velocity_torques_come_from_the_change_of_the_inertia(chain: Chain) -> None:
    """With C of the Christoffel symbols of D: C q̇ = H, and Ḋ − 2C is skew (passivity)."""
    n = chain.joint_count
    q, v, _ = random_state(2, n)
    slope = slopes_of_inertia(chain, q)  # slope[k] = ∂D/∂q_k
    change = np.einsum("kij,k->ij", slope, v)
    christoffel = 0.5 * (change + np.einsum("jik,k->ij", slope, v) - np.einsum("ijk,k->ij", slope, v))
    own = recursive.velocity_torques(chain.arrays(), q, v)
    np.testing.assert_allclose(christoffel @ v, own, atol=1e-11)
    skew = change - 2 * christoffel
    np.testing.assert_allclose(skew, -skew.T, atol=1e-11)
    assert v @ change @ v == pytest.approx(2 * v @ own, abs=1e-11)


def slopes_of_inertia(chain: Chain, q: FloatArray) -> FloatArray:
    arrays = dual(chain.arrays())
    result = []
    for k in range(chain.joint_count):
        stepped = q.astype(complex)
        stepped[k] += 1j * DUAL_STEP
        result.append(recursive.mass_matrix(arrays, stepped).imag / DUAL_STEP)
    return np.array(result)


@pytest.mark.parametrize("chain", CHAINS)
def test_gravity_is_the_gradient_of_the_potential(chain: Chain) -> None:
    q, _, _ = random_state(3, chain.joint_count)
    arrays = dual(chain.arrays())
    gradient = []
    for k in range(chain.joint_count):
        stepped = q.astype(complex)
        stepped[k] += 1j * DUAL_STEP
        gradient.append(recursive.potential_energy(arrays, stepped).imag / DUAL_STEP)
    np.testing.assert_allclose(recursive.gravity_torques(chain.arrays(), q), gradient, atol=1e-11)


@pytest.mark.parametrize("chain", CHAINS)
def test_inertia_is_symmetric_and_positive(chain: Chain) -> None:
    for seed in range(5):
        q, _, _ = random_state(seed, chain.joint_count)
        matrix = recursive.mass_matrix(chain.arrays(), q)
        np.testing.assert_array_equal(matrix, matrix.T)
        assert np.linalg.eigvalsh(matrix)[0] > 0


def test_the_arm_straight_up_needs_no_torque() -> None:
    torque = recursive.gravity_torques(TABLE_7_9.chain().arrays(), np.array([0.3, np.pi / 2, 0.0]))
    np.testing.assert_allclose(torque, 0.0, atol=1e-14)


def test_the_arm_held_out_level_carries_its_weight() -> None:
    arm = TABLE_7_9
    g = -arm.gravity[2]
    beyond_elbow = g * (arm.mass_3 / 2 + arm.load) * arm.length_3
    at_elbow = g * (arm.mass_2 / 2 + arm.mass_3 + arm.load) * arm.length_2
    torque = recursive.gravity_torques(arm.chain().arrays(), np.zeros(3))
    np.testing.assert_allclose(torque, [0.0, at_elbow + beyond_elbow, beyond_elbow], atol=1e-13)


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
