"""The torque balance on records whose torques are known: derivatives, drive limits, damped gears, noise of repeats."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.discrepancy.inverse_dynamics.candidates import _has_effect
from model.fitting.choice import chosen_unknowns
from model.fitting.options import FitOptions
from model.inverse_dynamics.drive_limits import LATER, at_shown_limit, pieces_of, stands_at_limit
from model.inverse_dynamics.link_motion import link_motion
from model.inverse_dynamics.recorded_motion import RecordedMotion, recorded_motion, recorded_motions
from model.inverse_dynamics.repeats import TorqueNoise
from model.inverse_dynamics.torque_balance import TorqueBalance, _follow_with_lag
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.rigs import bench_machine, slide_machine
from tests.model.inverse_dynamics.test_fit_torques import EXAMPLES, rod, swinging
from tests.model.simulation.records import trace_of


def test_required_torque_along_a_simulated_trace_is_what_the_motor_supplied() -> None:
    """Each joint on a sine of its own: inertia, speed, gravity and back-EMF all take part."""
    model = base_model(load_machine("ma2000"), friction=False).with_values({"controller.delay": 0.0})
    time = 0.002 * np.arange(1500)

    def drive(t: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.stack([3 * np.sin(5 * t), 4 * np.sin(4 * t + 0.5) + 2, 3 * np.sin(7 * t)], axis=1)

    at_start = np.tile([np.pi, 0.8, -0.5], (len(time), 1))
    run = simulate(model, trace_of(at_start, 0.002, drive=drive(time)), Options(quantise=False, loop="drive"))
    # The board holds a drive for 20 ms, so 10 ms late on average, and this simulation for 2 ms.
    recorded = drive(time + 0.009)
    measured = trace_of(at_start, 0.002, position=run.position, velocity=run.velocity, drive=recorded)
    balance = TorqueBalance(model, (recorded_motion(measured, model.machine, 12.0),))
    left, supplied = balance.residual({})[0], balance.supplied_by_drive()[0]
    assert (np.abs(left).max(axis=0) < (0.06, 0.03, 0.03) * np.abs(supplied).max(axis=0)).all()
    # what a warm winding does not let through is missing in full: no rise is large enough to explain the drive away
    lost = [
        TorqueBalance(model.with_effect("resistance_rise", (2,), {"rise": rise, "time_constant": 1.0}), balance.records)
        for rise in (1.0, 2.0)
    ]
    some, twice = (np.std(one.residual({})[0][:, 1]) for one in lost)
    assert twice == pytest.approx(2.0 * some, rel=0.1)


def test_derivatives_are_those_of_the_residual_and_a_vanishing_error_changes_nothing() -> None:
    # Without Coulomb friction the residual is linear in mass and viscous friction
    model = rod().without_effect("coulomb_friction")
    balance = TorqueBalance(model, (recorded_motion(swinging(1), model.machine, 12.0),))
    unknowns = chosen_unknowns(model, FitOptions(parameters=("link1.mass", "*viscous*"), use_priors=False))
    values = {u.name: u.start for u in unknowns}
    here = balance.residual(values)
    for u, slope in zip(unknowns, balance.slopes(values, unknowns), strict=True):
        far = balance.residual({**values, u.name: 2 * u.start})
        np.testing.assert_allclose(slope[0] * u.start, far[0] - here[0], atol=1e-9)
    # A residual that jumps where an error begins would be evidence for errors of any size
    trace, _ = seen_through_a_bent_sensor(tachometer=False)
    model = rod().with_effect("potentiometer_offset", (1,))
    balance = TorqueBalance(model, (recorded_motion(trace, model.machine, 12.0),))
    without, next_to_none = (
        balance.residual({"joint1.potentiometer_offset.offset": value})[0] for value in (0.0, 1e-12)
    )
    np.testing.assert_allclose(next_to_none, without, atol=1e-8 * float(np.abs(without).max()))


def test_records_that_cannot_be_compared_are_refused() -> None:
    model, trace = rod(), swinging(1)
    parts = {name: getattr(trace, name)[:126] for name in ("time", "position", "velocity", "drive", "set_point")}
    short = replace(trace, **parts)
    with pytest.raises(TraceError, match=r"lasts 0\.\d+ s; a comparison of torques below 12 Hz needs 1 s"):
        recorded_motion(short, model.machine, 12.0)
    with pytest.raises(SpecError, match=r"cutoff 200 Hz: trace swing1 is sampled every 0\.004 s"):
        recorded_motion(trace, model.machine, 200.0)


BENT = {
    "joint1.potentiometer_gain.relative": 0.05,
    "joint1.potentiometer_offset.offset": 0.03,
    "joint1.potentiometer_nonlinearity.bend_2": 0.02,
}


def seen_through_a_bent_sensor(*, tachometer: bool) -> tuple[Trace, NDArray[np.float64]]:
    """A swing as a sensor with the errors of `BENT` reads it, and its true position, speed and acceleration (k, 3)."""
    sensor = rod().machine.joint(1).sensor
    span, zero = sensor.range.value, sensor.at_zero.value
    time = 0.004 * np.arange(3000)
    q = 0.6 * np.sin(2.0 * time) + 0.2 * np.sin(5.0 * time)
    v = 1.2 * np.cos(2.0 * time) + 1.0 * np.cos(5.0 * time)
    a = -2.4 * np.sin(2.0 * time) - 5.0 * np.sin(5.0 * time)
    x = (q - zero) / span
    read = q + 0.05 * (x - 0.5) * span + 0.03 + 0.02 * np.sin(2 * np.pi * x)
    derived = v * (1.05 + 0.02 * 2 * np.pi / span * np.cos(2 * np.pi * x))
    noise = 1e-5 * np.random.default_rng(1).standard_normal((2, len(time)))
    speed = (v if tachometer else derived) + noise[0]
    columns = (read + noise[1], speed, np.ones(len(time)))
    position, velocity, drive = (column[:, None] for column in columns)
    trace = trace_of(position, 0.004, position=position, velocity=velocity, drive=drive)
    return trace, np.column_stack([q, v, a])


@pytest.mark.parametrize("tachometer", [True, False])
def test_errors_of_a_position_sensor_bend_only_the_speeds_that_are_formed_of_it(tachometer: bool) -> None:
    trace, truth = seen_through_a_bent_sensor(tachometer=tachometer)
    model = rod()
    for name in ("potentiometer_gain", "potentiometer_offset", "potentiometer_nonlinearity"):
        model = model.with_effect(name, (1,))
    model = model.with_values(BENT)
    record = recorded_motion(trace, model.machine, 12.0)
    assert record.own_speed.tolist() == [tachometer]
    joints = model.vector[at.SHARED :].reshape(1, at.PER_JOINT)
    links = link_motion(record, joints)
    inside = slice(record.edge, -record.edge)
    every = round(record.period / 0.004)
    found = np.column_stack([links.position, links.speed, links.acceleration])[inside]
    # errors at the angle itself, and not at the reading, which lies a few hundredths beside it
    for column, tolerance in zip(range(3), (1e-4, 1e-4, 5e-3), strict=True):
        np.testing.assert_allclose(found[:, column], truth[::every, column][: len(record.time)][inside], atol=tolerance)


@pytest.mark.parametrize("time_constant", [0.0, 1e-4, 0.003, 0.05])
def test_a_gear_that_damps_follows_a_straight_torque_late(time_constant: float) -> None:
    period = 0.004
    time = period * np.arange(400)
    followed = _follow_with_lag(2.0 * time, time_constant, period)
    lag = time_constant * (1.0 - np.exp(-time / time_constant)) if time_constant else np.zeros_like(time)
    np.testing.assert_allclose(followed, 2.0 * (time - lag), atol=1e-12)


# ---- Where a recorded drive stands at a limit that no file states

WAVE = np.sin(0.05 * np.arange(600))


def at_limit(drive: Floats) -> list[int]:
    """Samples of a sliding joint's drive (r,) that stand at its limit."""
    return np.flatnonzero(stands_at_limit(drive[:, None], slide_machine())[:, 0]).tolist()


