"""What must hold of any mechanics: energy, periods, Newton's law, work; on one joint and on three."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import load_machine
from model import layout as at
from model.dynamics import recursive
from model.machine_model.model import base_model
from model.simulation.bodies import chain_body
from model.simulation.inputs import inputs_of
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.machines import pendulum, slide
from tests.model.simulation.records import ramp_trace, trace_of


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


def test_without_drive_and_friction_energy_is_kept() -> None:
    machine = load_machine("ma2000")
    model = base_model(machine, friction=False).with_values(
        {f"joint{j}.motor.back_emf_constant": 0.0 for j in (1, 2, 3)}
    )
    start = np.array([[3.0, 0.4], [0.8, -0.3], [0.1, 0.5]])
    trace = ramp_trace(machine, duration=1.0)
    trace = replace(trace, drive=np.zeros_like(trace.position))
    run = simulate(model, inputs_of(trace, machine), Options(loop="open", initial=start))
    shared, joints = model.vector[: at.SHARED].copy(), model.vector[at.SHARED :].reshape(3, -1).copy()
    chain = chain_body(shared, joints, np.zeros(3, np.int64))
    energy = [
        recursive.kinetic_energy(chain, q.copy(), v.copy()) + recursive.potential_energy(chain, q.copy())
        for q, v in zip(run.position, run.velocity, strict=True)
    ]
    assert np.ptp(run.position, axis=0).min() > 0.1
    assert np.ptp(energy) < 1e-8


def test_a_record_of_drive_alone_is_repeated_in_open_loop_and_only_so() -> None:
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
    with pytest.raises(TraceError, match="has no set points; simulate it in open loop"):
        simulate(model, alone)
    with pytest.raises(TraceError, match="has no drive, which a simulation in open loop needs"):
        simulate(model, ramp, Options(loop="open"))
    with pytest.raises(TraceError, match="neither set points nor drive"):
        simulate(model, replace(ramp, set_point=None))


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


def test_a_cascade_brings_the_carriage_to_its_set_point() -> None:
    model = base_model(slide())
    wanted = np.full((200, 1), 0.1)
    trace = trace_of(wanted, 0.01, position=np.zeros((200, 1)))
    run = simulate(model, trace)
    assert run.position[-1, 0] == pytest.approx(0.1, abs=1e-4)
    assert run.position[:, 0].max() < 0.102


@pytest.mark.parametrize(
    ("positions", "says"),
    [(np.zeros((2, 3)), "at least 3 are needed"), (np.full((50, 3), 180.0), "degrees"), (np.zeros((50, 2)), "joint 3")],
)
def test_traces_that_cannot_be_simulated_are_refused(positions: np.ndarray, says: str) -> None:
    with pytest.raises(TraceError, match=says):
        simulate(base_model(load_machine("ma2000")), trace_of(positions))


def test_an_unstable_loop_is_said_to_be_one() -> None:
    model = base_model(pendulum()).with_effect("spring_torque", (1,), {"stiffness": -9.0})
    trace = trace_of(np.zeros((3000, 1)), 0.01, drive=np.zeros((3000, 1)))
    with pytest.raises(SpecError, match="does not stay finite"):
        simulate(model, trace)
