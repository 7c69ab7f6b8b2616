"""Tables 5.1 and 5.2: which inertial parameters act on which joint."""

from dataclasses import replace

import numpy as np
import pytest

from model.dynamics import recursive
from model.dynamics.inertial_influence import (
    PARAMETERS,
    acting_parameters,
    parameter_name,
    parameters_about_joint,
    torque_sensitivities,
)
from model.kinematics.chain import Chain, ChainError
from tests.model.dynamics.chains import TABLE_7_9, random_chain, random_link, random_state

STATES = [random_state(seed, 3) for seed in range(10)]
WAIST_STILL = [(q, v * [0, 1, 1], a * [0, 1, 1]) for q, v, a in STATES]


def arm_of_any_links() -> Chain:
    rng = np.random.default_rng(8)
    return replace(TABLE_7_9.chain(), links=tuple(random_link(rng) for _ in range(3)))


def all_of(link: int) -> set[str]:
    return {parameter_name(link, which) for which in range(len(PARAMETERS))}


def test_table_5_1_holds_for_shoulder_and_elbow() -> None:
    _, shoulder, elbow = acting_parameters(arm_of_any_links(), STATES)
    assert set(shoulder) == all_of(2) - {"c2z"} | all_of(3)
    assert set(elbow) == all_of(3) - {"c3z"}


def test_table_5_1_names_too_many_parameters_for_the_waist() -> None:
    # It lists all of links 2 and 3. The shoulder lies on the waist's axis, so mass and centre of link 2 have no
    # arm there, and I*zz acts about axes that are at right angles to the waist.
    waist = acting_parameters(arm_of_any_links(), STATES)[0]
    assert set(waist) == {"I1yy"} | all_of(2) - {"m2", "c2x", "c2y", "c2z", "I2zz"} | all_of(3) - {"I3zz"}


def test_table_5_2_holds_for_shoulder_and_elbow() -> None:
    _, shoulder, elbow = acting_parameters(arm_of_any_links(), WAIST_STILL)
    assert set(shoulder) == {"m2", "c2x", "c2y", "I2zz", "m3", "c3x", "c3y", "I3zz"}
    assert set(elbow) == {"m3", "c3x", "c3y", "I3zz"}


@pytest.mark.parametrize("which", range(len(PARAMETERS)))
def test_sensitivity_is_the_change_of_the_torque(which: int) -> None:
    """Against a finite change of the body itself, made of point masses so that nothing is shared."""
    chain = arm_of_any_links()
    exact = torque_sensitivities(chain, STATES[0])[:, 2, which]
    q, v, a = STATES[0]
    step = 1e-6
    sides = [recursive.inverse_dynamics(changed(chain, which, s * step), q, v, a) for s in (1, -1)]
    np.testing.assert_allclose(exact, (sides[0] - sides[1]) / (2 * step), rtol=1e-6, atol=1e-6)


def changed(chain: Chain, which: int, change: float) -> recursive.ChainArrays:
    """Link 3's parameter about its joint changed, in the packed form about the frame's own origin."""
    mass, cx, cy, cz, *inertia = parameters_about_joint(chain, 3) + change * np.eye(10)[which]
    a3, d3 = chain.joints[2].a, chain.joints[2].d
    x, y, z = cx - a3, cy, cz - d3
    about_centre = np.array(inertia) - mass * outer(cx, cy, cz)
    arrays = chain.arrays()
    arrays.inertial[2] = [mass, mass * x, mass * y, mass * z, *(about_centre + mass * outer(x, y, z))]
    return arrays


def outer(x: float, y: float, z: float) -> np.ndarray:
    return np.array([y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y])


def test_a_prismatic_joint_is_refused() -> None:
    with pytest.raises(ChainError, match="joint 1 is prismatic"):
        torque_sensitivities(random_chain(1, 2, "prismatic"), random_state(1, 2))
