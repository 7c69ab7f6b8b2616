"""What must hold of any mechanics, and bodies against sums over point masses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model import layout as at
from model.arrays import Floats
from model.drives.controller import GAINS, MEMORY, SCALE, D, I, P, board_pid
from model.drives.sensor import reading
from model.dynamics import recursive
from model.kinematics.chain import ChainArrays
from model.machine_model.model import base_model
from model.simulation.bodies import chain_body
from model.simulation.chain_of_model import chain_of, gravity_loads
from model.simulation.dynamics_of_run import chain_levels
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.machines import pendulum, slide
from tests.model.simulation.records import ramp_inputs, ramp_trace, trace_of


def test_a_pendulum_swings_with_the_period_of_its_elliptic_integral() -> None:
    amplitude = 1.2
    model = base_model(pendulum())
    start = np.array([[-np.pi / 2 + amplitude, 0.0]])
    trace = trace_of(np.zeros((600, 1)), 0.01, drive=np.zeros((600, 1)))
    swing = simulate(model, trace, Options(loop="open", initial=start)).position[:, 0] + np.pi / 2
    down = np.flatnonzero((swing[:-1] > 0) & (swing[1:] <= 0))
    crossings = 0.01 * (down + swing[down] / (swing[down] - swing[down + 1]))
    period = 4 * np.sqrt(2 * 0.5 / (3 * 9.81)) * ellipk(np.sin(amplitude / 2) ** 2)
    assert np.diff(crossings).mean() == pytest.approx(period, rel=1e-4)


def test_a_record_of_drive_alone_is_repeated_in_open_loop() -> None:
    machine = load_machine("ma2000")
    model = base_model(machine)
    closed = simulate(model, ramp_trace(machine), Options(quantise=False))
    ramp = ramp_trace(machine)
    driven = replace(ramp, drive=closed.drive)
    alone = replace(driven, set_point=None)
    opened = simulate(model, alone, Options(loop="open", quantise=False))
    np.testing.assert_array_equal(
        opened.position, simulate(model, driven, Options(loop="open", quantise=False)).position
    )
    np.testing.assert_allclose(opened.position, closed.position, atol=1e-5)  # the drive before the record differs


def test_a_carriage_obeys_newton_and_its_friction() -> None:
    model = base_model(slide())
    drive = np.full((100, 1), 2.0)
    trace = trace_of(np.zeros((100, 1)), 0.01, drive=drive)
    free = simulate(model, trace, Options(loop="open", quantise=False))
    assert free.velocity[-1, 0] == pytest.approx(1.5 * 2.0 / 2.5 * 0.99, rel=1e-9)
    rubbed = simulate(
        model.with_effect("coulomb_friction", (1,), {"torque": 1.0}), trace, Options(loop="open", quantise=False)
    )
    assert rubbed.velocity[-1, 0] == pytest.approx((3.0 - 1.0) / 2.5 * 0.99, rel=1e-2)
    held = simulate(
        model.with_effect("coulomb_friction", (1,), {"torque": 4.0}), trace, Options(loop="open", quantise=False)
    )
    assert np.abs(held.position).max() < 2e-5  # within the distance over which friction builds up
    assert model.with_effect("coulomb_friction", (1,)).parameter("joint1.coulomb_friction.torque").unit == "N"


def test_a_cascade_brings_the_carriage_to_its_set_point_and_an_unstable_loop_is_said() -> None:
    model = base_model(slide())
    wanted = np.full((200, 1), 0.1)
    trace = trace_of(wanted, 0.01, position=np.zeros((200, 1)))
    run = simulate(model, trace)
    assert run.position[-1, 0] == pytest.approx(0.1, abs=1e-4)
    assert run.position[:, 0].max() < 0.102
    model = base_model(pendulum()).with_effect("spring_torque", (1,), {"stiffness": -9.0})
    trace = trace_of(np.zeros((3000, 1)), 0.01, drive=np.zeros((3000, 1)))
    with pytest.raises(SpecError, match="does not stay finite"):
        simulate(model, trace)


# ---- The controller and converters against vectors worked out by hand.


def row(joint: int) -> np.ndarray:
    vector = base_model(load_machine("ma2000")).vector
    return vector[at.slot(joint, 0) : at.slot(joint + 1, 0)].copy()


@pytest.mark.parametrize(
    ("gains", "errors", "powers"),
    [
        ((2, 0, 0), (0, 3, -5, 63, 64, -200), (0, 6, -10, 126, 127, -127)),
        # sum before each period: 0, 20, 40, 60, 80 → 0, 0, 0, 0, 1 after the division by 64
        ((1, 2, 0), (10, 10, 10, 10, 10), (10, 10, 10, 10, 11)),
        # a negative sum is divided towards minus infinity: −2 / 64 → −1
        ((1, 2, 0), (-1, -1), (-1, -2)),
        ((1, 0, 3), (4, 6, 1), (4, 12, -14)),
    ],
)
def test_integer_pid(gains: tuple[int, int, int], errors: tuple[int, ...], powers: tuple[int, ...]) -> None:
    own, memory = np.zeros(GAINS), np.zeros(MEMORY)
    own[[P, I, D]], own[SCALE] = gains, 1.0
    memory[1] = errors[0]
    assert [board_pid(float(e), own, row(1), True, memory) for e in errors] == list(powers)


def test_the_sum_does_not_grow_further_into_a_limit_that_is_reached() -> None:
    own, memory = np.zeros(GAINS), np.zeros(MEMORY)
    own[[P, I]], own[SCALE] = (2.0, 1.0), 1.0
    for _ in range(5):
        assert board_pid(100.0, own, row(1), True, memory) == 127.0
    assert memory[0] == 0.0
    assert board_pid(-10.0, own, row(1), True, memory) == -20.0


def test_readings_round_to_counts_and_power_is_that_of_the_same_period() -> None:
    # Readings round half up to counts
    joint = row(3)
    angle = joint[at.AT_ZERO] + joint[at.RAD_PER_COUNT] * np.array([2047.4, 2047.5, 2048.0])
    assert [reading(float(a), 0.0, True, joint) for a in angle] == [2047.0, 2048.0, 2048.0]
    assert reading(float(angle[0]), 0.0, False, joint) == pytest.approx(2047.4)
    # Power is the gain times the error of the same period
    model = base_model(load_machine("ma2000"))
    run = simulate(model, ramp_inputs(model.machine))
    counts = run.error / [model.machine.calibration(j).rad_per_count for j in (1, 2, 3)]
    assert np.abs(counts - np.round(counts)).max() < 1e-6
    assert np.array_equal(run.power, np.clip(2 * np.round(counts), -127, 127))
    assert np.abs(run.drive - run.power * 36 / 127).max() < 1e-12
    # Static error falls with the gain
    machine = load_machine("ma2000")
    model = base_model(machine, friction=False)
    inputs = ramp_inputs(machine, duration=3.0)
    errors = []
    for gain in (1.0, 2.0):
        inputs.gains[:, P] = gain
        errors.append(simulate(model, inputs, Options(quantise=False)).error[-1])
    assert errors[0][1:] == pytest.approx(2 * errors[1][1:], rel=0.05)  # the posture differs a little
    assert abs(errors[1][1]) > 1e-4


# ---- Bodies as the equations of motion read them, held against sums over point masses


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


def test_a_body_is_moved_to_the_origin_of_its_frame_and_grows_in_shape() -> None:
    tensor = np.array([[0.4, 0.03, -0.05], [0.03, 0.5, 0.07], [-0.05, 0.07, 0.6]])
    names = ("INERTIA_XX", "INERTIA_XY", "INERTIA_XZ", "INERTIA_YY", "INERTIA_YZ", "INERTIA_ZZ")
    own = dict(zip(names, tensor[np.triu_indices(3)], strict=True))
    centre = {"CENTRE_X": -0.3, "CENTRE_Y": 0.1, "CENTRE_Z": 0.2, "SHIFT": 0.05}
    found = body_of(joint(at.BODY, MASS=2.0, **own, **centre)).inertial[0]
    np.testing.assert_allclose(found, inertial(2.0, np.array([-0.25, 0.1, 0.2]), tensor))
    # A body of the same shape that is a quarter heavier has a quarter more inertia; one without mass has no shape
    heavier = body_of(joint(at.BODY, MASS=2.0, MASS_ADDED=0.5, CENTRE_X=-0.3, **own)).inertial[0]
    np.testing.assert_allclose(heavier, inertial(2.5, np.array([-0.3, 0.0, 0.0]), 1.25 * tensor))
    point = body_of(joint(at.BODY, MASS_ADDED=0.5, CENTRE_X=-0.3, **own)).inertial[0]
    np.testing.assert_allclose(point, inertial(0.5, np.array([-0.3, 0.0, 0.0]), tensor))


def test_rods_cylinders_and_loads_are_where_their_joints_say() -> None:
    found = body_of(joint(at.ROD, MASS=1.2, A=0.5, SHIFT=0.04)).inertial[0]
    places = -0.5 + (np.arange(2000) + 0.5) * 0.5 / 2000 + 0.04
    points = [inertial(1.2 / 2000, np.array([x, 0.0, 0.0]), np.zeros((3, 3))) for x in places]
    np.testing.assert_allclose(found, np.sum(points, axis=0), rtol=1e-6, atol=1e-12)
    # Half of m r² about that axis, a quarter across it, about the origin of the frame before it
    found = body_of(joint(at.CYLINDER, MASS=3.0, RADIUS=0.2, A=0.1, ALPHA=0.7)).inertial[0]
    axis = about_x(0.7).T @ [0.0, 0.0, 1.0]
    tensor = 0.25 * 3.0 * 0.2**2 * (np.eye(3) + np.outer(axis, axis))
    np.testing.assert_allclose(found, inertial(3.0, np.array([-0.1, 0.0, 0.0]), tensor), atol=1e-15)
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


def test_gravity_comes_from_elsewhere_on_a_tilted_base_and_pulls_at_the_middle_of_a_rod() -> None:
    found = body_of(joint(at.ROD), GRAVITY_X=1.0, GRAVITY_Y=2.0, GRAVITY_Z=-9.0, TILT_X=0.3, TILT_Y=-0.4).gravity
    np.testing.assert_allclose(found, about_y(-0.4).T @ about_x(0.3).T @ [1.0, 2.0, -9.0])
    angles = np.linspace(-2.0, 2.0, 9)
    found = gravity_loads(base_model(pendulum()), angles[:, None])
    np.testing.assert_allclose(found[:, 0], 1.2 * 9.81 * 0.25 * np.cos(angles))


def test_a_model_s_chain_has_its_tilt_its_load_and_the_values_of_another_vector() -> None:
    arm = base_model(load_machine("ma2000"))
    chain = chain_of(arm.with_effect("base_tilt", values={"about_x": 0.05, "about_y": -0.03}))
    np.testing.assert_allclose(chain.gravity, about_y(-0.03).T @ about_x(0.05).T @ chain_of(arm).gravity)
    loads = [chain_of(arm, arm.with_values({"load.mass": mass}).vector).inertial[2, 0] for mass in (1.0, 1.75)]
    assert loads[1] - loads[0] == pytest.approx(0.75)
    assert chain_of(base_model(slide())).prismatic.tolist() == [True]


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