def with_runs(*runs: tuple[int, int, float]) -> Floats:
    """A wave with stretches (first, count) of one value."""
    drive: Floats = WAVE.copy()
    for first, count, value in runs:
        drive[first : first + count] = value
    return drive


def test_a_drive_stands_at_a_limit_where_it_stays_at_its_largest_value() -> None:
    assert at_limit(WAVE) == []
    assert at_limit(with_runs((100, 2, 3.0), (300, 2, -3.0))) == [], "two samples in a row are no stretch"
    found = at_limit(with_runs((100, 3, 3.0), (300, 1, -3.0)))
    assert found == [100, 101, 102, 300], "that it stays there once shows the limit, which acts at every sample there"
    assert at_limit(with_runs((100, 40, 3.0), (300, 40, -2.9))) == list(range(100, 140))
    drive = with_runs((100, 5, 3.0))
    drive[101], drive[103] = 3.0 * (1 - 5e-7), 3.0 * (1 - 1e-4)
    drive[200:203] = 3.0
    assert at_limit(drive) == [100, 101, 102, 104, 200, 201, 202]


@pytest.mark.parametrize(("calm", "found"), [(0.05, 0), (0.15, 510)])
def test_a_drive_that_only_switches_is_taken_as_it_was_recorded(calm: float, found: int) -> None:
    drive = 3.0 * np.sign(WAVE + 0.01)
    drive[: round(calm * len(drive))] = 0.5
    assert len(at_limit(drive)) == found


