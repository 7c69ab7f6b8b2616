"""The worlds' integrator: energy, steps, drives and friction against what is known without it."""

import math
from typing import Any

import mujoco
import numpy as np
import pytest

from trials.rigs.bodies import Bodies, Link, mjcf
from trials.rigs.drawing import sound_rig
from trials.rigs.engine import Motion, _motor_torque, simulate, step_within
from trials.rigs.kinds import KINDS
from trials.rigs.parameters import BRISTLE, LOOP, PID, SWITCH, TANH, joints

HANGING = (9.81, 0.0, 0.0)
LEVEL = (0.0, 0.0, -9.81)


def loop(step: float = 1e-4, period: float = 0.005) -> Any:
    made = np.zeros(1, LOOP)
    made["controller"], made["period"], made["step"] = PID, period, step
    return made


def free_fall(bodies: Bodies, start: list[float], count: int = 400, rotors: float = 0.02) -> Motion:
    free = joints(len(start))
    free["range"], free["count"], free["rotor"] = 2 * math.pi, 1e-4, rotors
    return simulate(bodies, free, loop(), np.tile(start, (count, 1)))


def angle_after(seconds: float, rate: float) -> float:
    """How far a rod has fallen under a controller without gains, of this rate in Hz."""
    free = joints(1)
    free["range"], free["count"], free["rotor"] = 2 * math.pi, 1e-6, 1e-9
    samples = np.full((1 + round(seconds * rate), 1), 0.4 * math.pi)
    motion = simulate(
        Bodies((Link.rod(0.3, 0.8),), 0.0, HANGING), free, loop(step_within(1.0 / rate, 1e-4), 1.0 / rate), samples
    )
    assert motion.time[-1] == pytest.approx(seconds)
    return float(motion.angle[-1, 0])


@pytest.mark.parametrize("rate", [50.0, 300.0, 400.0, 700.0, 7000.0])
def test_as_much_time_goes_by_as_is_written_down(rate: float) -> None:
    """At 300 Hz a period went by in thirty-three steps of 0.1 ms, and was written down with 3.33 ms."""
    assert angle_after(0.2, rate) == pytest.approx(angle_after(0.2, 250.0), abs=2e-4)
    assert 1.0 / rate / step_within(1.0 / rate, 1e-4) == pytest.approx(round(1e4 / rate), abs=1e-6)


def test_a_period_that_is_no_whole_number_of_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="not a whole number of steps"):
        simulate(Bodies((Link.rod(0.3, 0.8),), 0.0, HANGING), joints(1), loop(1e-4, 1 / 300), np.zeros((9, 1)))


@pytest.mark.parametrize(
    ("bodies", "start"),
    [
        (Bodies((Link.rod(0.3, 0.8),), 0.1, HANGING), [1.0]),
        (Bodies((Link.rod(0.3, 0.8), Link.rod(0.2, 0.4)), 0.0, HANGING), [1.0, -0.7]),
        (sound_rig("six-volts", KINDS["six-volts"], 3).bodies, [0.1, 0.8, -0.6, 0.2, 0.3, 0.1]),
    ],
    ids=["one joint", "two joints", "six joints"],
)
def test_an_arm_without_drives_and_friction_keeps_its_energy(bodies: Bodies, start: list[float]) -> None:
    motion = free_fall(bodies, start)
    model = mujoco.MjModel.from_xml_string(mjcf(bodies, (0.02,) * len(start)))
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    energies = []
    for angle, speed in zip(motion.angle[::40], motion.velocity[::40], strict=True):
        data.qpos[:], data.qvel[:] = angle, speed
        mujoco.mj_forward(model, data)
        energies.append(data.energy.copy())
    potential, kinetic = np.array(energies).T
    assert kinetic.max() > 0.05
    assert (potential + kinetic) == pytest.approx(potential[0] + kinetic[0], abs=2e-3 * kinetic.max())


