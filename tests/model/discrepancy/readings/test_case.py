"""A case of readings: its first fit, the noise that its records show, what is begun again, and what is left."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.discrepancy.engine.case import is_strained
from model.discrepancy.engine.fitting import Fit, evaluate, fit
from model.discrepancy.readings.case import ReadingCase, noise_floor, weighed_by_noise
from model.discrepancy.readings.observation import Observation, forms_rounded_drive
from model.discrepancy.readings.trials import list_trials
from model.discrepancy.thresholds import FEEDBACK_SHARE
from model.machine_model.model import Lineage, Model, base_model
from model.machine_model.parameter import Kind
from model.simulation.inputs import gains_of
from tests.model.discrepancy.readings.cases import case_of, fitted, searched
from tests.model.fitting import imagined

ARM = imagined.arm()
TRUTH = {"joint2.viscous_friction.coefficient": 2.2e-4, "load.mass": 1.4, "joint1.motor.back_emf_constant": 0.0352}


def at_start(case: ReadingCase, off: Mapping[str, float] = MappingProxyType({})) -> Fit:
    """The given model as it is, but for numbers so many deviations off; nothing is fitted."""
    unknowns = case.unknowns(case.given, {})
    values = {u.name: u.start for u in unknowns}
    for name, deviations in off.items():
        values[name] += deviations * (case.given.parameter(name).deviation or 0.0)
    return evaluate(case.compared, unknowns, values, np.ones(3))


def test_the_first_fit_reaches_the_same_end_from_wherever_the_model_was_given() -> None:
    """As near to the record as the arm's own numbers, from thousands of deviations of noise away."""
    record = imagined.trace(ARM.with_values(TRUTH), seconds=4.0)
    own = case_of(ARM.with_values(TRUTH), [record])
    truth = at_start(own)
    others = {"load.mass": 2.6, "link2.length": 1.05 * ARM.parameter("link2.length").value}
    ends = [fitted(case_of(given, [record])).cost for given in (ARM, ARM.with_values(others))]
    assert max(ends) < truth.cost
    assert max(ends) - min([*ends, fitted(own).cost]) < 5.0
    assert at_start(case_of(ARM.with_values(others), [record])).cost > 100 * truth.cost


Fails = Callable[[float, Floats], bool]


@dataclass(frozen=True)
class Unstable(Observation):
    """An observation whose simulations do not stay finite where `fails` of the feedback share and numbers says so."""

    fails: Fails = lambda _share, _numbers: False

    def readings(self, model: Model, states: Any, *options: Any) -> list[Floats]:
        shown = super().readings(model, states, *options)
        failed = self.fails(self.prepared[0].following, states[0][0])
        return [np.full_like(y, np.nan) for y in shown] if failed else shown


def unstable(fails: Fails) -> tuple[ReadingCase, float]:
    """A case whose simulations fail there, and the cost of the given model along the record where they do not."""
    case = case_of(ARM, [imagined.trace(ARM.with_values(TRUTH), seconds=2.0)])
    own = case.compared.observation
    fields = (own.machine, own.records, own.deviations, own.unit, own.prepared)
    return replace(case, compared=case.compared.on(Unstable(*fields, fails=fails))), at_start(case).cost


def test_the_first_fit_starts_from_the_given_model_where_the_closed_loop_has_led_to_instability() -> None:
    led: list[Floats] = []  # there, with the full share

    def fails_there(share: float, numbers: Floats) -> bool:
        led.extend([numbers] if share == FEEDBACK_SHARE else [])
        return share == FEEDBACK_SHARE and np.array_equal(numbers, led[0])

    case, given = unstable(fails_there)
    assert fitted(case).cost < 0.2 * given
    case, given = unstable(lambda share, _numbers: share != FEEDBACK_SHARE)
    assert fitted(case).cost < 0.2 * given, "with the record as feedback"


def test_a_model_that_is_unstable_everywhere_is_refused_with_one_line() -> None:
    with pytest.raises(SpecError, match="the simulation does not stay finite: the control loop is unstable"):
        fitted(unstable(lambda _share, _numbers: True)[0])


# ---- What may differ, and around which numbers.


