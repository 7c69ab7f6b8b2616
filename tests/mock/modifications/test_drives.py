"""Effects of motors, amplifiers and gears: sign, size, and the joint they act on."""

import itertools
import math

import pytest

from mock_controller.modifications.registry import build_modifications
from mock_controller.plant import default_plant
from tests.mock.modifications.steady import STRETCHED, effect, plant_with, steady_rate, without_friction


def test_a_weak_magnet_gives_a_faster_motor_with_less_torque() -> None:
    joint = default_plant().joints[0]
    plain = plant_with(parameters=without_friction())
    weak = plant_with(effect("weakened_magnet", joint=1, loss=0.4), parameters=without_friction())
    electrical, flux = joint.torque_constant * joint.back_emf_constant / joint.resistance, 0.6
    damping = (flux**2 * electrical + joint.viscous_friction) / (electrical + joint.viscous_friction)
    assert steady_rate(weak, 1, 0.5) / steady_rate(plain, 1, 0.5) == pytest.approx(flux / damping, rel=1e-3)


def test_inductance_delays_the_torque_and_changes_nothing_in_the_end() -> None:
    plain = plant_with(parameters=without_friction())
    late = plant_with(effect("motor_inductance", joint=1, inductance=0.05), parameters=without_friction())
    for plant in (plain, late):
        plant.advance([0.4, 0, 0, 0, 0, 0], 10_000)
    assert 0.0 < late.joint_rates[0] < 0.7 * plain.joint_rates[0]
    assert steady_rate(late, 1, 0.4) == pytest.approx(steady_rate(plain, 1, 0.4), rel=0.01)


def test_a_stalled_motor_warms_to_where_its_loss_leaves_through_its_case() -> None:
    theta = 20.0
    warm = effect("resistance_drift", joint=1, thermal_resistance=theta, time_constant=0.5)
    plant = plant_with(warm, parameters=without_friction())
    plant.stall(1)
    plant.advance([0.2, 0, 0, 0, 0, 0], 10_000_000)
    volts, cold = 0.2 * 28, default_plant().joints[0].resistance
    # R = R0 (1 + α θ u²/R)
    expected = 0.5 * (cold + math.sqrt(cold**2 + 4 * cold * 0.0039 * theta * volts**2))
    assert warm.resistance == pytest.approx(expected, rel=1e-4)
    torque = 600 * 0.0208 * volts / cold
    assert warm.torque_change(torque, 0.0, 0.0, 0.0) == pytest.approx(torque * (cold / expected - 1), rel=1e-3)
    plant.release(1)
    plant.reset(STRETCHED)
    assert warm.resistance == cold


@pytest.mark.parametrize("rise", [0.5, -0.3])
def test_a_winding_warmed_from_outside_loses_torque_with_time_and_not_with_current(rise: float) -> None:
    outside = effect("resistance_rise", joint=1, rise=rise, time_constant=20.0)
    plant_with(outside, parameters=without_friction())
    for time in (0.0, 10.0, 60.0):
        resistance = 1.0 + rise * (1.0 - math.exp(-time / 20.0))
        assert [outside.torque_change(torque, time, 0.0, 0.0) for torque in (0.0, 1.0, -4.0)] == pytest.approx(
            [0.0, 1.0 / resistance - 1.0, 4.0 - 4.0 / resistance]
        )


def test_a_threshold_passes_nothing_below_it_and_all_above() -> None:
    plant = plant_with(effect("amplifier_threshold", joint=2, width=2.0))
    plant.advance([0.0, 0.07, 0.0, 0, 0, 0], 1000)
    assert plant.motor_volts[1] == 0.0
    plant.advance([0.0, -0.5, 0.07, 0, 0, 0], 1000)
    assert plant.motor_volts[1:3] == pytest.approx((-14.0, 1.96))


