"""D, H, G and the energies agree with MuJoCo and Pinocchio to 1e-10 on random chains and states."""

import numpy as np
import pytest

from model.dynamics import recursive
from model.kinematics.chain import Chain
from tests.model.dynamics.chains import OFFSET_ARM, random_chain, random_state
from tests.model.dynamics.oracles import MuJoCo, Pinocchio, Terms

AGREEMENT = 1e-10
CHAINS = [
    pytest.param(random_chain(seed, n, kinds), id=f"{n}-{kinds}-{seed}")
    for n in range(1, 7)
    for kinds in ("revolute", "mixed", "prismatic")
    for seed in (1, 2)
]


def ours(chain: Chain, q: np.ndarray, velocity: np.ndarray) -> Terms:
    arrays = chain.arrays()
    gravity = recursive.gravity_torques(arrays, q)
    return Terms(
        recursive.mass_matrix(arrays, q),
        recursive.velocity_torques(arrays, q, velocity) + gravity,
        gravity,
        recursive.kinetic_energy(arrays, q, velocity),
        recursive.potential_energy(arrays, q),
    )


def assert_agree(mine: Terms, other: Terms) -> None:
    for name in Terms.__dataclass_fields__:
        a, b = np.asarray(getattr(mine, name)), np.asarray(getattr(other, name))
        scale = 1.0 + np.abs(b).max()
        np.testing.assert_allclose(a, b, rtol=0.0, atol=AGREEMENT * scale, err_msg=name)


@pytest.mark.parametrize("chain", CHAINS)
@pytest.mark.parametrize("engine", [MuJoCo, Pinocchio])
def test_random_chain_agrees(chain: Chain, engine: type[MuJoCo] | type[Pinocchio]) -> None:
    oracle = engine(chain)
    for seed in range(5):
        q, velocity, _ = random_state(seed, chain.joint_count)
        assert_agree(ours(chain, q, velocity), oracle.terms(q, velocity))


def test_the_idealised_arm_agrees_with_pinocchio() -> None:
    # MuJoCo refuses the rods: a body must have inertia about all its axes there.
    chain = OFFSET_ARM.chain()
    oracle = Pinocchio(chain)
    for seed in range(20):
        q, velocity, _ = random_state(seed, 3)
        assert_agree(ours(chain, q, velocity), oracle.terms(q, velocity))
