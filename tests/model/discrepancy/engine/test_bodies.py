"""Numbers of a body in which torques are linear, against Pinocchio's inverse dynamics."""

import numpy as np
import pinocchio
import pytest

from model.arrays import Floats
from model.discrepancy.engine.bodies import unknown_bodies
from model.fitting.unknowns import Unknown
from tests.model.fitting.test_consistent_bodies import SOUND, of_body

MODEL = of_body(*SOUND)
NUMBERS = ("mass", *(f"centre_{a}" for a in "xyz"), *(f"inertia_{e}" for e in ("xx", "yy", "zz", "xy", "xz", "yz")))
STATED = np.array([MODEL.parameter(f"link1.{name}").value for name in NUMBERS])
UNKNOWNS = tuple(Unknown(MODEL.parameter(f"link1.{name}"), v) for name, v in zip(NUMBERS, STATED, strict=True))
MOTION = np.random.default_rng(3).normal(size=(40, 3))
"""Position, speed and acceleration of samples."""


def torques(numbers: Floats) -> Floats:
    """Of a pendulum about a tilted axis with this body, (N,) N·m, by Pinocchio."""
    xx, yy, zz, xy, xz, yz = numbers[4:]
    body = pinocchio.Inertia(numbers[0], numbers[1:4], np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    model = pinocchio.Model()
    axis = pinocchio.JointModelRevoluteUnaligned(*np.array([2.0, 1.0, 2.0]) / 3.0)
    joint = model.addJoint(0, axis, pinocchio.SE3.Identity(), "joint")
    model.appendBodyToJoint(joint, body, pinocchio.SE3.Identity())
    data = model.createData()
    return np.array([pinocchio.rnea(model, data, *(np.array([x]) for x in sample))[0] for sample in MOTION])


def slopes(numbers: Floats) -> Floats:
    """(10, N) by central differences; torques are quadratic at most."""
    step = 1e-3
    sides = [(torques(numbers + step * unit), torques(numbers - step * unit)) for unit in np.eye(10)]
    return np.array([(above - below) / (2 * step) for above, below in sides])


@pytest.mark.parametrize("known", [(), (4, 5, 6, 7, 8, 9)], ids=["all ten", "mass and centre"])
def test_torques_change_in_proportion_to_the_linear_step_and_derivatives_hold_elsewhere(known: tuple[int, ...]) -> None:
    free = [k for k in range(10) if k not in known]
    (body,) = unknown_bodies(MODEL, [UNKNOWNS[k] for k in free])
    far = STATED.copy()
    far[free] += np.array([0.8, 0.1, -0.05, 0.07, 0.01, 0.02, -0.01, 0.005, 0.01, -0.004])[free]
    change, derivatives = (far - STATED)[free], slopes(STATED)[free]
    plain = torques(STATED) + change @ derivatives
    body.linearise(change, STATED[free], far[free])
    told, found = torques(STATED) + change @ derivatives, torques(far)
    body.transport(derivatives, STATED[free], far[free])
    if known:  # inertia about the joint, which the square of the centre changes, is no unknown
        assert np.abs(told - found).max() < 0.2 * np.abs(plain - found).max()
        return
    np.testing.assert_allclose(told, found, atol=1e-9)
    assert np.abs(plain - found).max() > 0.1
    np.testing.assert_allclose(derivatives, slopes(far), atol=1e-8)


def test_a_body_without_mass_is_left_and_one_with_a_wrong_mass_by_an_effect_is_none() -> None:
    (body,) = unknown_bodies(MODEL, UNKNOWNS)
    empty, change = STATED * np.r_[0.0, np.ones(9)], np.ones(10)
    body.linearise(change, empty, STATED)
    assert (change == 1.0).all()
    assert not unknown_bodies(MODEL, UNKNOWNS[:1])
    assert not unknown_bodies(MODEL.with_effect("link_mass", (1,), {"added": 0.1}), UNKNOWNS)
