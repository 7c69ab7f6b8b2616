"""The torque balance: on simulated records whose torques are known, and its derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from model import layout as at
from model.fitting.choice import chosen_unknowns
from model.fitting.options import FitOptions
from model.inverse_dynamics.link_motion import link_motion
from model.inverse_dynamics.recorded_motion import recorded_motion
from model.inverse_dynamics.torque_balance import TorqueBalance, _follow_with_lag
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.inverse_dynamics.test_fit_torques import rod, swinging
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


def test_derivatives_are_those_of_the_residual() -> None:
    """Without Coulomb friction the residual is linear in mass and viscous friction."""
    model = rod().without_effect("coulomb_friction")
    balance = TorqueBalance(model, (recorded_motion(swinging(1), model.machine, 12.0),))
    unknowns = chosen_unknowns(model, FitOptions(parameters=("link1.mass", "*viscous*"), use_priors=False))
    values = {u.name: u.start for u in unknowns}
    here = balance.residual(values)
    for u in unknowns:
        far = balance.residual({**values, u.name: 2 * u.start})
        np.testing.assert_allclose(balance.slope(values, here, u)[0] * u.start, far[0] - here[0], atol=1e-9)


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
    assert sensor is not None
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


def test_a_vanishing_error_of_a_sensor_changes_nothing() -> None:
    """A residual that jumps where an error begins would be evidence for errors of any size."""
    trace, _ = seen_through_a_bent_sensor(tachometer=False)
    model = rod().with_effect("potentiometer_offset", (1,))
    balance = TorqueBalance(model, (recorded_motion(trace, model.machine, 12.0),))
    without, next_to_none = (
        balance.residual({"joint1.potentiometer_offset.offset": value})[0] for value in (0.0, 1e-12)
    )
    np.testing.assert_allclose(next_to_none, without, atol=1e-8 * float(np.abs(without).max()))


@pytest.mark.parametrize("time_constant", [0.0, 1e-4, 0.003, 0.05])
def test_a_gear_that_damps_follows_a_straight_torque_late(time_constant: float) -> None:
    period = 0.004
    time = period * np.arange(400)
    followed = _follow_with_lag(2.0 * time, time_constant, period)
    lag = time_constant * (1.0 - np.exp(-time / time_constant)) if time_constant else np.zeros_like(time)
    np.testing.assert_allclose(followed, 2.0 * (time - lag), atol=1e-12)
