"""What a machine file states of a sampled PID is what its simulation does."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine, parse_machine
from daq.contracts.quantity import Quantity
from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import Simulation, sensitivities, simulate
from tests.model.imported import imported
from tests.model.simulation import machines

PERIOD = 0.01


def quantity(value: float, unit: str, deviation: float | None = None) -> Quantity:
    return Quantity(value=value, unit=unit, source="test", deviation=deviation)


def slide(**stated: Any) -> Machine:
    """The slide with a plain PID on position, of which the file says more."""
    machine = machines.slide()
    controller = machine.controller.model_copy(update={"gains": ((60.0, 0.0, 8.0),), "velocity_gains": None, **stated})
    return Machine.model_validate(machine.model_copy(update={"controller": controller}).model_dump())


def record(set_points: Floats, **more: Any) -> Trace:
    """A record of these set points."""
    made = imported(period=PERIOD)
    time = PERIOD * np.arange(len(set_points))
    return Trace(made, (1,), time, set_points, set_point=set_points, **more)


def steps(size: float = 0.2) -> Floats:
    return size * (np.arange(150) // 40 % 2).astype(float)[:, None]


def run(machine: Machine, quantise: bool = True, **more: Any) -> Simulation:
    return simulate(base_model(machine), record(steps()), Options(quantise=quantise, **more))


def test_drive_and_error_keep_to_resolution_dead_band_and_limits() -> None:
    drive = run(slide(drive_resolution=quantity(0.14, "V"))).drive / 0.14
    assert np.allclose(drive, np.round(drive), atol=1e-9)
    assert np.ptp(drive) > 10
    still, moved = (run(slide(dead_band=quantity(band, "m"))).drive for band in (0.21, 0.19))
    assert not still.any()
    assert np.abs(moved).max() > 8.0
    assert run(slide(dead_band=quantity(0.21, "m")), quantise=False).drive.any()
    free, held = run(slide()).drive, run(slide(output_limit=quantity(5.0, "V"))).drive
    assert np.abs(free).max() > 8.0
    assert np.abs(held).max() == 5.0
    limit = {"output_limit": quantity(2.0, "V"), "gains": ((60.0, 400.0, 8.0),)}
    assert run(slide(**limit)).position.max() < 0.24, "a sum that grows at the limit would take the slide far beyond"


def test_set_points_are_rounded_and_an_error_of_the_gains_is_one_of_the_output() -> None:
    coarse = simulate(base_model(slide(set_point_resolution=quantity(0.3, "m"))), record(steps(0.2)))
    full = simulate(base_model(slide()), record(steps(0.3)))
    assert np.array_equal(coarse.position, full.position)
    stated = run(slide(gain_error=quantity(0.25, "1")), quantise=False)
    higher = run(slide(gains=((75.0, 0.0, 10.0),)), quantise=False)
    assert np.allclose(stated.position, higher.position, rtol=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_the_recorded_drive_is_the_input(share: float) -> None:
    """Rounding, limit and gains of the controller leave no trace in a simulation with the recorded drive."""
    machine = slide(drive_resolution=quantity(0.5, "V"), output_limit=quantity(5.0, "V"), gain_error=quantity(0.3, "1"))
    made = run(machine)
    given = record(steps(), drive=made.drive)
    given = Trace(given.record, (1,), given.time, made.reading, set_point=given.set_point, drive=made.drive)
    plain = base_model(slide())
    options = Options(quantise=False, following=share, recorded_drive=True)
    apart = np.abs(simulate(plain, given, options).reading - made.reading).max()
    assert apart < 2e-5, "the rounding of a reading"
    assert np.abs(simulate(plain, given, Options(following=share)).reading - made.reading).max() > 50 * apart


def test_what_a_file_says_to_be_uncertain_is_a_parameter_with_a_derivative() -> None:
    machine = slide(output_limit=quantity(5.0, "V", 0.2), gain_error=quantity(0.0, "1", 0.05))
    model = base_model(machine)
    names = ("joint1.controller.output_limit", "joint1.controller.gain_error")
    assert [(p.value, p.deviation) for p in map(model.parameter, names)] == [(5.0, 0.2), (0.0, 0.05)]
    found = sensitivities(model, record(steps()), [model.parameter(n) for n in names]).reading
    assert (np.abs(found).max(axis=(1, 2)) > 1e-4).all()


def test_a_zero_that_may_be_off_turns_the_link() -> None:
    text = machines.PENDULUM + "\n".join(
        (
            "[joints.sensor]",
            "bits = 16",
            'range = { value = 6.0, unit = "rad", source = "test" }',
            'at_zero = { value = -3.0, unit = "rad", source = "test", deviation = 0.02, low = -3.1 }',
        )
    )
    zero = base_model(parse_machine(text)).parameter("joint1.sensor.zero")
    assert (zero.value, zero.deviation, zero.slots) == (0.0, 0.02, (at.slot(1, at.THETA),))
    assert zero.low == pytest.approx(-0.1)


def test_numbers_that_no_method_uses_or_of_other_joints_are_refused() -> None:
    text = machines.PENDULUM.replace(
        'd = { value = 0.0, unit = "m",', 'd = { value = 0.0, deviation = 0.1, unit = "m",'
    )
    with pytest.raises(SpecError, match=r"joints.1.geometry.d: no method can use a deviation here") as error:
        parse_machine(text)
    assert "\n" not in str(error.value)
    with pytest.raises(ValueError, match=r"controller.output_limit has 2 numbers for 1 joints"):
        slide(output_limit=(quantity(5.0, "V"), quantity(5.0, "V")))


def test_a_current_gives_torque_through_the_gear() -> None:
    current = 'kind = "current"\ntorque_constant = { value = 0.05, unit = "N·m/A", source = "test" }\n'
    current += 'gear_ratio = { value = 20.0, unit = "1", source = "test" }'
    plain = 'kind = "gain"\ngain = { value = 1.0, unit = "N·m", source = "test" }'
    amperes = base_model(parse_machine(machines.PENDULUM.replace(plain, current)))
    torques = base_model(machines.pendulum())
    drive = 3.0 * np.sin(0.1 * np.arange(100))[:, None]
    given = record(np.zeros((100, 1)), drive=drive)
    moved = [simulate(m, given, Options(loop="open")).position for m in (amperes, torques)]
    assert np.allclose(*moved, rtol=1e-9)
    assert np.ptp(moved[0]) > 0.1


def test_seven_joints_are_simulated_and_a_simulation_shows_itself() -> None:
    head, _, joint = machines.PENDULUM.partition("[[joints]]")
    text = head.replace("modelled_joints = [1]", f"modelled_joints = {list(range(1, 8))}") + ("[[joints]]" + joint) * 7
    model = base_model(parse_machine(text))
    made = record(np.zeros((20, 1)))
    still = np.zeros((20, 7))
    seven = Trace(made.record, tuple(range(1, 8)), made.time, still, drive=still)
    assert np.isfinite(simulate(model, seven, Options(loop="open")).position).all()
    found = run(slide())
    assert repr(found) == "<Simulation: 150 periods to 1.5 s, joints 1>"
    np.testing.assert_array_equal(found.at_samples(found.position), found.position)
    made = record(steps())
    between = replace(made, time=made.time + 0.3 * PERIOD * (np.arange(150) % 2))
    odd = simulate(base_model(slide()), between)
    np.testing.assert_allclose(odd.at_samples(odd.time), between.time, atol=1e-9)


@pytest.mark.parametrize("inner", [None, ((40.0, 30.0, 0.2),)], ids=["one loop", "cascade"])
def test_the_drive_is_what_the_gains_make_of_the_readings(inner: tuple[tuple[float, ...], ...] | None) -> None:
    """P e + I ∫e dt + D de/dt; in a cascade that is the speed asked for, and the same of its error the drive."""
    machine = slide(gains=((6.0, 3.0, 0.1),), velocity_gains=inner)
    found = run(machine, quantise=False)
    error, speed = found.error[:, 0], np.diff(found.reading[:, 0], prepend=found.reading[0, 0]) / PERIOD
    np.testing.assert_allclose(error, steps()[:, 0] - found.reading[:, 0], atol=1e-12)

    def pid(e: Floats, p: float, i: float, d: float, before: float) -> Floats:
        return np.asarray(p * e + i * np.cumsum(e) * PERIOD + d * np.diff(e, prepend=before) / PERIOD)

    drive = pid(error, 6.0, 3.0, 0.1, error[0])
    if inner is not None:
        drive = pid(drive - speed, *inner[0], 0.0)
    np.testing.assert_allclose(found.drive[:, 0], drive, rtol=1e-9, atol=1e-9)
    assert np.ptp(found.position) > 0.1


@pytest.mark.parametrize("periods", [0.0, 0.3, 1.0, 2.5, 12.7])
def test_a_drive_acts_as_much_later_as_its_delay_says(periods: float) -> None:
    """A carriage of 2.5 kg pushed by 3 N from then on; the drive before the record was the same as its first."""
    model = base_model(machines.slide()).with_effect("input_delay", (1,), {"time": periods * PERIOD})
    drive = np.full((40, 1), 2.0)
    drive[0] = 0.0
    found = simulate(model, record(np.zeros((40, 1)), drive=drive), Options(loop="open", quantise=False))
    begun = PERIOD * (1.0 + periods)
    np.testing.assert_allclose(found.velocity[:, 0], 1.2 * np.clip(found.time - begun, 0.0, None), atol=1e-12)
    np.testing.assert_allclose(found.position[:, 0], 0.6 * np.clip(found.time - begun, 0.0, None) ** 2, atol=1e-12)
