"""The default loop: joints 1 and 3 underdamped, joint 2 overdamped, all clearly stable.

The linearised sampled loop of each joint (inertia at the posture, back-EMF and viscous damping, zero-order hold,
computing delay) is worked out here on its own; friction is left out, as it only adds damping.
"""

import math

import mujoco
import numpy as np
import pytest
from scipy.linalg import expm

from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import Board, PeriodSnapshot, default_board
from mock_controller.plant import Plant, default_plant
from mock_controller.plant.rigid_body import build_model

POSTURES = [(45, 0), (45, 90), (90, 0), (0, 0), (30, -60)]
"""(θ2, θ3) in degrees: stretched out, folded and upright."""


class SampledLoop:
    """Joint (inertia J, damping c, torque per volt k) under volts = −K·angle, held, `delay` s after sampling."""

    def __init__(self, inertia: float, damping: float, per_volt: float, period: float, delay: float) -> None:
        system = np.array([[0, 1, 0], [0, -damping / inertia, per_volt / inertia], [0, 0, 0]])
        early, late = expm(system * delay), expm(system * (period - delay))
        self.period = period
        # State: angle, rate, volts still held from the last period.
        self.step = np.zeros((3, 3))
        self.step[:2] = np.hstack([late[:2, :2] @ early[:2, :2], late[:2, :2] @ early[:2, 2:]])
        self.push = np.append(late[:2, 2], 1.0)

    def poles(self, gain: float) -> np.ndarray:
        return np.linalg.eigvals(self.step - np.outer(self.push, [gain, 0, 0]))

    def largest_stable_gain(self) -> float:
        low, high = 1.0, 1e5
        while high / low > 1.001:
            middle = math.sqrt(low * high)
            low, high = (middle, high) if max(abs(self.poles(middle))) < 1 else (low, middle)
        return low

    def phase_margin(self, gain: float) -> float:
        frequencies = np.linspace(0.5, math.pi / self.period, 4000)
        resolvents = np.exp(1j * self.period * frequencies)[:, None, None] * np.eye(3) - self.step
        response = gain * np.linalg.solve(resolvents, self.push[:, None])[:, 0, 0]
        crossing = int(np.argmax(abs(response) < 1))
        return 180 + math.degrees(np.angle(response[crossing]))

    def damping_ratio(self, gain: float) -> float:
        """Of the slower two poles; the third belongs to the delay."""
        slow = sorted(self.poles(gain), key=abs)[-2:]
        s = np.log(np.array(slow, dtype=complex)) / self.period
        return float(min(-s.real / abs(s)))


def loop_of(joint: int, posture: tuple[int, int]) -> SampledLoop:
    parameters, timing = default_plant(), default_board().timing
    model = build_model(parameters, 1e-3)
    data = mujoco.MjData(model)
    data.qpos[:3] = [math.pi, *map(math.radians, posture)]
    mujoco.mj_forward(model, data)
    inertias = np.zeros((6, 6))
    mujoco.mj_fullM(model, data, inertias)
    drive = parameters.joints[joint - 1]
    n, k = drive.gear_ratio, drive.torque_constant / drive.resistance
    damping = n**2 * (k * drive.back_emf_constant + drive.viscous_friction)
    period, delay = timing.period * 1e-6, timing.computing_delay * 1e-6
    return SampledLoop(float(inertias[joint - 1, joint - 1]), damping, n * k, period, delay)


def default_gain(joint: int) -> float:
    """V/rad at P = 2: counts a radian, one DAC count a count and unit of P, 36 V over 127 counts."""
    return 2 * 4096 / default_board().calibrations[joint - 1].range_rad * 36 / 127


@pytest.mark.parametrize("posture", POSTURES)
def test_every_joint_has_twice_the_gain_and_thirty_degrees_to_spare(posture: tuple[int, int]) -> None:
    for joint in range(1, 7):
        loop, gain = loop_of(joint, posture), default_gain(joint)
        assert loop.largest_stable_gain() > 2.0 * gain, f"joint {joint}"
        assert loop.phase_margin(gain) > 30, f"joint {joint}"


@pytest.mark.parametrize("posture", POSTURES)
def test_joints_1_and_3_are_underdamped_and_joint_2_overdamped(posture: tuple[int, int]) -> None:
    ratios = [loop_of(joint, posture).damping_ratio(default_gain(joint)) for joint in (1, 2, 3)]
    assert 0.35 < ratios[0] < 0.55
    assert ratios[1] > 0.99
    assert 0.2 < ratios[2] < 0.35


def test_default_ramp_overshoots_on_joints_1_and_3_and_not_on_joint_2() -> None:
    """21.6° in 0.65 s, then held: 80 posture units as the controller takes them."""
    board = Board(default_board(), default_memory_map(), Plant(default_plant()), seed=1)
    board.run_until(500_000)
    start = board.memory.values("set_point")
    rows: list[PeriodSnapshot] = []
    for period in range(100):
        done = min(period * 0.02 / 0.65, 1.0)
        board.write_set_points({joint: start[joint - 1] + math.floor(80 * done + 0.5) for joint in (1, 2, 3)})
        board.run_until(510_000 + period * 20_000)
        snapshot = board.snapshots.newest()
        assert snapshot is not None
        rows.append(snapshot)
    overshoot = [-min(row.errors[joint] for row in rows[30:]) for joint in range(3)]
    assert overshoot[0] >= 3
    assert overshoot[1] <= 1
    assert overshoot[2] >= 3
    assert max(abs(error) for row in rows for error in row.errors[:3]) < 127
    assert max(abs(power) for row in rows for power in row.powers) < 127
    assert max(abs(error) for error in rows[-1].errors) <= 4
    assert board.counters.set_points_missed == 0
