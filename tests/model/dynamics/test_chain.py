"""Chains of rigid bodies: what cannot exist is refused; dynamics agree in other coordinates."""

import cmath
import math
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from model.dynamics import recursive
from model.dynamics.dual import DUAL_STEP, LARGEST_ANGLE, reciprocal, sin_cos
from model.dynamics.inertial_influence import (
    PARAMETERS,
    acting_parameters,
    parameter_name,
    parameters_about_joint,
    torque_sensitivities,
)
from model.dynamics.wide_numbers import WIDTH, Dual, Lanes, Plain, exponential, root, seen_as, where, whole
from model.kinematics.chain import Chain, ChainError, Joint, JointKind, Link
from tests.model.dynamics.chains import TABLE_7_9, random_chain, random_link, random_state

BODY = random_link(np.random.default_rng(0))


def one_joint(link: Link = BODY, joint: Joint = Joint(), **more: object) -> Chain:  # noqa: B008
    return Chain((joint,), (link,), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Chain((), ()), "chain has 0 joints; at least one is needed"),
        (lambda: Chain((Joint(),) * 2, (BODY,)), "2 joints and 1 links"),
        (lambda: one_joint(joint=Joint(alpha=float("nan"))), "joint 1: alpha is nan"),
        (lambda: one_joint(joint=Joint(rotor_inertia=-1.0)), "joint 1: rotor inertia is -1.0"),
        (lambda: one_joint(Link(-2.0)), "link 1: mass is -2.0 kg"),
        (lambda: one_joint(Link(1.0, np.array([0, np.inf, 0]))), "link 1: centre of mass"),
        (lambda: one_joint(Link(1.0, np.zeros(2))), "link 1: centre of mass"),
        (lambda: one_joint(Link(1.0, inertia=np.eye(2))), "link 1: inertia must be a 3 × 3"),
        (lambda: one_joint(Link(1.0, inertia=np.triu(np.ones((3, 3))))), "link 1: inertia is not symmetric"),
        (lambda: one_joint(Link(1.0, inertia=np.diag([1, 1, -0.1]))), "negative principal moment -0.1"),
        (lambda: one_joint(Link(1.0, inertia=np.diag([1, 1, 3.0]))), "exceeds the sum of the other two"),
        (lambda: one_joint(load=-1.0), "load is -1.0 kg"),
        (lambda: one_joint(gravity=np.zeros(2)), "gravity has shape"),
        (lambda: one_joint(gravity=np.array([0, 0, np.nan])), "gravity must be three finite numbers"),
        (lambda: one_joint(Link(0.0)), "joint 1 has zero inertia: no mass beyond it"),
        (lambda: one_joint(Link(1.0)), "joint 1 has zero inertia: all mass beyond it lies on its axis"),
        (lambda: one_joint(Link(0.0), Joint(JointKind.PRISMATIC)), "joint 1 has zero inertia"),
        (lambda: Chain((Joint(), Joint(a=0.3)), (BODY, Link(0.0))), "joint 2 has zero inertia"),
    ],
)
def test_an_impossible_chain_is_refused_in_one_line(build: object, message: str) -> None:
    with pytest.raises(ChainError, match=message) as caught:
        build()  # type: ignore[operator]
    assert "\n" not in str(caught.value)


def test_one_kind_of_inertia_is_enough_and_a_chain_cannot_be_changed_in_place() -> None:
    arrays = one_joint(Link(0.0), Joint(rotor_inertia=0.5)).arrays()
    assert recursive.mass_matrix(arrays, np.zeros(1))[0, 0] == 0.5
    arrays = one_joint(Link(2.0), Joint(a=0.5, alpha=0.3, d=1.0)).arrays()
    assert recursive.mass_matrix(arrays, np.zeros(1))[0, 0] == pytest.approx(0.5)
    with pytest.raises(ValueError, match="read-only"):
        TABLE_7_9.chain().gravity[2] = 0.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass_2": -1.0}, "mass_2 is -1.0"),
        ({"length_3": 0.0}, "length_3 is 0.0; a positive number"),
        ({"mass_3": float("nan")}, "mass_3 is nan"),
        ({"offset_2": float("inf")}, "must be finite"),
        ({"rotor_inertia": (0.0, -1.0, 0.0)}, "rotor inertias not negative"),
    ],
)
def test_an_arm_of_rods_out_of_range_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ChainError, match=message):
        replace(TABLE_7_9, **change)  # type: ignore[arg-type]


# ---- Elementary functions in real and dual numbers.


@numba.njit
def compiled_sin_cos(x: complex) -> tuple[complex, complex]:
    return sin_cos(x)


@numba.njit(error_model="numpy")
def compiled_reciprocal(x: complex) -> complex:
    return reciprocal(x)


@given(st.floats(-LARGEST_ANGLE, LARGEST_ANGLE))
@example(0.0)
@example(math.pi / 4)
@example(-math.pi / 2)
@example(3 * math.pi)
def test_sine_and_cosine_are_right_to_the_last_digits(x: float) -> None:
    s, c = compiled_sin_cos(x)
    assert abs(s - math.sin(x)) <= 2.3e-16
    assert abs(c - math.cos(x)) <= 2.3e-16