def test_every_joint_is_judged_by_its_own_drive_if_that_has_an_unknown_limit() -> None:
    drive = np.tile(WAVE[:, None], (1, 2))
    drive[200:230, 1] = -7.0
    found = stands_at_limit(drive, load_machine(str(EXAMPLES / "double_pendulum.toml")))
    assert found.any(axis=0).tolist() == [False, True]
    assert np.flatnonzero(found[:, 1]).tolist() == list(range(200, 230))
    assert at_limit(np.zeros(100)) == []
    assert not stands_at_limit(with_runs((100, 50, 3.0))[:, None], bench_machine()).any()


@given(mask=st.lists(st.booleans(), min_size=1, max_size=60), longest=st.integers(1, 12))
def test_pieces_cover_every_stretch_and_little_else(mask: list[bool], longest: int) -> None:
    at = np.array(mask)
    pieces = pieces_of(at, longest)
    covered = np.zeros(len(at) + LATER, dtype=bool)
    for piece in pieces:
        assert at[piece.start]
        assert 1 <= piece.stop - piece.start <= longest + LATER
        covered[piece] = True
    later = np.zeros_like(covered)
    for lag in range(LATER + 1):
        later[lag : lag + len(at)] |= at
    assert covered[: len(at)][at].all()
    assert not covered[~later].any(), "no further than the drive may act later"
    assert len({piece.start for piece in pieces}) == len(pieces)


def test_a_stretch_is_cut_into_pieces_and_a_rounded_top_is_no_limit() -> None:
    at = np.zeros(30, dtype=bool)
    at[4:14] = at[20] = True
    assert pieces_of(at, 6) == [slice(4, 10), slice(10, 14 + LATER), slice(20, 21 + LATER)]
    assert pieces_of(at, 20) == [slice(4, 14 + LATER), slice(20, 21 + LATER)]
    assert pieces_of(np.zeros(5, dtype=bool), 4) == []
    # A drive that is rounded comes to the top of a swing step by step; where it is cut off, it jumps there
    time = np.arange(0.0, 4.0, 0.001)
    swing = 3.0 * np.sin(2 * np.pi * 0.9 * time) + 0.5 * np.sin(2 * np.pi * 5.0 * time)
    rounded = 0.01 * np.round(swing / 0.01)
    assert (np.abs(rounded) == np.abs(rounded).max()).sum() > 3
    assert not at_shown_limit(rounded).any()
    steep = 0.01 * np.round(np.clip(40.0 * swing, -3.0, 3.0) / 0.01)
    assert at_shown_limit(steep).mean() > 0.5


