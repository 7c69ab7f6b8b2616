"""What a sound rig imitates is not named: a drive that is held, noise of readings, friction near a reversal, numbers
within what their file states."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.lifted import ends_at_bound, is_far, is_far_everywhere
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.resolution import MOST_UNEVEN, _is_hardly_reached, steepest_bend
from model.machine_model.model import base_model
from model.machine_model.parameter import Kind, Parameter
from tests.model.discrepancy.inverse_dynamics import rigs

SAMPLE = 0.002
"""s between the samples of `slide_trace`."""


def acting_late(trace: Trace, samples: float) -> Trace:
    """The trace of a rig whose drive acts so many samples after it was recorded."""
    recorded = np.interp(trace.time + samples * SAMPLE, trace.time, trace.drive[:, 0])
    return replace(trace, drive=recorded[:, None])


def slide(hidden: dict[str, float], late: float = 0.0, machine: Machine | None = None) -> Diagnosis:
    training, held_out = (acting_late(rigs.slide_trace(seed, hidden), late) for seed in (1, 2))
    return diagnose_torques(base_model(machine or rigs.slide_machine()), [training], [held_out])


def stating_friction(**friction: dict[str, Any]) -> Machine:
    """The slide, with a file that states its friction."""
    written = rigs.slide_machine().model_dump(mode="json", exclude_none=True)
    written["joints"][0]["friction"] = friction
    return Machine.model_validate(written)


def named(found: Diagnosis) -> list[str | None]:
    return [step.effect for step in found.steps if step.adopted]


def test_how_a_drive_is_held_is_no_effect() -> None:
    """1.6 samples: half a sample by being held, the rest by the loop that forms it."""
    found = slide({}, late=1.6)
    assert found.verdict == "nothing-significant", found.summary
    assert found.model_after.effects == found.model_before.effects


def test_a_delay_beyond_two_samples_is_named_whole() -> None:
    found = slide({}, late=5.0)
    assert named(found) == ["input_delay"], found.summary
    assert found.steps[0].parameters["joint1.input_delay.time"].value == pytest.approx(5 * SAMPLE, rel=0.05)


def test_friction_far_beyond_what_the_file_states_is_named() -> None:
    """It was fitted within its prior alone, and its remainder looked like something else."""
    machine = stating_friction(viscous=rigs.quantity(6.0, "N·s/m", low=0.0, deviation=1.8))
    found = slide({"viscous": 60.0}, machine=machine)
    assert named(found) == ["viscous_friction"], found.summary
    assert found.steps[0].parameters["joint1.viscous_friction.coefficient"].value == pytest.approx(60.0, rel=0.02)
    assert found.model_after.parameter("joint1.viscous_friction.coefficient").value == pytest.approx(60.0, rel=0.02)


@pytest.mark.parametrize(
    ("share", "true"),
    [pytest.param(0.1, 3.0, marks=pytest.mark.slow), (0.3, 3.0), pytest.param(0.3, 0.0, marks=pytest.mark.slow)],
)
def test_friction_far_below_what_the_file_states_is_named(share: float, true: float) -> None:
    """In plain distances no friction at all is 3.3 deviations from what is stated to 30 %."""
    machine = stating_friction(coulomb=rigs.quantity(30.0, "N", low=0.0, deviation=30.0 * share))
    found = slide({"coulomb": true}, machine=machine)
    assert named(found) == ["coulomb_friction"], found.summary
    assert found.steps[0].parameters["joint1.coulomb_friction.torque"].value == pytest.approx(true, abs=0.3)


def test_another_law_that_takes_a_stated_friction_away_is_named_and_not_that_friction() -> None:
    """The force of a loss grows with the drive: without it in the model, what is left of it is fitted as friction."""
    machine = stating_friction(coulomb=rigs.quantity(6.0, "N", low=0.0, deviation=1.8))
    found = slide({"coulomb": 6.0, "spring": 400.0}, machine=machine)
    assert named(found) == ["spring_torque"], found.summary
    coulomb = found.model_after.parameter("joint1.coulomb_friction.torque").value
    assert coulomb == pytest.approx(6.0, rel=0.1)


@pytest.mark.parametrize("true", [8.0, pytest.param(15.0, marks=pytest.mark.slow)])
def test_friction_within_what_the_file_states_is_no_effect(true: float) -> None:
    """15 is 5 of the stated deviations above 6, and 2.5 times as much: with 30 % stated, 3 deviations of a ratio."""
    machine = stating_friction(viscous=rigs.quantity(6.0, "N·s/m", low=0.0, deviation=1.8))
    found = slide({"viscous": true}, machine=machine)
    assert found.verdict == "nothing-significant", found.summary
    assert found.model_after.parameter("joint1.viscous_friction.coefficient").value == pytest.approx(true, rel=0.1)


def stated(share: float, low: float = 0.0, joint: int = 1) -> Parameter:
    """A friction of 10 that a file states to a share of itself."""
    return Parameter(
        name=f"joint{joint}.coulomb_friction.level",
        kind=Kind.EFFECT,
        effect="coulomb_friction",
        part="level",
        unit="N",
        value=10.0,
        low=low,
        high=1e4,
        deviation=10.0 * share,
        joints=(joint,),
    )


@pytest.mark.parametrize(("share", "factor"), [(0.1, 1.49), (0.3, 3.32), (0.5, 7.39)])
def test_a_number_that_cannot_be_negative_is_far_by_a_factor_up_and_down(share: float, factor: float) -> None:
    for beyond, far in ((1.02, True), (0.98, False)):
        assert is_far(stated(share), 10.0 * factor * beyond) is far
        assert is_far(stated(share), 10.0 / (factor * beyond)) is far
    assert is_far(stated(share), 0.0)


def test_a_number_that_may_be_negative_is_far_by_its_distance() -> None:
    assert is_far(stated(0.3, low=-1e4), -2.1)
    assert not is_far(stated(0.3, low=-1e4), -1.9)


def test_a_group_is_far_only_where_every_joint_of_it_is() -> None:
    own = [stated(0.3, joint=j) for j in (1, 2)]
    first, second = (p.name for p in own)
    assert is_far_everywhere(own, {first: 50.0, second: 50.0})
    assert not is_far_everywhere(own, {first: 50.0, second: 11.0})
    assert not is_far_everywhere(own, {first: 9.0, second: 11.0})
    assert is_far_everywhere((), {})


def test_a_joint_is_far_where_one_of_its_numbers_is() -> None:
    own = [stated(0.3), replace(stated(0.3), name="joint1.coulomb_friction.other", part="other")]
    assert is_far_everywhere(own, {own[0].name: 50.0, own[1].name: 10.0})


def sized(low: float, high: float, null: float | None = 0.0, effect: str = "coulomb_friction") -> Parameter:
    """A size of an effect with these bounds."""
    return replace(stated(0.3), low=low, high=high, null=null, effect=effect)


@pytest.mark.parametrize(
    ("p", "value", "at_end"),
    [
        (sized(0.0, 5.0), 5.0, True),
        (sized(0.0, 5.0), 5.0 * (1 - 1e-7), True),
        (sized(0.0, 5.0), 5.0 * (1 - 1e-5), False),
        (sized(0.0, 5.0), 0.0, False),
        (sized(-5.0, 5.0), -5.0, True),
        (sized(-2.0, 5.0, null=5.0), 5.0, False),
        (sized(-2.0, 5.0, null=5.0), -2.0, True),
        (sized(0.0, np.inf), 1e12, False),
        (sized(-np.inf, np.inf), -1e12, False),
        (sized(-np.inf, 5.0), 5.0, True),
        (sized(0.0, 5.0, null=None), 5.0, False),
        (sized(1.0, 12.0, effect="supply_limit"), 1.0, False),
    ],
)
def test_a_size_at_the_end_of_what_it_may_be_is_not_resolved(p: Parameter, value: float, at_end: bool) -> None:
    """An end at which the effect does nothing, none at infinity, and numbers that only shape an effect do not count."""
    assert ends_at_bound(p, value) is at_end


def test_the_slowest_ripple_is_no_ripple() -> None:
    """The rate of a tone only shapes it, yet at its bound a fit would go on: half a wave a turn is a spring."""
    model = base_model(rigs.slide_machine()).with_effect("torque_ripple", (1,))
    rate = model.parameter("joint1.torque_ripple.cycles")
    assert ends_at_bound(rate, rate.low)
    assert not ends_at_bound(rate, 2.0 * rate.low)


def bent(**bends: float) -> float:
    """How uneven the MA2000's first potentiometer is with these terms, as shares of its range."""
    model = base_model(load_machine("ma2000"))
    span = model.machine.joint(1).sensor
    terms = {name: share * span.range.value for name, share in bends.items()}
    return steepest_bend(model.with_effect("potentiometer_nonlinearity", (1,), terms), 1)