def test_numbers_are_expected_to_be_what_is_known_of_them() -> None:
    """A number of the machine what its file states, or what an earlier fit to other records knows; an effect that the
    model was given with what it is there."""
    stated = ARM.parameter("load.mass")
    known = {"posterior": {"load.mass": {"value": 1.4, "deviation": 0.5 * (stated.deviation or 0.0)}}}
    heavy = ARM.with_values({"load.mass": 1.4}).with_effect("motor_inductance", (2,), {"inductance": 0.06})
    record = imagined.trace(heavy, seconds=1.0)
    for given, expected in ((heavy, stated.value), (heavy.with_lineage(Lineage(traces=("earlier",), fit=known)), 1.4)):
        unknowns = {u.name: u for u in case_of(given, [record]).base}
        load, inductance = unknowns["load.mass"], unknowns["joint2.motor_inductance.inductance"]
        assert load.expected == pytest.approx(expected)
        assert load.start == pytest.approx(1.4)
        assert inductance.expected == inductance.start == pytest.approx(0.06)


def test_a_board_rounds_its_drive_unless_whole_errors_make_whole_counts_of_power() -> None:
    machine = imagined.machine()
    own: Any = machine.controller
    ratio = own.dac_counts_per_adc_count.model_copy(update={"value": 0.27})
    coarse = machine.model_copy(update={"controller": own.model_copy(update={"dac_counts_per_adc_count": ratio})})
    model, gains = base_model(machine), gains_of(machine, None)
    assert not forms_rounded_drive(model, gains)
    assert forms_rounded_drive(base_model(coarse), gains_of(coarse, None))
    assert forms_rounded_drive(model, gains + np.eye(9)[1]), "it integrates"
    assert forms_rounded_drive(model.with_effect("wrong_gain", (1,), {"relative": 0.15}), gains)


# ---- Noise: as stated, or as records show it.


@pytest.mark.parametrize("noise", [0.3, 1.0], ids=["as stated", "three times"])
def test_noise_that_records_show_is_reckoned_with(noise: float) -> None:
    """What is left is then noise, on fitted and on held-out records alike: no more and no less than the floor."""
    traces = [imagined.trace(ARM, k, seconds=5.0, noise=noise) for k in (0, 1)]
    case, now = weighed_by_noise(case_of(ARM, traces[:1], traces[1:]))
    shown = case.compared.observation.noise
    assert (shown is None) is (noise == 0.3)
    assert case.held_out.observation.noise is shown
    counts = case.compared.floor / case.compared.observation.unit
    np.testing.assert_allclose(counts, np.hypot(noise, 12**-0.5), rtol=0.12)
    for left, floor in ((now.squares, case.noise), (case.held_squares(now), case.noise_held)):
        np.testing.assert_allclose(np.sqrt(left) / floor, 1.0, atol=0.3)
        assert np.all(floor > 0.9 * case.compared.floor)
    assert case.joints_left(now, now, named=False) == ()


def test_the_floor_is_what_the_right_model_leaves_of_independent_records() -> None:
    case = case_of(ARM, [imagined.trace(ARM, seconds=4.0)])
    floor = noise_floor(case.compared, at_start(case).values)
    left = []
    for seed in range(1, 7):
        now = at_start(case_of(ARM, [imagined.trace(ARM, seconds=4.0, seed=seed)]))
        postures = [u for u in now.unknowns if u.kind is Kind.INITIAL_POSITION]
        left.append(fit(now.compared, postures, {}, now.memory).squares)
    np.testing.assert_allclose(np.sqrt(np.mean(left, axis=0)) / floor, 1.0, atol=0.15)


def test_what_is_missing_is_no_noise_and_is_left_on_its_joint() -> None:
    rubbing = ARM.with_effect("coulomb_friction", (2,), {"torque": 8.0})
    record = imagined.trace(rubbing, seconds=5.0)
    case, missing = weighed_by_noise(case_of(ARM, [record]))
    assert case.compared.observation.noise is None
    assert 2 in case.joints_left(missing, missing, named=True)
    with_it = case_of(rubbing, [record])
    assert with_it.joints_left(at_start(with_it), missing, named=True) == ()


