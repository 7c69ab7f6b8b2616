"""A chain that cannot exist is refused in one line that says what and where."""

from dataclasses import replace

import numpy as np
import pytest

from model.dynamics import recursive
from model.kinematics.chain import Chain, ChainError, Joint, JointKind, Link
from tests.model.dynamics.chains import TABLE_7_9, random_chain, random_link

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


def test_a_rotor_alone_is_inertia_enough() -> None:
    arrays = one_joint(Link(0.0), Joint(rotor_inertia=0.5)).arrays()
    assert recursive.mass_matrix(arrays, np.zeros(1))[0, 0] == 0.5


def test_a_point_away_from_the_axis_is_inertia_enough() -> None:
    arrays = one_joint(Link(2.0), Joint(a=0.5, alpha=0.3, d=1.0)).arrays()
    assert recursive.mass_matrix(arrays, np.zeros(1))[0, 0] == pytest.approx(0.5)


def test_a_chain_cannot_be_changed_in_place() -> None:
    with pytest.raises(ValueError, match="read-only"):
        TABLE_7_9.chain().gravity[2] = 0.0


def test_the_load_acts_as_one_more_point_of_the_last_link() -> None:
    chain = random_chain(5, 3)
    lever = chain.load_position
    points = replace(chain, load=0.0).arrays()
    points.inertial[-1, 0] += chain.load
    points.inertial[-1, 1:4] += chain.load * lever
    x, y, z = lever
    points.inertial[-1, 4:] += chain.load * np.array(
        [y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y]
    )
    np.testing.assert_allclose(points.inertial, chain.arrays().inertial, atol=1e-15)


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