@pytest.mark.parametrize("drive", [np.zeros(20), np.full(20, 2.0)])
def test_a_drive_of_one_size_shows_no_limit(drive: Floats) -> None:
    assert not at_shown_limit(drive).any()


# ---- The damping of a gear that gives is found with its compliance

STIFFNESS = 60.0


@pytest.mark.parametrize("damping", [0.15, 1.5])
def test_the_damping_of_a_gear_that_gives_fits_best_where_it_is(damping: float) -> None:
    """Twist follows torque late by compliance times damping: 2.5 and 25 ms."""
    trace = rigs.geared_trace(3, {"stiffness": STIFFNESS, "damping": damping}, 8.0)
    sound = base_model(rigs.geared_machine())
    model = sound.with_effect("joint_compliance", (1,), {"compliance": 1 / STIFFNESS})
    balance = TorqueBalance(model, recorded_motions([trace], model.machine, 12.0))
    (name,) = (p.name for p in model.parameters if p.effect == "joint_compliance" and p.part == "damping")

    def left(value: float) -> float:
        return float(np.sqrt(np.mean(np.concatenate(balance.residual({name: value})) ** 2)))

    tried = {factor * damping: left(factor * damping) for factor in (0.0, 0.3, 1.0, 3.0)}
    assert min(tried, key=lambda value: tried[value]) == damping, tried


def test_a_number_has_an_effect_of_the_library_where_that_does_the_same() -> None:
    motor = base_model(rigs.bench_machine())
    constant = motor.parameter("joint1.motor.torque_constant")
    assert _has_effect(motor, constant, lower=True), "a weakened magnet"
    assert not _has_effect(motor, constant, lower=False), "no effect makes a magnet stronger"
    assert not _has_effect(motor, motor.parameter("joint1.motor.rotor_inertia"), lower=True)
    arm = base_model(rigs.geared_machine())
    assert _has_effect(arm, arm.parameter("link1.centre_x"), lower=False), "a shifted centre of mass"
    assert not _has_effect(arm, arm.parameter("link1.centre_y"), lower=False)


# ---- The noise that repeated motion shows

TIME = np.arange(0.0, 20.0, 0.002)


ONE_WAY = np.array([False])


def motion(position: Floats) -> RecordedMotion:
    trace: Trace = rigs.trace_of("made", TIME, position[:, None], np.ones((len(TIME), 1)), "N")
    return recorded_motion(trace, rigs.slide_machine(), 8.0)


def residual(record: RecordedMotion, noise: float) -> Floats:
    """A large torque that follows from the motion, and noise."""
    moved = 5.0 * np.sin(20 * record.position[record.rows]) + 10.0 * record.speed[record.rows]
    return moved + noise * np.random.default_rng(1).standard_normal(moved.shape)


def noise_of(record: RecordedMotion, residual: Floats, round_: np.ndarray) -> Floats:
    return TorqueNoise(np.zeros(1), (record,), round_).of([residual])


def test_what_differs_between_passages_is_noise_also_of_a_joint_that_turns_round() -> None:
    record = motion(0.1 * np.sin(2 * np.pi * 0.5 * TIME))
    for noise in (0.2, 1.0):
        found = noise_of(record, residual(record, noise), ONE_WAY)
        assert abs(found[0] - noise) < 0.2 * noise
    record = motion(0.1 * np.sin(2 * np.pi * 0.02 * TIME**2) + 0.01 * TIME)
    assert noise_of(record, residual(record, 1.0), ONE_WAY)[0] == 0.0
    # A torque that repeats every turn is no noise, however far the joint has turned
    record = motion(np.pi * TIME + 0.5 * np.sin(np.pi * TIME))
    torque = 2.0 * np.sin(7 * record.position[record.rows])
    noisy = torque + 0.2 * np.random.default_rng(1).standard_normal(torque.shape)
    assert 0.18 < noise_of(record, noisy, np.array([True]))[0] < 0.24
    assert noise_of(record, noisy, ONE_WAY)[0] == 0.0
