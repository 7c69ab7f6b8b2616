"""Bodies as the equations of motion read them, held against sums over point masses, rotation matrices and tensors."""

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model import layout as at
from model.arrays import Floats
from model.dynamics import recursive
from model.kinematics.chain import ChainArrays
from model.machine_model.model import base_model
from model.simulation.bodies import chain_body
from model.simulation.chain_of_model import chain_of, gravity_loads
from model.simulation.dynamics_of_run import chain_levels
from tests.model.simulation.machines import pendulum, slide


def about_x(angle: float) -> Floats:
    """Rotation matrix."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def about_y(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def about_z(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def joint(shape: int, **columns: float) -> Floats:
    """The numbers of one joint."""
    row = np.zeros(at.PER_JOINT)
    row[at.SHAPE] = shape
    for name, value in columns.items():
        row[getattr(at, name)] = value
    return row


def body_of(*joints: Floats, flags: tuple[int, ...] | None = None, **shared: float) -> ChainArrays:
    common = np.zeros(at.SHARED)
    for name, value in shared.items():
        common[getattr(at, name)] = value
    return chain_body(common, np.array(joints), np.array(flags or (0,) * len(joints), dtype=np.int64))


def inertial(mass: float, centre: Floats, tensor: Floats) -> Floats:
    """Mass, first moments and xx xy xz yy yz zz about the origin, for a tensor about the centre."""
    whole = tensor + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.array([mass, *(mass * centre), *whole[np.triu_indices(3)]])


def test_a_general_body_is_moved_from_its_centre_to_the_origin_of_its_frame() -> None:
    tensor = np.array([[0.4, 0.03, -0.05], [0.03, 0.5, 0.07], [-0.05, 0.07, 0.6]])
    names = ("INERTIA_XX", "INERTIA_XY", "INERTIA_XZ", "INERTIA_YY", "INERTIA_YZ", "INERTIA_ZZ")
    own = dict(zip(names, tensor[np.triu_indices(3)], strict=True))
    centre = {"CENTRE_X": -0.3, "CENTRE_Y": 0.1, "CENTRE_Z": 0.2, "SHIFT": 0.05}
    found = body_of(joint(at.BODY, MASS=2.0, **own, **centre)).inertial[0]
    np.testing.assert_allclose(found, inertial(2.0, np.array([-0.25, 0.1, 0.2]), tensor))


def test_a_mass_that_is_added_to_a_body_keeps_its_shape() -> None:
    """A body of the same shape that is a quarter heavier has a quarter more inertia; one without mass has no shape."""
    tensor = np.array([[0.4, 0.03, -0.05], [0.03, 0.5, 0.07], [-0.05, 0.07, 0.6]])
    names = ("INERTIA_XX", "INERTIA_XY", "INERTIA_XZ", "INERTIA_YY", "INERTIA_YZ", "INERTIA_ZZ")
    own = dict(zip(names, tensor[np.triu_indices(3)], strict=True))
    heavier = body_of(joint(at.BODY, MASS=2.0, MASS_ADDED=0.5, CENTRE_X=-0.3, **own)).inertial[0]
    np.testing.assert_allclose(heavier, inertial(2.5, np.array([-0.3, 0.0, 0.0]), 1.25 * tensor))
    point = body_of(joint(at.BODY, MASS_ADDED=0.5, CENTRE_X=-0.3, **own)).inertial[0]
    np.testing.assert_allclose(point, inertial(0.5, np.array([-0.3, 0.0, 0.0]), tensor))


def test_a_rod_is_a_row_of_point_masses_that_ends_at_the_origin_of_its_frame() -> None:
    found = body_of(joint(at.ROD, MASS=1.2, A=0.5, SHIFT=0.04)).inertial[0]
    places = -0.5 + (np.arange(2000) + 0.5) * 0.5 / 2000 + 0.04
    points = [inertial(1.2 / 2000, np.array([x, 0.0, 0.0]), np.zeros((3, 3))) for x in places]
    np.testing.assert_allclose(found, np.sum(points, axis=0), rtol=1e-6, atol=1e-12)


def test_a_cylinder_turns_about_the_axis_of_its_joint() -> None:
    """Half of m r² about that axis, a quarter across it, about the origin of the frame before it."""
    found = body_of(joint(at.CYLINDER, MASS=3.0, RADIUS=0.2, A=0.1, ALPHA=0.7)).inertial[0]
    axis = about_x(0.7).T @ [0.0, 0.0, 1.0]
    tensor = 0.25 * 3.0 * 0.2**2 * (np.eye(3) + np.outer(axis, axis))
    np.testing.assert_allclose(found, inertial(3.0, np.array([-0.1, 0.0, 0.0]), tensor), atol=1e-15)


def test_load_and_payload_are_points_at_the_end_of_the_last_link() -> None:
    first, last = joint(at.ROD, MASS=1.0, A=0.5), joint(at.ROD, MASS=2.0, A=0.3)
    with_load, without = body_of(first, last, LOAD=0.4, PAYLOAD=0.25).inertial, body_of(first, last).inertial
    np.testing.assert_allclose(with_load - without, [[0.0] * 10, [0.65] + [0.0] * 9], atol=1e-15)


def test_joints_keep_their_geometry_and_rotors_count_by_the_square_of_their_gear() -> None:
    turning = joint(at.ROD, A=0.5, ALPHA=0.1, D=0.2, THETA=0.3, ROTOR_INERTIA=1e-4, GEAR=50.0)
    sliding = joint(at.ROD, PRISMATIC=1.0, ROTOR_INERTIA=0.5, GEAR=1.0)
    found = body_of(turning, sliding)
    assert found.prismatic.tolist() == [False, True]
    assert found.geometry[0].tolist() == [0.3, 0.2, 0.5, 0.1]
    np.testing.assert_allclose(found.rotor_inertia, [0.25, 0.5])
    apart = body_of(turning, sliding, flags=(at.HAS_FLEXIBILITY, at.HAS_INDUCTANCE))
    np.testing.assert_allclose(apart.rotor_inertia, [0.0, 0.5])


def test_a_base_that_is_turned_about_x_and_then_about_y_feels_gravity_from_elsewhere() -> None:
    found = body_of(joint(at.ROD), GRAVITY_X=1.0, GRAVITY_Y=2.0, GRAVITY_Z=-9.0, TILT_X=0.3, TILT_Y=-0.4).gravity
    np.testing.assert_allclose(found, about_y(-0.4).T @ about_x(0.3).T @ [1.0, 2.0, -9.0])


def test_a_model_s_chain_has_its_tilt_its_load_and_the_values_of_another_vector() -> None:
    arm = base_model(load_machine("ma2000"))
    chain = chain_of(arm.with_effect("base_tilt", values={"about_x": 0.05, "about_y": -0.03}))
    np.testing.assert_allclose(chain.gravity, about_y(-0.03).T @ about_x(0.05).T @ chain_of(arm).gravity)
    loads = [chain_of(arm, arm.with_values({"load.mass": mass}).vector).inertial[2, 0] for mass in (1.0, 1.75)]
    assert loads[1] - loads[0] == pytest.approx(0.75)
    assert chain_of(base_model(slide())).prismatic.tolist() == [True]


def test_gravity_pulls_at_a_rod_with_the_weight_at_its_middle() -> None:
    angles = np.linspace(-2.0, 2.0, 9)
    found = gravity_loads(base_model(pendulum()), angles[:, None])
    np.testing.assert_allclose(found[:, 0], 1.2 * 9.81 * 0.25 * np.cos(angles))


def levels(chain: ChainArrays, q: Floats, joints: Floats, published: int = 0) -> Floats:
    settings, out = np.zeros(at.SETTINGS, dtype=np.int64), np.zeros(len(q))
    settings[at.PUBLISHED_LOADS] = published
    chain_levels(q, joints, chain, settings, out)
    return out


def test_friction_grows_with_the_weight_across_the_axis_of_its_joint() -> None:
    """Two revolute joints, a sliding one, and another revolute one; gravity from anywhere."""
    rng = np.random.default_rng(8)
    joints = np.array(
        [
            joint(
                at.ROD,
                **dict(
                    zip(("THETA", "ALPHA", "MASS", "COULOMB", "COULOMB_ARM"), rng.uniform(0.3, 2.0, 5), strict=True)
                ),
                PRISMATIC=float(number == 2),
            )
            for number in range(4)
        ]
    )
    gravity, q = rng.normal(size=3), rng.normal(size=4)
    chain = body_of(*joints, LOAD=0.7, GRAVITY_X=gravity[0], GRAVITY_Y=gravity[1], GRAVITY_Z=gravity[2])
    expected, turned = [], np.eye(3)
    for number, row in enumerate(joints):
        pull = turned.T @ gravity
        weight = sum(other[at.MASS] for other in joints[number:]) + 0.7
        expected.append(row[at.COULOMB] + row[at.COULOMB_ARM] * weight * np.hypot(pull[0], pull[1]))
        turned = turned @ about_z(row[at.THETA] + (0.0 if number == 2 else q[number])) @ about_x(row[at.ALPHA])
    np.testing.assert_allclose(levels(chain, q, joints), expected)


def test_friction_of_the_arm_of_rods_grows_as_the_source_has_it() -> None:
    """(7.32) to (7.34), with what gravity does along the links."""
    numbers = [(5.0, 1.0, 0.1), (2.0, 2.0, 0.2), (1.0, 3.0, 0.3)]
    joints = np.array([joint(at.ROD, MASS=m, A=0.3, COULOMB=c, COULOMB_ARM=a) for m, c, a in numbers])
    chain, q = body_of(*joints, LOAD=0.5, GRAVITY_Z=-9.81), np.array([0.4, 0.9, -0.5])
    two, three = 2.0 * 9.81 * np.sin(q[1]), 1.5 * 9.81 * np.sin(q[1] + q[2])
    expected = [
        1.0 + 0.1 * abs(two * np.cos(q[1]) + three * np.cos(q[1] + q[2])),
        2.0 + 0.2 * abs(two + three * np.cos(q[2])),
        3.0 + 0.3 * abs(three),
    ]
    np.testing.assert_allclose(levels(chain, q, joints, published=1), expected)


def test_friction_in_proportion_to_gravity_torque_is_a_share_of_the_slope_of_potential_energy() -> None:
    """Three joints, one of them sliding; gravity from anywhere."""
    rng = np.random.default_rng(11)
    names = ("THETA", "ALPHA", "A", "D", "MASS", "GRAVITY_SHARE")
    joints = np.array(
        [
            joint(at.ROD, **dict(zip(names, rng.uniform(0.2, 1.2, len(names)), strict=True)), PRISMATIC=float(k == 1))
            for k in range(3)
        ]
    )
    gravity, q = rng.normal(size=3), rng.normal(size=3)
    chain = body_of(*joints, LOAD=0.7, GRAVITY_X=gravity[0], GRAVITY_Y=gravity[1], GRAVITY_Z=gravity[2])
    steps = 1e-5 * np.eye(3)
    slope = np.array(
        [recursive.potential_energy(chain, q + h) - recursive.potential_energy(chain, q - h) for h in steps]
    )
    expected = joints[:, at.GRAVITY_SHARE] * np.abs(slope / 2e-5)
    assert expected.min() > 0.05
    np.testing.assert_allclose(levels(chain, q, joints), expected, rtol=1e-6)