def test_supply_limit_cuts_its_joint_and_no_other() -> None:
    plant = plant_with(effect("supply_limit", joint=2, reduction=10.0))
    plant.advance([1.25, 1.25, -1.25, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == pytest.approx((35.0, 26.0, -35.0))
    plant.advance([0, -1.25, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[1] == pytest.approx(-26.0)


def test_slew_rate_lets_the_output_climb_so_much_a_step() -> None:
    plant = plant_with(effect("amplifier_slew_rate", joint=1, time_per_volt=1e-3))
    plant.advance([0.5, 0.5, 0, 0, 0, 0], 3000)
    assert plant.motor_volts[:2] == pytest.approx((3.0, 14.0))
    plant.advance([0.5, 0.5, 0, 0, 0, 0], 20_000)
    assert plant.motor_volts[:2] == pytest.approx((14.0, 14.0))


def test_coupled_drives_share_volts_in_one_direction() -> None:
    plant = plant_with(effect("drive_coupling", joint=1, onto=2, share=0.1))
    plant.advance([0.5, 0, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == pytest.approx((14.0, 1.4, 0.0))
    plant.advance([0, 0.5, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == pytest.approx((0.0, 14.0, 0.0))


@pytest.mark.parametrize("delay", [0.004, 0.0043, 0.065])
def test_delayed_drive_comes_late_and_whole(delay: float) -> None:
    plant = plant_with(effect("input_delay", joint=1, delay=delay))
    seen = []
    for step in range(100):
        plant.advance([0.5 if step < 20 else 0.0, 0, 0.5, 0, 0, 0], 1000)
        seen.append(plant.motor_volts[0])
        assert plant.motor_volts[2] == 14.0
    centre = sum(k * volts for k, volts in enumerate(seen)) / sum(seen)
    assert sum(seen) == pytest.approx(20 * 14.0)
    assert centre - 9.5 == pytest.approx(delay * 1e3)


def test_ripple_repeats_so_many_times_a_turn() -> None:
    ripple = effect("torque_ripple", joint=3, amplitude=2.0, periods=12.0, phase=0.3)
    turn = 2 * math.pi
    values = [ripple.joint_torque(0.0, turn * k / 1200, 0.0) for k in range(1200)]
    assert max(values) == pytest.approx(2.0, rel=1e-3)
    assert sum(a < 0 <= b for a, b in itertools.pairwise(values)) == 12
    cogging = effect("detent_cogging", joint=3, amplitude=2.0, periods=12.0)
    sharp = [cogging.joint_torque(0.0, turn * k / 1200, 0.0) for k in range(1200)]
    assert max(sharp) == pytest.approx(2.0, rel=0.35)
    assert max(b - a for a, b in itertools.pairwise(sharp)) > 2 * max(b - a for a, b in itertools.pairwise(values))


def test_gear_loss_is_a_share_of_the_torque_it_transmits() -> None:
    lossy = effect("gear_loss", joint=1, loss=0.25)
    assert lossy.torque_change(-8.0, 0.0, 0.0, 0.0) == 0.0
    assert lossy.friction_level(1.0, 0.0, 0.3) == pytest.approx(3.0)
    plain, slow = plant_with(parameters=without_friction()), plant_with(lossy, parameters=without_friction())
    for plant in (plain, slow):
        plant.advance([0.5, 0, 0, 0, 0, 0], 30_000)
    assert 0.75 * plain.joint_rates[0] < slow.joint_rates[0] < 0.95 * plain.joint_rates[0]


def test_a_compliant_joint_twists_in_proportion_to_its_load() -> None:
    (spring,) = build_modifications([("joint_compliance", {"joint": 2, "compliance": 1e-3, "damping": 4.0})])
    plant = plant_with(spring, angles=(math.pi, 0.3, 0.0, 0.0, 0.0, 0.0))
    plant._rotors[1]._inertia = 1e9  # the rotor is held
    plant.advance([0.0] * 6, 800_000)
    sag = 0.3 - plant.joint_angles[1]
    body = default_plant().rigid_body
    reach = body.a2 + body.a3
    weight = 9.81 * (0.5 * body.m2 * body.a2 + body.m3 * (body.a2 + 0.5 * body.a3) + body.m_load * reach)
    assert sag == pytest.approx(1e-3 * weight * math.cos(0.3), rel=0.35)  # friction holds a part of it
    assert plant.joint_angles[0] == pytest.approx(math.pi, abs=1e-3)


def test_backlash_lets_the_link_fall_by_its_play_and_no_further() -> None:
    (loose,) = build_modifications([("backlash", {"joint": 3, "play": 0.02, "stiffness": 4000.0, "damping": 1.0})])
    plant = plant_with(loose, parameters=default_plant(), angles=(math.pi, 0.3, -0.3, 0.0, 0.0, 0.0))
    plant._rotors[2]._inertia = 1e9
    for joint in (1, 2):
        plant.stall(joint)
    plant.advance([0.0] * 6, 500_000)
    fallen = -0.3 - plant.joint_angles[2]
    assert 0.5 * 0.02 - 1e-4 < fallen < 0.5 * 0.02 + 2.3 / 4000 + 1e-4