def test_a_constant_voltage_gives_the_speed_and_time_of_a_motor() -> None:
    """(J) dω/dt = K u/R − K² ω/R, from rest, by a controller that asks for 10 V."""
    motor = joints(1)
    motor["torque_constant"] = motor["back_emf"] = 0.5
    motor["resistance"], motor["rotor"], motor["range"], motor["count"] = 2.0, 0.05, 6.0, 1e-4
    motor["p"], motor["limit"] = 1e6, 10.0
    asked = np.full((200, 1), 1e3)
    asked[0] = 0.0
    body = Bodies((Link(0.0, 0.0, 0.0, 0.0, 0.1, (0.0, 0.0, 0.0), (0.01, 0.01, 0.01)),), 0.0, LEVEL)
    motion = simulate(body, motor, loop(), asked)
    rate = 0.5**2 / 2.0 / 0.06
    time = motion.time - 0.005
    expected = np.where(time > 0, 20.0 * (1 - np.exp(-rate * time)), 0.0)
    assert motion.velocity[2:, 0] == pytest.approx(expected[2:], rel=1e-3)


@pytest.mark.parametrize(("speed", "torque"), [(0.0, 3.0), (3.0, 2.625), (-3.0, 3.0), (20.0, 0.5), (30.0, -0.75)])
def test_a_current_loop_runs_out_of_volts_where_the_motor_drives_and_not_where_it_brakes(
    speed: float, torque: float
) -> None:
    """3 N·m are asked for: 6 A of 12 V over 2 Ω at rest. A motor that turns faster than its supply can drive it gives
    current back."""
    (motor,) = joints(1)
    motor["torque_constant"] = motor["back_emf"] = motor["nominal_constant"] = 0.5
    motor["resistance"], motor["supply"], motor["gear"], motor["current_rate"] = 2.0, 12.0, 1.0, 1e3
    _, given = _motor_torque(3.0, 0.0, speed, 0.0, motor, 1.0)
    assert given == pytest.approx(torque)


@pytest.mark.parametrize("contact", [TANH, BRISTLE, SWITCH])
def test_every_contact_slides_with_coulomb_friction(contact: int) -> None:
    """A level disc thrown by nothing but a weight's torque slows down as friction says."""
    p = joints(1)
    p["contact"], p["coulomb"], p["sign_width"] = contact, 0.2, 2e-3
    p["bristle"], p["bristle_damping"] = 500.0, 1.0
    p["range"], p["count"], p["p"], p["limit"], p["gear"], p["torque_constant"] = 6.0, 1e-4, 1e6, 0.5, 1.0, 1.0
    body = Bodies((Link(0.0, 0.0, 0.0, 0.0, 0.1, (0.0, 0.0, 0.0), (0.05, 0.05, 0.05)),), 0.0, LEVEL)
    asked = np.full((100, 1), 1e3)
    asked[0] = 0.0
    motion = simulate(body, p, loop(), asked)
    acceleration = np.diff(motion.velocity[40:, 0]) / 0.005
    assert acceleration == pytest.approx((0.5 - 0.2) / 0.05, rel=1e-3)


@pytest.mark.parametrize("contact", [BRISTLE, SWITCH])
def test_friction_with_a_state_of_rest_holds_a_joint(contact: int) -> None:
    p = joints(1)
    p["contact"], p["coulomb"], p["bristle"], p["bristle_damping"] = contact, 1.0, 5000.0, 10.0
    p["range"], p["count"] = 6.0, 1e-4
    hanging = Bodies((Link.rod(0.3, 0.5),), 0.0, HANGING)
    motion = simulate(hanging, p, loop(), np.full((400, 1), 1.0))
    assert motion.angle[:, 0] == pytest.approx(1.0, abs=5e-4)  # bristles bend by some 2e-4 rad
    p["coulomb"] = 0.3
    assert abs(simulate(hanging, p, loop(), np.full((400, 1), 1.0)).angle[-1, 0] - 1.0) > 0.3


@pytest.mark.parametrize("kind", ["planar-pid", "arm-rounded"])
def test_half_the_step_moves_no_reading_by_a_tenth_of_a_count(kind: str) -> None:
    rig = sound_rig(kind, KINDS[kind], 11)
    rig.joints["contact"], rig.joints["i"] = TANH, 0.0
    time = np.arange(300) * float(rig.loop["period"][0])
    asked = np.array(rig.centre) + 0.2 * np.sin(2 * time)[:, None]
    fine = rig.loop.copy()
    fine["step"] = rig.loop["step"] / 2
    readings = [simulate(rig.bodies, rig.joints, each, asked).angle for each in (rig.loop, fine)]
    apart = np.abs(readings[0] - readings[1])[100:]  # once the loop has caught the arm
    assert apart.max() < 0.1 * 2 * math.pi / 2**16