def test_the_gap_is_what_the_readings_say_beside_the_motion_of_the_arm_alone() -> None:
    """The model is the arm, so that the gap is a square wave on the readings, whose root mean square is its height. A
    simulation that is given most of the record follows it."""
    wave, recorded = 0.01, imagined.trace(ARM, seconds=3.0, noise=0.0)
    rows = np.arange(len(recorded))
    sign = np.where(rows // 10 % 2, -wave, wave) * (rows >= 20)  # compared from 0.4 s after the start
    waved = imagined.changed(recorded, position=recorded.position + sign[:, None] * np.array([1.0, 0.0, 2.0]))
    case = case_of(ARM, [waved])
    now = at_start(case)
    bare = case.errors(replace(now, unknowns=()))
    assert bare == {"fitted": pytest.approx((wave, 0.0, 2 * wave), rel=0.01, abs=5e-4), "held_out": ()}
    assert np.sqrt(now.squares[0]) > 1.2 * wave
    followed = np.array(case.errors(now)["fitted"]) / np.array([wave, 1.0, 2 * wave])
    assert (followed[[0, 2]] > 0.9).all()  # what belongs to no model follows little of it
    assert (followed[[0, 2]] < 1.0).all()


def test_the_gap_of_a_right_model_is_the_noise_of_the_same_loop() -> None:
    """Neither the noise of the simulation that follows the record, nor that of a reading alone."""
    case = case_of(ARM, [imagined.trace(ARM, number) for number in (0, 1)])
    now = at_start(case)
    noise, most = case.noise_of_errors(now)
    np.testing.assert_allclose(case.errors(now)["fitted"], noise, rtol=0.15)
    assert (noise / case.noise).max() > 1.2
    assert (most >= np.sqrt(1.3) * noise).all()


def test_a_bias_is_how_far_an_estimate_moves_nearer_to_the_record_while_all_else_stays() -> None:
    loose = ARM.with_effect("dead_zone", (1,), {"width": 1.0})
    case, width = case_of(loose, [imagined.trace(loose, seconds=6.0)]), loose.parameter("joint1.dead_zone.width")
    unknowns = case.unknowns(loose, {width.name: width})
    now = fit(case.compared, unknowns, {u.name: u.start for u in unknowns}, np.ones(3))
    deviation = now.standard_deviations[width.name]
    off = replace(now, values={**now.values, width.name: now.values[width.name] + 3.0 * deviation})
    assert abs(case.bias(now, [width])[width.name]) < deviation
    assert case.bias(off, [width]) == {width.name: pytest.approx(-3.0 * deviation, abs=deviation)}


# ---- Numbers that what is missing has driven off.

DELAY = 0.015
"""s: the tolerance parameters go to the brink of instability to imitate so much."""


def test_a_delay_that_tolerances_have_imitated_is_found_with_the_numbers_as_stated() -> None:
    late = ARM.with_effect("input_delay", (3,), {"time": DELAY})
    case = case_of(ARM, [imagined.trace(late, seconds=6.0)], effects=("input_delay",), joints=(3,))
    driven_off = fitted(case)
    assert is_strained(driven_off)
    (best,) = searched(case, driven_off).fitted
    assert best.fit.values["joint3.input_delay.time"] == pytest.approx(DELAY, rel=0.15)
    assert not is_strained(best.fit)
    assert best.fit.cost < 0.6 * driven_off.cost


@pytest.mark.parametrize(
    ("number", "off", "effect"),
    [
        ("link3.mass", 6.0, "link_mass"),
        ("joint3.motor.torque_constant", -6.0, "weakened_magnet"),
        ("load.mass", 6.0, "payload"),
        ("controller.delay", 6.0, "input_delay"),
    ],
)
def test_a_number_far_off_begins_the_effect_that_does_the_same(number: str, off: float, effect: str) -> None:
    """With the number as stated; where it is within what is stated, or of another joint, nothing is taken back."""
    case = case_of(ARM, [imagined.trace(ARM, seconds=1.0)], effects=(effect,))
    far, near = (at_start(case, {number: deviations}) for deviations in (off, off / 3))
    trials = {t.joints: t for t in list_trials(far, case.compared.observation, case.options)}
    own, stated = trials.get((3,), trials.get(())), ARM.parameter(number)
    (size,), distance = own.amplitudes, far.values[number] - stated.value
    start = case.take_back(effect, own.parameters, far)
    assert start[size] == pytest.approx(-distance / stated.value if effect == "weakened_magnet" else distance)
    assert start[number] == pytest.approx(stated.value)
    assert case.take_back(effect, own.parameters, near) == {}
    if stated.joints:
        assert case.take_back(effect, trials[(2,)].parameters, far) == {}
    if stated.kind is Kind.INERTIA:  # the law is the number's own
        there = evaluate(far.compared.of_model(own.model), far.unknowns, {**far.values, **start}, far.memory)
        np.testing.assert_allclose(there.row, far.row, atol=1e-9)
