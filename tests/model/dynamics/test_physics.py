"""What other engines do not show: the inertia is symmetric to the bit, and a solution carries derivatives."""

import numpy as np
import pytest

from model.dynamics import recursive
from model.dynamics.dual import DUAL_STEP
from model.dynamics.linear_solve import solve_symmetric
from model.kinematics.chain import Chain
from tests.model.dynamics.chains import OFFSET_ARM, TABLE_7_9, random_chain, random_state

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