@pytest.mark.parametrize("x", [0.7, 0.7 + DUAL_STEP * 1j])
def test_interpreted_functions_agree_with_compiled_ones(x: complex) -> None:
    assert sin_cos(x) == pytest.approx(compiled_sin_cos(x), abs=1e-15)
    assert sin_cos(x) == pytest.approx((cmath.sin(x), cmath.cos(x)), abs=1e-15)
    assert reciprocal(x) == pytest.approx(compiled_reciprocal(x), abs=1e-15)


@numba.njit
def formula(x: Any, y: Any) -> Any:
    """Every operation of numbers of several parts."""
    s, c = sin_cos(x)
    z = (x * y - 2.0 * c) / (2.5 + s) + exponential(-y) - y / 3.0
    z += root(30.0 + x) * reciprocal(1.5 + y)
    z -= 0.5
    return where((z.real > 1.0) & (z.real <= 4.0), z - whole(z), -z)


@numba.njit
def along(tag: Any, numbers: Any, results: Any) -> None:
    seen, found = seen_as(tag, numbers), seen_as(tag, results)
    for k in range(seen.shape[0]):
        found[k] = formula(seen[k, 0], seen[k, 1])


def by_numpy(x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    z = (x * y - 2 * np.cos(x)) / (2.5 + np.sin(x)) + np.exp(-y) - y / 3 + np.sqrt(30 + x) / (1.5 + y) - 0.5
    chosen = (z.real > 1) & (z.real <= 4)
    return np.asarray(np.where(chosen, z - np.floor(z.real), -z))


def test_numbers_of_several_parts_calculate_as_numpy_does() -> None:
    """Lanes as arrays of real numbers, each derivative as a complex step, in numpy's functions."""
    rng = np.random.default_rng(1)
    points = np.stack([rng.uniform(-20.0, 20.0, (500, WIDTH)), rng.uniform(0.1, 3.0, (500, WIDTH))], axis=1)
    lanes = np.zeros((500, WIDTH))
    along(Lanes(0), points, lanes)
    np.testing.assert_allclose(lanes, by_numpy(points[:, 0], points[:, 1]), rtol=0, atol=1e-12)
    dual = np.concatenate([points[..., :1], rng.normal(size=(500, 2, WIDTH))], axis=-1)
    found = np.zeros((500, 1 + WIDTH))
    along(Dual(0), dual, found)
    stepped = dual[..., :1] + 1j * DUAL_STEP * dual[..., 1:]
    expected = by_numpy(stepped[:, 0], stepped[:, 1])
    np.testing.assert_allclose(found[:, 0], expected[:, 0].real, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[:, 1:], expected.imag / DUAL_STEP, rtol=1e-10, atol=1e-10)
    plain = np.zeros(500)
    along(Plain(0), points[..., 0].copy(), plain)
    np.testing.assert_allclose(plain, lanes[:, 0], rtol=0, atol=1e-12)


def test_an_angle_that_is_not_a_number_stays_so() -> None:
    assert all(math.isnan(v) for v in compiled_sin_cos(math.nan))


# ---- Tables 5.1 and 5.2: which inertial parameters act on which joint.

STATES = [random_state(seed, 3) for seed in range(10)]
WAIST_STILL = [(q, v * [0, 1, 1], a * [0, 1, 1]) for q, v, a in STATES]


def arm_of_any_links() -> Chain:
    rng = np.random.default_rng(8)
    return replace(TABLE_7_9.chain(), links=tuple(random_link(rng) for _ in range(3)))


def all_of(link: int) -> set[str]:
    return {parameter_name(link, which) for which in range(len(PARAMETERS))}


def test_tables_5_1_and_5_2_hold_for_shoulder_and_elbow() -> None:
    _, shoulder, elbow = acting_parameters(arm_of_any_links(), STATES)
    assert set(shoulder) == all_of(2) - {"c2z"} | all_of(3)
    assert set(elbow) == all_of(3) - {"c3z"}
    _, shoulder, elbow = acting_parameters(arm_of_any_links(), WAIST_STILL)
    assert set(shoulder) == {"m2", "c2x", "c2y", "I2zz", "m3", "c3x", "c3y", "I3zz"}
    assert set(elbow) == {"m3", "c3x", "c3y", "I3zz"}
    # It lists all of links 2 and 3. The shoulder lies on the waist's axis, so mass and centre of link 2 have no
    # arm there, and I*zz acts about axes that are at right angles to the waist.
    waist = acting_parameters(arm_of_any_links(), STATES)[0]
    assert set(waist) == {"I1yy"} | all_of(2) - {"m2", "c2x", "c2y", "c2z", "I2zz"} | all_of(3) - {"I3zz"}
    with pytest.raises(ChainError, match="joint 1 is prismatic"):
        torque_sensitivities(random_chain(1, 2, "prismatic"), random_state(1, 2))


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


@pytest.mark.parametrize("joints", range(1, 7))
def test_forward_dynamics_inverts_inverse_dynamics(joints: int) -> None:
    arrays = random_chain(3, joints).arrays()
    q, velocity, acceleration = random_state(3, joints)
    torque = recursive.inverse_dynamics(arrays, q, velocity, acceleration)
    np.testing.assert_allclose(recursive.forward_dynamics(arrays, q, velocity, torque), acceleration, atol=1e-10)
