"""Ripples and disturbances are proposed at their rates, on joints that have a tone already too."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.machine import Machine
from daq.contracts.quantity import Quantity
from daq.contracts.trace import Trace
from model.discrepancy.engine.fitting import Fit, evaluate
from model.discrepancy.engine.probing import Trial, projection
from model.discrepancy.readings.case import ReadingCase
from model.discrepancy.readings.observation import Observation
from model.discrepancy.readings.tones import USUAL_TONES, propose_tones, rates_tried, torque_response
from model.discrepancy.readings.trials import tone_trial
from model.effects.effect import Tone
from model.machine_model.model import Model
from tests.model.discrepancy.motions import trace_of
from tests.model.discrepancy.readings.cases import case_of
from tests.model.fitting import imagined

HUM = {"sine": 0.5, "cosine": 0.2, "frequency": 1.7}
RIPPLE = {"sine": 1.0, "cosine": 0.0, "cycles": 40.0}


def seen(known: Model, *traces: Trace) -> tuple[ReadingCase, Fit]:
    """What a model leaves of records, nothing being fitted."""
    case = case_of(known, traces)
    unknowns = case.unknowns(known, {})
    return case, evaluate(case.compared, unknowns, {u.name: u.start for u in unknowns}, np.ones(3))


def proposed(known: Model, *traces: Trace, joints: tuple[int, ...] = (2,)) -> list[Trial]:
    case, now = seen(known, *traces)
    return propose_tones(projection(now.with_slopes()), case.compared, joints)


def observed(seconds: float) -> Observation:
    """A record of that length, as it is observed."""
    return case_of(imagined.arm(), [imagined.trace(imagined.arm(), seconds=seconds)]).compared.observation


@pytest.mark.parametrize("has_hum", [False, True])
def test_a_ripple_is_proposed_at_its_cycles(has_hum: bool) -> None:
    """Also on a joint whose disturbance is known, which is not moved to find it; and as large as it is."""
    known = imagined.arm().with_effect("periodic_disturbance", (2,), HUM) if has_hum else imagined.arm()
    case, now = seen(known, trace_of(known.with_effect("torque_ripple", (2,), RIPPLE), 12.0))
    clear = projection(now.with_slopes())
    found = propose_tones(clear, case.compared, (2,))
    assert [t.effect for t in found] == ["torque_ripple", "periodic_disturbance"][: 2 - has_hum]
    best = clear.probe(found[0])
    ripple = {p.part: best.start[p.name] for p in best.trial.parameters}
    assert ripple["cycles"] == pytest.approx(40.0, abs=3.0)
    assert np.hypot(ripple["sine"], ripple["cosine"]) == pytest.approx(1.0, rel=0.5)
    assert all(clear.probe(t).gain < best.gain for t in found[1:])


@pytest.mark.parametrize("cycles", [33.0, 47.0, 70.0])
def test_a_ripple_at_which_a_joint_sticks_is_found_among_those_that_look_alike(cycles: float) -> None:
    """By the highest peak of the spectrum alone, 51, 66 and 57 cycles were proposed."""
    known = imagined.arm()
    ripple = {"sine": 6.0, "cosine": 0.0, "cycles": cycles}
    found = proposed(known, trace_of(known.with_effect("torque_ripple", (2,), ripple), 12.0))
    assert found[0].starts[0]["joint2.torque_ripple.cycles"] == pytest.approx(cycles, abs=3.5)


def test_a_ripple_may_not_become_so_slow_that_it_is_a_spring() -> None:
    """A spring on a joint is like a part of one slow wave: a wave that is fitted keeps half of itself on the travel."""
    recorded = trace_of(imagined.arm().with_effect("spring_torque", (2,), {"stiffness": 8.0}), 12.0)
    ripple = next(t for t in proposed(imagined.arm(), recorded) if t.effect == "torque_ripple")
    cycles = next(p for p in ripple.parameters if p.part == "cycles")
    assert cycles.low == pytest.approx(np.pi / float(np.ptp(recorded.position[:, 1])), rel=1e-2)
    assert ripple.starts[0][cycles.name] >= cycles.low


def test_the_response_to_a_torque_is_the_same_beside_a_tone() -> None:
    humming = imagined.arm().with_effect("periodic_disturbance", (2,), HUM)
    plain, beside = (
        torque_response(now, case.compared, 2)
        for case, now in (seen(arm, trace_of(arm, 12.0)) for arm in (imagined.arm(), humming))
    )
    lags = imagined.PERIOD * np.arange(len(plain))
    slow = np.exp(-2j * np.pi * np.linspace(0.7, 4.3, 20)[:, None] * lags)
    assert np.linalg.norm(slow @ (beside - plain)) < 0.3 * np.linalg.norm(slow @ plain)


def test_a_joint_with_both_kinds_of_tones_gets_no_third_and_a_short_record_none() -> None:
    known = imagined.arm().with_effect("periodic_disturbance", (2,), HUM).with_effect("torque_ripple", (2,), RIPPLE)
    assert {t.joints for t in proposed(known, trace_of(known, 4.0), joints=(1, 2))} == {(1,)}
    assert proposed(imagined.arm(), trace_of(imagined.arm(), 1.2), joints=(1, 2, 3)) == []


def test_the_response_is_taken_from_the_record_that_moves_a_joint_furthest() -> None:
    """The first is too short to show an answer of 1.5 s."""
    truth = imagined.arm().with_effect("torque_ripple", (2,), RIPPLE)
    found = proposed(imagined.arm(), imagined.trace(truth, 1, seconds=1.2), trace_of(truth, 12.0))
    ripple = next(t for t in found if t.effect == "torque_ripple")
    assert ripple.starts[0]["joint2.torque_ripple.cycles"] == pytest.approx(RIPPLE["cycles"], abs=1.0)


@pytest.mark.parametrize("seconds", [6.0, 55.0, 180.0])
def test_no_disturbance_falls_between_the_tones_that_are_tried(seconds: float) -> None:
    """Steps of half of what the record can distinguish where the usual number allows it."""
    rates = rates_tried(observed(seconds), "periodic_disturbance", 1)
    assert np.diff(rates).max() <= 1.0 / seconds + 1e-12
    assert (rates[0], rates[-1]) == (pytest.approx(4.0 / seconds), 8.0)
    assert len(rates) == {6.0: 88, 55.0: USUAL_TONES}.get(seconds, len(rates))


def test_a_tone_is_tried_with_the_number_of_rates_that_it_was_chosen_from() -> None:
    found = proposed(imagined.arm(), trace_of(imagined.arm(), 4.0))
    assert {t.places for t in found} == {USUAL_TONES}
    observation = observed(2.0)
    has_one, rates = imagined.arm().with_effect("periodic_disturbance", (2,), HUM), np.array([0.01, 2.0])
    assert tone_trial(has_one, "periodic_disturbance", 2, Tone.OVER_TIME, rates, 0.1, 7, observation) is None
    trial = tone_trial(imagined.arm(), "periodic_disturbance", 1, Tone.OVER_TIME, rates, 0.5, 7, observation)
    assert trial is not None
    tried = [start["joint1.periodic_disturbance.frequency"] for start in trial.starts]
    assert (trial.places, tried) == (7, [0.5, 2.0]), "none below the slowest"


def with_first(sensor: dict[str, object] | None, kind: str = "revolute") -> Machine:
    """The arm with another sensor on joint 1, or with none."""
    machine = imagined.machine()
    own = machine.joint(1).sensor
    changed = {"kind": kind, "sensor": None if sensor is None else own.model_copy(update=sensor)}
    return machine.model_copy(update={"joints": (machine.joint(1).model_copy(update=changed), *machine.joints[1:])})


def test_the_shortest_wave_is_what_the_sensor_resolves_and_the_library_allows() -> None:
    """A joint that slides 2 mm a count would hide every wave under 11 cm; 10 µm a count shows the library's, of 6 mm.
    Where nothing moves there is no wave."""
    observation = observed(6.0)

    def shortest(machine: Machine) -> float:
        return float(rates_tried(replace(observation, machine=machine), "torque_ripple", 1)[-1])

    turning = {bits: shortest(with_first({"bits": bits})) for bits in (11, 12, 20)}
    assert turning == {11: pytest.approx(50.0), 12: pytest.approx(100.0), 20: 1000.0}
    assert shortest(with_first(None)) == 1000.0
    for resolution, highest in ((1e-3, 2 * np.pi / (1e-3 * 4096 / 75)), (1e-5, 1000.0)):
        span = Quantity(value=4096 * resolution, unit="m", source="test")
        assert shortest(with_first({"range": span}, "prismatic")) == pytest.approx(highest)
    points = imagined.set_points(0, 6.0)
    points[:, 0] = points[0, 0]
    still = case_of(imagined.arm(), [imagined.trace(imagined.arm(), points=points, noise=0.0)]).compared.observation
    assert [len(rates_tried(still, "torque_ripple", j)) > 0 for j in (1, 2)] == [False, True]