def test_a_potentiometer_under_load_is_not_too_uneven_to_be_one() -> None:
    """Loaded with twice its own resistance, its reading of x is x/(1 + x(1 − x)/2): written out as sine terms here."""
    x = np.linspace(0.0, 1.0, 2001)
    off = x / (1 + 0.5 * x * (1 - x)) - x
    terms = {f"bend_{k}": 2 * float(np.trapezoid(off * np.sin(k * np.pi * x), x)) for k in (1, 2, 3, 4)}
    assert 0.3 < bent(**terms) < MOST_UNEVEN


def test_a_reading_that_goes_backwards_is_no_sensor() -> None:
    """As a tight spot of an axis was told."""
    assert bent(bend_1=-0.08, bend_2=0.1, bend_3=-0.074, bend_4=0.023) > 1.0
    assert bent(bend_1=0.0025) < 0.01


@pytest.mark.slow
def test_a_variance_above_the_noise_without_a_shape_is_no_unknown_effect() -> None:
    """White noise of the recorded force, which no file states and no reading shows."""
    draw = np.random.default_rng(5)

    def noisy(seed: int) -> Trace:
        trace = rigs.slide_trace(seed, {})
        return replace(trace, drive=trace.drive + 4.0 * draw.standard_normal(trace.drive.shape))

    found = diagnose_torques(base_model(rigs.slide_machine()), [noisy(1)], [noisy(2)])
    assert found.rmse_fit[0].after > 1.5 * found.rmse_fit[0].floor
    assert found.remaining == ()
    assert found.verdict == "nothing-significant", found.summary


@pytest.mark.parametrize(("above", "hardly"), [(0.003, True), (0.02, False)])
def test_a_limit_that_the_drive_hardly_ever_exceeds_is_none(above: float, hardly: bool) -> None:
    """Spikes of one sample are smeared by the low-pass, and sound drives seem to be cut off there."""
    model = base_model(rigs.bench_machine()).with_effect("supply_limit", (1,))
    own = tuple(p for p in model.parameters if p.effect == "supply_limit")
    drive = np.where(np.arange(1000) < 1000 * above, 12.0, -3.0)[:, None]
    records: Any = [SimpleNamespace(commanded=drive)]
    fit: Any = SimpleNamespace(values={"joint1.supply_limit.voltage": 9.0})
    assert _is_hardly_reached(Fitted("supply_limit", (1,), model, own, fit), records) == hardly
